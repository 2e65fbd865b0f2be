"""Recipes, one struct for each kind of job: all that decides a shard's bytes besides the input itself.

Each kind of job is done by a module of ``jobs``, in `MODULES`, which has
``prepare_input(folder, job, index)``  prepares an input; returns the number of its shards, as far as known, and true
if anything was made
``make(folder, job, index, number)``  makes a shard unless it is there and whole; returns true if it was made
``inspect_input(folder, job, index)``  returns `InputFacts` by the input's files; None before its first task is done
``GROWS``  only where `prepare_input` is to be called again when all its shards are there: true

The first two raise TactileError for what cannot be done, OSError if the disk cannot be written."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from ...files.version import __version__
from ...recordings import PrepareOptions
from ...recordings.electrode_gains import SensorFile
from ...recordings.tables.column_map import ColumnMap
from ...sensors import SOURCE, TARGET
from ...translation.answer import Answer
from ..results import TRANSLATED

SHARD_FRAMES = 1000  # frames per task: seconds of work, so that little is lost when a worker dies (assumed)
MAX_SHARD_FRAMES = 100_000  # 8 GB of displacements (assumed to be more than anyone wants in a file)
Law = Literal["sheet"]  # of electrodes; there was another, so files of jobs name it
PICTURE_FRAMES = 50  # rendered frames per shard: some seconds of work, and 80 MB with OpenEXR


class Prepare(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Options of ``recordings.PrepareOptions`` that a job can have, under the same names."""

    kind: str | None = None
    tare: str | None = None
    drift: bool = True
    counts_per_unit: float | None = None
    smooth: int | None = None
    polarity: str = "auto"
    columns: ColumnMap | None = None

    def options(self) -> PrepareOptions:
        """Return the options for ``recordings.prepare``."""
        return PrepareOptions(**msgspec.structs.asdict(self))


class Translate(msgspec.Struct, tag="batch", tag_field="verb", forbid_unknown_fields=True, frozen=True):
    """Recipe from recordings to shards of translated frames.

    keep : names of arrays to keep; weights : SHA-256 of the weights' card; shard_frames : frames per shard
    calibration : SHA-256 of the gel's calibration and its photograph, "" for the shipped unit
    preset : of pictures: fast, standard, quality, reference; variant : Mitsuba's: llvm_ad_rgb, scalar_rgb, "" for fast
    answer : options of the estimated contact; gel : "translated", "solved" or "ball:28", see ``convert.ToolOptions``
    source, target : names of sensors; every : translate one frame in ``every``; sensor : calibration of the source's
    unit
    version : of this package when the job was made, as in the other recipes"""

    keep: list[str]
    weights: str
    shard_frames: Annotated[int, Meta(ge=1, le=MAX_SHARD_FRAMES)] = SHARD_FRAMES
    prepare: Prepare = Prepare()
    sensor: SensorFile | None = None
    calibration: str = ""
    preset: str = "fast"
    variant: str = ""
    answer: Answer = Answer()
    gel: str = TRANSLATED
    source: str = SOURCE
    target: str = TARGET
    every: Annotated[int, Meta(ge=1)] = 1
    version: str = __version__


class Pairs(msgspec.Struct, tag="pairs", tag_field="verb", forbid_unknown_fields=True, frozen=True):
    """Recipe from a scene to `count` paired contacts of the sensors source and target, drawn from `seed`.
    keep : ["traction"] or []; electrodes : law of counts; surfaces, files : SHA-256 of the sensors' nodes, of meshes"""

    count: Annotated[int, Meta(ge=1)]
    seed: int
    surfaces: list[str]
    files: list[str]
    source: str = SOURCE
    target: str = TARGET
    keep: list[str] = []
    electrodes: Law = "sheet"
    version: str = __version__


class Simulate(msgspec.Struct, tag="simulate", tag_field="verb", forbid_unknown_fields=True, frozen=True):
    """Recipe from a scene to one recording for each input, each with its own values of the scene's parameters.
    seed : random seed of the first input, one more for each next one; values : one dict per input, name -> value
    keep : electrodes, displacement_<sensor>, traction_<sensor>; files : SHA-256 of the scene's meshes"""

    seed: int
    values: list[dict[str, float | str]]
    files: list[str]
    keep: list[str]
    electrodes: Law = "sheet"
    version: str = __version__


class Render(msgspec.Struct, tag="render", tag_field="verb", forbid_unknown_fields=True, frozen=True):
    """Recipe from deformed gels to pictures; fields as in ``render.Options``, frames "A:B:STEP", calibration a hash."""

    preset: str
    variant: str
    frames: str
    size: tuple[int, int] | None
    exr: bool
    noise: bool
    calibration: str = ""
    object_reflectance: float | None = None
    shard_frames: Annotated[int, Meta(ge=1, le=MAX_SHARD_FRAMES)] = PICTURE_FRAMES
    version: str = __version__


Recipe = Translate | Pairs | Simulate | Render
MODULES: dict[Any, str] = {
    Translate: "translate_shards", Pairs: "pairs",
    Simulate: "simulate", Render: "render_shards",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class InputFacts:
    """Facts of an input. shards, frames : number of its shards, and of its frames if it is a recording
    warnings : function that reads its warnings, which takes longer; raises TactileError if the input is damaged
    bytes : estimated size of all its shards; 0 if unknown before they exist"""

    shards: int
    frames: int = 0
    warnings: Callable[[], tuple[str, ...]] = tuple
    bytes: int = 0


def module_for(recipe: Recipe) -> ModuleType:
    """Return the module that does jobs of this kind."""
    return importlib.import_module(f"...{MODULES[type(recipe)]}", __name__)
