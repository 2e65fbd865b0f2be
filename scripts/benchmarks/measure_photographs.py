"""Compare pictures with photographs of DIGITs, and write the rows to docs/calibration.csv.

    python scripts/benchmarks/measure_photographs.py DATA                  DATA holds digit_real, biotac_force ...
    python scripts/benchmarks/measure_photographs.py DATA --parts levels   that part alone; the file's others stay

Calibrations are fitted, by the fast preset, from round numbers (`start.toml`) or from the unit that ships, and are
judged on photographs that were not fitted. `levels` compares how dark, bright and colourful photographs are with
pictures of real recordings; `told_apart` measures how well a classifier tells the two apart (scikit-learn).
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import parser_of, printed, read_table, write_table
from tactile_core.accuracy import Row, row
from tactile_core.pictures.background import read_photograph
from tactile_core.pictures.calibrate.evaluate import Evaluation, evaluate_unit, mean_metrics
from tactile_core.pictures.calibrate.fit import calibrate
from tactile_core.pictures.calibrate.photographs import CHANGE, Photographs, chosen, press_of, read_photographs
from tactile_core.pictures.renderer import Renderer, camera_noise
from tactile_core.recordings import PrepareOptions, read
from tactile_core.recordings.assemble import assemble
from tactile_core.sensors.calibration import LARGEST_LEVEL, Calibration
from tactile_core.sensors.calibration_file import load_calibration
from tactile_core.translation.translate import translate

ROOT = Path(__file__).resolve().parents[2]
PAGE, START = ROOT / "docs/calibration.csv", ROOT / "scenes/calibrations/start.toml"
DIAMETER = 6e-3  # m, of the balls
PATCH = 32  # px, of pictures that a classifier sees
FRAMES = 100, 25  # between those drawn of the long recording, and of the short one


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the rows of the parts that the command line names; returns the exit status."""
    parser = parser_of(__doc__, json=False)
    parser.add_argument("data", type=Path, metavar="DATA")
    parser.add_argument("--parts", default=",".join(PARTS), help="which, by commas")
    options = parser.parse_args(arguments)
    parts: dict[str, list] = {}
    for each in read_table(PAGE) if PAGE.exists() else []:
        parts.setdefault(each["part"], []).append(each)
    for name in options.parts.split(","):
        parts[name] = printed(PARTS[name](options.data))
        write_table(PAGE, parts)
    return 0


def own_unit(data: Path) -> Photographs:
    """Read the 14 photographs of the unit that ships from the folder ``data``."""
    return read_photographs(data / "digit_real" / "presses")


def deeper(data: Path, known: Photographs) -> Photographs:
    """Read two deeper presses, of another ball and day, from the folder ``data``; background : that of ``known``"""
    files = sorted((data / "digit_real" / "deeper").glob("*.png"))
    found = (press_of(file.name, read_photograph(file), known.background) for file in files)
    return dataclasses.replace(known, presses=tuple(press for press in found if press is not None))


def other_unit(data: Path) -> Photographs:
    """Read ten photographs of another unit (Taxim's), and its untouched gel, from the folder ``data``."""
    folder = data / "digit_other_unit"
    return read_photographs(folder, folder / "untouched.jpg")


def folds(photographs: Photographs, count: int, start: Calibration) -> Iterator[tuple[Calibration, Photographs]]:
    """Split photographs into ``count`` parts; for each yield a fit from ``start`` to all others, and the part."""
    names = [press.name for press in photographs.presses]
    for fold in range(count):
        apart = names[fold::count]
        others = chosen(photographs, [name for name in names if name not in apart])
        yield calibrate(others, DIAMETER, start, unit="", quick=True).calibration, chosen(photographs, apart)


def metric_rows(tried: list[Evaluation], of: str) -> Iterator[Row]:
    """Yield rows of the metrics' means over evaluated photographs, and of the worst PSNR; of : names them, a text"""
    ours, baseline = mean_metrics(tried)
    for name, unit in (("roi_psnr", "dB"), ("roi_l1", "levels"), ("through_psnr", "dB"), ("through_l1", "levels")):
        yield row(name, ours[name], unit, baseline=baseline[name], of=of)
    yield row("lobe_iou", ours["lobe_iou"], "", of=of)
    yield row("below_background", 100 * (1 - ours["roi_l1"] / baseline["roi_l1"]), "%", of=of)
    yield row("worst_psnr", min(each.metrics["roi_psnr"] for each in tried), "dB", of=of)


def thirds(data: Path) -> Iterator[Row]:
    """Yield rows of fits to two thirds of ``own_unit``'s photographs in ``data``, begun at round numbers and judged on
    the other third and on ``deeper`` presses."""
    known = own_unit(data)
    start, deep, apart, deep_tried = load_calibration(START), deeper(data, known), [], []
    for unit, third in folds(known, 3, start):
        apart += evaluate_unit(unit, third, DIAMETER / 2, search_radius=False)
        deep_tried += evaluate_unit(unit, deep, DIAMETER / 2, search_radius=False)
    yield from metric_rows(apart, "14 photographs by thirds")
    yield from metric_rows(deep_tried, "2 deeper, by the fits of the 14")


def five(data: Path) -> Iterator[Row]:
    """Yield rows of the shipped calibration on the five photographs that it was not fitted to and on another unit's."""
    unit, known = load_calibration(), own_unit(data)
    apart = [press.name for press in known.presses if press.name not in unit.fit.photographs]
    for of, each in (("5 not fitted", chosen(known, apart)), ("another unit", other_unit(data))):
        yield from metric_rows(evaluate_unit(unit, each, DIAMETER / 2, search_radius=False), f"unit that ships, {of}")


def fifths(data: Path) -> Iterator[Row]:
    """Yield rows of fits to four fifths of another unit's photographs, from the shipped unit, judged on the fifth."""
    tried = []
    for unit, fifth in folds(other_unit(data), 5, load_calibration()):
        tried += evaluate_unit(unit, fifth, DIAMETER / 2, search_radius=False)
    yield from metric_rows(tried, "another unit by fifths")


def levels(data: Path) -> Iterator[Row]:
    """Yield ``level_rows`` of photographs in the folder ``data``, and of pictures of real recordings there."""
    known, other = own_unit(data), other_unit(data)
    for of, each in (("14 photographs", known), ("2 deeper", deeper(data, known)), ("another unit", other)):
        shown = np.stack([press.picture for press in each.presses])
        yield from level_rows(shown, each.background + np.stack([press.drift for press in each.presses]), of)
    renderer = Renderer(preset="fast")
    for of, displacement in recordings(data):
        yield from level_rows(renderer.render(displacement), renderer.background, f"pictures of {of}")


def recordings(data: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and gel displacement (T, n, 3) m of recordings in ``data``: a finger on a force sensor, a slide."""
    folder = data / "biotac_force"
    rest, pressed = (np.loadtxt(folder / f"finger1_{name}.txt") for name in ("rest", "counts"))
    counts = np.concatenate([rest, pressed])
    recording = assemble("finger1", "text", electrodes=counts, stamps=np.arange(len(counts)) / 100)
    tare = PrepareOptions(tare=slice(0, len(rest)))
    frames = slice(len(rest), None, FRAMES[0])
    yield "a pressed finger", translate(recording, prepare=tare, frames=frames).displacement_digit
    slide = read(data / "biotac_recordings" / "slide" / "mat10_31_bio.csv")
    yield "a slide", translate(slide, frames=slice(None, None, FRAMES[1])).displacement_digit


def level_rows(pictures: np.ndarray, rest: np.ndarray, of: str) -> Iterator[Row]:
    """Yield rows of pictures (n, H, W, 3): % of clipped values, and percentiles over touched pixels of their
    saturation, of their levels, and of their levels divided by those at rest.
    rest : of the untouched gel, levels, one picture or n; of : the pictures, in words"""
    rest = np.broadcast_to(rest, pictures.shape)
    touched = np.abs(pictures - rest.clip(0, LARGEST_LEVEL)).max(-1) > CHANGE
    seen, share = pictures[touched].astype(float), pictures[touched] / np.maximum(rest[touched], 1)
    saturation = 1 - seen.min(1) / np.maximum(seen.max(1), 1)
    yield row("clipped", 100 * np.mean((pictures == 0) | (pictures == LARGEST_LEVEL)), "% of all", of=of)
    yield row("clipped_touched", 100 * np.mean((seen == 0) | (seen == LARGEST_LEVEL)), "% of touched", of=of)
    for percent in (50, 99, 99.9):
        yield row(f"saturation_{percent:g}", float(np.percentile(saturation, percent)), "", of=of)
    for percent in (0.1, 1, 5):
        yield row(f"of_rest_{percent:g}", float(np.percentile(share, percent)), "", of=of)
    for percent in (1, 10, 50, 90, 99):
        yield row(f"level_{percent}", float(np.percentile(seen, percent)), "levels", of=of)


def told_apart(data: Path) -> Iterator[Row]:
    """Yield rows of how often a classifier tells photographs from drawn pictures of the same presses, on pieces that it
    was not trained on: 0.5 if it cannot tell. Pictures have the photographs' background."""
    unit, known = load_calibration(), own_unit(data)
    tried = evaluate_unit(unit, known, DIAMETER / 2, search_radius=False)
    drawn = [np.random.default_rng(number) for number in range(len(tried))]
    grain = [camera_noise(unit, random) for random in drawn]
    white = [random.standard_normal(noise.shape) * unit.noise for random, noise in zip(drawn, grain, strict=True)]
    for of, noises in (("without noise", [0.0] * len(tried)), ("with --noise", grain), ("with white noise", white)):
        pictures = [
            np.rint(each.picture + noise).clip(0, LARGEST_LEVEL) for each, noise in zip(tried, noises, strict=True)
        ]
        photographs = [each.press.picture for each in tried]
        yield row("told_apart", share_told(photographs, pictures), "1", 0.5, of=f"{len(tried)} pictures {of}")


def share_told(photographs: list[np.ndarray], pictures: list[np.ndarray]) -> float:
    """Return the share of pieces that a support vector machine classifies rightly, with each pair held out in turn.
    photographs, pictures : n each, in pairs, (H, W, 3) grey levels"""
    from sklearn.model_selection import LeaveOneGroupOut, cross_val_score
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC

    pairs = [(patch_statistics(one), patch_statistics(other)) for one, other in zip(photographs, pictures, strict=True)]
    statistics = np.concatenate([np.concatenate(pair) for pair in pairs])
    real = np.concatenate([[True] * len(one) + [False] * len(other) for one, other in pairs])
    group = np.repeat(np.arange(len(pairs)), [len(one) + len(other) for one, other in pairs])
    machine = make_pipeline(StandardScaler(), SVC())
    return float(cross_val_score(machine, statistics, real, groups=group, cv=LeaveOneGroupOut()).mean())


def patch_statistics(picture: np.ndarray) -> np.ndarray:
    """Return 24 statistics (squares, 24) of each square of PATCH px of a picture (H, W, 3): spread of levels, of their
    first and second differences, and products of neighbouring differences and of those of two colours."""
    levels, found = picture.astype(float), []
    for down, right in np.ndindex(levels.shape[0] // PATCH, levels.shape[1] // PATCH):
        patch = np.moveaxis(levels[down * PATCH :, right * PATCH :][:PATCH, :PATCH], -1, 0)
        right, down = np.diff(patch, axis=2), np.diff(patch, axis=1)
        sizes = [each.std((1, 2)) for each in (patch, right, down, np.diff(right, axis=2), np.diff(down, axis=1))]
        along = [(right[:, :, 1:] * right[:, :, :-1]).mean((1, 2)), (down[:, 1:] * down[:, :-1]).mean((1, 2))]
        between = [(right[a] * right[b]).mean() for a, b in ((0, 1), (1, 2), (0, 2))]
        found.append(np.concatenate([*(np.log(0.3 + size) for size in sizes), *along, between]))
    return np.array(found)


PARTS: dict[str, Callable[[Path], Iterator[Row]]] = {
    each.__name__: each for each in (levels, five, thirds, fifths, told_apart)
}  # fmt: skip

if __name__ == "__main__":
    sys.exit(main())
