"""Locks that allow one job per folder; the system drops a lock when its holder dies."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from ..errors import TactileError

FILE = ".tactile-batch-lock"


@contextlib.contextmanager
def held(folder: Path, part: tuple[int, int] | None = None) -> Iterator[None]:
    """Hold the lock of a job's folder; with `part` (i, n) share it with the job's other parts, as in a queue's array.
    Raises TactileError if another job, or the same part, is running. On a network file system it works if that forwards
    locks (NFS 4 and Lustre with flock do)."""
    with contextlib.ExitStack() as stack:
        stack.enter_context(_lock(folder / FILE, folder, shared=part is not None))
        if part is not None:
            name = f"{FILE}-{part[0]}-of-{part[1]}"
            stack.enter_context(_lock(folder / name, f"{folder}, --array {part[0]}/{part[1]}", shared=False))
        yield


@contextlib.contextmanager
def awaited(file: Path) -> Iterator[None]:
    """Wait for the lock on ``file`` and hold it; the file stays. On a file system without locks nobody waits."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        with contextlib.suppress(OSError):
            _wait(descriptor)
        yield
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def _lock(file: Path, where: str | Path, shared: bool) -> Iterator[None]:
    """Hold a lock on ``file``, shared or not; the file stays, as one that others remove would protect nothing. Raises
    TactileError, on `where`, if another process holds it."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        take(descriptor, shared=shared)
    except OSError as error:
        os.close(descriptor)
        advice = "Wait for it, watch it with --status, or name another folder"
        raise TactileError(where, "another job is running here", "one at a time", advice) from error
    try:
        yield
    finally:
        os.close(descriptor)


def take(descriptor: int, *, shared: bool = False) -> None:
    """Lock an open file, by its descriptor, without waiting. Raises OSError if another process has locked it.
    shared : true allows other shared locks on it"""
    if os.name == "nt":
        import msvcrt

        if not shared:  # Windows has no shared locks here: parts of an array are kept apart by their own locks alone
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
    else:
        import fcntl

        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)


def _wait(descriptor: int) -> None:
    if os.name == "nt":
        import errno
        import msvcrt

        while True:
            try:
                return msvcrt.locking(descriptor, msvcrt.LK_LOCK, 1)  # gives up after ten tries, a second apart
            except OSError as error:
                if error.errno not in (errno.EDEADLK, errno.EACCES):
                    raise
    import fcntl

    return fcntl.flock(descriptor, fcntl.LOCK_EX)
