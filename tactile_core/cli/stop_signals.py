"""SIGTERM and SIGHUP end a job as Ctrl-C does: with its clean-up."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NAMES = ("SIGTERM", "SIGHUP")  # Windows has no SIGHUP


class Stopped(KeyboardInterrupt):
    """Exception raised by one of the signals. number : of the signal."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


@contextmanager
def stopping() -> Iterator[None]:
    """Make stop signals raise Stopped inside the block; restore the former handlers after it.

    A signal that is ignored (nohup) or handled by the program around us stays so. After the first signal the others
    are ignored up to the block's end: `timeout` and terminals send two, and the second would cut the clean-up short.
    Outside of the main thread, where Python allows no handlers, nothing changes.
    """
    numbers = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    ours = [number for number in numbers if signal.getsignal(number) is signal.SIG_DFL]
    if threading.current_thread() is not threading.main_thread():
        ours = []

    def stop(number: int, frame: FrameType | None) -> None:
        """Raise Stopped, and ignore all further stop signals, so that the clean-up is not interrupted."""
        for other in ours:
            signal.signal(other, signal.SIG_IGN)
        raise Stopped(number)

    try:
        for number in ours:
            signal.signal(number, stop)
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)
