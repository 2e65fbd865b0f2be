"""Neo-Hookean law, nearly incompressible: W = mu/2 (J^-2/3 I1 - 3), volume change by a pressure p of its own.

F = I + grad u, J = det F, I1 = tr(F^T F); the first Piola-Kirchhoff stress is
P = mu J^-2/3 (F - I1/3 F^-T) + p J F^-T.
"""

from __future__ import annotations

import dataclasses
from typing import Protocol

import numpy as np

from ...sensors import Material


class Law(Protocol):
    """A nearly incompressible material: isochoric energy, and the bulk modulus that the pressure works against."""

    @property
    def bulk(self) -> float:
        """Bulk modulus, Pa."""

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
        g = cofactors(f) / j[..., None, None]  # F^-T
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


def cofactors(f: np.ndarray) -> np.ndarray:
    """Return the cofactors (..., 3, 3) J F^-T of matrices; written out, several times faster than LAPACK one by one."""
    a, b, c = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    answer = np.empty_like(f)
    for row, first, second in ((0, b, c), (1, c, a), (2, a, b)):
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            answer[..., row, k] = first[..., i] * second[..., j] - first[..., j] * second[..., i]
    return answer


def determinants(f: np.ndarray) -> np.ndarray:
    """Return the determinants (...,) of matrices (..., 3, 3)."""
    a, b, c = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    minors = (b[..., (k + 1) % 3] * c[..., (k + 2) % 3] - b[..., (k + 2) % 3] * c[..., (k + 1) % 3] for k in range(3))
    return sum(a[..., k] * minor for k, minor in enumerate(minors))


# Of the shear modulus, for the gel; the skin, which bends, does not need it, and would be 2 % stiffer. Measured on the
# graded gel under a 7 mm ball against the mesh twice as fine: 0 and 5 give -0.3 and +0.1 % of force, 1.3 and 1.1 um
# of shape at 0.6 mm.
SHARE = 4.0


@dataclasses.dataclass(frozen=True)
class SplitBulkModulus:
    """A law with ``at_points`` Pa of its bulk modulus at each point, which keeps coarse cells from buckling.

    With the volume held by the cell's pressure alone, a Gauss point may give up half of its volume where the next one
    gains it: under a sharp edge, or deep under a small ball, coarse cells then buckle. A small part of the modulus that
    acts at each point forbids it. The sum is the material's own modulus, so the limit of fine meshes is the same.
    """

    law: NeoHookean
    at_points: float

    @classmethod
    def from_law(cls, law: NeoHookean) -> SplitBulkModulus:
        """Split off ``SHARE`` shear moduli at the points."""
        return cls(law, SHARE * law.shear)

    @property
    def bulk(self) -> float:
        """Return the bulk modulus, Pa, that the cells' pressures carry."""
        return self.law.bulk - self.at_points

    def energy(self, f: np.ndarray, j: np.ndarray) -> np.ndarray:
        """See ``Law.energy``."""
        return self.law.energy(f, j) + self.at_points / 2 * (j - 1) ** 2

    def stress_tangent(self, f: np.ndarray, j: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Law.stress_tangent``."""
        stress, tangent = self.law.stress_tangent(f, j, p + self.at_points * (j - 1))
        cofactor = cofactors(f)
        tangent += self.at_points * cofactor[..., :, :, None, None] * cofactor[..., None, None, :, :]
        return stress, tangent
