"""Paired contacts: the same force, angle and unrolled place on BioTac and DIGIT, as training data.

Presses are numbered; press i draws all it needs from (seed, i), so any number of workers makes the same file, and
an interrupted run goes on from the blocks of presses that are already on disk.
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable

from .. import atomic, sensors
from ..errors import TactileError
from ..mechanics.compliance import biotac_compliance, digit_compliance
from ..mechanics.pair_card import card, card_path
from ..mechanics.pair_file import merge
from . import job as jobs
from . import parts, scene_input
from . import run as runs
from .here import Here
from .kinds import pairs as blocks
from .local import Local
from .recipes import Pairs
from .run import Place


def make_pairs(
    scene_path: str | os.PathLike,
    count: int,
    seed: int,
    out: str | os.PathLike,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
    place: Callable[[pathlib.Path], Place] | None = None,
) -> None:
    """Simulate ``count`` paired contacts of a scene into the HDF5 file ``out``.

    progress : called with (blocks of presses done, known so far). Blocks wait in ``<out>.parts``, a folder as of
        ``tactile batch``, which is removed at the end; the file's card (``pair_card``) is written beside it.
    workers : processes, this one alone for 1; place : where blocks are made instead, from the job's folder
    Raises TactileError for a bad scene, count, or for parts of another scene or seed.
    """
    out = pathlib.Path(out)
    job, names, text = plan(scene_path, count, seed, out)
    digit_compliance(), biotac_compliance()  # built once here, not by every worker at the same time
    with parts.begun(out, job) as folder:
        where = (place or (lambda folder: Here(folder) if workers == 1 else Local(folder.resolve(), workers)))(folder)
        parts.check(runs.run(folder, job, where, None, progress or (lambda done, known: None)))
        merge(blocks.blocks(folder, job), count, out, text, seed, names)
        atomic.write_json(card_path(out), card(out))
        parts.finished(folder)


def plan(scene_path: str | os.PathLike, count: int, seed: int, out: pathlib.Path) -> tuple[jobs.Job, list[str], str]:
    """The job, the names of the indenters and the scene's text; raises what ``make_pairs`` raises before it begins."""
    scene, text, inputs, files = scene_input.found(scene_path, ["presses"])
    if scene.pairs is None:
        raise TactileError(f"{scene_path}, pairs", "missing", "a [pairs] table", "See scenes/press_sphere/scene.toml")
    if count < 1:
        raise TactileError("--count", str(count), "at least 1")
    for spec in scene.indenters:
        spec.build()  # an impossible one is refused before anything is written
    atomic.claim(out)
    surfaces = [sensors.biotac_surface().sha256, sensors.digit_surface().sha256]
    job = jobs.make(inputs, Pairs(count, seed, surfaces, files), None)
    return job, [spec.name for spec in scene.indenters], text
