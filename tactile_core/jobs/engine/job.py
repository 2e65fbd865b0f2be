"""Read and write ``job.json``: what a job makes, by its recipe and inputs. It never changes after it is written; all
else follows from it. A recipe, one struct for each kind of job, is all that decides a shard's bytes besides the input.

Each kind of job is done by a module of ``jobs``, in `MODULES`, which has
``prepare_input(folder, job, index)``  prepares an input; returns the number of its shards, as far as known, and true
if anything was made
``make(folder, job, index, number)``  makes a shard unless it is there and whole; returns true if it was made
``inspect_input(folder, job, index)``  returns `InputFacts` by the input's files; None before its first task is done
``GROWS``  only where `prepare_input` is to be called again when all its shards are there: true

The first two raise TactileError for what cannot be done, OSError if the disk cannot be written."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, Generic, Literal, TypeVar

import msgspec
from msgspec import Meta

from ...errors import TactileError
from ...files import atomic, provenance
from ...files.outside import read_small
from ...files.version import __version__
from ...recordings import PrepareOptions, electrode_gains
from ...recordings.electrode_gains import SensorFile
from ...recordings.tables.column_map import ColumnMap
from ...sensors import SOURCE, TARGET
from ...translation.answer import Answer
from .. import results
from ..results import TRANSLATED
from .inputs import Input

FORMAT = "tactile-job-1"
FILE, PREPARED, SHARDS, ASIDE, MANIFEST = "job.json", "prepared", "shards", "aside", "manifest.json"
ADVICE = "Use an empty --out folder"
MOST = 2**30  # bytes of a job file; one of 10,000 inputs has 2.5 MB
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


R = TypeVar("R")


class Job(msgspec.Struct, Generic[R], forbid_unknown_fields=True, frozen=True, dict=True):
    """A job: a recipe and the inputs to run it on. weights, calibration : folder and file, None for the package's own
    format : version of job.json's layout; versions : by name, of Python, this package and libraries that made it"""

    format: str
    inputs: list[Input]
    recipe: R
    weights: str | None
    calibration: str | None
    versions: dict[str, str]

    @functools.cached_property  # every shard names it, and with 10,000 inputs it takes 10 ms
    def id(self) -> str:
        """Return the SHA-256 of all that decides the shards; equal for equal inputs in another place."""
        named = [[one.name, one.sha256] for one in self.inputs]
        content = json.dumps([named, msgspec.to_builtins(self.recipe)], sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()


def make(inputs: list[Input], recipe: R, weights: str | None, calibration: str | None = None) -> Job[R]:
    """Return a new job, not yet written; weights, calibration : folder and file, None for those that ship"""
    networks, unit = (None if path is None else os.path.abspath(path) for path in (weights, calibration))
    return Job(FORMAT, inputs, recipe, networks, unit, provenance.versions())


def write(folder: Path, job: Job) -> None:
    """Make the job's folder and write its job file. Raises TactileError if that is not possible."""
    with atomic.writing(folder, advice="Name another --out folder"):
        folder.mkdir(parents=True, exist_ok=True)
        atomic.write_json(folder / FILE, msgspec.to_builtins(job))


def check_empty(folder: Path, advice: str) -> None:
    """Raise TactileError, with advice, if a folder that has no job holds files; hidden ones are ignored."""
    others = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    if others:
        raise TactileError(folder, f"holds {others[0]}, and no job", "an empty folder", advice)


def exists(folder: Path) -> bool:
    """Return true if the folder holds a job."""
    return (folder / FILE).exists()


def read_to_run(folder: Path) -> Job:
    """Return the job in a folder, to run it. Raises TactileError as `read`, and for a job of another version."""
    job = read(folder)
    if job.recipe.version != __version__:
        found = f"made by version {job.recipe.version}"
        raise TactileError(folder / FILE, found, f"version {__version__}, which is running", ADVICE)
    return job


def completion(job: Job) -> str:
    """Return in words, for a message, which command completes a job that is not complete."""
    same = job.recipe.version == __version__
    return "the same command goes on" if same else f"version {job.recipe.version}, which began it, goes on with it"


def read(folder: Path) -> Job:
    """Return the job in a folder. Raises TactileError for no job, and for one that is damaged or of another format."""
    file = folder / FILE
    try:
        job = msgspec.convert(json.loads(read_small(file, MOST)), Job[Recipe])
    except OSError as error:
        found, advice = f"cannot be read ({error.strerror or error})", "Begin one: tactile batch RECORDINGS --out DIR"
        raise TactileError(file, found, "the folder of a job", advice) from error
    except (ValueError, RecursionError) as error:  # of JSON and of msgspec
        raise TactileError(file, f"damaged ({error})", f"a job file ({FORMAT})", ADVICE) from error
    if job.format != FORMAT:
        raise TactileError(f"{file}, format", repr(job.format), repr(FORMAT), ADVICE)
    for index, one in enumerate(job.inputs):
        odd = os.path.basename(one.name) != one.name or "\0" in one.name + one.path
        if odd or not one.name.startswith(f"{index:05d}_") or not _encodes(one.name + one.path):
            raise TactileError(f"{file}, inputs", f"the name {one.name!r:.80}", f"{index:05d}_<file name>", ADVICE)
    if isinstance(job.recipe, Translate):
        results.parse_words(",".join(job.recipe.keep), results.KEEPABLE, least=0)
        job.recipe.prepare.options().check()
        if job.recipe.sensor is not None:
            electrode_gains.check(job.recipe.sensor, f"{file}, recipe, sensor")
    if isinstance(job.recipe, Simulate) and len(job.recipe.values) != len(job.inputs):
        found = f"{len(job.recipe.values)} sets of values"
        raise TactileError(f"{file}, recipe", found, f"{len(job.inputs)}, one for each input", ADVICE)
    return job


def _encodes(name: str) -> bool:
    """Return true if the name can be a path on this machine."""
    try:
        os.fsencode(name)
    except UnicodeEncodeError:
        return False
    return True


def prepared_file(folder: Path, name: str) -> Path:
    """Return the path of the prepared recording of that name, ``prepared/NAME.h5``, existing or not."""
    return folder / PREPARED / f"{name}.h5"


def shard_file(folder: Path, name: str, number: int) -> Path:
    """Return the path of a shard by its number, from 0, in the recording called `name`, existing or not."""
    return folder / SHARDS / f"{name}-{number:06d}.h5"
