"""Fit the place and depth at which the ball of a photograph was pressed, with a known calibration."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..camera_curve import bent, ends
from .ball_pictures import BallPictures, smaller, working_factor
from .photo_metrics import windowed
from .photographs import Press, dilated

START_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-7, 1e6
EASIER, HARDER = 0.2, 8.0  # factors of the damping after a step that helped, and after one that did not


def minimise(
    problem: Any, x: np.ndarray, *, most: int, tolerance: float, progress: Callable[[int], None] = lambda _: None
) -> tuple[np.ndarray, float]:
    """Minimise a sum of squares by damped Gauss-Newton steps from x (n,); return the last x and its cost. It ends after
    ``most`` steps, when a step gains less than a share ``tolerance``, or when none helps.

    problem : has ``cost(x)``, half the sum of squares, infinity for a meaningless x; ``inside(x)``, the nearest valid
        x; ``normal_equations(x)``, Gauss-Newton's matrix (n, n) and the cost's gradient (n,), at the last accepted x
    progress : called with the number of steps done"""
    cost, damping = problem.cost(x), START_DAMPING
    for step in range(most):
        matrix, gradient = problem.normal_equations(x)
        before = cost
        while True:
            damped = matrix + np.diag(damping * np.diag(matrix) + 1e-12 * np.trace(matrix))
            trial = problem.inside(x - np.linalg.solve(damped, gradient))
            trial_cost = problem.cost(trial)
            if trial_cost < cost:
                x, cost, damping = trial, trial_cost, max(damping * EASIER, LEAST_DAMPING)
                break
            damping *= HARDER
            if damping > MOST_DAMPING:
                return x, problem.cost(x)
        progress(step + 1)
        if before - cost < tolerance * before:
            break
    return x, cost


DEPTHS = (0.5 / 2.2, 1.2 / 2.2)  # over the deepest print's, from which fits start; the best result is taken
PRINT = 3e-3  # m, about the width of a print; a smaller ball's is its diameter (assumed)
SHALLOWEST = 0.03e-3  # m, of the table of prints
SMALLEST_BALL, LARGEST_BALL = 0.25e-3, 8e-3  # m, radius
MARGIN = 3  # working px round the region that count too: a print must not shade what the photograph shows untouched
STEP = 10e-6  # m, of the differences that make the Jacobian
STEPS, TOLERANCE = 25, 1e-5
# Grey levels, standard deviation of a pixel against the priors. The model's own misfits are 5 to 9 levels, alike over
# whole parts of a print: so thousands of pixels count as some fifty.
MODEL_ERROR = 80.0


class Ball(NamedTuple):
    """A pressed ball: right, down (image frame), depth from first touch, radius, all m."""

    right: float
    down: float
    depth: float
    radius: float


class Sight:
    """What a fit reads of a photograph: change (h, w, 3) in reduced pixels, and the mask (h, w) of the n that count.
    shown : (n, 3) levels of change in those
    factor : by which the photograph is reduced; None for ``working_factor``"""

    def __init__(self, press: Press, factor: int | None = None) -> None:
        factor = factor or working_factor(press.picture.shape[1], press.picture.shape[0])
        self._radius = press.radius
        self.change = smaller(press.change, factor)
        spoilt = smaller((press.picture.max(-1) == 255).astype(np.float32), factor) > 0
        self.region = smaller(press.touched.astype(np.float32), factor) > 0.25
        self.counts = dilated(self.region, MARGIN) & ~spoilt
        self.shown = self.change[self.counts]
        untouched = smaller(press.picture.astype(np.float32), factor)[self.counts] - self.shown  # in that day's light
        self._ends = ends(untouched)

    def missed(self, change: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return residuals (n, 3), levels, of a ``change`` (n, 3) of linear light, and the camera curve's slopes (n,
        3)."""
        seen, slope = bent(change, self._ends)
        return seen - self.shown, slope

    def radius(self, common: float) -> float:
        """Return the radius, m, of the photograph's own ball, or if it gives none ``common``, that of the set."""
        return common if self._radius is None else self._radius

    def guesses(self, bench: BallPictures, radius: float) -> list[tuple[float, float]]:
        """Return two starts (right, down) m for a ball of a radius, m: the change's centre of mass, and the place where
        its mean over a dent's width is largest. bench : gives the places of the reduced pixels"""
        weight = np.abs(self.change).max(-1) * self.region
        width = round(min(PRINT, 2 * radius) / bench.camera.pixel_size[0]) | 1
        largest = np.unravel_index(windowed(weight[..., None].astype(float), width)[..., 0].argmax(), weight.shape)
        weight /= weight.sum()
        middle = float((weight * bench.right).sum()), float((weight * bench.down).sum())
        return [middle, (float(bench.right[largest]), float(bench.down[largest]))]


def fit_ball(
    bench: BallPictures, sight: Sight, radius: float, *, free_radius: bool = False, lit: bool = False
) -> tuple[Ball, float]:
    """Fit the ball whose picture is nearest the photograph of ``sight``; return it and the mean squared residual,
    levels squared.
    bench : draws balls in reduced pixels; radius : m, the ball's, or where its search starts with ``free_radius``
    lit : true fits the object's light through the coating as well (``missing_light``), false takes the unit's"""
    problem = _PressProblem(bench, sight, radius, lit)
    starts = [
        np.array([*place, share * bench.deepest(radius), radius][: 4 if free_radius else 3])
        for place in sight.guesses(bench, radius)
        for share in DEPTHS
    ]
    ends = (minimise(problem, start, most=STEPS, tolerance=TOLERANCE) for start in starts)
    x, cost = min(ends, key=lambda end: end[1])
    return Ball(*x, *[radius][len(x) - 3 :]), 2 * cost / (3 * sight.counts.sum())


class _PressProblem:
    """Squares of residuals of a ball's picture over x = right, down, depth and, if free, radius, all m."""

    def __init__(self, bench: BallPictures, sight: Sight, radius: float, lit: bool) -> None:
        self._bench, self._sight, self._radius, self._lit = bench, sight, radius, lit

    def _missed(self, x: np.ndarray) -> np.ndarray:
        ball = (*x[:3], x[3] if len(x) > 3 else self._radius)
        if self._lit:
            return missing_light(self._bench, self._sight, ball)[0].ravel()
        return self._sight.missed(self._bench.change(ball)[self._sight.counts])[0].ravel()

    def cost(self, x: np.ndarray) -> float:
        """Return half the sum of squares, levels squared, at x (3,) or (4,) m; infinity far off the picture or
        table."""
        radius = x[3] if len(x) > 3 else self._radius
        inside = np.abs(x[0]) < -2 * self._bench.right[0, 0] and np.abs(x[1]) < -2 * self._bench.down[0, 0]
        if not (inside and x[2] >= SHALLOWEST and SMALLEST_BALL <= radius <= LARGEST_BALL):
            return np.inf
        if x[2] > self._bench.deepest(radius):
            return np.inf
        self._last = self._missed(x)
        return float(np.square(self._last).sum() / 2)

    def inside(self, x: np.ndarray) -> np.ndarray:
        """Return x unchanged: ``cost`` rejects what lies outside picture and table."""
        return x

    def normal_equations(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return J^T J (n, n), grey levels squared / m2, and J^T r (n,), grey levels squared / m; r are the residuals,
        J their derivatives by x (n,). `cost` must have been called last with this x: its residuals are used."""
        last = self._last
        jacobian = np.stack([(self._missed(x + step) - last) / STEP for step in STEP * np.eye(len(x))], -1)
        return jacobian.T @ jacobian, jacobian.T @ last


CONTACT_SHARE = 0.8  # radius of the contact over sqrt(2 R depth), by the table of prints
LIKELY = 0.1  # prior deviation of the light that comes through, over the coating's own, for small prints (assumed)


def contact_radius(depth: float, radius: float) -> float:
    """Return the contact radius, m, of a ball of ``radius``, m, pressed to ``depth``, m."""
    return float(min(CONTACT_SHARE * np.sqrt(2 * radius * depth), radius))


def missing_light(
    bench: BallPictures, sight: Sight, ball: tuple[float, float, float, float]
) -> tuple[np.ndarray, float]:
    """Fit, by least squares, the object's light through the coating that the unit's picture of a ball lacks.
    bench : draws balls; ball : its right, down, depth and radius, m; sight : of the photograph
    Returns the residual (n, 3), grey levels, of the picture with that light; and the light, as a share of that of a
    coating that faces the LEDs."""
    missed, slope = sight.missed(bench.change(ball)[sight.counts])
    white = slope * bench.white(ball)[sight.counts]
    more = -float((white * missed).sum()) / float((white * white).sum() + (MODEL_ERROR / LIKELY) ** 2)
    return missed + more * white, more
