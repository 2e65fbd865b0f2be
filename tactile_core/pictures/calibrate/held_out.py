"""Evaluate a calibration on presses that it was not fitted on, and check the layout of photographs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...errors import TactileError
from ...sensors.calibration import Calibration
from .ball_pictures import BallPictures, FastPictures, working_factor
from .evaluate import Evaluation, evaluate_unit, fitted_size, mean_metrics
from .fit import calibrate, unexplained_share
from .photographs import Photographs, Press, chosen, turned
from .press_fit import Sight, fit_ball

FOLDS = 3  # of cross-validation
WORTH = 0.8  # of the background's L1: a calibration that leaves more of a press is worth nothing (assumed)
# What a picture that keeps its shape may be turned by: rows, columns reversed.
WAYS = {
    (True, True): "turned by 180 degrees",
    (False, True): "mirrored left to right",
    (True, False): "mirrored top to bottom",
}
LOOKED_AT = 4  # presses, the plainest, from which their orientation is found
CLEARLY = 0.8  # of what is unexplained as they are given, that another way may leave (assumed)


def check_orientation(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Raise TactileError for photographs that are explained clearly better when turned or mirrored; ball_diameter : m.

    progress : called with (ways tried, in all)
    The other four of the eight ways change the pictures' shape, by which they are recognised.
    """
    plain = sorted(photographs.presses, key=lambda press: -float(np.square(press.change).sum()))[:LOOKED_AT]
    unit = fitted_size(start, photographs)
    factor = working_factor(unit.camera.width, unit.camera.height)
    bench = FastPictures(unit.at_size(unit.camera.width // factor, unit.camera.height // factor))
    given = _median_unexplained(plain, bench, ball_diameter / 2)
    for number, ((rows, columns), name) in enumerate(WAYS.items(), 1):
        progress(number, len(WAYS) + 1)
        left = _median_unexplained([turned(press, rows, columns) for press in plain], bench, ball_diameter / 2)
        if left < CLEARLY * given:
            found = f"{name}: {100 * left:.0f} % of the presses is unexplained so, {100 * given:.0f} % as they are"
            raise TactileError(photographs.folder, found, "fingertip up, as the camera sees the gel", "Turn them")
    progress(len(WAYS) + 1, len(WAYS) + 1)


def _median_unexplained(presses: list[Press], bench: BallPictures, radius: float) -> float:
    """Median share of presses' squares that balls of a radius, m, leave."""
    sights = [Sight(press) for press in presses]
    return float(np.median([unexplained_share(sight, fit_ball(bench, sight, radius)[1]) for sight in sights]))


def cross_validated(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    *,
    quick: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Evaluation]:
    """Evaluate each press with a calibration of the others, by thirds; none for a single press. ball_diameter : m."""
    names = [press.name for press in photographs.presses]
    folds = min(FOLDS, len(names))
    tried = []
    for fold in range(folds if folds > 1 else 0):
        apart = names[fold::folds]
        others = chosen(photographs, [name for name in names if name not in apart])

        def step(done: int, total: int, before: int = fold) -> None:
            progress(before * total + done, folds * total)

        done = calibrate(others, ball_diameter, start, unit="others", quick=quick, progress=step).calibration
        tried += evaluate_unit(done, chosen(photographs, apart), ball_diameter / 2)
    return tried


def check_worth(tried: list[Evaluation]) -> None:
    """Raise TactileError for a calibration that explains its presses no better than the background."""
    ours, baseline = mean_metrics(tried)
    if not ours["roi_l1"] <= WORTH * baseline["roi_l1"]:
        found = (
            f"{ours['roi_l1']:.1f} levels off in the region of the press, the background alone {baseline['roi_l1']:.1f}"
        )
        advice = "Check --ball-diameter, --background, the light, and that the pictures lie fingertip up"
        raise TactileError("calibration, tried on held-out presses", found, f"at most {WORTH:g} of that", advice)
