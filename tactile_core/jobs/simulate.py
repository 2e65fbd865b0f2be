"""Simulated recordings of a scene over a grid of parameters, in a folder that appears whole or not at all.

<out>/<number>_<values>.h5   each as `tactile simulate` makes it
<out>/grid.json              the seed and values of each
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

import msgspec

from ..files import array_pack, atomic, checksummed
from ..mechanics.electrodes.biotac_sheet import SHEET
from ..mechanics.fast.compliance import compliance_of
from ..sensors import PAIR
from ..simulation.scene import Scene, to_toml
from ..simulation.scene_grid import combinations, name_of, with_values
from ..simulation.scene_recording import DEFAULT, check_places, recording_of
from .engine import job as jobs
from .engine import run as runs
from .engine.inputs import load_scene_of, read_scene
from .engine.job import Job
from .engine.local import InProcess
from .engine.recipes import InputFacts, Law, Simulate
from .engine.run import Place, Progress

GRID = "grid.json"
FORMAT = "tactile-grid-1"
GROWS = False


def simulate_grid(
    job: Job[Simulate],
    out: str | os.PathLike,
    progress: Progress = lambda done, known: None,
    place: Callable[[Path], Place] = InProcess,
) -> None:
    """Simulate all recordings of a `plan` into the folder ``out``.

    progress : (tasks done, known so far); place : where the work is done, from the job's folder
    The job is in ``<out>.parts`` until all is there. Raises TactileError for what cannot be done.
    """
    for sensor in PAIR:
        compliance_of(sensor)  # built once here, not by every worker at the same time
    with runs.completed(Path(out), job, place, progress) as folder:
        _put_together(folder, job, Path(out))


def plan(
    scene_path: str | os.PathLike,
    grid: Sequence[str],
    out: str | os.PathLike,
    seed: int = 0,
    keep: Sequence[str] = DEFAULT,
    electrodes: str = SHEET,
) -> Job[Simulate]:
    """Return the job: the [recording] of a scene for each combination of the values in ``grid`` (``scene_grid``).

    seed : of the first recording, each has one more than that before it; keep : words of ``scene_recording.outputs``
    electrodes : the law of their counts, of ``biotac_sheet.LAWS``
    Raises TactileError for a bad scene, grid or place, before any work.
    """
    values = combinations(grid)
    scene, _, inputs, files = read_scene(scene_path, [name_of(one) for one in values])
    for one in values:
        check_places(scene_path, recording_of(with_values(scene, one, str(scene_path)), scene_path))
    atomic.claim(out)
    return jobs.make(inputs, Simulate(seed, values, files, list(keep), cast(Law, electrodes)), None)


def _put_together(folder: Path, job: Job[Simulate], out: Path) -> None:
    rows = []
    advice = "Make room, then give the command again"
    with atomic.writing(out, "room for it", advice), atomic.new_folder(out) as partial:
        for index, one in enumerate(job.inputs):
            array_pack.unpack(jobs.shard_file(folder, one.name, 0), partial)
            rows.append({
                "file": f"{one.name}.h5", "seed": job.recipe.seed + index, "values": job.recipe.values[index]
            })  # fmt: skip
        content = {"format": FORMAT, "scene_sha256": job.inputs[0].sha256, "recordings": rows}
        atomic.write_json(partial / GRID, content)


def prepare_input(folder: Path, job: Job[Simulate], index: int) -> tuple[int, bool]:
    """Return one shard; nothing needs to be prepared."""
    return 1, False


def make(folder: Path, job: Job[Simulate], index: int, number: int) -> bool:
    """Simulate a recording."""
    from ..simulation.scene_recording import simulate_recording

    one = job.inputs[index]
    file = jobs.shard_file(folder, one.name, number)
    if checksummed.verified_checksum(file) is not None:
        return False
    scene, text = load_scene_of(one, tuple(job.recipe.files))
    values = job.recipe.values[index]
    varied = with_values(msgspec.toml.decode(text, type=Scene), values, one.path)  # its files named as the scene does
    scene = with_values(scene, values, one.path)
    with tempfile.TemporaryDirectory() as name:
        out, seed = Path(name) / f"{one.name}.h5", job.recipe.seed + index
        electrodes, loaded = job.recipe.electrodes, (scene, to_toml(varied))
        simulate_recording(one.path, out, seed, keep=job.recipe.keep, loaded=loaded, electrodes=electrodes)
        array_pack.write_files(file, Path(name))
    return True


def inspect_input(folder: Path, job: Job[Simulate], index: int) -> InputFacts | None:
    """Return one shard: a recording is not split."""
    return InputFacts(1)
