"""Check the options of a job of translations, and make its recipe."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import TactileError
from ..pictures.mitsuba.variant import variant_for
from ..recordings import readers
from ..recordings.electrode_gains import SensorFile
from ..sensors.calibration_file import load_calibration
from ..translation.answer import Answer
from . import convert
from .drawer import describe_gel
from .engine.inputs import unit_hash
from .engine.recipes import MAX_SHARD_FRAMES, SHARD_FRAMES, Prepare, Translate
from .results import TRANSLATED, GelKind


def make(
    paths: Sequence[Path],
    say: Callable[[str], None],
    *,
    keep: Sequence[str],
    prepare: Prepare,
    sensor: SensorFile | None,
    weights: str | None,
    calibration: str | None,
    target: str,
    preset: str | None,
    answer: Answer,
    gel: GelKind = TRANSLATED,
    shard_frames: int = SHARD_FRAMES,
    every: int = 1,
) -> Translate:
    """Return the recipe of a job on these recordings; fields as of ``recipes.Translate``.
    say : called with sentences on approximations of the gel; weights, calibration : folder and file, None for those
        that ship
    preset : None for fast pictures, if any
    Raises TactileError for options that do not go together, and for unknown names."""
    prepare.options().check()
    source = None if weights else readers.sensor_of_first(paths, prepare.columns)
    tools = convert.ToolOptions(weights, answer=answer, gel=gel, target=target, source=source)
    network, solves = tools.load_networks()
    if shard_frames > MAX_SHARD_FRAMES:
        raise TactileError("--shard-frames", str(shard_frames), f"1 to {MAX_SHARD_FRAMES}")
    if solves:
        from . import solved_gel

        solved_gel.check_installed()
    unit = load_calibration(calibration, target)
    for sentence in describe_gel(target, network.target):
        say(sentence)
    unit_sha256 = "" if calibration is None else unit_hash(Path(calibration))
    drawn_by = preset or "fast"
    if preset is not None and "image" not in keep:
        raise TactileError("--preset", drawn_by, "--keep image", "Keep the pictures that it makes")
    if "marker_motion" in keep:
        from ..pictures.marker_field import MarkerField

        MarkerField(unit)  # refused here where the unit has no dots
    pictures = unit_sha256, drawn_by, variant_for(drawn_by)
    known = list(keep), network.sha256, shard_frames, prepare, sensor
    return Translate(*known, *pictures, answer, gel, network.source, target, every)
