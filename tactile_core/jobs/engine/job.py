"""Read and write ``job.json``: what a job makes. It never changes after it is written; all else follows from it."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from pathlib import Path
from typing import Generic, TypeVar

import msgspec

from ...errors import TactileError
from ...files import atomic, provenance
from ...files.outside import read_small
from ...files.version import __version__
from ...recordings import electrode_gains
from .. import results
from .inputs import Input
from .recipes import Recipe, Simulate, Translate

FORMAT = "tactile-job-1"
FILE, PREPARED, SHARDS, ASIDE, MANIFEST = "job.json", "prepared", "shards", "aside", "manifest.json"
ADVICE = "Use an empty --out folder"
MOST = 2**30  # bytes of a job file; one of 10,000 inputs has 2.5 MB


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
