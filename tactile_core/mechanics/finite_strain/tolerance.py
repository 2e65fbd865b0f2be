"""Criteria that end Newton's iteration for a contact of finite strain."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Tolerance:
    """Criteria that end an iteration.

    gap : m, of every touching node; balance : of the largest nodal force and of the fluid's volume, before the last
        step; step : m, a last step so small that, Newton's method being quadratic, the balance after it is good
    """

    gap: float
    balance: float
    step: float = 0.0


EXACT = Tolerance(1e-9, 1e-8, 1e-13)
