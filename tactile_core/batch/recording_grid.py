"""Simulated recordings of a scene over a grid of parameters, in a folder that appears whole or not at all.

<out>/<number>_<values>.h5   each as `tactile simulate` makes it
<out>/grid.json              the seed and values of each
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from .. import atomic, pack
from ..errors import TactileError
from ..mechanics.compliance import biotac_compliance, digit_compliance
from ..mechanics.recording import ALL, check_places, recording_of
from ..scene_grid import combinations, name_of, with_values
from . import job as jobs
from . import parts, scene_input
from . import run as runs
from .here import Here
from .job import Job
from .recipes import Simulate
from .run import Place

GRID = "grid.json"
FORMAT = "tactile-grid-1"


def simulate_grid(
    job: Job,
    out: str | os.PathLike,
    progress: Callable[[int, int], None] | None = None,
    place: Callable[[Path], Place] | None = None,
) -> None:
    """Simulate all recordings of a `plan` into the folder ``out``.

    progress : (tasks done, known so far); place : where the work is done, from the job's folder; None for this process
    The job is in ``<out>.parts`` until all is there. Raises TactileError for what cannot be done.
    """
    digit_compliance(), biotac_compliance()  # built once here, not by every worker at the same time
    with parts.begun(Path(out), job) as folder:
        parts.check(runs.run(folder, job, (place or Here)(folder), None, progress or (lambda done, known: None)))
        _put_together(folder, job, Path(out))
        parts.finished(folder)


def plan(
    scene_path: str | os.PathLike, grid: Sequence[str], out: str | os.PathLike, seed: int = 0, keep: Sequence[str] = ALL
) -> Job:
    """The job: the [recording] of a scene for each combination of the values in ``grid`` (``scene_grid``).

    seed : of the first recording, each has one more than that before it; keep : words of ``recording.OUTPUTS``
    Raises TactileError for a bad scene, grid or place, before any work.
    """
    values = combinations(grid)
    scene, _, inputs, files = scene_input.found(scene_path, [name_of(one) for one in values])
    for one in values:
        check_places(scene_path, recording_of(with_values(scene, one, str(scene_path)), scene_path))
    atomic.claim(out)
    return jobs.make(inputs, Simulate(seed, values, files, list(keep)), None)


def _put_together(folder: Path, job: Job, out: Path) -> None:
    told = []
    try:
        with atomic.new_folder(out) as partial:
            for index, one in enumerate(job.inputs):
                pack.unpack(jobs.shard_file(folder, one.name, 0), partial)
                told.append({
                    "file": f"{one.name}.h5", "seed": job.recipe.seed + index, "values": job.recipe.values[index]
                })  # fmt: skip
            content = {"format": FORMAT, "scene_sha256": job.inputs[0].sha256, "recordings": told}
            atomic.write_json(partial / GRID, content)
    except OSError as error:
        found = f"cannot be written ({error.strerror or error})"
        raise TactileError(out, found, "room for it", "Make room, then give the command again") from error
