"""Run a job's tasks in processes on this machine; a thread supervises each, and starts another when one dies."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from ...files.threads import ONE
from . import tasks
from .tasks import Failure, Reply, Task

RESTART = 200  # tasks after which a worker is replaced, so that what libraries leak is given back (assumed)
KILLS = 3  # times that a task may take its worker with it
WORKER_COMMAND = (sys.executable, "-m", f"{__package__}.task_worker")
Start = Callable[[], "subprocess.Popen[str]"]


class Local:
    """Executor of tasks in `workers` processes, each with one thread, for the job in `folder`.
    restart : number of tasks after which a process is replaced; command : words that start it; the folder is added"""

    def __init__(
        self, folder: Path, workers: int, restart: int = RESTART, command: Sequence[str] | None = None
    ) -> None:
        self._folder, self._workers, self._restart, self._command = folder, workers, restart, command or WORKER_COMMAND
        # SAFEPATH: else `-m` takes modules from the folder that the command is given in, with a stranger's recordings.
        self._environment = {**os.environ, **ONE, "PYTHONPATH": _search_path(), "PYTHONSAFEPATH": "1"}
        self._todo: queue.SimpleQueue[Task | None] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[tuple[Task, Reply] | BaseException] = queue.SimpleQueue()
        self._running: set[subprocess.Popen] = set()
        self._stopped = False

    def submit(self, task: Task) -> None:
        """Submit a task; `results` gives its reply."""
        self._todo.put(task)

    def results(self, count: Callable[[], int]) -> Iterator[tuple[Task, Reply]]:
        """Yield each task with its reply as it comes, while ``count()``, the number still awaited, is above 0."""
        while count():
            found = self._done.get()
            if isinstance(found, BaseException):
                raise found
            yield found

    def __enter__(self) -> Local:
        self._threads = [threading.Thread(target=self._watch, daemon=True) for _ in range(self._workers)]
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None = None, *more: object) -> None:
        self._stopped = True
        for _ in self._threads:
            self._todo.put(None)
        if kind is not None:
            for process in tuple(self._running):
                process.kill()  # nothing half-written has a name that counts
        for thread in self._threads:
            thread.join()

    def _watch(self) -> None:
        """Take tasks until there are no more, and have them done by one process at a time."""
        worker = _Worker(self._start, self._restart)
        try:
            while (task := self._todo.get()) is not None:
                self._done.put((task, self._serve(worker, task)))
        except BaseException as error:  # a thread has nobody else to tell
            self._done.put(error)
        finally:
            worker.end()

    def _serve(self, worker: _Worker, task: Task) -> Reply:
        for _ in range(KILLS):
            reply = worker.ask(msgspec.to_builtins(task))
            if reply is not None:
                return msgspec.convert(reply, Reply)
            if self._stopped:
                break
        return Reply(failure=Failure(f"killed its worker {KILLS} times ({worker.cause}); set aside"))

    def _start(self) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [*self._command, str(self._folder)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8", env=self._environment,
        )  # fmt: skip
        self._running.add(process)
        if self._stopped:
            process.kill()
        return process


def _search_path() -> str:
    """Return a PYTHONPATH by which a worker finds this package under its name, which is a long one in Blender."""
    root = Path(__file__).parents[__package__.count(".") + 1]
    return os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])


class _Worker:
    """Worker that runs one process after another. cause : why the last process died"""

    def __init__(self, start: Start, restart: int) -> None:
        self._start, self._restart = start, restart
        self._process: subprocess.Popen[str] | None = None
        self._served = 0
        self.cause = ""

    def ask(self, task: dict[str, Any]) -> dict[str, Any] | None:
        """Send a task to a process and return its reply; None if the process died, with the reason in `cause`."""
        if self._process is None:
            self._process, self._served = self._start(), 0
        line = ""
        with suppress(OSError):
            self._process.stdin.write(json.dumps(task) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        self._served += 1
        if not line.endswith("\n"):
            self._process.kill()
            with suppress(OSError):  # what it never read would else be tried again, and reported, when it is forgotten
                self._process.stdin.close()
            status = self._process.wait()
            self.cause = f"signal {-status}" if status < 0 else f"exit status {status}"
            self._process = None
            return None
        if self._served >= self._restart:
            self.end()
        return json.loads(line)

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            with suppress(OSError):
                self._process.stdin.close()
            self._process.wait()
            self._process = None


class InProcess:
    """Executor of tasks in this process."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._todo = folder, deque[Task]()

    def submit(self, task: Task) -> None:
        """Submit a task; `results` gives its reply."""
        self._todo.append(task)

    def results(self, count: Callable[[], int]) -> Iterator[tuple[Task, Reply]]:
        """Do the submitted tasks in order; yield (task, reply) while ``count()``, how many are awaited, is above 0."""
        while count():
            task = self._todo.popleft()
            yield task, msgspec.convert(tasks.run(str(self._folder), msgspec.to_builtins(task)), Reply)

    def __enter__(self) -> InProcess:
        return self

    def __exit__(self, *error: object) -> None:
        self._todo.clear()
