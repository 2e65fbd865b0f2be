"""A scene over a grid of parameters to simulated recordings: an input and a shard for each combination."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from ... import pack, sealed
from ...scene import Scene
from ...scene_grid import with_values
from ...scene_text import to_toml
from .. import job as jobs
from ..scene_input import load
from . import Seen

if TYPE_CHECKING:
    from ..job import Job

GROWS = False


def first(folder: Path, job: Job, index: int) -> tuple[int, bool]:
    """Nothing: a recording is one shard."""
    return 1, False


def make(folder: Path, job: Job, index: int, number: int) -> bool:
    """Simulate a recording."""
    from ...mechanics.recording import simulate_recording

    one = job.inputs[index]
    file = jobs.shard_file(folder, one.name, number)
    if sealed.digest_of(file) is not None:
        return False
    scene, text = load(one, tuple(job.recipe.files))
    values = job.recipe.values[index]
    told = with_values(msgspec.toml.decode(text, type=Scene), values, one.path)  # its files named as the scene does
    scene = with_values(scene, values, one.path)
    with tempfile.TemporaryDirectory() as name:
        out, seed = Path(name) / f"{one.name}.h5", job.recipe.seed + index
        simulate_recording(one.path, out, seed, keep=job.recipe.keep, loaded=(scene, to_toml(told)))
        pack.write_files(file, Path(name))
    return True


def seen(folder: Path, job: Job, index: int) -> Seen | None:
    """One shard."""
    return Seen(1)
