"""Presets of pictures: how exactly each is computed, and its measured error and time."""

from __future__ import annotations

import dataclasses
import functools
import json
from typing import Any

from .. import accuracy
from ..accuracy import Candidate
from ..errors import TactileError
from ..files.shipped import shipped

TABLE = shipped("optics_presets.json")
SPACING = 0.107e-3  # m between vertices: two pixels of the default camera, about 20,000 vertices in the picture


@dataclasses.dataclass(frozen=True)
class Gather:
    """Resolution at which light that the gel reflects onto itself is summed.
    step : pixels between places; azimuths : number of directions around each; bounces : of light, 1 or more
    growth : each step outward as a share of the distance so far, but at least one place"""

    step: int
    azimuths: int
    growth: float
    bounces: int


@dataclasses.dataclass(frozen=True)
class Preset:
    """Settings of a Mitsuba render.

    says : the preset in words; points : points of light per LED and pass; spacing : m between vertices of the gel's
        mesh
    bounce_step : by LLVM, pixels between the places at which one bounce is gathered; 0 leaves it out
    paths : by LLVM, passes of Mitsuba's path integrator, of 64 paths per pixel; 0 for our own integrator

    Without LLVM, on a matte coating:
    passes : pictures to average, each from other points of the LEDs and the pixels; 1 takes each pixel's middle
    gather : resolution of the gel's light on itself; None leaves it out
    window : true bends rays at the window"""

    name: str
    says: str
    points: int
    spacing: float = SPACING
    bounce_step: int = 0
    paths: int = 0
    passes: int = 1
    gather: Gather | None = None
    window: bool = False


FAST = "fast"  # light.Lamps: numpy alone
STANDARD = Preset(
    "standard", "4 points an LED, one coarse bounce", points=4, bounce_step=8,
    gather=Gather(step=8, azimuths=12, growth=0.3, bounces=1),
)  # fmt: skip
QUALITY = Preset(
    "quality", "6 points an LED, one bounce", points=6, bounce_step=4,
    gather=Gather(step=4, azimuths=12, growth=0.3, bounces=1),
)  # fmt: skip
REFERENCE = Preset(
    "reference", "Mitsuba's path integrator, 256 paths a pixel, four bounces", points=8, spacing=SPACING / 2, paths=4,
    passes=64, gather=Gather(step=2, azimuths=32, growth=0.1, bounces=4), window=True,
)  # fmt: skip
PRESETS = {preset.name: preset for preset in (STANDARD, QUALITY, REFERENCE)}
NAMES = (FAST, *PRESETS)
DEFAULT = STANDARD.name


def preset_named(name: str) -> Preset:
    """Return Mitsuba's preset ``standard``, ``quality`` or ``reference``; raises TactileError for another name."""
    if name not in tuple(PRESETS):  # a list cannot be looked up in a dictionary
        raise TactileError("--preset", repr(name), f"one of {', '.join(NAMES)}")
    return PRESETS[name]


@functools.cache
def measured() -> dict[str, Any]:
    """Return the table of ``measure_presets.py``: in "presets", by name, ``ms`` by Mitsuba's variant, and ``error``,
    levels."""
    return json.loads(TABLE.read_text(encoding="utf-8"))


def cheapest(error: float, variant: str) -> str:
    """Return the name of the fastest preset by a ``variant`` of Mitsuba whose measured ``error``, grey levels rms from
    the full model, is at most this. Raises TactileError if none is."""
    table = measured()["presets"]
    times = {name: table[name]["ms"] for name in NAMES}  # by variant; numpy's is the same by all
    ms = {name: known.get("numpy", known.get(variant, float("inf"))) for name, known in times.items()}
    rows = [Candidate(name, table[name]["error"], ms[name]) for name in NAMES]
    return accuracy.cheapest(rows, error, "levels").name


def describe_choice(name: str, error: float) -> str:
    """Return a sentence on why the preset ``name`` was chosen. error : grey levels, the largest that was allowed"""
    found = measured()["presets"][name]
    return f"pictures: {name}, {found['error']:.2g} levels rms from the full model, at most {error:g}; {found['says']}"
