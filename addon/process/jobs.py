"""Start and follow a job in another process: its progress comes as lines, and it can be cancelled."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from ...tactile_core.errors import TactileError

_LOOK = 0.05  # s between two looks at the worker
_PATIENCE = 5.0  # s that a cancelled job has to end by itself


class Job:
    """A worker process that does one job, and the folder of its files.

    stage : name of the step that it reports; done, total : progress within that step
    finished : true once it has ended well; drawn : number of pictures that could be shown so far
    """

    def __init__(self, kind: str, folder: Path, *, listening: bool = False, **options: object) -> None:
        """Start the worker. kind : a key of ``worker.JOBS``, such as "simulate"; folder : holds its input and output
        options : other entries of job.json; listening : true if the job waits for messages of ``tell``"""
        self.folder, self.done, self.total, self.finished, self.stage = folder, 0, 1, False, ""
        self.drawn = 0
        (folder / "job.json").write_text(json.dumps({"kind": kind} | options), encoding="utf-8")
        self._lines: queue.Queue[str] = queue.Queue()
        with open(folder / "stderr.txt", "wb") as errors:
            self._process = subprocess.Popen(
                [sys.executable, "-B", os.fspath(Path(__file__).with_name("worker.py")), os.fspath(folder)],
                stdin=subprocess.PIPE if listening else subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                encoding="utf-8",
                env=_environment(),
            )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def share(self) -> float:
        """Share of the stage that is done, 0 to 1."""
        return self.done / self.total

    def tell(self, message: dict) -> None:
        """Send a listening worker a message that its job reads; if it has died, the next ``poll`` raises its error."""
        with contextlib.suppress(OSError), _alive_on_broken_pipe():
            self._process.stdin.write(json.dumps(message) + "\n")
            self._process.stdin.flush()

    def poll(self, wait: float = 0.0) -> bool:
        """Read messages for up to ``wait`` s; return true once the worker ended. Raises TactileError if it failed."""
        error = None
        for message in self._messages(wait):
            error = message.get("error", error)
            self.stage = message.get("stage", self.stage)
            if message.get("total"):
                self.done, self.total = message["done"], message["total"]
            self.drawn += "drawn" in message
            self.finished = self.finished or bool(message.get("finished"))
        if error is not None:
            self.cancel()
            raise TactileError("Tactile", error)
        if self._reader.is_alive() or not self._lines.empty():
            return False
        if self._process.wait() and not self.finished:
            raise TactileError("Tactile worker", self._last_words(), "a finished job", "See the advice in Preferences")
        return True

    def wait(self) -> None:
        """Wait for the end of the process; raises TactileError when it failed."""
        while not self.poll(_LOOK):
            pass

    def cancel(self) -> None:
        """End the process; what it has written stays in its folder."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._reader.join(_PATIENCE)
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError), _alive_on_broken_pipe():  # what was not read by a dead worker
                    pipe.close()

    def _messages(self, wait: float) -> Iterator[dict]:
        """Yield the messages since the last call; waits at most ``wait`` s for the first."""
        try:
            yield _message(self._lines.get(timeout=wait) if wait else self._lines.get_nowait())
            while True:
                yield _message(self._lines.get_nowait())
        except queue.Empty:
            return

    def _read(self) -> None:
        for line in self._process.stdout:
            self._lines.put(line)

    def _last_words(self) -> str:
        words = (self.folder / "stderr.txt").read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return f"ended with status {self._process.returncode}" + (f": {words[-1]}" if words else "")


class JobFolder:
    """A temporary folder for a job's files, removed at the end of a ``with`` block or by ``close``."""

    def __init__(self) -> None:
        self.path = Path(tempfile.mkdtemp(prefix="tactile-"))

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.path, ignore_errors=True)


@contextlib.contextmanager
def _alive_on_broken_pipe() -> Iterator[None]:
    """Block the signal SIGPIPE, which would end Blender if the worker has died; Python alone would ignore it."""
    if not hasattr(signal, "SIGPIPE"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
    try:
        yield
    finally:
        if signal.SIGPIPE in signal.sigpending():
            signal.sigwait({signal.SIGPIPE})
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _message(line: str) -> dict:
    try:
        found = json.loads(line)
    except ValueError:  # a library that writes to stdout
        return {}
    return found if isinstance(found, dict) else {}


def _environment() -> dict[str, str]:
    """Return the worker's environment: it finds ``tactile_core``, Blender's packages and the extension's wheels."""
    packages = [entry for entry in sys.path if Path(entry).name in ("site-packages", "dist-packages")]
    path = os.pathsep.join([os.fspath(Path(__file__).parents[2]), *packages])
    return os.environ | {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8"}
