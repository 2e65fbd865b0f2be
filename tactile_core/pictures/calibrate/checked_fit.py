"""Fit a unit for ``tactile calibrate``: check orientation, evaluate fits on held-out presses, fit on all presses."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...errors import TactileError
from ...sensors.calibration import Calibration
from ...sensors.calibration_file import load_calibration
from ..presets import FAST
from ..renderer import Renderer
from .ball_pictures import FastPictures, smaller, whole_factor
from .evaluate import Evaluation, evaluate_unit, fitted_size, mean_metrics
from .fit import Calibrated, calibrate, unexplained_share
from .photographs import Photographs, Press, chosen
from .press_fit import Sight, fit_ball

# (transposed, then rows reversed, columns reversed): the effect on a picture.
TURNS = {
    (False, False, False): "",
    (False, True, True): "turned by 180 degrees",
    (False, False, True): "mirrored left to right",
    (False, True, False): "mirrored top to bottom",
    (True, False, True): "turned by 90 degrees clockwise",
    (True, True, False): "turned by 90 degrees counter-clockwise",
    (True, False, False): "turned by 90 degrees clockwise and mirrored left to right",
    (True, True, True): "turned by 90 degrees clockwise and mirrored top to bottom",
}
COLOURS = "red and blue exchanged"
LOOKED_AT = 4  # presses, those of the largest changes, by which orientation is judged
COARSE_SIDE = 60  # px, about the short side of their pictures, which are reduced by a whole factor
CLEARLY = 0.8  # a way is clearly better if its residual is below this share of another's (assumed)


class Way(NamedTuple):
    """Steps that transform a picture, each if true: transpose, reverse rows, reverse columns, exchange red with
    blue."""

    transposed: bool
    rows: bool
    columns: bool
    colours: bool

    def applied_to(self, picture: np.ndarray) -> np.ndarray:
        """Return a picture (h, w, 3) or mask (h, w) after this transformation."""
        changed = picture.swapaxes(0, 1) if self.transposed else picture
        changed = changed[:: -1 if self.rows else 1, :: -1 if self.columns else 1]
        return changed[..., ::-1] if self.colours and changed.ndim == 3 else changed

    def __str__(self) -> str:
        words = [TURNS[self[:3]], COLOURS if self.colours else ""]
        return " with ".join(filter(None, words)) or "as they are"


GIVEN = Way(False, False, False, False)


def check_orientation(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Raise TactileError if another orientation or order of colours explains the photographs clearly better than as
    they are; it says which share of the presses each leaves unexplained.

    ball_diameter : m; start : calibration under which the balls are fitted; progress : called with (ways tried, in all)
    Of 8 orientations and 2 orders of colours, those that give pictures of the camera's shape are tried. Among ways that
    explain the presses about equally well (lights may stand opposite each other) the untouched gel decides: it is
    compared with the start's and the shipped unit's, as a start of round numbers hardly predicts it."""
    plain = sorted(photographs.presses, key=lambda press: -float(np.square(press.change).sum()))[:LOOKED_AT]
    height, width = photographs.shape
    factor = whole_factor(width, height, COARSE_SIDE)
    untouched = smaller(photographs.background, factor)
    units = _units(photographs, start, untouched.shape[:2])
    seen = {transposed: (FastPictures(unit), _resting(unit)) for transposed, unit in units.items()}
    ways = [Way(*turn, colours) for turn in TURNS if turn[0] in units for colours in (False, True)]
    left, apart = {}, {}
    for number, way in enumerate(ways, 1):
        bench, resting = seen[way.transposed]
        sights = [Sight(_changed(press, way), factor) for press in plain]
        missed = [fit_ball(bench, sight, sight.radius(ball_diameter / 2))[1] for sight in sights]
        left[way] = float(np.median([unexplained_share(*pair) for pair in zip(sights, missed, strict=True)]))
        apart[way] = min(float(np.abs(way.applied_to(untouched) - each).mean()) for each in resting)
        progress(number, len(ways))
    best = _best(left, apart)
    if best == GIVEN:
        return
    shares = ", ".join(f"{100 * left[way]:.0f} % {way}" for way in sorted(left, key=left.__getitem__))
    found = f"{100 * left[best]:.0f} % of the presses is unexplained {best}"
    found += f", {100 * left[GIVEN]:.0f} % as they are" if GIVEN in left else ", and as they are they lie across"
    expected = "fingertip up, as the camera sees the gel, and red, green, blue"
    raise TactileError(photographs.folder, found, expected, f"Give them {best}. Each way leaves: {shares}")


def _changed(press: Press, way: Way) -> Press:
    """Return the press with its photograph and masks transformed by ``way``."""
    picture, drift, change = way.applied_to(press.picture), way.applied_to(press.drift), way.applied_to(press.change)
    touched, region = way.applied_to(press.touched), way.applied_to(press.region)
    return dataclasses.replace(press, picture=picture, drift=drift, change=change, touched=touched, region=region)


def _best(left: dict[Way, float], apart: dict[Way, float]) -> Way:
    """Return the way of least residual; of those within CLEARLY, one whose untouched gel is clearly nearer.
    left : by way, median share of presses' squares left unexplained; apart : by way, mean difference, grey levels,
        between the untouched gel's photograph and the nearest known picture of it"""
    best = min(left, key=left.__getitem__)
    near = [way for way in left if CLEARLY * left[way] <= left[best]]
    nearest = min(near, key=apart.__getitem__)
    best = nearest if apart[nearest] < CLEARLY * apart[best] else best
    return GIVEN if GIVEN in near and CLEARLY * apart[GIVEN] <= apart[best] else best


def _resting(unit: Calibration) -> list[np.ndarray]:
    """Return pictures (h, w, 3) of the untouched gel in a unit's pixels: the unit's own and the shipped unit's."""
    known = [unit]
    with contextlib.suppress(TactileError):  # a sensor without a calibration, or of another aspect ratio
        known.append(load_calibration(None, unit.camera.sensor).at_size(unit.camera.width, unit.camera.height))
    return [Renderer(each, FAST).background for each in known]


def _units(photographs: Photographs, start: Calibration, shape: tuple[int, int]) -> dict[bool, Calibration]:
    """Return the calibration ``start`` in the pixels of pictures of ``shape`` (h, w), as they are (False) and
    transposed (True), without those of another aspect ratio than the camera's. Raises TactileError if none is left."""
    units = {}
    for transposed, (height, width) in ((False, shape), (True, shape[::-1])):
        try:
            units[transposed] = start.at_size(width, height)
        except TactileError:  # of another aspect ratio
            continue
    if not units:
        fitted_size(start, photographs)  # raises, and says why
    return units


FOLDS = 3  # of cross-validation
WORTH = 0.8  # of the background's L1: a calibration that leaves more of a press is worth nothing (assumed)
CHECKED, TRIED = 5, 75  # % of the work done when photographs are checked, and when the folds are; a last fit follows

Progress = Callable[[int, int], None]


def fit_unit(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    *,
    unit: str,
    quick: bool = False,
    reflectance: float | None = None,
    progress: Progress = lambda done, total: None,
) -> tuple[Calibrated, list[Evaluation]]:
    """Fit a unit by ``fit.calibrate``. Return the fit, and each press evaluated by a fit to the other thirds of the
    presses; of a single press no evaluation.
    ball_diameter : m; start : calibration that the fit starts from; unit : name; quick : true fits without Mitsuba
    reflectance : of the ball, None to fit it; progress : called with (done, in all), in per cent
    Raises TactileError for photographs in another orientation, without such a ball, or a ball too large for the gel."""

    def part(first: int, last: int) -> Progress:
        return lambda done, total: progress(first + (last - first) * done // total, 100)

    check_orientation(photographs, ball_diameter, start, part(0, CHECKED))
    apart = cross_validated(photographs, ball_diameter, start, quick=quick, progress=part(CHECKED, TRIED))
    fit = functools.partial(calibrate, unit=unit, quick=quick, reflectance=reflectance, progress=part(TRIED, 100))
    return fit(photographs, ball_diameter, start), apart


def cross_validated(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    *,
    quick: bool = False,
    progress: Progress = lambda done, total: None,
) -> list[Evaluation]:
    """Evaluate each third of the presses by a calibration fitted to the others; return none for a single press.
    ball_diameter : m; start : calibration to start fits from; quick : no Mitsuba; progress : called with (done, in
    all)"""
    names = [press.name for press in photographs.presses]
    folds = min(FOLDS, len(names))
    tried = []
    for fold in range(folds if folds > 1 else 0):
        apart = names[fold::folds]
        others = chosen(photographs, [name for name in names if name not in apart])

        def step(done: int, total: int, before: int = fold) -> None:
            """Convert the progress of one fold to that of all."""
            progress(before * total + done, folds * total)

        done = calibrate(others, ball_diameter, start, unit="others", quick=quick, progress=step).calibration
        tried += evaluate_unit(done, chosen(photographs, apart), ball_diameter / 2)
    return tried


def check_worth(tried: list[Evaluation]) -> None:
    """Raise TactileError for a calibration whose error is over 0.8 (``WORTH``) times that of the background alone.
    tried : its evaluations, on presses held out"""
    ours, baseline = mean_metrics(tried)
    if not ours["roi_l1"] <= WORTH * baseline["roi_l1"]:
        off, alone = ours["roi_l1"], baseline["roi_l1"]
        found = f"{off:.1f} levels off in the region of the press, the background alone {alone:.1f}"
        advice = "Check --ball-diameter, --background, the light, and that the pictures lie fingertip up"
        raise TactileError("calibration, tried on held-out presses", found, f"at most {WORTH:g} of that", advice)
