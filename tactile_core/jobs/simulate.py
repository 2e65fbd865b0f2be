"""Simulated recordings of a scene over a grid of parameters, in a folder that appears whole or not at all.

<out>/<number>_<values>.h5   each as `tactile simulate` makes it
<out>/grid.json              the seed and values of each

A grid is all combinations of `NAME=A:B:N`, N values evenly from A to B, or `NAME=V,V,...`. NAME is a field of the
scene's TOML, with numbers for places in lists (``recording.tilt_deg``, ``indenters.0.radius_mm``), or one of three that
change the whole motion of the [recording]: ``force_n`` scales all forces to this greatest one, N; ``x_mm`` and ``z_mm``
move all points, so that the one of greatest force lies there. ``engine.job`` says how jobs call this."""

from __future__ import annotations

import itertools
import os
import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ..errors import TactileError
from ..files import atomic, checksummed
from ..mechanics.fast.compliance import compliance_of
from ..sensors import PAIR
from ..simulation.scene import Scene, check, to_toml
from ..simulation.scene_recording import DEFAULT, check_places, recording_of
from .engine import job as jobs
from .engine import run as runs
from .engine.inputs import load_scene_of, read_scene
from .engine.job import InputFacts, Job, Simulate
from .engine.local import InProcess
from .engine.run import Place, Progress

MOST = 100_000  # combinations (assumed to be more than anyone simulates)
MOTION = ("force_n", "x_mm", "z_mm")
FORM = "NAME=A:B:N or NAME=V,V,..."
Value = float | str


def combinations(words: Sequence[str]) -> list[dict[str, Value]]:
    """Return all combinations of the values in ``NAME=...`` words, each name -> value; the last name changes fastest.
    Raises TactileError for bad or repeated words."""
    axes: dict[str, list[Value]] = {}
    for word in words:
        name, mark, text = word.partition("=")
        if not mark or not re.fullmatch(r"[a-z_0-9]+(\.[a-z_0-9]+)*", name):
            raise TactileError("--grid", repr(word), FORM, "Such as force_n=0.2:2:5")
        if name in axes:
            raise TactileError("--grid", f"{name} twice", "each name once")
        axes[name] = _values(word, text)
    count = int(np.prod([float(len(values)) for values in axes.values()]))
    if count > MOST:
        raise TactileError("--grid", f"{count:,} combinations", f"at most {MOST:,}", "Split it")
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _values(word: str, text: str) -> list[Value]:
    steps = re.fullmatch(r"([^:,]+):([^:,]+):(\d{1,6})", text)
    if steps:
        low, high, count = _number(word, steps[1]), _number(word, steps[2]), int(steps[3])
        if not 1 <= count <= MOST:
            raise TactileError("--grid", repr(word), f"1 to {MOST:,} values")
        # Ten digits, so that 0.1:0.3:3 holds 0.2 and not 0.2 and a bit, which would stand in the file names.
        return [float(f"{value:.10g}") for value in np.linspace(low, high, count)]
    values = [part.strip() for part in text.split(",")]
    if not all(values) or ":" in text:
        raise TactileError("--grid", repr(word), FORM, "Such as force_n=0.2:2:5")
    return [_number(word, value) if _is_number(value) else value for value in values]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(word: str, text: str) -> float:
    value = float(text) if _is_number(text) else np.nan
    if not np.isfinite(value):
        raise TactileError("--grid", repr(word), "finite numbers")
    return value


def name_of(values: dict[str, Value]) -> str:
    """Return a file name of at most 80 characters: ``force_n-0.2_tilt_deg-10``; a text value stands for itself.
    Without values it is ``scene``."""
    parts = [
        f"{name.rpartition('.')[2]}-{value:g}" if isinstance(value, float) else value for name, value in values.items()
    ]
    return re.sub(r"[^A-Za-z0-9._-]", "_", "_".join(parts))[:80] or "scene"


def with_values(scene: Scene, values: dict[str, Value], where: str) -> Scene:
    """Return the scene with other values, name -> value as in a grid. Raises TactileError, on the file `where`, for an
    unknown field, or a value out of its range."""
    document = msgspec.to_builtins(scene)
    for name, value in values.items():
        if name in MOTION:
            _move(document, name, value, where)
        else:
            _set(document, name, value, where)
    try:
        changed = msgspec.convert(document, Scene)
    except msgspec.ValidationError as error:
        raise TactileError(where, str(error), "values that the scene's fields allow", "Change --grid") from error
    check(where, changed)
    return changed


def _set(document: dict[str, Any], name: str, value: Value, where: str) -> None:
    *path, last = name.split(".")
    place: Any = document
    try:
        for step in path:
            place = place[int(step)] if isinstance(place, list) else place[step]
        key = int(last) if isinstance(place, list) else last
        old = place[key]
    except (KeyError, IndexError, ValueError, TypeError) as error:
        raise TactileError(f"{where}, {name}", "no such field", "a field of the scene", "Compare its TOML") from error
    if isinstance(old, dict | list):
        raise TactileError(f"{where}, {name}", "a table or list", "a number or a word", "Name a field in it")
    place[key] = value


def _move(document: dict[str, Any], name: str, value: Value, where: str) -> None:
    points = (document["recording"] or {}).get("points", [])
    hardest = max(points, key=lambda point: point["force_n"], default={"force_n": 0.0})
    if not hardest["force_n"] > 0 or not isinstance(value, float):
        raise TactileError(f"{where}, {name}", "no motion that presses", "a [recording] with force, and a number")
    if name == "force_n":
        factor = value / hardest["force_n"]
        for point in points:
            point["force_n"] *= factor
    else:
        shift = value - hardest[name]
        for point in points:
            point[name] += shift


GRID = "grid.json"
FORMAT = "tactile-grid-1"


def simulate_grid(
    job: Job[Simulate],
    out: str | os.PathLike,
    progress: Progress = lambda done, known: None,
    place: Callable[[Path], Place] = InProcess,
) -> None:
    """Simulate all recordings of a job into the folder ``out``; the job is in ``<out>.parts`` until all are done.
    progress : called with (tasks done, known so far); place : function from the job's folder to the executor of tasks
    Raises TactileError for the first recording that cannot be simulated, and if the disk cannot be written."""
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
) -> Job[Simulate]:
    """Return the job that simulates the [recording] of a scene for each combination of values.
    grid : words such as ``force_n=0.2:2:5``; seed : random seed of the first recording, one more for each next one
    keep : electrodes, displacement_<sensor>, traction_<sensor>
    Raises TactileError for a bad scene, grid or place, before any work."""
    values = combinations(grid)
    scene, _, inputs, files = read_scene(scene_path, [name_of(one) for one in values])
    for one in values:
        check_places(scene_path, recording_of(with_values(scene, one, str(scene_path)), scene_path))
    atomic.claim(out)
    return jobs.make(inputs, Simulate(seed, values, files, list(keep)), None)


def _put_together(folder: Path, job: Job[Simulate], out: Path) -> None:
    rows = []
    advice = "Make room, then give the command again"
    with atomic.writing(out, "room for it", advice), atomic.new_folder(out) as partial:
        for index, one in enumerate(job.inputs):
            checksummed.unpack(jobs.shard_file(folder, one.name, 0), partial)
            rows.append({
                "file": f"{one.name}.h5", "seed": job.recipe.seed + index, "values": job.recipe.values[index]
            })  # fmt: skip
        content = {"format": FORMAT, "scene_sha256": job.inputs[0].sha256, "recordings": rows}
        atomic.write_json(partial / GRID, content)


def prepare_input(folder: Path, job: Job[Simulate], index: int) -> tuple[int, bool]:
    """Return (1, False): each recording is one shard, and nothing needs to be prepared."""
    return 1, False


def make(folder: Path, job: Job[Simulate], index: int, number: int) -> bool:
    """Simulate recording `index`, unless its file is there; return true if it was simulated."""
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
        simulate_recording(one.path, out, seed, keep=job.recipe.keep, loaded=(scene, to_toml(varied)))
        checksummed.write_files(file, Path(name))
    return True


def inspect_input(folder: Path, job: Job[Simulate], index: int) -> InputFacts | None:
    """Return the facts of an input: one shard, as a recording is not split."""
    return InputFacts(1)
