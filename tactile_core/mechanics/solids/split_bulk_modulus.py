"""A law whose bulk modulus is shared between each point and the cell's pressure: keeps coarse cells from buckling.

With the volume held by the cell's pressure alone, a Gauss point may give up half of its volume where the next one gains
it: under a sharp edge, or deep under a small ball, coarse cells then buckle. A small part of the modulus that acts at
each point forbids it. The sum is the material's own modulus, so the limit of fine meshes is the same.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from .determinants import cofactors
from .neo_hookean import NeoHookean

# Of the shear modulus, for the gel; the skin, which bends, does not need it, and would be 2 % stiffer. Measured on the
# graded gel under a 7 mm ball against the mesh twice as fine: 0 and 5 give -0.3 and +0.1 % of force, 1.3 and 1.1 um
# of shape at 0.6 mm.
SHARE = 4.0


@dataclasses.dataclass(frozen=True)
class SplitBulkModulus:
    """A law with ``at_points`` Pa of its bulk modulus at each point. See ``neo_hookean.Law``."""

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
