"""Finite-strain, nearly incompressible solid: neo-Hookean, Q2 displacement with a discontinuous linear pressure a cell.

Energy mu/2 (J^-2/3 I1 - 3) + p (J - 1) - p^2 / (2 kappa), p linear in each cell: the pressure is an independent Newton
iterate, eliminated cell by cell (mechanics.md). Simo, Taylor, Pister, Comput. Methods Appl. Mech. Eng. 51, 1985.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..sensors import Material
from .elasticity import reference_gradients
from .hex_mesh import HexMesh


@dataclasses.dataclass
class State:
    """displacement : (n, 3) m; pressure : (n_cells, 4) Pa, coefficients of 1, xi, eta, zeta (tension positive)."""

    displacement: np.ndarray
    pressure: np.ndarray

    def copy(self) -> State:
        """A state that can be changed alone."""
        return State(self.displacement.copy(), self.pressure.copy())


class FiniteStrainSolid:
    """Residual and tangent of a mesh of one material; see the module for the energy."""

    def __init__(self, mesh: HexMesh, material: Material) -> None:
        self.mesh = mesh
        self.shear = material.youngs / (2 * (1 + material.poisson))
        self.bulk = material.youngs / (3 * (1 - 2 * material.poisson))
        points, weights, reference = reference_gradients()
        jacobian = np.einsum("qak,ead->eqkd", reference, mesh.nodes[mesh.cells], optimize=True)
        self.weight = weights * np.linalg.det(jacobian)
        if not (self.weight > 0).all():
            raise ValueError("the mesh holds cells that are turned inside out")
        self.gradient = np.einsum("qak,eqdk->eqad", reference, np.linalg.inv(jacobian), optimize=True)
        self.linear = np.column_stack([np.ones(len(points)), points])
        self.mass = np.einsum("eq,qp,qr->epr", self.weight, self.linear, self.linear, optimize=True) / self.bulk
        dofs = (3 * mesh.cells[..., None] + np.arange(3)).reshape(len(mesh.cells), 81)
        self.dofs, self.rows, self.columns = dofs, np.repeat(dofs, 81, axis=1).ravel(), np.tile(dofs, (1, 81)).ravel()

    def rest(self) -> State:
        """No displacement, no pressure."""
        return State(np.zeros_like(self.mesh.nodes), np.zeros((len(self.mesh.cells), 4)))

    def deformation(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Deformation gradient F (n_cells, 27, 3, 3) and its determinant J (n_cells, 27)."""
        moved = displacement[self.mesh.cells]
        f = np.einsum("eai,eqaj->eqij", moved, self.gradient, optimize=True) + np.eye(3)
        return f, np.linalg.det(f)

    def energy(self, state: State) -> float:
        """Stored elastic energy, J."""
        f, j = self.deformation(state.displacement)
        p = state.pressure @ self.linear.T
        i1 = np.einsum("eqij,eqij->eq", f, f)
        density = self.shear / 2 * (j ** (-2 / 3) * i1 - 3) + p * (j - 1) - p**2 / (2 * self.bulk)
        return float((density * self.weight).sum())

    def linearise(self, state: State) -> Linearised:
        """Residual and tangent at a state; raises FloatingPointError where a cell is turned inside out."""
        f, j = self.deformation(state.displacement)
        if not (j > 0).all():
            raise FloatingPointError("a cell is turned inside out")
        p = state.pressure @ self.linear.T
        stress, tangent, cofactor = self._point_law(f, j, p)
        n = len(self.mesh.cells)
        residual = np.einsum("eq,eqij,eqaj->eai", self.weight, stress, self.gradient, optimize=True).reshape(n, 81)
        couple = np.einsum("eq,qp,eqij,eqaj->epai", self.weight, self.linear, cofactor, self.gradient, optimize=True)
        couple = couple.reshape(n, 4, 81)
        gap = np.einsum("eq,qp->ep", self.weight * (j - 1), self.linear) - np.einsum(
            "epr,er->ep", self.mass, state.pressure
        )
        stiffness = self._stiffness(tangent)
        to_pressure = np.linalg.solve(self.mass, couple)  # d(pressure) / d(displacement)
        pressure_gap = np.linalg.solve(self.mass, gap[..., None])[..., 0]
        stiffness += couple.swapaxes(1, 2) @ to_pressure
        condensed = residual + np.einsum("epi,ep->ei", couple, pressure_gap)
        return Linearised(self, residual, condensed, stiffness, to_pressure, pressure_gap)

    def _point_law(self, f: np.ndarray, j: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """First Piola-Kirchhoff stress, its derivative (..., 3, 3, 3, 3) and the cofactor J F^-T at all points."""
        g = np.linalg.inv(f).swapaxes(-1, -2)
        i1 = np.einsum("eqij,eqij->eq", f, f)
        scale = self.shear * j ** (-2 / 3)
        pj = p * j
        stress = scale[..., None, None] * (f - (i1 / 3)[..., None, None] * g) + pj[..., None, None] * g
        gg = np.einsum("eqij,eqkl->eqijkl", g, g)
        crossed = gg.transpose(0, 1, 2, 5, 4, 3)  # G_iL G_kJ
        fg = np.einsum("eqij,eqkl->eqijkl", f, g)
        tangent = -(2 / 3) * scale[..., None, None, None, None] * (fg + fg.transpose(0, 1, 4, 5, 2, 3))
        tangent += (2 / 9 * scale * i1 + pj)[..., None, None, None, None] * gg
        tangent += (scale * i1 / 3 - pj)[..., None, None, None, None] * crossed
        for i in range(3):
            for k in range(3):
                tangent[:, :, i, k, i, k] += scale
        return stress, tangent, j[..., None, None] * g

    def _stiffness(self, tangent: np.ndarray) -> np.ndarray:
        n = len(self.mesh.cells)
        stiffness = np.zeros((n, 81, 81))
        for q in range(27):
            gradient = self.gradient[:, q]  # (e, a, J)
            half = np.einsum("eijkl,ebl->eijbk", tangent[:, q] * self.weight[:, q, None, None, None, None], gradient)
            full = gradient @ half.transpose(0, 2, 1, 3, 4).reshape(n, 3, 3 * 81)  # (e, a, i b k)
            stiffness += full.reshape(n, 81, 81)
        return stiffness


@dataclasses.dataclass
class Linearised:
    """A solid's equations at one state, cell by cell, pressure eliminated."""

    solid: FiniteStrainSolid
    residual: np.ndarray
    condensed: np.ndarray
    stiffness: np.ndarray
    to_pressure: np.ndarray
    pressure_gap: np.ndarray

    def internal_force(self, *, condensed: bool = True) -> np.ndarray:
        """(3 n,) N; ``condensed`` with the pressure's own residual carried over, as the Newton step needs it."""
        values = self.condensed if condensed else self.residual
        size = 3 * len(self.solid.mesh.nodes)
        return np.bincount(self.solid.dofs.ravel(), values.ravel(), minlength=size)

    def matrix(self):  # noqa: ANN201 (scipy is imported only where it is needed)
        """Tangent stiffness, scipy CSC (3 n, 3 n), N/m."""
        import scipy.sparse

        size = 3 * len(self.solid.mesh.nodes)
        entries = (self.stiffness.ravel(), (self.solid.rows, self.solid.columns))
        return scipy.sparse.coo_matrix(entries, shape=(size, size)).tocsc()

    def pressure_step(self, step: np.ndarray) -> np.ndarray:
        """Change of the pressures (n_cells, 4) Pa that goes with a displacement step (n, 3) m."""
        local = step.reshape(-1)[self.solid.dofs]
        return np.einsum("epi,ei->ep", self.to_pressure, local) + self.pressure_gap
