"""Mooney-Rivlin law of two terms, nearly incompressible: C10 (J^-2/3 I1 - 3) + C01 (J^-4/3 I2 - 3)."""

from __future__ import annotations

import dataclasses

import numpy as np

from .neo_hookean import NeoHookean


@dataclasses.dataclass(frozen=True)
class MooneyRivlin:
    """A ``neo_hookean.Law``. c10, c01 : Pa, shear modulus 2 (c10 + c01) at small strain; bulk : kappa, Pa.

    R. S. Rivlin, D. W. Saunders, Phil. Trans. R. Soc. A 243, 1951; in isochoric invariants so that ``bulk`` alone
    resists a change of volume (G. A. Holzapfel, Nonlinear Solid Mechanics, 2000, section 6.5).
    """

    c10: float
    c01: float
    bulk: float

    def energy(self, f: np.ndarray, j: np.ndarray) -> np.ndarray:
        """See ``Law.energy``."""
        i1, i2, _ = _invariants(f)
        return self.c10 * (j ** (-2 / 3) * i1 - 3) + self.c01 * (j ** (-4 / 3) * i2 - 3)

    def stress_tangent(self, f: np.ndarray, j: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Law.stress_tangent``; the first term and the pressure are those of a neo-Hookean solid."""
        stress, tangent = NeoHookean(2 * self.c10, self.bulk).stress_tangent(f, j, p)
        g, one = np.linalg.inv(f).swapaxes(-1, -2), np.eye(3)
        i1, i2, c = _invariants(f)
        h = i1[..., None, None] * f - f @ c  # half the derivative of I2
        scale = (self.c01 * j ** (-4 / 3))[..., None, None]
        second = i2[..., None, None]
        stress = stress + scale * (2 * h - 4 / 3 * second * g)
        scale, second = scale[..., None, None], second[..., None, None]
        curve = 2 * _outer(f, f) - np.einsum("...iL,...kJ->...iJkL", f, f)  # dH/dF
        curve += np.einsum("ik,...JL->...iJkL", one, i1[..., None, None] * one - c)
        curve -= np.einsum("...ik,JL->...iJkL", f @ f.swapaxes(-1, -2), one)
        crossed = np.einsum("...iL,...kJ->...iJkL", g, g)
        part = 2 * curve - 8 / 3 * (_outer(h, g) + _outer(g, h)) + 4 / 3 * second * (4 / 3 * _outer(g, g) + crossed)
        return stress, tangent + scale * part


def _invariants(f: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """I1, I2 (...,) and C = F^T F (..., 3, 3)."""
    c = f.swapaxes(-1, -2) @ f
    i1 = np.einsum("...ii->...", c)
    return i1, (i1**2 - np.einsum("...ij,...ij->...", c, c)) / 2, c


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...iJ,...kL->...iJkL", a, b)
