"""Neo-Hookean law, nearly incompressible: mu/2 (J^-2/3 I1 - 3), volume change by a pressure of its own."""

from __future__ import annotations

import dataclasses
from typing import Protocol

import numpy as np

from ...sensors import Material
from .determinants import cofactors


class Law(Protocol):
    """A nearly incompressible material: isochoric energy, and the bulk modulus that the pressure works against."""

    bulk: float  # Pa

    def energy(self, f: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Return the isochoric energy density (...,) J/m3 of gradients f (..., 3, 3) with determinants j (...,)."""

    def stress_tangent(self, f: np.ndarray, j: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first Piola-Kirchhoff stress (..., 3, 3) Pa, with p J F^-T, and its derivative by F."""


@dataclasses.dataclass(frozen=True)
class NeoHookean:
    """Nearly incompressible neo-Hookean law.

    shear : mu, Pa; bulk : kappa, Pa. Simo, Taylor, Pister, Comput. Methods Appl. Mech. Eng. 51, 1985.
    """

    shear: float
    bulk: float

    @classmethod
    def from_material(cls, material: Material) -> NeoHookean:
        """Return mu = E / (2 (1 + nu)) and kappa = E / (3 (1 - 2 nu)), linear elasticity at small strain."""
        shear = material.youngs / (2 * (1 + material.poisson))
        return cls(shear, material.youngs / (3 * (1 - 2 * material.poisson)))

    def energy(self, f: np.ndarray, j: np.ndarray) -> np.ndarray:
        """See ``Law.energy``."""
        return self.shear / 2 * (j ** (-2 / 3) * np.einsum("...ij,...ij->...", f, f) - 3)

    def stress_tangent(self, f: np.ndarray, j: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Law.stress_tangent``."""
        g = cofactors(f) / j[..., None, None]
        i1 = np.einsum("...ij,...ij->...", f, f)
        scale, pj = self.shear * j ** (-2 / 3), p * j
        stress = scale[..., None, None] * f + (pj - scale * i1 / 3)[..., None, None] * g
        flat = (*j.shape, 9)
        f9, g9 = f.reshape(flat), g.reshape(flat)
        # P' = scale I - (2/3) scale (F x G + G x F) + (2/9 scale I1 + pJ) G x G + (scale I1 / 3 - pJ) G_iL G_kJ
        left = (2 / 9 * scale * i1 + pj)[..., None] * g9 - (2 / 3 * scale)[..., None] * f9
        tangent = left[..., :, None] * g9[..., None, :]
        tangent -= ((2 / 3 * scale)[..., None] * g9)[..., :, None] * f9[..., None, :]
        tangent = tangent.reshape(*j.shape, 3, 3, 3, 3)
        crossed = ((scale * i1 / 3 - pj)[..., None, None] * g)[..., :, None, None, :] * g.swapaxes(-1, -2)[
            ..., None, :, :, None
        ]
        tangent += crossed
        diagonal = np.einsum("...ijij->...ij", tangent)
        diagonal += scale[..., None, None]
        return stress, tangent
