"""A scene to paired contacts: a shard is a block of presses, and blocks are made until they hold the count."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ... import pack, sealed
from ...errors import TactileError
from ...scene import Scene
from .. import job as jobs
from ..scene_input import load
from . import Seen

if TYPE_CHECKING:
    from ..job import Job

GROWS = True
BLOCK = 4  # presses a block: a few seconds of work
COUNT = "count"  # the array of a block that says how many contacts it holds
GROWTH = 8  # times as many blocks as there are, at most, are asked for at once: the estimate is better then
IN_VAIN = 20  # blocks without a contact after which a scene is given up (assumed)


def first(folder: Path, job: Job, index: int) -> tuple[int, bool]:
    """Count what is there, and say how many blocks that asks for."""
    _scene(job.inputs[index], tuple(job.recipe.files))
    return wanted(_counts(folder, job, index), job.recipe.count, job.inputs[index].path), False


def make(folder: Path, job: Job, index: int, number: int) -> bool:
    """The contacts of some presses."""
    from ...mechanics.pair_rows import press_rows

    one = job.inputs[index]
    file = jobs.shard_file(folder, one.name, number)
    if sealed.digest_of(file) is not None:
        return False
    scene = _scene(one, tuple(job.recipe.files))
    rows = [row for i in range(BLOCK) for row in press_rows(scene, job.recipe.seed, number * BLOCK + i)]
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]} if rows else {}
    pack.write(file, columns | {COUNT: np.int64(len(rows))})
    return True


def seen(folder: Path, job: Job, index: int) -> Seen | None:
    """As many blocks as are wanted by those that are there."""
    counts = _counts(folder, job, index)
    if not counts:
        return None
    return Seen(wanted(counts, job.recipe.count, job.inputs[index].path))


def blocks(folder: Path, job: Job) -> list[Path]:
    """Files of the blocks that hold the contacts of a finished job, in order."""
    count = wanted(_counts(folder, job, 0), job.recipe.count, job.inputs[0].path)
    return [jobs.shard_file(folder, job.inputs[0].name, number) for number in range(count)]


def wanted(counts: dict[int, int], count: int, where: str) -> int:
    """Blocks for `count` contacts, by the contacts of those that are there: exact where they suffice.

    Raises TactileError for a scene whose presses touch nothing.
    """
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


def _counts(folder: Path, job: Job, index: int) -> dict[int, int]:
    """Contacts of each block that is there."""
    name, found = job.inputs[index].name, {}
    for file in (folder / jobs.SHARDS).glob(f"{name}-*.h5"):
        number = file.stem.rpartition("-")[2]
        if re.fullmatch(r"[0-9]{6,9}", number):  # not what a cloud's folder calls a conflicted copy
            found[int(number)] = _count(file)
    return found


def _count(file: Path) -> int:
    """Of a block; one that is damaged counts as empty until it is made anew."""
    try:
        return int(pack.read(file, names=(COUNT,))[COUNT])
    except (TactileError, KeyError):
        return 0


@functools.lru_cache(maxsize=2)
def _scene(one: jobs.Input, files: tuple[str, ...]) -> Scene:
    return load(one, files)[0]
