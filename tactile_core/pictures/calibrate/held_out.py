"""Evaluate a calibration on presses that it was not fitted on."""

from __future__ import annotations

from collections.abc import Callable

from ...errors import TactileError
from ...sensors.calibration import Calibration
from .evaluate import Evaluation, evaluate_unit, mean_metrics
from .fit import calibrate
from .photographs import Photographs, chosen

FOLDS = 3  # of cross-validation
WORTH = 0.8  # of the background's L1: a calibration that leaves more of a press is worth nothing (assumed)


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
