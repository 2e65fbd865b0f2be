"""Linear tetrahedra with a co-rotated linear law: a solid for ``newton``, as Isaac Gym has it."""

from __future__ import annotations

import dataclasses

import numpy as np

from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid, Linearised, State
from tactile_core.mechanics.solids.neo_hookean import NeoHookean
from tactile_core.sensors import Material

from .tet_file import TetMesh


@dataclasses.dataclass(frozen=True)
class _Mesh:
    nodes: np.ndarray
    cells: np.ndarray
    clamped: np.ndarray


class CorotatedTets(FiniteStrainSolid):
    """Linear tetrahedra of energy mu |F - R|^2 + lambda / 2 tr(R^T F - I)^2, F = R S; a solid for ``newton``.

    Müller, Gross, Interactive Virtual Materials, Graphics Interface 2004; that Isaac Gym's finite elements take this
    law is the account of Narang et al., 2021 (not at hand: assumed).
    """

    def __init__(self, mesh: TetMesh, attached: np.ndarray, material: Material) -> None:
        self.mesh = _Mesh(mesh.nodes, mesh.cells, attached)
        self.shear = material.youngs / (2 * (1 + material.poisson))
        self.law = NeoHookean.from_material(material)  # newton asks for the bulk modulus alone
        self.lame = material.youngs * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))
        corners = mesh.nodes[mesh.cells]
        edges = (corners[:, 1:] - corners[:, :1]).swapaxes(1, 2)  # columns
        self.volume = np.linalg.det(edges) / 6
        inner = np.linalg.inv(edges)  # rows: gradients of the barycentric coordinates 1 to 3
        self.gradient = np.concatenate([-inner.sum(1, keepdims=True), inner], axis=1)  # (e, a, J)
        self.dofs = (3 * mesh.cells[..., None] + np.arange(3)).reshape(len(mesh.cells), 12)

    def rest(self) -> State:
        """Return the state without displacement; this solid has no pressure unknowns."""
        return State(np.zeros_like(self.mesh.nodes), np.zeros((len(self.mesh.cells), 0)))

    def deformation(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the deformation gradient F (n_cells, 3, 3) and its determinant (n_cells,)."""
        f = np.einsum("eai,eaj->eij", displacement[self.mesh.cells], self.gradient) + np.eye(3)
        return f, np.linalg.det(f)

    def energy(self, state: State) -> float:
        """Return the stored elastic energy, J."""
        _, stretch, _ = np.linalg.svd(self.deformation(state.displacement)[0])
        density = self.shear * ((stretch - 1) ** 2).sum(1) + self.lame / 2 * (stretch.sum(1) - 3) ** 2
        return float(density @ self.volume)

    def linearise(self, state: State) -> Linearised:
        """Compute residual and tangent at a state; raises FloatingPointError where a cell is turned inside out."""
        f, _ = self.deformation(state.displacement)
        if not (np.linalg.det(f) > 0).all():  # NaN, too
            raise FloatingPointError("a cell is turned inside out")
        stress, tangent = self.stress_tangent(f)
        force = np.einsum("e,eij,eaj->eai", self.volume, stress, self.gradient).reshape(-1, 12)
        tangent *= self.volume[:, None, None, None, None]
        half = tangent.swapaxes(1, 2).reshape(-1, 27, 3) @ self.gradient.swapaxes(1, 2)  # (e, J i k, b)
        stiffness = self.gradient @ half.reshape(-1, 3, 36)
        none = np.zeros((len(force), 0))  # pressures: none are unknown
        return Linearised(self, force, force, stiffness.reshape(-1, 4, 3, 3, 4), np.zeros((len(force), 0, 12)), none)

    def stress_tangent(self, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return first Piola-Kirchhoff stress (e, 3, 3) Pa and derivative (e, 3, 3, 3, 3) at F (e, 3, 3), det F > 0.

        The derivative of R has the three twists of F's axes as eigenvectors: Smith, de Goes, Kim, ACM Trans. Graph. 38,
        2019, section 4.
        """
        left, stretch, right = np.linalg.svd(f)
        rotation = left @ right
        growth = stretch.sum(1) - 3  # tr(S - I)
        stress = 2 * self.shear * (f - rotation) + (self.lame * growth)[:, None, None] * rotation
        flat = rotation.reshape(-1, 9)
        tangent = 2 * self.shear * np.eye(9) + self.lame * flat[:, :, None] * flat[:, None, :]
        for i, j in ((0, 1), (0, 2), (1, 2)):
            twist = left[:, :, i, None] * right[:, j, None, :] - left[:, :, j, None] * right[:, i, None, :]
            twist = twist.reshape(-1, 9)
            size = (self.lame * growth - 2 * self.shear) / (stretch[:, i] + stretch[:, j])
            tangent += size[:, None, None] * twist[:, :, None] * twist[:, None, :]
        return stress, tangent.reshape(-1, 3, 3, 3, 3)
