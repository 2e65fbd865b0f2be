"""The two kinds of work in a job, as small values that any process can be handed."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import msgspec

from ...errors import TactileError
from ...files.threads import one_thread
from . import disk_room, kinds
from . import job as jobs


class Task(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """First step for input `recording` of the job (shard None), or one of its shards; see ``kinds``."""

    recording: int
    shard: int | None = None


class Reply(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Outcome of a task.

    made : False where it was there already; shards : that follow, of an input's first task
    error : why it cannot be done, as the user reads it; stop : no other task can be done either
    """

    made: bool = False
    shards: int = 0
    error: str = ""
    stop: bool = False


def name(job: jobs.Job, task: Task) -> str:
    """Name of the task in files and messages."""
    recording = job.inputs[task.recording].name
    return recording if task.shard is None else f"{recording}-{task.shard:06d}"


def run(folder: str, task: dict[str, Any]) -> dict[str, Any]:
    """Do a task of the job in `folder`; both sides plain data, so that JSON and Dask carry them alike.

    Never raises what the task's input or the disk brings about: the reply says it. From here on this process, which
    may be anybody's, keeps linear algebra in one thread, as the bytes would else depend on who does the task.
    """
    _one_thread_once()
    reply = _run(Path(folder), msgspec.convert(task, Task))
    return msgspec.to_builtins(reply)


@functools.cache
def _one_thread_once() -> None:
    one_thread()


def _run(folder: Path, task: Task) -> Reply:
    try:
        job = _job(str(folder), _stamp(folder))
    except (TactileError, OSError) as error:
        return Reply(error=str(error), stop=isinstance(error, OSError))
    try:
        kind = kinds.module_for(job)
        if task.shard is None:
            shards, made = kind.prepare_input(folder, job, task.recording)
            return Reply(made=made, shards=shards)
        return Reply(made=kind.make(folder, job, task.recording, task.shard))
    except TactileError as error:
        return Reply(error=str(error))
    except OSError as error:
        return Reply(error=str(disk_room.refused(folder, job, error)), stop=True)
    except MemoryError as error:
        return Reply(
            error=f"{name(job, task)}: {str(error) or 'no memory left'}. Give the same command with fewer workers"
        )


def _stamp(folder: Path) -> tuple[int, int]:
    """Stamp that distinguishes job files in the same place, for a worker that serves several jobs."""
    try:
        found = (folder / jobs.FILE).stat()
    except OSError as error:
        advice = "Give every machine the same path to it"
        raise TactileError(folder, "no job here", "the job's folder", advice) from error
    return found.st_ino, found.st_size


@functools.lru_cache(maxsize=4)
def _job(folder: str, stamp: tuple[int, int]) -> jobs.Job:
    return jobs.read(Path(folder))
