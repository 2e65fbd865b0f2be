"""Run a job from beginning to end, with any executor."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Protocol, Self

from ...errors import TactileError
from ...files import atomic, lock
from . import job as jobs
from . import manifest, tasks
from .job import Job
from .tasks import Failure, Reply, Task

Progress = Callable[[int, int], None]


class Place(Protocol):
    """Executor of tasks, such as local processes or a cluster's; a context manager."""

    def submit(self, task: Task) -> None:
        """Submit a task; `results` gives its reply."""

    def results(self, count: Callable[[], int]) -> Iterator[tuple[Task, Reply]]:
        """Yield each task with its reply as it comes, while ``count()``, the number still awaited, is above 0."""

    def __enter__(self) -> Self: ...

    def __exit__(self, kind: type[BaseException] | None, *more: object) -> None: ...


@dataclasses.dataclass
class Outcome:
    """Outcome of a run. made, kept : number of shards made now and before; aside : task's name -> why it failed"""

    made: int = 0
    kept: int = 0
    aside: dict[str, Failure] = dataclasses.field(default_factory=dict)


@contextlib.contextmanager
def opened(folder: Path, part: tuple[int, int] | None) -> Iterator[None]:
    """Lock a job's folder, which is made if needed, and clear what killed runs left. part : (i, n), the i-th of n parts
    of a queue's array; None for the whole job. Raises TactileError if it is locked."""
    made, new = not folder.exists(), not (folder / lock.FILE).exists()
    with atomic.writing(folder, advice="Name another --out folder"):
        folder.mkdir(parents=True, exist_ok=True)
        stack = contextlib.ExitStack()
        stack.enter_context(lock.held(folder, part))
    with stack:
        _sweep(folder, part)
        try:
            yield
        except BaseException:  # Ctrl-C, too; raised again
            if made and not (folder / jobs.PREPARED).exists():
                _unmake(folder)
            elif new and not jobs.exists(folder):  # a folder of others' files, which is left as it was
                (folder / lock.FILE).unlink(missing_ok=True)
            raise
        finally:
            if folder.exists():
                _sweep(folder, part)


def _unmake(folder: Path) -> None:
    """Remove a job's folder if it holds only locks and the file of a job that was refused before it began."""
    with suppress(OSError):  # others have removed it already
        files = list(folder.iterdir())
        if all(path.name.startswith((lock.FILE, jobs.FILE)) for path in files):
            for path in files:
                path.unlink()
            folder.rmdir()


def _sweep(folder: Path, part: tuple[int, int] | None) -> None:
    """Remove what killed workers left; not for a part of an array, as others may be writing, nor without a job."""
    if part is None and jobs.exists(folder):
        with atomic.writing(folder, "a job folder of ours that can be written", "Make it writable"):
            for place in (".", jobs.PREPARED, jobs.SHARDS, jobs.ASIDE):
                atomic.sweep_files(folder / place)


def run(folder: Path, job: Job, place: Place, part: tuple[int, int] | None, progress: Progress) -> Outcome:
    """Do the tasks of a job that are not done, all or those of part (i, n), inside the block of `opened`; return the
    outcome. place : executor of the tasks; progress : called with (tasks done, tasks known so far)
    Raises TactileError if the disk cannot be written."""
    work = _Work(folder, job, part)
    try:
        with place:  # which may be refused: the folders say that the job has begun
            for name in (jobs.PREPARED, jobs.SHARDS, jobs.ASIDE):
                (folder / name).mkdir(exist_ok=True)
            for task in work.first_tasks():
                place.submit(task)
            for task, reply in place.results(work.awaited):
                for follow in work.take(task, reply):
                    place.submit(follow)
                progress(work.finished, work.known)
        if part is None:
            manifest.write(folder, job)
    except OSError as error:
        raise manifest.refused(folder, job, error) from error
    return work.done


class _Work:
    """Tasks of a run, and its outcome, `done`. known, finished : number of tasks known so far, and of finished ones"""

    def __init__(self, folder: Path, job: Job, part: tuple[int, int] | None) -> None:
        self._folder, self._job = folder, job
        self._part, self._parts = part or (0, 1)
        self.done, self.known, self.finished = Outcome(), 0, 0
        self._grows = getattr(jobs.module_for(job.recipe), "GROWS", False)
        self._asked, self._open = Counter[int](), Counter[int]()  # shards of each input: so far, and not done of them

    def awaited(self) -> int:
        """Return the number of tasks whose reply has not come."""
        return self.known - self.finished

    def first_tasks(self) -> list[Task]:
        """Return tasks to prepare all inputs; a part of an array begins with its own, for the others to use."""
        count = len(self._job.inputs)
        own = [index for index in range(count) if index % self._parts == self._part]
        others = [index for index in range(count) if index % self._parts != self._part]
        self.known = count
        return [Task(index) for index in own + others]

    def take(self, task: Task, reply: Reply) -> list[Task]:
        """Record a worker's reply to a task; return the tasks that can be started now."""
        self.finished += 1
        name = tasks.name(self._job, task)
        file = self._folder / jobs.ASIDE / f"{name}.json"
        if reply.failure is not None:
            if reply.stop:
                raise reply.failure.error(name)
            self.done.aside[name] = reply.failure
            atomic.write_json(file, {"task": name, "why": str(reply.failure)}, shared=True)
            return []
        file.unlink(missing_ok=True)
        if task.shard is None:
            follow = self._shards(task.recording, reply.shards)
        else:
            self.done.made += reply.made
            self.done.kept += not reply.made
            self._open[task.recording] -= 1
            follow = [Task(task.recording)] if self._grows and not self._open[task.recording] else []
        self.known += len(follow)
        return follow

    def _shards(self, recording: int, count: int) -> list[Task]:
        """Return tasks for this part's shards among the first `count` of a recording, without those returned before."""
        if self._grows:
            count = max(count, self._parts)  # each part makes one, from which it learns how many there are
        numbers = range(self._asked[recording], count)
        self._asked[recording] = max(count, self._asked[recording])
        # Shifted by the recording, so that many short ones are spread over the parts too.
        mine = [number for number in numbers if (number + recording) % self._parts == self._part]
        self._open[recording] += len(mine)
        return [Task(recording, number) for number in mine]


def folder_of(out: Path) -> Path:
    """Return <out>.parts, the folder of a job whose shards are joined into the single result `out`."""
    return out.with_name(out.name + ".parts")


@contextlib.contextmanager
def begun(out: Path, job: Job) -> Iterator[Path]:
    """Lock and yield <out>.parts, the folder of a new job or of this job, begun before; or raise TactileError."""
    folder = folder_of(out)
    with opened(folder, None):
        if not jobs.exists(folder):
            jobs.check_empty(folder, "Move it away, or choose another name for the result")
            jobs.write(folder, job)
        elif jobs.read_to_run(folder).id != job.id:
            found = "holds parts of another scene, seed, count, option or version"
            raise TactileError(folder, found, "none or the same", "Remove the folder to start again")
        yield folder


def write(out: str | os.PathLike, job: Job) -> Path:
    """Write the job of `out` alone, for `tactile batch --array`; return <out>.parts. TactileError for another job's."""
    with begun(Path(out), job) as folder:
        return folder


@contextlib.contextmanager
def completed(
    out: Path, job: Job, place: Callable[[Path], Place], progress: Progress = lambda done, known: None
) -> Iterator[Path]:
    """Do a whole job, yield its folder, whose shards the block joins into `out`, and remove the folder.
    place : function from the job's folder to its executor; progress : called with (tasks done, tasks known)
    Raises TactileError for the first task that failed, for another job's folder, and if the disk cannot be written."""
    with begun(out, job) as folder:
        done = run(folder, job, place(folder), None, progress)
        for name, why in sorted(done.aside.items()):
            raise why.error(name)
        yield folder
    _remove(folder)


def _remove(folder: Path) -> None:
    """Remove the job's own files, the job file last, and the folder if it is then empty."""
    for name in (jobs.PREPARED, jobs.SHARDS, jobs.ASIDE):
        shutil.rmtree(folder / name, ignore_errors=True)
    for file in (jobs.MANIFEST, jobs.FILE, lock.FILE):
        (folder / file).unlink(missing_ok=True)
    for reader in folder.glob(f"{lock.FILE}-*"):
        reader.unlink()
    with suppress(OSError):
        folder.rmdir()
