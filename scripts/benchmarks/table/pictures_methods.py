"""Measure each preset's pictures of known deformations against the reference preset, on random contacts."""

from __future__ import annotations

import dataclasses
import time

import numpy as np

from benchmarks.measure_presets import QUICK_PASSES, changes, converge, fields, one_thread, rms
from tactile_core.pictures.presets import FAST, REFERENCE
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Calibration
from tactile_core.sensors.calibration_file import load_calibration

from .method import Method, best_ms, peak_mb

NAMES = ("reference", FAST, "standard", "quality")  # the reference first: it is the others' truth
FIELDS, QUICK_FIELDS = 6, 2
OF_FIELDS = 7  # seed of the contacts: others than the presets' table was made from


def measure(name: str, quick: bool, truth: str) -> Method:
    """Measure the preset ``name``'s time, memory and error at 240 x 320.

    quick : on fewer height maps; truth : file to which "reference", the first, writes its pictures, changes in levels
    Raises ModuleNotFoundError if mitsuba is missing."""
    unit = load_calibration()
    heights = fields(unit, QUICK_FIELDS if quick else FIELDS, OF_FIELDS)
    if name == REFERENCE.name:
        return _reference(unit, heights, quick, truth)
    renderer, label = of_preset(unit, name)
    ms, mb = best_ms(lambda: renderer(heights[0])), peak_mb()
    with np.load(truth, allow_pickle=False) as file:
        true, of = file["pictures"], str(file["of"])
    return Method("pictures", label, ms, mb, rms(changes(renderer, heights), true), "levels", rms(true), of)


def of_preset(unit: Calibration, name: str) -> tuple[Renderer, str]:
    """Return a preset's renderer, on one thread, and its name in the table, which ends in Mitsuba's variant, if any."""
    renderer = Renderer(unit, name)
    if renderer.variant:
        one_thread(renderer.variant)
    return renderer, name if name == FAST else f"{name}_{renderer.variant}"


def _reference(unit: Calibration, heights: list[np.ndarray], quick: bool, truth: str) -> Method:
    """Measure the reference preset. Its error is its noise: by the difference of two seeds, over sqrt(2). Each seed's
    first time includes the picture at rest. heights : each (H, W) m; truth : file to write its pictures to"""
    preset = dataclasses.replace(REFERENCE, passes=QUICK_PASSES) if quick else REFERENCE
    pictures, ms = [], []
    for seed, some in ((0, heights), (1, heights[:1])):
        drawn = converge(unit, some, preset, seed)
        for _ in some:
            began = time.process_time()
            pictures.append(next(drawn)[1])
            ms.append(1e3 * (time.process_time() - began))
    mb, true, other = peak_mb(), pictures[:-1], pictures[-1:]
    of = f"{len(true)} contact fields against the reference, {preset.passes} passes"
    np.savez(truth, pictures=true, of=of)
    noise = rms(other, true[:1]) / np.sqrt(2)
    return Method("pictures", REFERENCE.name, min(ms), mb, noise, "levels", rms(true), f"{of}: noise of a seed")
