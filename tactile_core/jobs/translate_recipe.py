"""What is asked of a job of translations, checked and made into its recipe."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..errors import TactileError
from ..pictures.mitsuba.variant import variant_for
from ..recordings import readers
from ..recordings.electrode_gains import SensorFile
from ..sensors import TARGET
from ..sensors.calibration_file import load_calibration
from ..translation.answer import Answer
from . import convert
from .drawer import describe_gel
from .engine.inputs import unit_hash
from .engine.recipes import MAX_SHARD_FRAMES, SHARD_FRAMES, Prepare, Translate
from .results import TRANSLATED, GelKind


@dataclass(frozen=True)
class Asked:
    """Options of a job of translations; fields as of ``recipes.Translate``.

    weights, calibration : folder and file, None for those that ship; preset : None for fast pictures, if any
    """

    keep: Sequence[str]
    prepare: Prepare = field(default_factory=Prepare)
    sensor: SensorFile | None = None
    weights: str | None = None
    calibration: str | None = None
    target: str = TARGET
    preset: str | None = None
    answer: Answer = field(default_factory=Answer)
    gel: GelKind = TRANSLATED
    shard_frames: int = SHARD_FRAMES
    every: int = 1


def make(asked: Asked, paths: Sequence[Path], say: Callable[[str], None]) -> Translate:
    """Return the recipe of a job on these recordings; say : told what is approximate about the gel.

    Raises TactileError for options that do not go together or name what there is not.
    """
    asked.prepare.options().check()
    source = None if asked.weights else readers.sensor_of_first(paths, asked.prepare.columns)
    tools = convert.ToolOptions(asked.weights, gel=asked.gel, target=asked.target, source=source)
    network, solves = tools.load_networks()
    if asked.shard_frames > MAX_SHARD_FRAMES:
        raise TactileError("--shard-frames", str(asked.shard_frames), f"1 to {MAX_SHARD_FRAMES}")
    if solves:
        from . import solved_gel

        solved_gel.check_installed()
    gel = load_calibration(asked.calibration, asked.target)
    for sentence in describe_gel(asked.target, network.target):
        say(sentence)
    unit = "" if asked.calibration is None else unit_hash(Path(asked.calibration))
    preset = asked.preset or "fast"
    if asked.preset is not None and "image" not in asked.keep:
        raise TactileError("--preset", preset, "--keep image", "Keep the pictures that it makes")
    if "marker_motion" in asked.keep:
        from ..pictures.marker_field import MarkerField

        MarkerField(gel)  # refused here where the unit has no dots
    pictures = unit, preset, variant_for(preset)
    known = list(asked.keep), network.sha256, asked.shard_frames, asked.prepare, asked.sensor
    return Translate(*known, *pictures, asked.answer, asked.gel, network.source, asked.target, asked.every)
