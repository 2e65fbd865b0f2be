"""Jobs whose shards are put together into one result: the job's folder is <result>.parts until it is done."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from ...errors import TactileError
from ...files import lock
from . import job as jobs
from . import run as runs
from .job import Job


def folder_of(out: Path) -> Path:
    """Return the folder of the job whose result `out` is."""
    return out.with_name(out.name + ".parts")


@contextmanager
def begun(out: Path, job: Job) -> Iterator[Path]:
    """Lock the folder of a new job, or of the same one begun before; at the end remove it, if `finished` was called.

    Raises TactileError where it holds another job, and what ``run.opened`` raises.
    """
    folder = folder_of(out)
    with runs.opened(folder, None):
        if not jobs.exists(folder):
            jobs.check_empty(folder, "Move it away, or choose another name for the result")
            jobs.write(folder, job)
        elif jobs.read(folder).id != job.id:
            found = "holds parts of another scene, seed, count, option or version"
            raise TactileError(folder, found, "none or the same", "Remove the folder to start again")
        yield folder
    if (folder / DONE).exists():
        _remove(folder)


def write(out: str | os.PathLike, job: Job) -> Path:
    """Write the job alone, for runners of `tactile batch --array`; its folder. Raises what `begun` raises."""
    with begun(Path(out), job) as folder:
        return folder


DONE = ".done"


def finished(folder: Path) -> None:
    """Mark the folder as no longer needed: `begun` removes it at its end."""
    (folder / DONE).touch()


def _remove(folder: Path) -> None:
    """Remove the job's own files, the job last, and the folder where it is empty then."""
    for name in (jobs.PREPARED, jobs.SHARDS, jobs.ASIDE):
        shutil.rmtree(folder / name, ignore_errors=True)
    for file in (jobs.MANIFEST, jobs.FILE, lock.FILE, DONE):
        (folder / file).unlink(missing_ok=True)
    for reader in folder.glob(f"{lock.FILE}-*"):
        reader.unlink()
    with suppress(OSError):
        folder.rmdir()


def check(done: runs.Done) -> None:
    """Raise TactileError for the first task that could not be done."""
    for name, why in sorted(done.aside.items()):
        where, _, found = why.partition(": ")
        raise TactileError(where, found) if found else TactileError(name, why)
