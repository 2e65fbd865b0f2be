"""Check the options of a job of translations, and make its recipe."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from ..errors import TactileError
from ..pictures.mitsuba.variant import variant_for
from ..pictures.presets import FAST
from ..recordings import readers
from ..sensors.calibration_file import load_calibration
from . import convert
from .drawer import describe_gel
from .engine.inputs import unit_hash
from .engine.recipes import MAX_SHARD_FRAMES, Translate


def completed(
    wanted: Translate, paths: Sequence[Path], say: Callable[[str], None], weights: str | None, calibration: str | None
) -> Translate:
    """Return the recipe of a job on these recordings, with the hashes, source and variant that follow from its files.

    wanted : what was asked for; its preset is empty for fast pictures, if any
    say : called with sentences on approximations of the gel; weights, calibration : folder and file, None for those
        that ship
    Raises TactileError for options that do not go together, and for unknown names."""
    wanted.prepare.options().check()
    source = None if weights else readers.sensor_of_first(paths, wanted.prepare.columns)
    tools = convert.ToolOptions(weights, answer=wanted.answer, gel=wanted.gel, target=wanted.target, source=source)
    network, solves = tools.load_networks()
    if wanted.shard_frames > MAX_SHARD_FRAMES:
        raise TactileError("--shard-frames", str(wanted.shard_frames), f"1 to {MAX_SHARD_FRAMES}")
    if solves:
        from . import solved_gel

        solved_gel.check_installed()
    unit = load_calibration(calibration, wanted.target)
    for sentence in describe_gel(wanted.target, network.target):
        say(sentence)
    if wanted.preset and "image" not in wanted.keep:
        raise TactileError("--preset", wanted.preset, "--keep image", "Keep the pictures that it makes")
    if "marker_motion" in wanted.keep:
        from ..pictures.marker_field import MarkerField

        MarkerField(unit)  # refused here where the unit has no dots
    preset = wanted.preset or FAST
    return msgspec.structs.replace(
        wanted, weights=network.sha256, source=network.source, preset=preset, variant=variant_for(preset),
        calibration="" if calibration is None else unit_hash(Path(calibration)),
    )  # fmt: skip
