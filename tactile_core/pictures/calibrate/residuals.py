"""The sum of squares that a unit's calibration minimises: presses' pictures less their photographs, and priors.

The unknowns are the unit's numbers and three numbers per press. The gain C is solved for at each step and eliminated
(variable projection: Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973), by Gauss-Newton steps, since the camera's toe
and shoulder are not linear. Gaussian priors (units' assumed spread) determine numbers that few photographs do not."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from ...errors import TactileError
from ...sensors.calibration import Calibration, Response
from ...sensors.camera import COLOURS
from ...sensors.gel_shape import shape_of
from .ball_pictures import BallPictures, FastPictures
from .ball_print import deepest
from .press_fit import MODEL_ERROR, SHALLOWEST, Sight

# name, standard deviation of units round the calibration that a fit starts from (assumed, but for the scale: 17 to
# 21 px/mm, docs/sources.md, DIGIT camera), step of the differences that make the Jacobian
CAMERA = (("px_per_mm_x", 0.7, 0.02), ("px_per_mm_y", 0.7, 0.02), ("apparent_height_mm", 4.0, 0.2))
GEL = (("dome_scale", 0.1, 0.02),)
COATING = (("albedo", 0.15, 0.05), ("spread_mm", 0.15, 0.02), ("object_light", 0.1, 0.02))
LED = (("right_mm", 2.0, 0.05), ("down_mm", 2.0, 0.05), ("up_mm", 1.0, 0.05), ("radius_mm", 1.0, 0.05),
       ("rise_per_mm", 0.2, 0.02))  # fmt: skip
LEDS = tuple((f"{colour}_{name}", spread, step) for colour in COLOURS for name, spread, step in LED)

PARAMETERS = (*CAMERA, *GEL, *COATING, *LEDS)
NAMES = tuple(name for name, _, _ in PARAMETERS)
OBJECT_LIGHT = NAMES.index("object_light")
SPREAD = np.array([spread for _, spread, _ in PARAMETERS])
STEP = np.array([step for _, _, step in PARAMETERS])
FIRST_LED, PER_LED = len(CAMERA) + len(GEL) + len(COATING), len(LED)
# Groups of numbers varied together in a finite difference: the three LEDs' are seen in bands of their own.
TOGETHER = (
    *((k,) for k in range(FIRST_LED)),
    *(tuple(range(FIRST_LED + k, len(NAMES), PER_LED)) for k in range(PER_LED)),
)
SMALLEST_RADIUS, LARGEST_RADIUS = 0.1, 8.0  # mm; the gel's window is 18 mm wide


def parameters_of(calibration: Calibration) -> np.ndarray:
    """Return a calibration's numbers (22,) in the order of ``NAMES``: camera, dome, coating, then each LED."""
    camera = calibration.camera
    lights = zip(calibration.leds, calibration.ambient_rise, strict=True)
    leds = [value for led, rise in lights for value in (*(1e3 * mm for mm in (*led.position, led.radius)), 1e-3 * rise)]
    head = [camera.px_per_mm_x, camera.px_per_mm_y, 1e3 * camera.apparent_height, calibration.dome_scale]
    head += [float(np.mean(calibration.coating.albedo)), 1e3 * calibration.coating.spread, calibration.through]
    return np.array([*head, *leds])


def with_parameters(calibration: Calibration, numbers: np.ndarray) -> Calibration:
    """Return the calibration with other numbers (22,), in the order of ``NAMES``, and with the gain that it has now.
    Raises TactileError for a number out of range."""
    scale_x, scale_y, height, dome, albedo, spread, through = (float(value) for value in numbers[:FIRST_LED])
    shares = np.asarray(calibration.coating.albedo)
    of_red, of_green, of_blue = (shares * (albedo / shares.mean())).tolist()
    coating = dataclasses.replace(calibration.coating, albedo=(of_red, of_green, of_blue), spread=1e-3 * spread)
    camera = dataclasses.replace(
        calibration.camera, px_per_mm_x=scale_x, px_per_mm_y=scale_y, apparent_height=1e-3 * height
    )
    rows = numbers[FIRST_LED:].reshape(3, PER_LED).tolist()
    red, green, blue = (
        dataclasses.replace(led, position=(1e-3 * x, 1e-3 * y, 1e-3 * z), radius=1e-3 * radius)
        for led, (x, y, z, radius, _) in zip(calibration.leds, rows, strict=True)
    )
    rise_red, rise_green, rise_blue = (1e3 * row[-1] for row in rows)
    changed = dataclasses.replace(
        calibration, camera=camera, leds=(red, green, blue), dome_scale=dome, coating=coating,
        ambient_rise=(rise_red, rise_green, rise_blue),
    )  # fmt: skip
    return changed.with_gain(calibration.gain).with_through(through)


GAIN_STEPS = 2  # by Gauss and Newton's method, from the gain that the call of ``cost`` before found
GAIN_SPREAD = (100.0, 20.0, 20.0)  # levels per unit of radiance, of C; levels per mm, of its slopes; assumed
PRESS_STEP = 10e-3  # mm


class UnitResiduals:
    """Cost and normal equations over x = the unit's free numbers, then right, down, depth of each press in mm.
    start : calibration in reduced pixels, the priors' mean; sights : one for each photograph
    radius : m, of balls whose press gives none
    free : (22,) bool, which of the unit's numbers may change; pictures : class that draws the unit's pictures"""

    def __init__(
        self,
        start: Calibration,
        sights: list[Sight],
        radius: float,
        free: np.ndarray,
        pictures: Callable[[Calibration], BallPictures] = FastPictures,
    ) -> None:
        self._start, self._sights, self._radius, self._free = start, sights, radius, free
        self._pictures = pictures
        thickness = shape_of(start.camera.sensor).thickness
        self._deepest = np.array([deepest(sight.radius(radius), thickness) for sight in sights])
        self._numbers = parameters_of(start)
        gain = start.gain
        terms = [np.asarray(gain.centre), 1e-3 * np.asarray(gain.along_right), 1e-3 * np.asarray(gain.along_down)]
        self._start_gain = np.concatenate(terms, axis=1)  # (channel, term and LED)
        self._gain_weight = np.repeat((MODEL_ERROR / np.array(GAIN_SPREAD)) ** 2, 3)
        self._weight = (MODEL_ERROR / SPREAD) ** 2
        self.gain = self._start_gain

    def unit(self, x: np.ndarray) -> Calibration:
        """Return the calibration that x (n,) describes, with the gain that the last call of ``cost`` found."""
        numbers = self._numbers.copy()
        numbers[self._free] = x[: self._free.sum()]
        centre, right, down = (tuple(map(tuple, part.tolist())) for part in np.split(self.gain, 3, axis=1))
        # Slopes per mm become slopes per m.
        slopes = [tuple(tuple(1e3 * value for value in row) for row in part) for part in (right, down)]
        try:
            gain = Response(centre, *slopes)
        except TactileError:  # on the way a colour may turn dark; at the end it may not
            gain = self._start.gain
        return with_parameters(self._start.with_gain(gain), numbers)

    def balls(self, x: np.ndarray) -> np.ndarray:
        """Return the balls (presses, 3) that x (n,) describes: right, down, depth, mm."""
        return x[self._free.sum() :].reshape(-1, 3)

    def cost(self, x: np.ndarray) -> float:
        """Return half the sum of squares at x (n,), with the best gain; infinity if a number is meaningless."""
        if not self._sensible(x):
            return np.inf
        try:
            bench = self._pictures(self.unit(x))
        except TactileError:  # an LED over the picture or as high as the camera, gel that ends in the picture
            return np.inf
        terms = [self._terms(bench, ball, sight) for ball, sight in zip(self.balls(x), self._sights, strict=True)]
        self._bench, self._last, self._balls_now = bench, terms, self.balls(x)
        for _ in range(GAIN_STEPS):
            matrix, gradient = self._gain_equations()
            self.gain = self.gain - np.linalg.solve(matrix, gradient[..., None])[..., 0]
        numbers = parameters_of(bench.calibration)
        cost = sum(np.square(missed).sum() for missed, _ in self._missed())
        cost += (self._weight * (numbers - self._numbers) ** 2).sum()
        cost += (self._gain_weight * (self.gain - self._start_gain) ** 2).sum()
        return float(cost / 2)

    def inside(self, x: np.ndarray) -> np.ndarray:
        """Return x (n,), its light through the coating 0 if it was below."""
        least = np.full(len(x), -np.inf)
        least[: self._free.sum()][np.flatnonzero(self._free) == OBJECT_LIGHT] = 0
        return np.maximum(x, least)

    def unexplained(self) -> np.ndarray:
        """Return the share (presses,) of each photograph's sum of squares left as residual by the last ``cost``."""
        pairs = zip(self._missed(), self._sights, strict=True)
        return np.array([np.square(missed).sum() / np.square(sight.shown).sum() for (missed, _), sight in pairs])

    def gain_errors(self) -> tuple[float, float, float]:
        """Return the standard errors of the gain and of its slopes per mm to right and down, each rms over the LEDs,
        at the parameters of the last call of ``cost``."""
        inverse = np.linalg.inv(self._gain_equations()[0])  # (channel, 9, 9)
        squares = MODEL_ERROR**2 * inverse.diagonal(0, 1, 2).mean(0).reshape(3, 3).mean(1)
        return tuple(np.sqrt(squares).tolist())

    def _sensible(self, x: np.ndarray) -> bool:
        balls, numbers = self.balls(x), self._numbers.copy()
        numbers[self._free] = x[: self._free.sum()]
        radii = numbers[FIRST_LED + 3 :: PER_LED]
        inside = (balls[:, 2] >= 1e3 * SHALLOWEST).all() and (balls[:, 2] <= 1e3 * self._deepest).all()
        return bool(inside and (radii >= SMALLEST_RADIUS).all() and (radii <= LARGEST_RADIUS).all())

    def _terms(self, bench: BallPictures, ball: np.ndarray, sight: Sight) -> np.ndarray:
        """Return each LED's light (9, p) of a press on its p pixels that count: its change times 1, right and down, mm.
        ball : (3,) mm, right, down and depth"""
        changes = bench.lights((*(1e-3 * ball), sight.radius(self._radius)))[:, sight.counts]
        right, down = (1e3 * values[sight.counts] for values in (bench.right, bench.down))
        return np.concatenate([changes, right * changes, down * changes])

    def _missed(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return each press's residuals (3, p), levels, of its p pixels that count, and the camera curve's slopes (3,
        p)."""
        pairs = zip(self._last, self._sights, strict=True)
        found = (sight.missed((self.gain @ terms).T) for terms, sight in pairs)
        return [(missed.T, slope.T) for missed, slope in found]

    def _gain_equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Return Gauss-Newton's matrix (3, 9, 9) and gradient (3, 9) of each channel's gain."""
        matrix, gradient = np.diag(self._gain_weight), self._gain_weight * (self.gain - self._start_gain)
        for terms, (missed, slope) in zip(self._last, self._missed(), strict=True):
            bright = slope[:, None] * terms
            matrix = matrix + bright @ bright.swapaxes(1, 2)
            gradient = gradient + (bright @ missed[..., None])[..., 0]
        return matrix, gradient

    def normal_equations(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return Gauss-Newton's matrix (n, n), gradient (n,) at x (n,), gain eliminated (Schur complement): A - sum
        over channels of B G^-1 B^T; A for x, G for the gain, B mixed. The gain's gradient is 0 at its optimum."""
        self.cost(x)
        count, free = len(x), int(self._free.sum())
        matrix, gradient = np.zeros((count, count)), np.zeros(count)
        numbers = parameters_of(self._bench.calibration)
        matrix[:free, :free] = np.diag(self._weight[self._free])
        gradient[:free] = (self._weight * (numbers - self._numbers))[self._free]
        own, _ = self._gain_equations()
        mixed = np.zeros((3, count, 9))  # by channel
        unit_steps = self._steps_of_unit(numbers)
        for k, (terms, (missed, slope)) in enumerate(zip(self._last, self._missed(), strict=True)):
            columns = np.r_[:free, free + 3 * k : free + 3 * k + 3]
            slopes = np.concatenate([unit_steps[k], self._steps_of_press(x, k)], axis=1)  # (3, free + 3, p)
            slopes *= slope[:, None]
            matrix[np.ix_(columns, columns)] += np.einsum("cap,cbp->ab", slopes, slopes, optimize=True)
            gradient[columns] += np.einsum("cap,cp->a", slopes, missed, optimize=True)
            mixed[:, columns] += slopes @ (slope[:, None] * terms).swapaxes(1, 2)
        for channel, equations in zip(mixed, own, strict=True):
            matrix -= channel @ np.linalg.solve(equations, channel.T)
        return matrix, gradient

    def _steps_of_unit(self, numbers: np.ndarray) -> list[np.ndarray]:
        """Return for each press the derivatives (3, free, p) of its picture, channel first, by the free ones of the
        unit's numbers (22,), by forward differences."""
        slopes = [np.zeros((3, int(self._free.sum()), terms.shape[1])) for terms in self._last]
        column = {number: k for k, number in enumerate(np.flatnonzero(self._free).tolist())}
        for group in TOGETHER:
            wanted = [number for number in group if number in column]
            bench, way = self._moved(numbers, group) if wanted else (self._bench, 1)
            for k, (before, sight) in enumerate(zip(self._last, self._sights, strict=True)):
                after = self._terms(bench, self._balls_now[k], sight) if wanted else before
                for number in wanted:
                    terms = after
                    if number >= FIRST_LED:  # of this LED alone
                        terms, led = before.copy(), (number - FIRST_LED) // PER_LED
                        terms[led::3] = after[led::3]
                    slopes[k][:, column[number]] = self.gain @ (terms - before) / (way * STEP[number])
        return slopes

    def _moved(self, numbers: np.ndarray, group: tuple[int, ...]) -> tuple[BallPictures, int]:
        """Return pictures with the numbers (22,) of the indices ``group`` one step larger, and 1; or, if a unit cannot
        have such numbers, one step smaller, and -1."""
        moved = np.zeros_like(numbers)
        moved[list(group)] = STEP[list(group)]
        try:
            return self._pictures(with_parameters(self._bench.calibration, numbers + moved)), 1
        except TactileError:  # at an end of its range, as an LED that touches the gel
            return self._pictures(with_parameters(self._bench.calibration, numbers - moved)), -1

    def _steps_of_press(self, x: np.ndarray, k: int) -> np.ndarray:
        """Return derivatives (3, 3, p), levels per mm, of press k's picture at x (n,): channel, right/down/depth, p."""
        ball, before, sight = self.balls(x)[k], self._last[k], self._sights[k]
        after = [self._terms(self._bench, ball + step, sight) for step in PRESS_STEP * np.eye(3)]
        return np.stack([self.gain @ (terms - before) / PRESS_STEP for terms in after], axis=1)
