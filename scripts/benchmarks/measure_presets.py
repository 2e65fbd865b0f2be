"""Measure each preset of `tactile render`: its error beside its time, on random contact fields.

    python scripts/benchmarks/measure_presets.py                       everything; writes data/optics_presets.json
    python scripts/benchmarks/measure_presets.py --fields 4            on fewer fields, which the file says; 10 else
    python scripts/benchmarks/measure_presets.py --quick --json FILE   two fields, 240 x 320; writes FILE alone

Errors are grey levels rms over the picture, its channels and the fields, before rounding: rows ``_error_direct`` from
converged direct light, in others from the full model of a matte coating: 64 pictures from 512 points per LED, four
bounces gathered over horizons, the window. That model shares no code with our integrator and has next to no noise;
Mitsuba's own path integrator, the preset `reference`, is compared with it too.
The full model traces without LLVM: all takes some 40 minutes of CPU (estimated from one pass).
Times are CPU time on one core, so that other programs do not count. Prints a table; exits 1 when an error row misses
its target. Needs the extras [render] and [fem]; rows of llvm_ad_rgb only where LLVM works.
"""

from __future__ import annotations

import dataclasses
import sys
import time
import timeit
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import finished, parser_of, printed
from benchmarks.mechanics.random_contacts import DEEPEST as DRAWN_TO
from benchmarks.mechanics.random_contacts import random_contacts
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.files import atomic, provenance
from tactile_core.mechanics.placement import pose_at, thickness_under
from tactile_core.mechanics.solve import solve
from tactile_core.pictures.coating_spread import CoatingSpread
from tactile_core.pictures.height_map import gel_mapper, of_unit, rest_height_map
from tactile_core.pictures.mitsuba.matte_light import MatteLight
from tactile_core.pictures.mitsuba.variant import LLVM, SCALAR, choose_variant
from tactile_core.pictures.presets import FAST, NAMES, PRESETS, REFERENCE, TABLE, Preset
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Calibration
from tactile_core.sensors.calibration_file import load_calibration

SEED = 20261122  # of the fields
FIELDS = 10
# Depths are drawn evenly up to this share of the gel's thickness: 1.2 mm, as deep as a ball of 6 mm is photographed.
# Farther down, the walls round a small punch fold over, where a height map is a guess.
DEEPEST = 0.3
LARGE = 480, 640
# Grey levels and ms on one core that the presets are meant to reach, by variant.
DIRECT_TARGET = {FAST: 0.5}
FULL_TARGET = {"standard": 0.6, "quality": 0.5}
MS_TARGET = {(FAST, None): 8, ("standard", LLVM): 100, ("quality", LLVM): 250, ("standard", SCALAR): 1500}
QUICK_PASSES = 8  # of the reference in a quick run
REPEATS = 5  # of a frame whose time is taken


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="two fields, the small size")
    parser.add_argument("--fields", type=int, default=FIELDS, metavar="N", help="contacts to draw")
    options = parser.parse_args(arguments)
    count = 2 if options.quick else options.fields
    rows = printed(measure(load_calibration(), count, options.quick))
    if not options.quick:
        atomic.write_json(TABLE, table(rows, count))
    return finished(rows, options.json)


def measure(unit: Calibration, count: int, quick: bool) -> Iterator[Row]:
    """Yield all rows, on ``count`` height maps. Errors are those of Mitsuba's faster variant, and one between variants.
    quick : true for a reference of fewer passes, and times of one height map in one size"""
    heights = fields(unit, count)
    variants = working_variants()
    best = variants[0]
    yield from errors(unit, heights, best, dataclasses.replace(REFERENCE, passes=QUICK_PASSES) if quick else REFERENCE)
    if len(variants) == 2:
        yield from agreement(unit, heights[0])
    large = unit.at_size(*LARGE)
    for sized, maps in [(unit, heights)] if quick else [(unit, heights), (large, fields(large, 2))]:
        for variant in variants:
            for name in NAMES if variant == best else NAMES[1:-1]:
                if name != REFERENCE.name or not quick:
                    yield speed(sized, name, variant, maps, quick)


def fields(unit: Calibration, count: int, seed: int = SEED) -> list[np.ndarray]:
    """Return ``count`` height maps (H, W) m of random contacts, solved by the fast tier, no deeper than ``DEEPEST``."""
    camera, found = unit.camera, []
    for contact in random_contacts(40 * count, seed):
        row, column = camera.to_pixel(contact.place.x, contact.place.z)
        if not (0 <= row < camera.height and 0 <= column < camera.width):
            continue
        pose = pose_at("digit", contact.indenter, contact.place)
        share = contact.depth * DEEPEST / DRAWN_TO
        depth = share * thickness_under("digit", contact.indenter, pose)
        displacement = solve("digit", contact.indenter, contact.place, depth=depth).displacement
        found.append(gel_mapper(camera)(displacement))
        if len(found) == count:
            break
    return found


def working_variants() -> list[str]:
    """List Mitsuba's variants that work here, the faster one first."""
    found = []
    for variant in (LLVM, SCALAR):
        try:
            found.append(choose_variant(variant).name)
        except TactileError as trouble:
            print(f"{variant}: {trouble}", file=sys.stderr)
    return found


def errors(unit: Calibration, heights: list[np.ndarray], variant: str, truth: Preset) -> Iterator[Row]:
    """Yield every preset's errors on heights (H, W) m, against converged direct light and against the full model.
    variant : of Mitsuba; truth : preset of the full model. Baseline: the background alone."""
    renderers = {name: Renderer(unit, name, variant) for name in NAMES[:-1]}
    of = f"{len(heights)} fields"
    drawn = {name: changes(renderer, heights) for name, renderer in renderers.items()}
    converged, full = zip(*converge(unit, heights, truth, seed=0), strict=True)
    for name, change in drawn.items():
        yield row(f"{name}_error_direct", rms(change, converged), "levels", DIRECT_TARGET.get(name),
                  baseline=rms(converged), of=of)  # fmt: skip
        yield row(f"{name}_error", rms(change, full), "levels", FULL_TARGET.get(name), baseline=rms(full), of=of)
    paths = changes(Renderer(unit, REFERENCE.name, variant), heights[:2])
    yield row(f"{REFERENCE.name}_error", rms(paths, full[:2]), "levels", baseline=rms(full[:2]),
              of="2 fields, by LLVM the noise of its 256 paths a pixel and what they differ by")  # fmt: skip


def changes(renderer: Renderer, heights: Iterable[np.ndarray]) -> list[np.ndarray]:
    """Return the change from rest, levels (H, W, 3), of the picture of each of heights (H, W) m, before rounding."""
    return [renderer.in_levels(renderer.radiance(height) - renderer.rest_radiance) for height in heights]


def converge(
    unit: Calibration, heights: list[np.ndarray], truth: Preset, seed: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield, for each of heights (H, W) m, the picture's change from rest, levels (H, W, 3), twice: by direct light
    alone, and by the full model. truth : preset of the full model; seed : of its samples"""
    rest = of_unit(rest_height_map(unit.camera), unit)
    light, levels = MatteLight(unit, truth, rest, seed), spread_in_levels(unit)
    resting, seen = light.direct(rest)
    whole = light.completed(rest, resting, seen)
    for number, height in enumerate(heights, 1):
        height = of_unit(height, unit)
        direct, seen = light.direct(height)
        yield levels(direct - resting), levels(light.completed(height, direct, seen) - whole)
        print(f"reference, seed {seed}: {number} of {len(heights)}", file=sys.stderr)


def spread_in_levels(unit: Calibration) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that blurs a light's radiance (H, W, 3) as the coating does, and returns levels (H, W, 3)."""
    in_levels, spread = Renderer(unit, FAST).in_levels, CoatingSpread(unit.camera, unit.coating.spread)
    return lambda radiance: in_levels(np.moveaxis(spread(np.moveaxis(radiance, -1, 0)), 0, -1))


def rms(pictures: Sequence[np.ndarray], others: Sequence[np.ndarray] | None = None) -> float:
    """Return the root mean square of all pictures' numbers, or of their differences from ``others`` of equal shapes."""
    difference = np.asarray(pictures) - (0 if others is None else np.asarray(others))
    return float(np.sqrt(np.mean(np.square(difference, dtype=float))))


def agreement(unit: Calibration, height: np.ndarray) -> Iterator[Row]:
    """Yield rows of how far pictures of height (H, W) m by Mitsuba's two variants differ, by preset."""
    for name in ("standard", "quality"):
        one, other = (Renderer(unit, name, variant) for variant in (LLVM, SCALAR))
        difference = one.in_levels(one.radiance(height) - other.radiance(height))
        yield row(f"{name}_variants_differ", rms([difference]), "levels", 0.6, of="rms, one field")


def speed(unit: Calibration, name: str, variant: str, heights: list[np.ndarray], quick: bool) -> Row:
    """Measure the CPU ms per frame of the preset ``name`` on one thread: the median over heights (H, W) m of the least
    of a few calls (other programs can only lengthen one). variant : of Mitsuba; quick : take one height map alone"""
    one_thread(variant)
    renderer = Renderer(unit, name, None if name == FAST else variant)
    slow = name == REFERENCE.name
    repeats = 1 if slow else REPEATS
    if not slow:
        renderer(heights[0])
    spent = [
        1e3 * min(timeit.repeat(lambda h=height: renderer(h), timer=time.process_time, repeat=repeats, number=1))
        for height in heights[: 1 if slow or quick else None]
    ]
    small = unit.camera.width == 240
    target = MS_TARGET.get((name, None if name == FAST else variant)) if small else None
    label = "numpy" if name == FAST else variant
    size = f"{unit.camera.width}x{unit.camera.height}"
    return row(f"{name}_{label}_{size}_ms", float(np.median(spent)), "ms", target, of=f"{size}, one core, CPU time")


def one_thread(variant: str) -> None:
    """Limit a variant of Mitsuba to one thread, since targets of time are for one core."""
    if variant == LLVM:
        import drjit
        import mitsuba

        mitsuba.set_variant(LLVM)
        drjit.set_thread_count(1)


def table(rows: list[Row], count: int) -> dict:
    """Return the content of the presets' data file from measured rows; count : number of height maps measured"""
    value = {found["name"]: found["value"] for found in rows}
    presets = {}
    for name in NAMES:
        times = {label: value.get(f"{name}_{label}_240x320_ms") for label in ("numpy", LLVM, SCALAR)}
        large = {label: value.get(f"{name}_{label}_480x640_ms") for label in times}
        presets[name] = {
            "error": value[f"{name}_error"],
            "error_direct": value.get(f"{name}_error_direct"),
            "ms": {label: ms for label, ms in times.items() if ms is not None},
            "ms_480x640": {label: ms for label, ms in large.items() if ms is not None},
            "says": PRESETS[name].says if name in PRESETS else "direct light, soft shadows on a height field, numpy",
        }
    import drjit
    import mitsuba

    versions = provenance.versions() | {"mitsuba": mitsuba.__version__, "drjit": drjit.__version__}
    how = f"scripts/benchmarks/measure_presets.py --fields {count}: grey levels rms on {count} random contact fields; "
    how += "CPU ms a frame, one core"
    return {"how": how, "machine": provenance.machine(), "presets": presets, "versions": versions}


if __name__ == "__main__":
    sys.exit(main())
