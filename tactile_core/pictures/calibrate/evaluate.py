"""A calibration tried on photographs: three numbers a press are fitted, and the picture is held against the photograph.

The baseline stands beside each metric: the background alone, as if nothing had touched the gel.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from ...errors import TactileError
from ...sensors.calibration import LARGEST_LEVEL, Calibration
from .ball_pictures import BallPictures, working_factor
from .photo_metrics import figures
from .photographs import Photographs, Press
from .press_fit import Ball, Sight, fit_ball

CONTACT_SHARE = 0.8  # radius of the contact over sqrt(2 R depth), by the table of prints
RADIUS_STARTS = (2e-3, 4.5e-3)  # m, from which the ball's radius is searched
FIGURES = ("roi_l1", "roi_psnr", "roi_ssim", "frame_l1", "lobe_iou", "ball_radius_error")
# name -> (unit, target, which way is better); targets of presses that were not fitted
TARGETS = {
    "roi_l1": ("levels", 8.0, -1), "roi_psnr": ("dB", 26.0, 1), "roi_ssim": ("", None, 1),
    "frame_l1": ("levels", None, -1), "lobe_iou": ("", 0.6, 1), "ball_radius_error": ("", 0.1, -1),
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Evaluation:
    """Result of a calibration on one photograph.

    ball : three numbers fitted, the radius known; free_radius : m, of the fit of four numbers
    picture : (H, W, 3) uint8, rendered; figures, null : by the names of FIGURES; flags : in words
    """

    press: Press
    ball: Ball
    free_radius: float
    picture: np.ndarray
    figures: dict[str, float]
    null: dict[str, float]
    flags: tuple[str, ...]


def evaluate_unit(
    calibration: Calibration,
    photographs: Photographs,
    radius: float,
    *,
    search_radius: bool = True,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Evaluation]:
    """Evaluate a calibration on each press of the photographs; radius : m, of the ball.

    Raises TactileError for photographs of another shape than the calibration's pictures.
    """
    unit = fitted_size(calibration, photographs)
    factor = working_factor(unit.camera.width, unit.camera.height)
    working = BallPictures(unit.at_size(unit.camera.width // factor, unit.camera.height // factor))
    whole = BallPictures(unit)
    tried = []
    for press in photographs.presses:
        tried.append(_try_press(whole, working, press, photographs.background, radius, search_radius))
        progress(len(tried), len(photographs.presses))
    return tried


def fitted_size(calibration: Calibration, photographs: Photographs) -> Calibration:
    """The calibration in the photographs' pixels; raises TactileError for another aspect ratio."""
    height, width = photographs.shape
    try:
        return calibration.at_size(width, height)
    except TactileError as error:
        advice = "Turn or cut them as the calibration's camera sees the gel: fingertip up"
        raise TactileError(photographs.folder, error.found, error.expected, advice) from error


def _try_press(
    whole: BallPictures, working: BallPictures, press: Press, background: np.ndarray, radius: float, search_radius: bool
) -> Evaluation:
    sight = Sight(press)
    ball, _ = fit_ball(working, sight, radius)
    untouched = background + press.drift  # the null knows how the light drifted as well
    picture = np.rint(untouched + whole.change(ball.numbers)).clip(0, LARGEST_LEVEL).astype(np.uint8)
    rounded = np.rint(untouched).clip(0, LARGEST_LEVEL).astype(np.uint8)
    ours = figures(picture, press.picture, background, press.region)
    null = figures(rounded, press.picture, background, press.region)
    free = float("nan")
    if search_radius:
        ends = [fit_ball(working, sight, start, free_radius=True) for start in RADIUS_STARTS]
        free = min(ends, key=lambda end: end[1])[0].radius
        ours["ball_radius_error"] = abs(free - radius) / radius
        null["ball_radius_error"] = float(np.mean([abs(start - radius) / radius for start in RADIUS_STARTS]))
    return Evaluation(press, ball, free, picture, ours, null, _flags(press, ball, whole))


def _flags(press: Press, ball: Ball, bench: BallPictures) -> tuple[str, ...]:
    """Describe what is wrong with a photograph; as the ball's place is known by now, also whether the edge cuts it."""
    camera = bench.camera
    contact = CONTACT_SHARE * np.sqrt(2 * ball.radius * ball.depth)
    over_right = abs(ball.right) + contact > camera.width / 2 * camera.pixel_size[0]
    over_down = abs(ball.down) + contact > camera.height / 2 * camera.pixel_size[1]
    return (*press.flags, "the print is cut by the picture's edge") if over_right or over_down else press.flags


def mean_figures(tried: list[Evaluation]) -> tuple[dict[str, float], dict[str, float]]:
    """Means over presses of the metrics and of the baseline's; NaN ones left out, NaN where all are."""
    means = []
    for which in ("figures", "null"):
        rows = [getattr(each, which) for each in tried]
        values = {name: np.array([row[name] for row in rows if name in row]) for name in FIGURES}
        means.append({name: _mean(value) for name, value in values.items()})
    return means[0], means[1]


def _mean(values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(values.mean()) if len(values) else float("nan")
