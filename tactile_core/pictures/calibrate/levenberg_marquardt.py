"""Levenberg-Marquardt's damped Gauss-Newton method for sums of squares, by their normal equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

START_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-7, 1e6
EASIER, HARDER = 0.2, 8.0  # factors of the damping after a step that helped, and after one that did not


class Problem(Protocol):
    """A sum of squares over parameters x (n,)."""

    def cost(self, x: np.ndarray) -> float:
        """Return half the sum of squares at x; infinity where x is meaningless."""

    def normal_equations(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return Gauss-Newton's matrix (n, n) and the cost's gradient (n,), at the last accepted x."""


def minimise(
    problem: Problem, x: np.ndarray, *, most: int, tolerance: float, progress: Callable[[int], None] = lambda _: None
) -> tuple[np.ndarray, float]:
    """Find a minimum near x and its cost, after ``most`` steps or once a step gains less than a share ``tolerance``."""
    cost, damping = problem.cost(x), START_DAMPING
    for step in range(most):
        matrix, gradient = problem.normal_equations(x)
        before = cost
        while True:
            damped = matrix + np.diag(damping * np.diag(matrix) + 1e-12 * np.trace(matrix))
            trial = x - np.linalg.solve(damped, gradient)
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
