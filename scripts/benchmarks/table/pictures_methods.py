"""Pictures of known deformations: each preset against the reference preset, on random contact fields."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from benchmarks.measure_presets import QUICK_PASSES, fields, one_thread, rms
from tactile_core.accuracy import row
from tactile_core.pictures.coating_spread import CoatingSpread
from tactile_core.pictures.height_map import of_unit, rest_height_map
from tactile_core.pictures.mitsuba.matte_light import MatteLight
from tactile_core.pictures.mitsuba.variant import choose_variant
from tactile_core.pictures.presets import FAST, REFERENCE, preset_named
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Calibration
from tactile_core.sensors.calibration_file import load_calibration

from .method import Method, best_ms, peak_mb

NAMES = ("reference", FAST, "standard", "quality")  # the reference first: it is the others' truth
FIELDS, QUICK_FIELDS = 6, 2
OF_FIELDS = 7  # seed of the contacts: others than the presets' table was made from


def measure(name: str, quick: bool, truth: str) -> Method:
    """Measure one preset's time, memory and error at 240 x 320.

    truth : where the reference leaves its pictures, changes in grey levels, for the other presets
    Raises ModuleNotFoundError where mitsuba is missing.
    """
    unit = load_calibration()
    heights = fields(unit, QUICK_FIELDS if quick else FIELDS, OF_FIELDS)
    if name == REFERENCE.name:
        return _reference(unit, heights, quick, truth)
    renderer = Renderer(unit, name)
    if renderer.variant:
        one_thread(renderer.variant)
    ms, mb = best_ms(lambda: renderer(heights[0])), peak_mb()
    with np.load(truth, allow_pickle=False) as file:
        true, of = file["pictures"], str(file["of"])
    levels = [renderer.in_levels(renderer.radiance(height) - renderer.rest_radiance) for height in heights]
    label = name if name == FAST else f"{name}_{renderer.variant}"
    more = [
        row(f"pictures_{label}_field_{number}", rms([found], [each]), "levels", baseline=rms([each]), of="one field")
        for number, (found, each) in enumerate(zip(levels, true, strict=True), 1)
    ]
    return Method("pictures", label, ms, mb, rms(levels, list(true)), "levels", rms(list(true)), of, tuple(more))


def spread_in_levels(unit: Calibration) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function from a light's radiance (H, W, 3) to grey levels (H, W, 3), spread by the coating."""
    in_levels, spread = Renderer(unit, FAST).in_levels, CoatingSpread(unit.camera, unit.coating.spread)
    return lambda radiance: in_levels(np.moveaxis(spread(np.moveaxis(radiance, -1, 0)), 0, -1))


def _reference(unit, heights, quick, truth) -> Method:  # noqa: ANN001
    """Measure the reference, whose error is its noise: half of the squared difference between two seeds. heights : (H,
    W) m of each field; truth : file for its pictures"""
    import time

    preset = dataclasses.replace(preset_named(REFERENCE.name), passes=QUICK_PASSES) if quick else REFERENCE
    variant = choose_variant().name
    one_thread(variant)
    rest, in_levels = of_unit(rest_height_map(unit.camera), unit), spread_in_levels(unit)
    pictures, ms = [], []
    for seed in (0, 1):
        light = MatteLight(unit, preset, variant, rest, seed)
        resting = light.radiance(rest)
        for height in heights if seed == 0 else heights[:1]:
            began = time.process_time()
            found = light.radiance(of_unit(height, unit))
            ms.append(1e3 * (time.process_time() - began))
            pictures.append(in_levels(found - resting))
    mb, true, other = peak_mb(), pictures[:-1], pictures[-1:]
    of = f"{len(true)} contact fields against the reference, {preset.passes} passes"
    np.savez(truth, pictures=true, of=of)
    noise = rms(other, true[:1]) / np.sqrt(2)
    return Method("pictures", f"reference_{variant}", min(ms), mb, noise, "levels", rms(true), f"{of}: noise of a seed")
