"""Measure speed against error of every way to draw a DIGIT's picture: ours, stock Mitsuba, a table, simple baselines.

    python scripts/benchmarks/compare_pictures.py PRESSES [--background FILE] [--deeper DIR] [--finish] [--every]
                                                  [--json FILE] [--quick]

On photographs: three fits without a third of PRESSES each, tried on that third; three numbers a press are fitted
(right, down, depth), by the fast picture; with --deeper, on further photographs of the same unit and ball, too, whose
drift of the light is taken off. Fits end on the fast picture, with --finish on Mitsuba's; they start from round
numbers that know nothing of the unit. Baselines: the background alone, and the nearest fitted photograph shifted to the
place. `through` allows light through the coating where the ball touches it, three more numbers a photograph; `known`
takes the mean of what the other photographs of the same day show. With --every, by `reference`, too (20 s of CPU a
photograph), and by the presets without LLVM.
Times are CPU ms a picture on one core, the least of a few. The presets' own, and their levels from the full model, are
those of data/optics_presets.json (measure_presets.py). Stock Mitsuba draws the file of `render --scene-out`; its error
is its noise, of the difference of two renders. Prints rows, then one table. Needs the extra [render]; LLVM's rows only
where LLVM works.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed


from benchmarks.competitors.taxim_like import TableBench, fit_table
from benchmarks.measure_presets import best_ms, one_thread, working_variants
from benchmarks.measured_rows import finished, parser_of, printed
from tactile_core.accuracy import Row, row
from tactile_core.pictures.calibrate.ball_pictures import FastPictures, working_factor
from tactile_core.pictures.calibrate.contact_light import contact_disc, contact_radius, fitted_light
from tactile_core.pictures.calibrate.fit import calibrate
from tactile_core.pictures.calibrate.held_out import FOLDS
from tactile_core.pictures.calibrate.photo_metrics import metrics
from tactile_core.pictures.calibrate.photographs import Photographs, Press, chosen, press_of, read_photographs
from tactile_core.pictures.calibrate.press_fit import MODEL_ERROR, Ball, Sight, fit_ball
from tactile_core.pictures.mitsuba.scene_file import write_scene
from tactile_core.pictures.mitsuba.variant import LLVM, SCALAR, activate
from tactile_core.pictures.presets import NAMES, QUALITY, REFERENCE, STANDARD, measured
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Calibration
from tactile_core.sensors.calibration_file import load_calibration

START = Path(__file__).resolve().parents[2] / "scenes/calibrations/start.toml"
BALL = 3e-3  # m, radius
SIZES = (240, 320), (480, 640)
SAMPLES = (32, 64, 256)  # a pixel, of stock Mitsuba
TABLE, STOCK = "taxim_like", "stock_mitsuba"
TYPICAL = (1e-3, 0.5e-3, 1e-3, BALL)  # right, down, depth, radius, m, of the press whose time is taken
FLANK = 0.5, 1.0  # of the contact's radius: where the print is steep

Change = Callable[[Ball], np.ndarray]  # (H, W, 3) grey levels, of a press


def main(arguments: list[str] | None = None) -> int:
    """Measure and print the rows; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("presses", metavar="PRESSES")
    parser.add_argument("--background", metavar="FILE", help="photograph of the untouched gel; estimated else")
    parser.add_argument("--deeper", metavar="DIR", help="further photographs, of another day")
    parser.add_argument("--finish", action="store_true", help="finish each fit on Mitsuba's pictures")
    parser.add_argument("--every", action="store_true", help="by reference and without LLVM as well")
    parser.add_argument("--quick", action="store_true", help="one third of the photographs, 240 x 320 at 32 samples")
    options = parser.parse_args(arguments)
    photographs = read_photographs(options.presses, options.background)
    rows = printed(measure(photographs, options.deeper, options.finish, options.every, options.quick))
    print(table(rows))
    return finished(rows, options.json)


def measure(photographs: Photographs, deeper: str | None, finish: bool, every: bool, quick: bool) -> Iterator[Row]:
    """Yield all rows: on photographs, then the table's times, then stock Mitsuba's."""
    variants = working_variants()
    one_thread(variants[0])
    further = [] if deeper is None else _further(Path(deeper), photographs)
    yield from on_photographs(photographs, further, variants, finish, every, 1 if quick else FOLDS)
    for size in SIZES[: 1 if quick else None]:
        unit = load_calibration().at_size(*size)
        yield table_time(unit, photographs)
        if variants[0] == LLVM:
            yield from stock_mitsuba(unit, SAMPLES[: 1 if quick else None])


def _further(folder: Path, photographs: Photographs) -> list[Press]:
    from tactile_core.pictures.background import read_photograph

    files = sorted(folder.glob("*.png"))
    found = [press_of(file.name, read_photograph(file), photographs.background) for file in files]
    return [press for press in found if press is not None]


def on_photographs(
    photographs: Photographs, further: list[Press], variants: list[str], finish: bool, every: bool, folds: int
) -> Iterator[Row]:
    """Rows of every method on photographs that it was not fitted on, and on further ones."""
    names = [press.name for press in photographs.presses]
    found: dict[tuple[str, str], list[dict[str, float]]] = {}
    for fold in range(folds):
        apart = names[fold::FOLDS]
        fitted = chosen(photographs, [name for name in names if name not in apart])
        unit = calibrate(fitted, 2 * BALL, load_calibration(START), unit="fold", quick=not finish).calibration
        for where, presses in (("apart", chosen(photographs, apart).presses), ("deeper", further)):
            for name, metrics_of in one_fit(unit, fitted, presses, variants, every):
                found.setdefault((where, name), []).append(metrics_of)
    for (where, name), each in found.items():
        for metric, unit_ in (("roi_psnr", "dB"), ("roi_l1", "levels"), ("flank_colour", "levels")):
            value = float(np.mean([one[metric] for one in each]))
            nothing = float(np.mean([one[metric] for one in found[where, "baseline_background"]]))
            of = f"{len(each)} photographs {'not fitted' if where == 'apart' else 'of another day, deeper'}"
            yield row(f"{where}_{name}_{metric}", value, unit_, baseline=nothing, of=of)


def one_fit(
    unit: Calibration, fitted: Photographs, presses: Sequence[Press], variants: list[str], every: bool
) -> Iterator[tuple[str, dict[str, float]]]:
    """Metrics by every method, by name, of presses that a unit was not fitted on."""
    fast = FastPictures(unit)
    factor = working_factor(unit.camera.width, unit.camera.height)
    working = FastPictures(unit.at_size(unit.camera.width // factor, unit.camera.height // factor))
    balls = {press.name: fit_ball(working, Sight(press), BALL)[0] for press in fitted.presses}
    ways = methods(unit, fitted, fast, variants, every) | {
        "baseline_shifted": lambda ball: shifted(ball, fitted, balls, fast)
    }
    placed = [fit_ball(working, Sight(press), BALL)[0] for press in presses]
    through = [fit_ball(working, Sight(press), BALL, opaque=False)[0] for press in presses]
    discs = [contact_disc(fast, seen.numbers) for seen in through]
    for name, change in ways.items():
        for press, ball in zip(presses, placed, strict=True):
            yield name, compared(change(ball), press, fitted.background, fast, ball)
        if name.startswith("baseline") or name == REFERENCE.name:  # whose one picture takes long enough
            continue
        changes = [change(seen) for seen in through]
        lights = np.stack([light_of(*each) for each in zip(changes, presses, discs, strict=True)])
        others = (lights.sum(0) - lights) / max(len(lights) - 1, 1)
        for kind, known in (("through", lights), ("known", others)):
            for press, seen, dark, disc, light in zip(presses, through, changes, discs, known, strict=True):
                lit = dark + disc[..., None] * light
                yield f"{name}_{kind}", compared(lit, press, fitted.background, fast, seen)


def methods(
    unit: Calibration, fitted: Photographs, fast: FastPictures, variants: list[str], every: bool
) -> dict[str, Change]:
    """Ways to draw the change by a press, by name; the slower variant's presets carry its name."""
    bench = TableBench(fast, fit_table(unit, fitted, BALL))
    found: dict[str, Change] = {
        "baseline_background": lambda ball: np.zeros((*unit.camera.shape, 3)),
        TABLE: lambda ball: bench.change(ball.numbers),
        "fast": lambda ball: fast.change(ball.numbers),
    }
    drawn = {name: (name, variants[0]) for name in (STANDARD.name, QUALITY.name)}
    if every:
        drawn |= {f"{name}_{variant}": (name, variant) for variant in variants[1:] for name in drawn}
        drawn[REFERENCE.name] = (REFERENCE.name, variants[0])
    for label, (preset, variant) in drawn.items():
        renderer = Renderer(unit, preset, variant, rest=fast.rest)
        found[label] = lambda ball, renderer=renderer: renderer.in_levels(
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


def light_of(change: np.ndarray, press: Press, disc: np.ndarray) -> np.ndarray:
    """Light (3,) through the coating, levels, that a photograph shows under a disc (H, W) beside a change."""
    counts = press.touched & (press.picture.max(-1) < 255)
    return fitted_light((press.change - change)[counts], disc[counts], MODEL_ERROR)


def compared(
    change: np.ndarray, press: Press, background: np.ndarray, fast: FastPictures, ball: Ball
) -> dict[str, float]:
    """Metrics of a change against a photograph, and the error of the flanks' mean colours."""
    untouched = background + press.drift
    picture = np.rint(untouched + change).clip(0, 255)
    return metrics(picture, press.picture, background, press.region) | {
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


def table_time(unit: Calibration, photographs: Photographs) -> Row:
    """CPU ms of a picture by the table that the photographs the unit was fitted on give."""
    fitted = chosen(photographs, list(unit.fit.photographs))
    coarse = unit.at_size(photographs.shape[1], photographs.shape[0])
    bench = TableBench(FastPictures(unit), fit_table(coarse, fitted, BALL))
    return row(f"{TABLE}_{_size(unit)}_ms", best_ms(bench.change, TYPICAL, 3), "ms", of="one core, CPU")


def stock_mitsuba(unit: Calibration, samples: tuple[int, ...]) -> Iterator[Row]:
    """CPU ms and noise, levels rms, of Mitsuba's own renders of the scene's file."""
    mi = activate(LLVM)
    matrix = np.asarray(unit.response.centre, np.float32).T
    with tempfile.TemporaryDirectory() as folder:
        write_scene(Path(folder) / "scene.xml", unit, FastPictures(unit).heights(TYPICAL))
        scene = mi.load_file(str(Path(folder) / "scene.xml"))
        np.array(mi.render(scene, spp=1, seed=0))  # compiles
        for count in samples:
            began = time.process_time()
            one, other = (np.array(mi.render(scene, spp=count, seed=seed)) @ matrix for seed in (1, 2))
            ms = 1e3 * (time.process_time() - began) / 2
            of = "one core, CPU, path integrator"
            yield row(f"{STOCK}_{count}_{_size(unit)}_ms", ms, "ms", of=of)
            noise = float(np.sqrt(np.mean(np.square(one - other)) / 2))
            yield row(f"{STOCK}_{count}_{_size(unit)}_noise", noise, "levels", of="rms")


def _size(unit: Calibration) -> str:
    return f"{unit.camera.width}x{unit.camera.height}"


def table(rows: list[Row]) -> str:
    """The rows and the presets' file as one table of speed against error, Markdown."""
    value = {found["name"]: found["value"] for found in rows}
    presets = measured()["presets"]
    small, large = (f"{width}x{height}" for width, height in SIZES)
    lines = [
        f"| | ms {small}: LLVM, without | ms {large} | levels from the full model | not fitted: dB, levels "
        "| flanks' colour | deeper: dB, levels |",
        "|---|---|---|---|---|---|---|",
    ]
    ways = [("baseline_background", "background alone"), ("baseline_shifted", "nearest fitted photograph, shifted")]
    for name, label in (*ways, (TABLE, "table after Taxim"), *((preset, f"`{preset}`") for preset in NAMES)):
        found = presets.get(name)
        if found:
            times = [_times(found["ms"]), _times(found["ms_480x640"]), _number(found["error"])]
        else:
            times = [_number(value.get(f"{name}_{size}_ms")) for size in (small, large)] + [""]
        seen = [
            _numbers(value, f"{where}_{name}", metrics_)
            for where, metrics_ in (
                ("apart", ("roi_psnr", "roi_l1")),
                ("apart", ("flank_colour",)),
                ("deeper", ("roi_psnr", "roi_l1")),
            )
        ]
        lines.append("| " + " | ".join([label, *times, *seen]) + " |")
    for count in SAMPLES:
        times = [_number(value.get(f"{STOCK}_{count}_{size}_ms")) for size in (small, large)]
        noise = _number(value.get(f"{STOCK}_{count}_{small}_noise"))
        cells = [f"stock Mitsuba, {count} samples", *times, f"{noise} (noise)", "", "", ""]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _times(ms: dict[str, float]) -> str:
    """Times of a preset by LLVM and without; one number where it needs no Mitsuba."""
    return _number(ms["numpy"]) if "numpy" in ms else _joined([ms.get(variant) for variant in (LLVM, SCALAR)])


def _numbers(value: dict[str, float], name: str, metrics_: Sequence[str]) -> str:
    return _joined([value.get(f"{name}_{metric}") for metric in metrics_])


def _joined(values: Sequence[float | None]) -> str:
    return ", ".join(_number(each) for each in values if each is not None)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


if __name__ == "__main__":
    sys.exit(main())
