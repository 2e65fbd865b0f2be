"""The two kinds of work in a job, to prepare an input and to make a shard, as small values for any process."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import msgspec

from ...errors import TactileError
from ...files.threads import one_thread
from . import job as jobs
from . import manifest

_one_thread_once = functools.cache(one_thread)


class Task(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Work on the job's input number `recording`: to make its shard number `shard`, or to prepare it if None."""

    recording: int
    shard: int | None = None


class Failure(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Reason why a task failed, with the fields of a TactileError; `where` is "" if its input is not to blame."""

    found: str
    where: str = ""
    expected: str = ""
    advice: str = ""

    @classmethod
    def from_error(cls, error: TactileError) -> Failure:
        """Return an error as a failure with the same fields."""
        return cls(error.found, error.where, error.expected, error.advice)

    def error(self, task: str) -> TactileError:
        """Return the failure as an error to raise. task : name of the failed task, in place of an empty `where`"""
        return TactileError(self.where or task, self.found, self.expected, self.advice)

    def __str__(self) -> str:
        return str(self.error("")).removeprefix(": ")


class Reply(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Outcome of a task. made : false if its result existed; shards : number of the input's shards, if it was prepared
    failure : why it failed, or None; stop : true if every other task would fail, too"""

    made: bool = False
    shards: int = 0
    failure: Failure | None = None
    stop: bool = False


def name(job: jobs.Job, task: Task) -> str:
    """Return a task's name for files and messages: INPUT, or INPUT-000007 for shard 7 of that input."""
    recording = job.inputs[task.recording].name
    return recording if task.shard is None else f"{recording}-{task.shard:06d}"


def run(folder: str, task: dict[str, Any]) -> dict[str, Any]:
    """Do a task of the job in `folder` and return its reply, both plain data for JSON and Dask alike.

    Errors of the task's input or the disk are in the reply and never raised. From here on linear algebra stays in one
    thread, as the bytes would otherwise depend on the process."""
    _one_thread_once()
    reply = _run(Path(folder), msgspec.convert(task, Task))
    return msgspec.to_builtins(reply)


def _run(folder: Path, task: Task) -> Reply:
    try:
        job = _job(str(folder), _stamp(folder))
    except TactileError as error:
        return Reply(failure=Failure.from_error(error))
    try:
        kind = jobs.module_for(job.recipe)
        if task.shard is None:
            shards, made = kind.prepare_input(folder, job, task.recording)
            return Reply(made=made, shards=shards)
        return Reply(made=kind.make(folder, job, task.recording, task.shard))
    except TactileError as error:
        return Reply(failure=Failure.from_error(error))
    except OSError as error:
        return Reply(failure=Failure.from_error(manifest.refused(folder, job, error)), stop=True)
    except MemoryError as error:
        advice = "Give the same command with fewer workers"
        return Reply(failure=Failure(str(error) or "no memory left", advice=advice))


def _stamp(folder: Path) -> tuple[int, int]:
    """Return inode and size of the job file, as a worker may serve several jobs in one place; or raise TactileError."""
    try:
        found = (folder / jobs.FILE).stat()
    except OSError as error:
        advice = "Give every machine the same path to it"
        raise TactileError(folder, "no job here", "the job's folder", advice) from error
    return found.st_ino, found.st_size


@functools.lru_cache(maxsize=4)
def _job(folder: str, stamp: tuple[int, int]) -> jobs.Job:
    return jobs.read_to_run(Path(folder))
