"""Evaluate a calibration on photographs: fit place and depth of each press, compare its picture with the photograph.
The baseline beside each metric is the background alone, as if nothing had touched the gel."""

from __future__ import annotations

import dataclasses
import io
import math
from collections.abc import Callable

import numpy as np

from ...accuracy import Row, row
from ...errors import TactileError
from ...sensors.calibration import LARGEST_LEVEL, Calibration
from ..camera_curve import bent, ends
from .ball_pictures import BallPictures, FastPictures, working_factor
from .photo_metrics import metrics
from .photographs import Photographs, Press
from .press_fit import Ball, Sight, contact_radius, fit_ball, missing_light

RADIUS_STARTS = (2 / 3, 1.5)  # of the ball's radius, from which it is searched
BRIGHT = 0.07  # excess of the object's light over the unit's, as a share of the coating's, that is flagged (assumed)
# name -> (unit, target, which way is better); targets of presses that were not fitted
TARGETS = {
    "roi_l1": ("levels", 8.0, -1), "roi_psnr": ("dB", 26.0, 1),
    "through_l1": ("levels", None, -1), "through_psnr": ("dB", None, 1), "roi_ssim": ("", None, 1),
    "frame_l1": ("levels", None, -1), "lobe_iou": ("", 0.6, 1), "ball_radius_error": ("", 0.1, -1),
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """Result of a calibration on one photograph.

    ball : as fitted, its radius known; picture : (H, W, 3) uint8, rendered; flags : doubts in words
    metrics, baseline : numbers, by ``TARGETS``' names, for the picture and for the background alone
    through : light of the ball through the coating, fitted to this photograph, as a share of the coating's own; metrics
        ``through_*`` take the median of the set's other photographs for it, all others the calibration's"""

    press: Press
    ball: Ball
    picture: np.ndarray
    through: float
    metrics: dict[str, float]
    baseline: dict[str, float]
    flags: tuple[str, ...]


def evaluate_unit(
    calibration: Calibration,
    photographs: Photographs,
    radius: float,
    *,
    search_radius: bool = True,
    pictures: Callable[[Calibration], BallPictures] = FastPictures,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Evaluation]:
    """Evaluate a calibration on each press of the photographs.
    radius : m, of balls whose press gives none; search_radius : true also fits the radius, for ``ball_radius_error``
    pictures : class that draws the compared pictures; places and depths are found with the fast ones
    progress : called with (presses done, in all)
    Raises TactileError for photographs of another shape than the calibration's pictures."""
    unit = fitted_size(calibration, photographs)
    factor = working_factor(unit.camera.width, unit.camera.height)
    working = FastPictures(unit.at_size(unit.camera.width // factor, unit.camera.height // factor))
    whole = pictures(unit)
    tried, count = [], len(photographs.presses)
    for press in photographs.presses:
        tried.append(_try_press(whole, working, press, photographs.background, radius, search_radius))
        progress(len(tried) // 2, count)
    for k, (press, each) in enumerate(zip(photographs.presses, tried, strict=True)):
        others = [other.through for other in tried if other is not each] or [each.through]
        lit = unit.with_through(float(np.median(others)))
        bright = FastPictures(lit.at_size(working.camera.width, working.camera.height))
        ball, _ = fit_ball(bright, Sight(press), each.ball.radius)
        found, baseline = _compared(press, photographs.background, pictures(lit).change(ball))[1], each.baseline
        for name in ("l1", "psnr"):
            each.metrics[f"through_{name}"], baseline[f"through_{name}"] = found[f"roi_{name}"], baseline[f"roi_{name}"]
        progress((count + k + 1) // 2, count)
    return tried


def fitted_size(calibration: Calibration, photographs: Photographs) -> Calibration:
    """Return the calibration in the photographs' pixels; raises TactileError for another aspect ratio."""
    height, width = photographs.shape
    try:
        return calibration.at_size(width, height)
    except TactileError as error:
        advice = "Turn or cut them as the calibration's camera sees the gel: fingertip up"
        raise TactileError(photographs.folder, error.found, error.expected, advice) from error


def _try_press(
    whole: BallPictures, working: BallPictures, press: Press, background: np.ndarray, radius: float, search_radius: bool
) -> Evaluation:
    """Evaluate one press: fit the ball, compare its picture (drawn by ``whole``) with the photograph; then fit the
    ball's light too and, with ``search_radius``, its radius.
    working : draws reduced pictures, for fits; background : (H, W, 3) levels, of the untouched gel
    radius : m, of the ball, if the press does not give its own"""
    sight = Sight(press)
    radius = sight.radius(radius)
    ball, _ = fit_ball(working, sight, radius)
    picture, ours = _compared(press, background, whole.change(ball))
    _, baseline = _compared(press, background, np.zeros_like(background))
    more = missing_light(working, sight, fit_ball(working, sight, radius, lit=True)[0])[1]
    known = whole.calibration.through
    through = min(max(known + more, 0.0), 1.0)
    if search_radius:
        ends = [fit_ball(working, sight, start * radius, free_radius=True) for start in RADIUS_STARTS]
        free = min(ends, key=lambda end: end[1])[0].radius
        ours["ball_radius_error"] = abs(free - radius) / radius
        baseline["ball_radius_error"] = float(np.mean([abs(start - 1) for start in RADIUS_STARTS]))
    flags = _flags(press, ball, whole)
    if through > known + BRIGHT:
        light = f"{100 * through:.0f} % of the coating's own light comes through it from the ball"
        flags += (f"{light}, {100 * known:.0f} % by the calibration",)
    return Evaluation(press, ball, picture, through, ours, baseline, flags)


def _compared(press: Press, background: np.ndarray, change: np.ndarray) -> tuple[np.ndarray, dict[str, float]]:
    """Return the picture (H, W, 3) uint8 of a press and its metrics against the photograph; the photograph's drift of
    light is added. change : (H, W, 3) levels, by the press; background : (H, W, 3) levels"""
    untouched = background + press.drift
    picture = np.rint(untouched + bent(change, ends(untouched))[0]).clip(0, LARGEST_LEVEL).astype(np.uint8)
    return picture, metrics(picture, press.picture, background, press.region)


def _flags(press: Press, ball: Ball, bench: BallPictures) -> tuple[str, ...]:
    """Return the press's flags in words, and one if the picture's edge cuts the contact. bench : whose camera it is"""
    camera = bench.camera
    contact = contact_radius(ball.depth, ball.radius)
    over_right = abs(ball.right) + contact > camera.width / 2 * camera.pixel_size[0]
    over_down = abs(ball.down) + contact > camera.height / 2 * camera.pixel_size[1]
    return (*press.flags, "the print is cut by the picture's edge") if over_right or over_down else press.flags


def mean_metrics(tried: list[Evaluation]) -> tuple[dict[str, float], dict[str, float]]:
    """Return the means over presses ``tried`` of the metrics and of the baseline's, by name; NaN values are left
    out."""
    means = []
    for which in ("metrics", "baseline"):
        rows = [getattr(each, which) for each in tried]
        values = {name: np.array([row[name] for row in rows if name in row]) for name in TARGETS}
        means.append({name: _mean(value) for name, value in values.items()})
    return means[0], means[1]


def _mean(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")


LARGEST_SHEET = 20  # presses; more would make a picture that nobody opens
GAP, MAGNIFIED = 4, 2  # px between pictures; factor of the difference, round grey 128


def rows_of(tried: list[Evaluation], name: str) -> tuple[list[Row], list[Row]]:
    """Return a report's rows: all metrics' means over presses; then each press's, with the place of its ball.
    name : that of the set of photographs"""
    ours, baseline = mean_metrics(tried)
    means, by_press = [], []
    for metric, (unit, target, better) in TARGETS.items():
        value, beside = (None if math.isnan(values[metric]) else values[metric] for values in (ours, baseline))
        asked = None if value is None else target
        means.append(row(metric, value, unit, asked, baseline=beside, of=name, at_least=better > 0))
    for each in tried:
        places = {"right": each.ball.right, "down": each.ball.down, "depth": each.ball.depth}
        by_press += [row(f"press_{what}", 1e3 * at, "mm", of=each.press.name) for what, at in places.items()]
        for metric, (unit, _, _) in TARGETS.items():
            value, beside = (values.get(metric) for values in (each.metrics, each.baseline))
            if value is not None and math.isfinite(value):
                known = beside if beside is not None and math.isfinite(beside) else None
                by_press.append(row(metric, value, unit, baseline=known, of=each.press.name))
    return means, by_press


def sheet(tried: list[Evaluation]) -> bytes:
    """Draw photograph, render and twice their difference, on grey, of the first 20 presses ``tried``; return a PNG."""
    from PIL import Image, ImageDraw

    shown = tried[:LARGEST_SHEET]
    height, width = shown[0].picture.shape[:2]
    columns = 1 if len(shown) < 3 else 2
    lines = math.ceil(len(shown) / columns)
    cell = (height + 18, 3 * (width + GAP) + GAP)
    drawn = Image.new("RGB", (columns * cell[1], lines * cell[0] + 16), "white")
    draw = ImageDraw.Draw(drawn)
    draw.text((GAP, 2), f"photograph, render, difference x {MAGNIFIED}", fill="black")
    for k, each in enumerate(shown):
        top, left = 16 + k // columns * cell[0], k % columns * cell[1] + GAP
        difference = 128 + MAGNIFIED * (each.picture.astype(float) - each.press.picture)
        for j, picture in enumerate((each.press.picture, each.picture, difference.clip(0, 255).astype(np.uint8))):
            drawn.paste(Image.fromarray(picture), (left + j * (width + GAP), top + 14))
        metrics, baseline = each.metrics, each.baseline
        text = f"{each.press.name}  {metrics['roi_psnr']:.1f} dB (baseline {baseline['roi_psnr']:.1f})"
        text += f"  {metrics['roi_l1']:.1f} levels (baseline {baseline['roi_l1']:.1f})  {'; '.join(each.flags)}"
        draw.text((left, top), text.encode("ascii", "replace").decode(), fill="black")
    content = io.BytesIO()
    drawn.save(content, "PNG")
    return content.getvalue()
