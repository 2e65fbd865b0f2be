"""Tasks in this very process, one after another."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec

from . import tasks
from .tasks import Reply, Task


class Here:
    """The place of a job that needs no other process."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._todo = folder, deque[Task]()

    def submit(self, task: Task) -> None:
        """Have a task done."""
        self._todo.append(task)

    def results(self, count: Callable[[], int]) -> Iterator[tuple[Task, Reply]]:
        """Replies as they come, as long as `count` says that some are awaited."""
        while count():
            task = self._todo.popleft()
            yield task, msgspec.convert(tasks.run(str(self._folder), msgspec.to_builtins(task)), Reply)

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *error: object) -> None:
        self._todo.clear()
