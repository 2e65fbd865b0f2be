"""Simulate paired contacts, the same force, lean and place on BioTac and DIGIT, as training data. Press i draws all it
needs from (seed, i), so any number of workers makes the same file, and an interrupted run continues with the missing
blocks of presses. What jobs call is described in ``engine.job``."""

from __future__ import annotations

import functools
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..files import atomic, checksummed
from ..mechanics.fast.compliance import compliance_of
from ..sensors import PAIR
from ..sensors.descriptor import of_kind
from ..sensors.fluid_sensor import Fluid
from ..sensors.gel_sensor import GelSensor
from ..simulation.pairs_writer import Made, card, card_path, merge
from ..simulation.random_bodies import NAME
from ..simulation.scene import Scene
from .engine import job as jobs
from .engine import run as runs
from .engine.inputs import Input, load_scene_of, read_scene
from .engine.job import InputFacts, Job, Pairs
from .engine.local import InProcess
from .engine.run import Place, Progress

GROWS = True
BLOCK = 4  # presses per block: a few seconds of work
COUNT = "count"  # the array of a block that says how many contacts it holds
GROWTH = 8  # times as many blocks as there are, at most, are asked for at once: the estimate is better then
MOST = 10**8  # contacts of a file, 4 TB
IN_VAIN = 20  # blocks without a contact after which a scene is given up (assumed)


def make_pairs(
    scene_path: str | os.PathLike,
    count: int,
    seed: int,
    out: str | os.PathLike,
    progress: Progress = lambda done, known: None,
    place: Callable[[Path], Place] = InProcess,
    pair: tuple[str, str] = PAIR,
    keep: Sequence[str] = (),
) -> None:
    """Simulate ``count`` paired contacts of a scene into the HDF5 file ``out``, and write its card (``pairs_writer``).

    progress : called with (blocks of presses done, known so far); blocks are kept in ``<out>.parts``, which is removed
        at the end; place : function from the job's folder to the executor of tasks
    pair : names of the sensors, source and target; keep : ("traction",) to keep it, else ()
    Raises TactileError for a bad scene or count, and for parts of another scene or seed."""
    out = Path(out)
    job, names, text = plan(scene_path, count, seed, out, pair, keep)
    compliance_of(pair[1]), compliance_of(pair[0])  # built once here, not by every worker at the same time
    with runs.completed(out, job, place, progress) as folder:
        merge(blocks(folder, job), count, out, Made(text, names, seed, pair, keep))
        atomic.write_json(card_path(out), card(out, *pair))


def plan(
    scene_path: str | os.PathLike,
    count: int,
    seed: int,
    out: Path,
    pair: tuple[str, str] = PAIR,
    keep: Sequence[str] = (),
) -> tuple[Job[Pairs], list[str], str]:
    """Return the job, the indenters' names and the scene's TOML text; parameters and errors: see ``make_pairs``."""
    source, target = pair
    of_kind(source, Fluid), of_kind(target, GelSensor)
    scene, text, inputs, files = read_scene(scene_path, ["presses"])
    if scene.pairs is None:
        raise TactileError(f"{scene_path}, pairs", "missing", "a [pairs] table", "See scenes/press_sphere/scene.toml")
    if not 1 <= count <= MOST:
        raise TactileError("--count", str(count), f"1 to {MOST:,}")
    for spec in scene.indenters:
        spec.build()  # an impossible one is refused before anything is written
    atomic.claim(out)
    surfaces = [sensors.sensor_surface(sensor).sha256 for sensor in pair]
    job = jobs.make(inputs, Pairs(count, seed, surfaces, files, source, target, list(keep)), None)
    names = [spec.name for spec in scene.indenters]
    return job, names + [NAME] * (scene.pairs.random_bodies > 0), text


def prepare_input(folder: Path, job: Job[Pairs], index: int) -> tuple[int, bool]:
    """Return the number of blocks that the job needs, by the contacts made so far, and False: nothing is prepared."""
    _scene(job.inputs[index], tuple(job.recipe.files))
    return _wanted(folder, job), False


def make(folder: Path, job: Job[Pairs], index: int, number: int) -> bool:
    """Solve the contacts of block `number` of presses and write them; return false if they were there already."""
    from ..simulation.pair_sampling import press_rows

    one = job.inputs[index]
    file = jobs.shard_file(folder, one.name, number)
    if checksummed.verified_checksum(file) is not None:
        return False
    scene = _scene(one, tuple(job.recipe.files))
    recipe = job.recipe
    presses = range(number * BLOCK, (number + 1) * BLOCK)
    way = (recipe.source, recipe.target), recipe.keep
    rows = [row for press in presses for row in press_rows(scene, recipe.seed, press, *way)]
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]} if rows else {}
    checksummed.write(file, columns | {COUNT: np.array(len(rows))})
    return True


def inspect_input(folder: Path, job: Job[Pairs], index: int) -> InputFacts | None:
    """Return the number of blocks needed in all, by the contacts made so far; None before the first block."""
    return InputFacts(_wanted(folder, job)) if _counts(folder, job) else None


def blocks(folder: Path, job: Job[Pairs]) -> list[Path]:
    """Return the files of the blocks, in order, that hold the contacts of a finished job."""
    return [jobs.shard_file(folder, job.inputs[0].name, number) for number in range(_wanted(folder, job))]


def _wanted(folder: Path, job: Job[Pairs]) -> int:
    """Return the number of blocks needed in all, estimated by the contacts made so far."""
    return wanted(_counts(folder, job), job.recipe.count, job.inputs[0].path)


def wanted(counts: dict[int, int], count: int, where: str) -> int:
    """Return the estimated number of blocks for `count` contacts; counts : block -> contacts made so far
    Raises TactileError, on the scene's file `where`, if many blocks made no contact."""
    have, number = 0, 0
    while have < count and number in counts:
        have += counts[number]
        number += 1
    if have >= count:
        return number
    total = sum(counts.values())
    if not total and len(counts) > IN_VAIN:
        found = f"{len(counts) * BLOCK} presses made no contact"
        raise TactileError(where, found, "a scene whose indenter can press the pad")
    most = GROWTH * len(counts) + 1
    estimate = -(-count * len(counts) // total) if total else most
    return max(number + 1, min(estimate, most))


def _counts(folder: Path, job: Job[Pairs]) -> dict[int, int]:
    """Return block -> number of contacts, for the blocks that exist."""
    name, found = job.inputs[0].name, {}
    for file in (folder / jobs.SHARDS).glob(f"{name}-*.h5"):
        number = file.stem.rpartition("-")[2]
        if re.fullmatch(r"[0-9]{6,9}", number):  # not what a cloud's folder calls a conflicted copy
            found[int(number)] = _count(file)
    return found


def _count(file: Path) -> int:
    """Return the number of contacts in a block; 0 for a damaged one, until it is made again."""
    try:
        return int(checksummed.read(file, names=(COUNT,))[COUNT])
    except (TactileError, KeyError):
        return 0


@functools.lru_cache(maxsize=2)
def _scene(one: Input, files: tuple[str, ...]) -> Scene:
    return load_scene_of(one, files)[0]
