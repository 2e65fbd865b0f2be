"""Fit a unit's calibration to photographs of a ball pressed into it, by Gauss-Newton: on the fast picture first, then
on Mitsuba's, which adds the light of one bounce."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ...errors import TactileError
from ...sensors.calibration import AMBIENT_DEGREE, PHOTOGRAPHED_DEGREE, Calibration, Fit
from ..background import fit_ambient
from ..height_map import rest_height_map
from ..presets import FAST, QUALITY
from ..renderer import Renderer
from .ball_pictures import BallPictures, FastPictures, MitsubaPictures, missing_mitsuba, working_factor, working_preset
from .evaluate import Evaluation, evaluate_unit, fitted_size, mean_metrics
from .photographs import Photographs, Press
from .press_fit import MODEL_ERROR, Sight, fit_ball, minimise
from .residuals import GAIN_SPREAD, NAMES, OBJECT_LIGHT, SPREAD, UnitResiduals, parameters_of

PLACING_STEPS, STEPS, FINISHING_STEPS = 6, 14, 8  # of the search
# Object's light from which the two searches start, of which the better is taken: a ridge lies between none and much.
OBJECT_STARTS = (0.0, 0.15)
TOLERANCE = 1e-3  # a step that gains less than 0.1 % of the cost is noise
UNEXPLAINED = 0.5  # largest unexplained share of squares of a photograph that shows this ball
IDENTIFIED = 0.5  # of the assumed spread of units: numbers of a larger standard error are reported as not determined
NEVER_IDENTIFIED = ("centre_x_mm", "centre_z_mm")  # no press depends on them: kept from the start
# mm, spread at which a fit begins: the picture's derivative by it is zero at none, so that no step would be taken.
LEAST_SPREAD = 0.1
MM_LIMITS = (0.5, 16.0)  # mm, ball diameters that fit on the gel


@dataclasses.dataclass(frozen=True)
class Calibrated:
    """Result of `calibrate`: the unit's calibration, and warnings, sentences on what makes it doubtful.
    tried : evaluations of it on the presses it was fitted to"""

    calibration: Calibration
    tried: list[Evaluation]
    warnings: tuple[str, ...]


def check_diameter(ball_diameter: float) -> None:
    """Raise TactileError for a ball_diameter, m, that does not fit on the gel: 0.5 to 16 mm do."""
    if not MM_LIMITS[0] <= 1e3 * ball_diameter <= MM_LIMITS[1]:
        expected = f"{MM_LIMITS[0]:g} to {MM_LIMITS[1]:g}"
        raise TactileError("ball diameter, mm", f"{1e3 * ball_diameter:g}", expected)


def calibrate(
    photographs: Photographs,
    ball_diameter: float,
    start: Calibration,
    *,
    unit: str,
    quick: bool = False,
    reflectance: float | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Calibrated:
    """Fit camera, dome, coating, lights and gain of a unit, from the calibration ``start``.

    ball_diameter : m; unit : its name; progress : called with (steps done, in all)
    reflectance : of the ball, above 0 to 1; the coating's transmission is then fitted. None keeps the start's
        transmission and fits the reflectance: photographs of one object determine only the product
    quick : true stops after the fast picture, which also happens if Mitsuba by LLVM does not work
    Raises TactileError for a ball that does not fit on the gel, and if no photograph shows such a ball."""
    check_diameter(ball_diameter)
    coating = dataclasses.replace(start.coating, spread=max(start.coating.spread, 1e-3 * LEAST_SPREAD))
    whole = fitted_size(dataclasses.replace(start, coating=coating), photographs)
    factor = working_factor(whole.camera.width, whole.camera.height)
    working = whole.at_size(whole.camera.width // factor, whole.camera.height // factor)
    trouble = "" if quick else missing_mitsuba()
    finish = not quick and not trouble
    total = PLACING_STEPS + 3 * STEPS + finish * FINISHING_STEPS + 1
    search = _Search(working, photographs, ball_diameter / 2, lambda done: progress(done, total))
    every = np.ones(len(NAMES), bool)
    # The object's light is fitted from the start, or else ambient light that grows with height takes its place.
    lights = np.arange(len(NAMES)) >= OBJECT_LIGHT
    seen = np.array(NAMES) != "albedo"  # the fast picture has no bounce
    search.place()
    search.put_aside()
    search.fit(lights)
    if search.readmit():
        search.fit(lights)
    search.fit(seen)
    if finish:
        search.fit(every, MitsubaPictures(working_preset(QUALITY, factor)), FINISHING_STEPS)
    fitted = search.calibration().at_size(whole.camera.width, whole.camera.height)
    if reflectance is not None:
        # The transmission that explains the object's light by an object of this reflectance.
        coating = dataclasses.replace(fitted.coating, transmission=min(fitted.through / reflectance, 1.0))
        fitted = dataclasses.replace(fitted, coating=coating, object_reflectance=reflectance)
    used = dataclasses.replace(photographs, presses=tuple(search.presses))
    tried = evaluate_unit(fitted, used, ball_diameter / 2, search_radius=False)
    progress(total, total)
    errors, unknown = search.identified(factor)
    metrics = {name: value for name, value in mean_metrics(tried)[0].items() if np.isfinite(value)}
    names = tuple(press.name for press in search.presses)
    note = _note(search.presses, finish=finish, estimated=photographs.estimated)
    rest_radiance = Renderer(fitted, FAST).radiance(rest_height_map(fitted.camera))
    degree = AMBIENT_DEGREE if photographs.estimated else PHOTOGRAPHED_DEGREE
    calibration = dataclasses.replace(
        fitted,
        unit=unit,
        ambient=fit_ambient(photographs.background, fitted, rest_radiance, degree),
        photograph="",
        noise=photographs.noise,
        fit=Fit(note, names, (*unknown, *NEVER_IDENTIFIED), ball_diameter, metrics, errors),
    )
    warnings = _warnings(photographs, tried, search.aside)
    if trouble:
        warnings = (f"fitted by the fast picture alone: {trouble}", *warnings)
    return Calibrated(calibration, tried, warnings)


def _note(presses: Sequence[Press], *, finish: bool, estimated: bool) -> str:
    """Describe what a calibration was fitted to: pictures, presses, balls and background.
    finish : true if the fit ended by Mitsuba; estimated : true if the background was not photographed"""
    light, rest = "Mitsuba" if finish else "fast picture", "estimated" if estimated else "photographed"
    balls = {f"{2e3 * press.radius:g}" for press in presses if press.radius is not None}
    of = f" by balls of {', '.join(sorted(balls, key=float))} mm" if balls else ""
    return f"{light}; {len(presses)} presses{of}; background {rest}"


class _Search:
    """State of a fit: the presses that it uses, the unit's numbers and the balls' places.
    radius : m, of balls whose press gives none; progress : called with the steps done"""

    def __init__(
        self, start: Calibration, photographs: Photographs, radius: float, progress: Callable[[int], None]
    ) -> None:
        self.start, self.radius = start, radius
        self.presses = list(photographs.presses)
        self._sights = [Sight(press) for press in self.presses]
        self.aside: dict[str, float] = {}  # photographs left out: name -> share unexplained
        self._progress, self._done = progress, 0
        self._object = np.array(NAMES) == "object_light"  # free while balls are placed; others stay

    def place(self) -> None:
        """Fit presses, gain and the object's light alone; the unit's other numbers stay those of the start."""
        bench = FastPictures(self.start)
        balls = [fit_ball(bench, sight, sight.radius(self.radius), lit=True)[0] for sight in self._sights]
        self._problem = UnitResiduals(self.start, self._sights, self.radius, self._object)
        places = 1e3 * np.array([ball[:3] for ball in balls]).ravel()
        starts = [np.array([light, *places]) for light in OBJECT_STARTS]
        self._minimise(min(starts, key=self._problem.cost), PLACING_STEPS)

    def put_aside(self) -> None:
        """Leave out photographs that do not look like the ball. Raises TactileError if none does."""
        left = self._problem.unexplained()
        good = [k for k, share in enumerate(left) if share < UNEXPLAINED]
        if not good:
            found = f"no photograph looks like a ball of {2e3 * self.radius:g} mm"
            advice = "Check --ball-diameter, --background and the way the pictures lie (fingertip up)"
            raise TactileError("presses", found, "photographs of that ball", advice)
        self.aside = {press.name: float(left[k]) for k, press in enumerate(self.presses) if k not in good}
        if self.aside:
            self._all = list(self.presses)
            self._take([self.presses[k] for k in good], self.start, self._problem.balls(self._x)[good])
            self._minimise(self._x, PLACING_STEPS)

    def readmit(self) -> bool:
        """Take photographs back that show the ball under the lights found so far; return true if there are any."""
        if not self.aside:
            return False
        bench, balls, taken = FastPictures(self.calibration()), self._problem.balls(self._x).tolist(), []
        placed = {press.name: ball for press, ball in zip(self.presses, balls, strict=True)}
        for press in self._all:
            if press.name in self.aside:
                sight = Sight(press)
                ball, left = fit_ball(bench, sight, sight.radius(self.radius))
                self.aside[press.name] = unexplained_share(sight, left)
                if self.aside[press.name] < UNEXPLAINED:
                    placed[press.name] = (1e3 * np.array(ball[:3])).tolist()
                    taken.append(press.name)
        for name in taken:
            del self.aside[name]
        kept = [press for press in self._all if press.name in placed]
        self._take(kept, self.calibration(), np.array([placed[press.name] for press in kept]))
        return bool(taken)

    def _take(self, presses: list[Press], unit: Calibration, balls: np.ndarray) -> None:
        """Go on with these presses. balls : (n, 3) mm, right, down and depth; unit : whose numbers to start from"""
        self.presses, self._sights = presses, [Sight(press) for press in presses]
        self._problem = UnitResiduals(unit, self._sights, self.radius, self._object)
        self._x = np.array([unit.through, *balls.ravel()])
        self._problem.cost(self._x)

    def fit(
        self, free: np.ndarray, pictures: Callable[[Calibration], BallPictures] = FastPictures, steps: int = STEPS
    ) -> None:
        """Go on with the search over the unit's numbers that are ``free`` (22,) bool, by at most ``steps``; pictures :
        class that draws a unit's pictures"""
        numbers, balls = parameters_of(self._problem.unit(self._x)), self._problem.balls(self._x)
        self._problem, self._free = UnitResiduals(self.start, self._sights, self.radius, free, pictures), free
        self._minimise(np.concatenate([numbers[free], balls.ravel()]), steps)

    def _minimise(self, x: np.ndarray, steps: int) -> None:
        done = self._done
        shown = lambda step: self._progress(done + step)  # noqa: E731
        self._x, _ = minimise(self._problem, x, most=steps, tolerance=TOLERANCE, progress=shown)
        self._problem.cost(self._x)
        self._done += steps

    def calibration(self) -> Calibration:
        """Return the unit that the parameters found so far describe."""
        return self._problem.unit(self._x)

    def identified(self, factor: int) -> tuple[dict[str, float], tuple[str, ...]]:
        """Return standard errors by name, and the names of parameters that the photographs do not determine. The
        assumed spread of units counts as one more measurement; misfits of the model count as MODEL_ERROR.
        factor : width of a fitted pixel, in pixels of the photographs"""
        matrix, _ = self._problem.normal_equations(self._x)
        errors = SPREAD.copy()  # of what was not fitted
        errors[self._free] = MODEL_ERROR * np.sqrt(np.diag(np.linalg.inv(matrix)))[: self._free.sum()]
        found = zip(NAMES, errors, SPREAD, strict=True)
        unknown = [name for name, error, spread in found if error > IDENTIFIED * spread]
        named = dict(zip(NAMES, errors.tolist(), strict=True))
        for name in ("px_per_mm_x", "px_per_mm_y"):
            named[name] *= factor
        parts = zip(("gain_centre", "gain_along_right_per_mm", "gain_along_down_per_mm"),
                    self._problem.gain_errors(), GAIN_SPREAD, strict=True)  # fmt: skip
        for name, error, spread in parts:
            named[name] = error
            if error > IDENTIFIED * spread:
                unknown.append(name)
        return named, tuple(unknown)


def unexplained_share(sight: Sight, left: float) -> float:
    """Return the share of the change's mean square that a fit leaves; left : what it leaves, grey levels squared"""
    return left / max(float(np.square(sight.change[sight.counts]).mean()), 1e-9)


def _warnings(photographs: Photographs, tried: list[Evaluation], aside: dict[str, float]) -> tuple[str, ...]:
    found = []
    if photographs.estimated:
        found.append("the background is the median of the photographs; a photograph of the untouched gel is better")
    if photographs.untouched:
        found.append(f"no press in {', '.join(photographs.untouched)}")
    found += [
        f"{name}: does not look like the ball ({100 * share:.0f} % of it unexplained), left out"
        for name, share in aside.items()
    ]
    found += [f"{each.press.name}: {flag}" for each in tried for flag in each.flags]
    return tuple(found)
