"""The kinds of job, a module of ``jobs`` each. Each has

``prepare_input(folder, job, index)``  does what an input needs before its shards; returns how many shards it has, as
    far as is known, and whether anything was made
``make(folder, job, index, number)``  makes a shard unless it is there and whole; returns whether it was made
``inspect_input(folder, job, index)``  what the files tell of an input, None before its first task was done
``GROWS``  whether `prepare_input` is to be asked again when all its shards are there

Both doing functions raise TactileError for what cannot be done, OSError where the disk cannot be written.
"""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any

from . import recipes

if TYPE_CHECKING:
    from .job import Job

MODULES: dict[Any, str] = {
    recipes.Translate: "translate_shards", recipes.Pairs: "pairs",
    recipes.Simulate: "simulate", recipes.Render: "render_shards",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class InputFacts:
    """Facts known of an input. shards : their number; frames : of a recording

    warnings : reads those to report, which takes longer than the rest; TactileError where the input is damaged
    bytes : about, of all its shards; 0 where that is not known before they are there
    """

    shards: int
    frames: int = 0
    warnings: Callable[[], tuple[str, ...]] = tuple
    bytes: int = 0


def module_for(job: Job) -> ModuleType:
    """Return the module that does a job."""
    return importlib.import_module(f"...{MODULES[type(job.recipe)]}", __name__)
