"""Run a job's tasks by Dask workers, on any machines that see the job's folder under the same path.

Dask's messages are pickles, which run code: a scheduler on ``tcp://`` obeys whoever reaches it. So a scheduler started
here for a queue speaks TLS, with keys made for this run alone; ``tcp://`` to other machines must be asked for.
``tls://`` takes the certificates of Dask's own settings ``distributed.comm.tls``."""

from __future__ import annotations

import asyncio
import functools
import gc
import logging
import queue
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

import msgspec

from ...errors import TactileError
from ...files.outside import read_toml_text
from . import tasks
from .local import KILLS
from .tasks import Failure, Reply, Task

SCHEMES = ("tcp://", "tls://", "ucx://")
PATIENCE, AGAIN = 10.0, 60.0  # s without a reply, after which the lack of workers is reported, and reported again
CONFIGURED = "distributed.comm.timeouts.connect"  # Dask's own setting of how long to wait for others, 30 s by itself


class QueueFile(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Content of a TOML file that starts a cluster. jobs : number of jobs to submit to the queue
    options : keyword arguments of dask_jobqueue's class for that queue"""

    queue: Literal["slurm", "pbs", "sge", "lsf", "htcondor"]
    jobs: int
    options: dict[str, Any]


class Cluster:
    """Executor of tasks by the workers of a Dask scheduler; a context manager."""

    def __init__(
        self, folder: Path, address: str, say: Callable[[str], None] = lambda text: None, insecure: bool = False
    ) -> None:
        """Store what to connect to. folder : the job's; address : the scheduler's, or path of a `QueueFile`
        say : called with sentences, such as that no worker has come. Raises TactileError for a bad address or file, and
        for other machines without TLS unless `insecure` is true."""
        self._say, self._insecure = say, insecure
        if address.startswith(("tcp://", "ucx://")) and not _here(address):
            self._without_tls(address)
        self._folder = str(folder.resolve())
        self._address = address
        self._queue = None if address.startswith(SCHEMES) else _read(address)
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._tasks: dict[str, tuple[Task, Any]] = {}  # a future that nobody holds is given up

    def submit(self, task: Task) -> None:
        """Submit a task; `results` gives its reply."""
        plain = msgspec.to_builtins(task)
        with self._answering():
            future = self._client.submit(tasks.run, self._folder, plain, pure=False)
        self._tasks[future.key] = task, future
        future.add_done_callback(self._done.put)

    def results(self, count: Callable[[], int]) -> Iterator[tuple[Task, Reply]]:
        """Yield each task with its reply as it comes, while ``count()``, the number still awaited, is above 0."""
        while count():
            future = self._next()
            yield self._tasks.pop(future.key)[0], self._reply(future)

    def _next(self) -> Any:
        """Return the next finished future; if no worker comes, say so."""
        patience = PATIENCE
        while True:
            try:
                return self._done.get(timeout=patience)
            except queue.Empty:
                patience = AGAIN
                with self._answering():
                    workers = self._client.scheduler_info()["workers"]
                if not workers:
                    self._say(f"{self._address}: no worker has come yet; {len(self._tasks)} tasks wait for one")

    def _reply(self, future: Any) -> Reply:
        from distributed import KilledWorker

        with self._answering():
            error = future.exception() if future.status in ("error", "lost", "cancelled") else None
            if isinstance(error, KilledWorker):
                why = f"killed its worker {KILLS} times ({error.last_worker.address}); set aside"
                return Reply(failure=Failure(why))
            if future.status != "finished":
                raise error or RuntimeError(future.status)
            return msgspec.convert(future.result(), Reply)

    @contextmanager
    def _answering(self) -> Iterator[None]:
        """Raise Dask's many errors after the loss of its scheduler, in the block, as a TactileError."""
        try:
            yield
        except Exception as error:
            advice = "Start one, and give the same command again: what is done stays"
            raise TactileError(self._address, f"a task was lost ({error})", "a working scheduler", advice) from error

    def __enter__(self) -> Cluster:
        with ExitStack() as stack:
            place = self._address if self._queue is None else stack.enter_context(self._started(stack))
            self._client = stack.enter_context(self._connected(place))
            self._open = stack.pop_all()
        return self

    def _started(self, stack: ExitStack) -> Any:
        """Return the context manager of a queue's cluster; TLS keys of this run lie in the job's folder meanwhile."""
        options = {"worker_extra_args": ["--no-dashboard"], **self._queue.options}
        options["scheduler_options"] = {"dashboard_address": "127.0.0.1:0", **options.get("scheduler_options", {})}
        if self._insecure:
            self._without_tls("--cluster")
        else:
            keys = stack.enter_context(tempfile.TemporaryDirectory(prefix=".tls-", dir=self._folder))
            options |= {"protocol": "tls://", "security": _one_time_keys(), "shared_temp_directory": keys}
        return _closing(_start(self._queue, options))

    def _without_tls(self, where: str) -> None:
        """Warn that a scheduler, at `where`, has no TLS. Raises TactileError unless that was accepted."""
        found = "no TLS: Dask's messages run code, and whoever reaches the scheduler or listens can send them"
        if not self._insecure:
            raise TactileError(where, found, "tls://", "In a network that is yours alone, add --insecure")
        self._say(f"warning: {where}: {found}")

    def _connected(self, place: Any) -> Any:
        """Return a client of the scheduler at `place`, an address or cluster. Raises TactileError if none answers."""
        from distributed import Client, Security

        for name in ("distributed", "distributed.client"):  # what its logs tell of a lost scheduler, a sentence tells
            logging.getLogger(name).setLevel(logging.CRITICAL)
        security = Security(require_encryption=True) if self._address.startswith("tls://") else None
        try:
            return Client(place, security=security, timeout=wait(), set_as_default=False, loop=loop())
        except (OSError, ValueError, TypeError, RuntimeError, MemoryError) as error:  # the last: of other servers
            found = f"no scheduler answers ({error})"
        gc.collect()  # ends that client here: within the next one's start it would wait for ever, for a lock held there
        raise TactileError(self._address, found, "a Dask scheduler", "Start one: dask scheduler")

    def __exit__(self, *error: object) -> None:
        self._tasks.clear()
        self._open.close()


def _read(address: str) -> QueueFile:
    try:
        return msgspec.toml.decode(read_toml_text(address), type=QueueFile)
    except OSError as error:
        expected = "tcp://HOST:PORT, tls://HOST:PORT or a TOML file"
        raise TactileError("--cluster", f"{address!r} ({error.strerror})", expected) from error
    except (ValueError, RecursionError) as error:
        raise TactileError(address, str(error), "queue, jobs and [options], as in docs/batch.md") from error


@contextmanager
def _closing(cluster: Any) -> Iterator[Any]:
    """Close the cluster at the end, even if its library asserts that all jobs are closed, which may come late."""
    try:
        yield cluster
    finally:
        with suppress(AssertionError):  # the last of what closing does
            cluster.close()
        for name, value in vars(cluster).items():
            if name.startswith("_job_") and hasattr(value, "close"):
                value.close()  # the workers' keys, which it would remove some time


def _here(address: str) -> bool:
    """Return true if an address is this machine's own loopback."""
    return address.split("://", 1)[1].rsplit(":", 1)[0].strip("[]") in ("127.0.0.1", "::1", "localhost")


def _one_time_keys() -> Any:
    """Return a TLS key and certificate made for this run. Raises TactileError without the library for it."""
    from distributed import Security

    try:
        return Security.temporary()
    except ImportError as error:
        advice = "Install it: python -m pip install cryptography; or do without TLS: --insecure"
        raise TactileError("--cluster", "no cryptography, which makes TLS keys", "it", advice) from error


def _start(wanted: QueueFile, options: dict[str, Any]) -> Any:
    """Return a cluster whose workers are jobs of a queue. Raises TactileError for unknown options."""
    import dask
    import dask_jobqueue

    dask.config.set({"distributed.scheduler.allowed-failures": KILLS - 1})
    names = {"slurm": "SLURM", "pbs": "PBS", "sge": "SGE", "lsf": "LSF", "htcondor": "HTCondor"}
    try:
        cluster = getattr(dask_jobqueue, f"{names[wanted.queue]}Cluster")(loop=loop(), **options)
    except (TypeError, ValueError) as error:
        raise TactileError("--cluster, options", str(error), f"options of dask_jobqueue's {wanted.queue}") from error
    cluster.scale(jobs=wanted.jobs)
    return cluster


def wait() -> float:
    """Return the time, s, to wait for a loop or scheduler; DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT=120s sets it."""
    import dask
    import distributed  # noqa: F401 - brings its settings
    from dask.utils import parse_timedelta

    return parse_timedelta(dask.config.get(CONFIGURED))


@functools.cache
def loop() -> Any:
    """Return a running tornado loop, in a thread that lasts as long as the process. (Dask's own gives up after 10 s
    whatever its settings, too soon on a very busy machine.) Raises TactileError if it does not start."""
    from tornado.ioloop import IOLoop

    began, found = threading.Event(), []

    async def run() -> None:
        """Signal that the loop runs, then keep it running."""
        found.append(IOLoop.current())
        began.set()
        await asyncio.Event().wait()

    threading.Thread(target=asyncio.run, args=(run(),), daemon=True, name="dask loop").start()
    if not began.wait(wait()):
        advice = "Ease the machine, or set DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT=120s"
        raise TactileError("dask", f"its loop has not started after {wait():g} s", "a running thread", advice)
    return found[0]
