"""Fit a unit as ``tactile calibrate`` does: photographs that lie right, a trial on held-out presses, the fit on all."""

from __future__ import annotations

from collections.abc import Callable

from ...errors import TactileError
from ...sensors.calibration import Calibration
from .evaluate import Evaluation, evaluate_unit, mean_metrics
from .fit import Calibrated, calibrate
from .orientation import check_orientation
from .photographs import Photographs, chosen

FOLDS = 3  # of cross-validation
WORTH = 0.8  # of the background's L1: a calibration that leaves more of a press is worth nothing (assumed)
CHECKED, TRIED = 5, 75  # % of the work, of three folds and a fit, when photographs are checked and when folds are tried

Progress = Callable[[int, int], None]


def fit_unit(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    *,
    unit: str,
    quick: bool = False,
    progress: Progress = lambda done, total: None,
) -> tuple[Calibrated, list[Evaluation]]:
    """Fit a unit, as ``fit.calibrate``, and evaluate what fits of the other thirds make of each press.

    progress : called with (done, in all), in per cent
    Raises TactileError for photographs that lie another way, and what ``fit.calibrate`` raises.
    """

    def part(first: int, last: int) -> Progress:
        return lambda done, total: progress(first + (last - first) * done // total, 100)

    check_orientation(photographs, ball_diameter, start, part(0, CHECKED))
    apart = cross_validated(photographs, ball_diameter, start, quick=quick, progress=part(CHECKED, TRIED))
    return calibrate(photographs, ball_diameter, start, unit=unit, quick=quick, progress=part(TRIED, 100)), apart


def cross_validated(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    *,
    quick: bool = False,
    progress: Progress = lambda done, total: None,
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
