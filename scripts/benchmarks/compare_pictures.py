"""Measure speed against error of every way to draw a DIGIT's picture: ours, stock Mitsuba, a table, simple nulls.

    python scripts/benchmarks/compare_pictures.py PRESSES [--deeper DIR] [--json FILE] [--quick]

On photographs: three fits without a third of PRESSES each, tried on that third; three numbers a press are fitted
(right, down, depth), by the fast picture; with --deeper, on further photographs of the same unit and ball, too, whose
drift of the light is taken off. Nulls: the background alone, and the nearest fitted photograph shifted to the place.
`through` allows light through the coating where the ball touches it, three more numbers a photograph.
Times are CPU ms a picture on one core, the least of a few. Stock Mitsuba draws the file of `render --scene-out`; its
error is its noise, against the mean of 1,024 samples. Needs the extra [render]; LLVM's rows only where LLVM works.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed


from benchmarks.competitors.taxim_like import TableBench, fit_table
from benchmarks.measure_presets import best_ms, one_thread, working_variants
from tactile_core.accuracy import HEADER, Row, line, row
from tactile_core.files import atomic
from tactile_core.pictures.calibrate.ball_pictures import FastPictures, working_factor
from tactile_core.pictures.calibrate.contact_light import contact_disc, contact_radius, fitted_light
from tactile_core.pictures.calibrate.fit import calibrate
from tactile_core.pictures.calibrate.kept_apart import FOLDS
from tactile_core.pictures.calibrate.photo_metrics import figures
from tactile_core.pictures.calibrate.photographs import Photographs, Press, chosen, press_of, read_photographs
from tactile_core.pictures.calibrate.press_fit import MODEL_ERROR, Ball, Sight, fit_ball
from tactile_core.pictures.mitsuba.scene_file import write_scene
from tactile_core.pictures.mitsuba.variant import LLVM, activate
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Calibration
from tactile_core.sensors.calibration_file import load_calibration

BALL = 3e-3  # m, radius
SIZES = ((240, 320), (480, 640))
SAMPLES, MANY = (32, 64, 256), 1024  # of stock Mitsuba, a pixel
TYPICAL = (1e-3, 0.5e-3, 1e-3, BALL)  # right, down, depth, radius, m, of the press whose time is taken
FLANK = 0.5, 1.0  # of the contact's radius: where the print is steep

Change = Callable[[Ball], np.ndarray]  # (H, W, 3) grey levels, of a press


def main(arguments: list[str] | None = None) -> int:
    """Measure and print; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("presses", metavar="PRESSES")
    parser.add_argument("--deeper", metavar="DIR", help="further photographs, of another day")
    parser.add_argument("--json", metavar="FILE", help="write the rows here")
    parser.add_argument("--quick", action="store_true", help="one fit of the fast picture alone, the small size")
    options = parser.parse_args(arguments)
    rows = []
    print(HEADER)
    for found in measure(read_photographs(options.presses), options.deeper, options.quick):
        rows.append(found)
        print(line(found), flush=True)
    if options.json:
        atomic.write_json(Path(options.json), rows)
    return 0


def measure(photographs: Photographs, deeper: str | None, quick: bool) -> Iterator[Row]:
    """Yield all rows: on photographs, then times, then stock Mitsuba's noise."""
    variants = working_variants()
    one_thread(variants[0])
    further = [] if deeper is None else _further(Path(deeper), photographs)
    yield from on_photographs(photographs, further, variants, quick)
    unit = load_calibration()
    for size in SIZES[: 1 if quick else None]:
        yield from times(unit.at_size(*size), variants)
    if variants[0] == LLVM:
        for size in SIZES[: 1 if quick else None]:
            yield from stock_mitsuba(unit.at_size(*size), SAMPLES[: 1 if quick else None])


def _further(folder: Path, photographs: Photographs) -> list[Press]:
    from tactile_core.pictures.background import read_photograph

    files = sorted(folder.glob("*.png"))
    found = [press_of(file.name, read_photograph(file), photographs.background) for file in files]
    return [press for press in found if press is not None]


def on_photographs(photographs: Photographs, further: list[Press], variants: list[str], quick: bool) -> Iterator[Row]:
    """Rows of every method on photographs that it was not fitted on, and on further ones."""
    names = [press.name for press in photographs.presses]
    found: dict[tuple[str, str], list[dict[str, float]]] = {}
    for fold in range(1 if quick else FOLDS):
        apart = names[fold::FOLDS]
        fitted = chosen(photographs, [name for name in names if name not in apart])
        unit = calibrate(fitted, 2 * BALL, load_calibration(), unit="fold", quick=quick).calibration
        for where, presses in (("apart", chosen(photographs, apart).presses), ("deeper", further)):
            for name, figures_of in one_fit(unit, fitted, presses, variants):
                found.setdefault((where, name), []).append(figures_of)
    for (where, name), each in found.items():
        for figure, unit_ in (("roi_psnr", "dB"), ("roi_l1", "levels"), ("flank_colour", "levels")):
            value = float(np.mean([one[figure] for one in each]))
            null = float(np.mean([one[figure] for one in found[where, "null_background"]]))
            of = f"{len(each)} photographs {'not fitted' if where == 'apart' else 'of another day, deeper'}"
            yield row(f"{where}_{name}_{figure}", value, unit_, null=null, of=of)


def one_fit(
    unit: Calibration, fitted: Photographs, presses: Sequence[Press], variants: list[str]
) -> Iterator[tuple[str, dict[str, float]]]:
    """Figures by every method, by name, of presses that a unit was not fitted on."""
    fast = FastPictures(unit)
    factor = working_factor(unit.camera.width, unit.camera.height)
    working = FastPictures(unit.at_size(unit.camera.width // factor, unit.camera.height // factor))
    balls = {press.name: fit_ball(working, Sight(press), BALL)[0] for press in fitted.presses}
    ways = methods(unit, fitted, fast, variants) | {"null_shifted": lambda ball: shifted(ball, fitted, balls, fast)}
    for press in presses:
        ball, _ = fit_ball(working, Sight(press), BALL)
        seen, _ = fit_ball(working, Sight(press), BALL, opaque=False)
        for name, change in ways.items():
            yield name, compared(change(ball), press, fitted.background, fast, ball)
            if not name.startswith("null"):
                lit = with_light(change(seen), press, fast, seen)
                yield f"{name}_through", compared(lit, press, fitted.background, fast, seen)


def methods(unit: Calibration, fitted: Photographs, fast: FastPictures, variants: list[str]) -> dict[str, Change]:
    """Ways to draw the change by a press, by name."""
    table = TableBench(fast, fit_table(unit, fitted, BALL))
    found: dict[str, Change] = {
        "null_background": lambda ball: np.zeros((*unit.camera.shape, 3)),
        "taxim_like": lambda ball: table.change(ball.numbers),
        "fast": lambda ball: fast.change(ball.numbers),
    }
    for variant in variants[:1]:  # the other one's pictures are half a level apart: ``measure_presets``
        for preset in ("standard", "quality"):
            renderer = Renderer(unit, preset, variant, rest=fast.rest)
            found[f"{preset}_{variant.split('_')[0]}"] = lambda ball, renderer=renderer: renderer.in_levels(
                renderer.radiance(fast.heights(ball.numbers)) - renderer.rest_radiance
            )
    return found


def shifted(ball: Ball, fitted: Photographs, balls: dict[str, Ball], fast: FastPictures) -> np.ndarray:
    """Change (H, W, 3) of the fitted photograph pressed nearest, moved by whole pixels to a ball's place."""
    press = min(
        fitted.presses,
        key=lambda each: np.hypot(balls[each.name].right - ball.right, balls[each.name].down - ball.down),
    )
    right, down = fast.camera.pixel_size
    columns = round((ball.right - balls[press.name].right) / right)
    rows = round((ball.down - balls[press.name].down) / down)
    change = np.where(press.touched[..., None], press.change, 0)
    height, width = change.shape[:2]
    moved = np.zeros_like(change)
    to, of = (np.s_[max(rows, 0) : height + min(rows, 0), max(columns, 0) : width + min(columns, 0)],
              np.s_[max(-rows, 0) : height - max(rows, 0), max(-columns, 0) : width - max(columns, 0)])  # fmt: skip
    moved[to] = change[of]
    return moved


def with_light(change: np.ndarray, press: Press, fast: FastPictures, ball: Ball) -> np.ndarray:
    """The change with as much light through the coating as the photograph shows."""
    disc = contact_disc(fast, ball.numbers)
    counts = press.touched & (press.picture.max(-1) < 255)
    return change + disc[..., None] * fitted_light((press.change - change)[counts], disc[counts], MODEL_ERROR)


def compared(
    change: np.ndarray, press: Press, background: np.ndarray, fast: FastPictures, ball: Ball
) -> dict[str, float]:
    """Figures of a change against a photograph, and the error of the flanks' mean colours."""
    untouched = background + press.drift
    picture = np.rint(untouched + change).clip(0, 255)
    return figures(picture, press.picture, background, press.region) | {
        "flank_colour": flank_colour(picture - press.picture, fast, ball)
    }


def flank_colour(error: np.ndarray, fast: FastPictures, ball: Ball) -> float:
    """Mean over the flanks that face each LED, and over channels, of the absolute error of the mean colour, levels."""
    right, down = fast.right - ball.right, fast.down - ball.down
    share = np.hypot(right, down) / contact_radius(ball.depth, ball.radius)
    errors = []
    for led in fast.calibration.leds:
        toward = np.array(led.position[:2]) - (ball.right, ball.down)
        facing = (right * toward[0] + down * toward[1]) / (np.hypot(right, down) * np.hypot(*toward) + 1e-12) > 0.7
        flank = facing & (share > FLANK[0]) & (share < FLANK[1])
        if flank.sum() > 20:  # else cut by the picture's edge
            errors.append(np.abs(error[flank].mean(0)).mean())
    return float(np.mean(errors))


def times(unit: Calibration, variants: list[str]) -> Iterator[Row]:
    """CPU ms of a picture by each preset and variant."""
    fast = FastPictures(unit)
    height, size = fast.heights(TYPICAL), f"{unit.camera.width}x{unit.camera.height}"
    names = [("fast", None), *((preset, variant) for variant in variants for preset in ("standard", "quality"))]
    for preset, variant in names:
        renderer = Renderer(unit, preset, variant, rest=fast.rest)
        renderer(height)
        label = preset if variant is None else f"{preset}_{variant.split('_')[0]}"
        yield row(f"{label}_{size}_ms", best_ms(renderer, height, 3), "ms", of="one core, CPU")


def stock_mitsuba(unit: Calibration, samples: tuple[int, ...]) -> Iterator[Row]:
    """CPU ms and noise, levels rms, of Mitsuba's own renders of the scene's file."""
    mi = activate(LLVM)
    fast = FastPictures(unit)
    matrix = np.asarray(unit.response.centre, np.float32).T
    size = f"{unit.camera.width}x{unit.camera.height}"
    with tempfile.TemporaryDirectory() as folder:
        write_scene(Path(folder) / "scene.xml", unit, fast.heights(TYPICAL))
        scene = mi.load_file(str(Path(folder) / "scene.xml"))

        def drawn(count: int, seed: int) -> np.ndarray:
            return np.array(mi.render(scene, spp=count, seed=seed)) @ matrix

        truth = np.mean([drawn(256, seed) for seed in range(100, 100 + MANY // 256)], axis=0)
        for count in samples:
            drawn(count, 0)
            ms = best_ms(lambda seed, count=count: drawn(count, seed), 1, 2)
            squares = np.mean(np.square(drawn(count, 2) - truth))
            noise = float(np.sqrt(squares / (1 + count / MANY)))  # the truth's own noise is in it
            yield row(f"stock_mitsuba_{count}_{size}_ms", ms, "ms", of="one core, CPU, path integrator")
            yield row(f"stock_mitsuba_{count}_{size}_noise", noise, "levels", of="rms")


if __name__ == "__main__":
    sys.exit(main())
