"""Finite-strain, nearly incompressible solid: Q2 displacement with a discontinuous linear pressure per cell.

Energy W(F) + p (J - 1) - p^2 / (2 kappa), p linear in each cell: the pressure is an independent Newton iterate,
eliminated cell by cell. Simo, Taylor, Pister, Comput. Methods Appl. Mech. Eng. 51, 1985.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...sensors import Material
from .block_pattern import BlockPattern
from .elasticity import reference_gradients
from .hex_mesh import HexMesh

# Over the shear modulus, for the gel; the skin, which bends, does not need it, and would be 2 % stiffer. On the graded
# gel under a 7 mm ball at 0.6 mm, against the mesh twice as fine, 0 and 5 give errors of -0.3 and +0.1 % of force, 1.3
# and 1.1 um of shape.
SHARE = 4.0


@dataclasses.dataclass(frozen=True)
class NeoHookean:
    """Nearly incompressible neo-Hookean law.

    shear : mu, Pa; bulk : kappa, Pa, the bulk modulus that acts through each cell's pressure
    at_points : Pa, a part of the bulk modulus that acts at each Gauss point, so that coarse cells do not buckle. If the
        cell's pressure alone held the volume, a Gauss point could lose half of its volume to the next one: under a
        sharp edge, or deep under a small ball, coarse cells then buckle. Fine meshes have the same limit
    """

    shear: float
    bulk: float
    at_points: float = 0.0

    @classmethod
    def from_material(cls, material: Material, *, split: bool = False) -> NeoHookean:
        """Make the law that at small strain is linear: mu = E / (2 (1 + nu)), kappa = E / (3 (1 - 2 nu)).

        split : true to let 4 mu (``SHARE``) of kappa act at the Gauss points (``at_points``)"""
        shear = material.youngs / (2 * (1 + material.poisson))
        at_points = SHARE * shear if split else 0.0
        return cls(shear, material.youngs / (3 * (1 - 2 * material.poisson)) - at_points, at_points)

    def energy(self, f: np.ndarray, j: np.ndarray) -> np.ndarray:
        """Return the energy density W(F) (...,) J/m3, without the pressure's terms p (J - 1) - p^2 / (2 kappa).
        f, j : F (..., 3, 3) and its determinant J (...)"""
        isochoric = self.shear / 2 * (j ** (-2 / 3) * np.einsum("...ij,...ij->...", f, f) - 3)
        return isochoric + self.at_points / 2 * (j - 1) ** 2

    def stress_tangent(self, f: np.ndarray, j: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the first Piola-Kirchhoff stress (..., 3, 3) Pa, p J F^-T included, and its derivative (..., 3, 3, 3,
        3) Pa with respect to F.
        f, j : F (..., 3, 3) and its determinant J (...); p : (...) Pa, pressure of the cells, tension positive"""
        cofactor = cofactors(f)
        g = cofactor / j[..., None, None]  # F^-T
        i1 = np.einsum("...ij,...ij->...", f, f)
        scale, pj = self.shear * j ** (-2 / 3), (p + self.at_points * (j - 1)) * j
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
        if self.at_points:
            tangent += self.at_points * cofactor[..., :, :, None, None] * cofactor[..., None, None, :, :]
        return stress, tangent


def cofactors(f: np.ndarray) -> np.ndarray:
    """Return the cofactors (..., 3, 3) J F^-T of matrices f (..., 3, 3); much faster, written out, than by LAPACK."""
    a, b, c = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    answer = np.empty_like(f)
    for row, first, second in ((0, b, c), (1, c, a), (2, a, b)):
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            answer[..., row, k] = first[..., i] * second[..., j] - first[..., j] * second[..., i]
    return answer


def determinants(f: np.ndarray) -> np.ndarray:
    """Return the determinants (...) of matrices f (..., 3, 3)."""
    a, b, c = f[..., 0, :], f[..., 1, :], f[..., 2, :]
    minors = (b[..., (k + 1) % 3] * c[..., (k + 2) % 3] - b[..., (k + 2) % 3] * c[..., (k + 1) % 3] for k in range(3))
    return sum(a[..., k] * minor for k, minor in enumerate(minors))


_BATCH = 32  # cells whose stiffness is made at once: what they need stays in the processor's cache


@dataclasses.dataclass
class State:
    """State of a solid.

    displacement : (n, 3) m; pressure : (n_cells, 4) Pa, coefficients of 1, xi, eta, zeta (tension positive).
    """

    displacement: np.ndarray
    pressure: np.ndarray

    def copy(self) -> State:
        """Return a copy that can be changed without changing this state."""
        return State(self.displacement.copy(), self.pressure.copy())


class FiniteStrainSolid:
    """Residual and tangent stiffness of a mesh of one material; the module states the energy.

    material : the law, or linear constants to make it of (``NeoHookean.from_material``, not split)
    pattern : of the mesh's cells; None: made at first use. Raises ValueError for cells that are turned inside out"""

    def __init__(self, mesh: HexMesh, material: Material | NeoHookean, pattern: BlockPattern | None = None) -> None:
        self.mesh = mesh
        self.law = NeoHookean.from_material(material) if isinstance(material, Material) else material
        if pattern is not None:
            self.pattern = pattern
        points, weights, reference = reference_gradients()
        n = len(mesh.cells)
        corners = np.ascontiguousarray(mesh.nodes[mesh.cells].swapaxes(1, 2))  # (e, d, a)
        jacobian = (corners @ reference.transpose(1, 0, 2).reshape(27, 81)).reshape(n, 3, 27, 3).swapaxes(1, 2)
        self.weight = weights * np.linalg.det(jacobian)
        if not (self.weight > 0).all():
            raise ValueError("the mesh holds cells that are turned inside out")
        self.gradient = reference @ np.linalg.inv(jacobian)  # (e, q, a, d)
        self._by_node = np.ascontiguousarray(self.gradient.transpose(0, 2, 1, 3)).reshape(n, 27, 81)
        self._by_point = np.ascontiguousarray(self.gradient.swapaxes(2, 3))
        self.linear = np.column_stack([np.ones(len(points)), points])
        self.mass = np.einsum("eq,qp,qr->epr", self.weight, self.linear, self.linear, optimize=True) / self.law.bulk
        self.dofs = (3 * mesh.cells[..., None] + np.arange(3)).reshape(n, 81)

    @functools.cached_property
    def pattern(self) -> BlockPattern:
        """Sparsity pattern of the stiffness matrix."""
        return BlockPattern(self.mesh.cells, self.mesh.clamped)

    def rest(self) -> State:
        """Return the state without displacement and pressure."""
        return State(np.zeros_like(self.mesh.nodes), np.zeros((len(self.mesh.cells), 4)))

    def deformation(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the deformation gradient F (n_cells, 27, 3, 3) at Gauss points and its determinant J (n_cells, 27),
        under displacement (n, 3) m."""
        moved = displacement[self.mesh.cells].swapaxes(1, 2)
        f = (moved @ self._by_node).reshape(-1, 3, 27, 3).swapaxes(1, 2) + np.eye(3)
        return f, determinants(f)

    def energy(self, state: State) -> float:
        """Return the stored elastic energy, J."""
        f, j = self.deformation(state.displacement)
        p = state.pressure @ self.linear.T
        density = self.law.energy(f, j) + p * (j - 1) - p**2 / (2 * self.law.bulk)
        return float((density * self.weight).sum())

    def linearise(self, state: State) -> Linearised:
        """Compute residual and tangent at a state. Raises FloatingPointError if a cell is turned inside out."""
        f, j = self.deformation(state.displacement)
        if not (j > 0).all():  # NaN, too
            raise FloatingPointError("a cell is turned inside out")
        p = state.pressure @ self.linear.T
        n = len(j)
        residual, couple = np.empty((n, 27, 3)), np.empty((n, 27, 4, 3))
        stiffness = np.empty((n, 27, 3, 3, 27))
        for start in range(0, n, _BATCH):
            part = slice(start, start + _BATCH)
            self._cells(part, f[part], j[part], p[part], residual, couple, stiffness)
        gap = (self.weight * (j - 1)) @ self.linear - np.einsum("epr,er->ep", self.mass, state.pressure)
        couple = couple.swapaxes(1, 2)  # (e, p, a, i)
        to_pressure = np.linalg.solve(self.mass, couple.reshape(n, 4, 81)).reshape(n, 4, 27, 3)
        pressure_gap = np.linalg.solve(self.mass, gap[..., None])[..., 0]
        by_dof = couple.reshape(n, 4, 81).swapaxes(1, 2)
        stiffness += (by_dof @ to_pressure.swapaxes(2, 3).reshape(n, 4, 81)).reshape(n, 27, 3, 3, 27)
        by_cell = residual.reshape(n, 81)
        condensed = by_cell + (by_dof @ pressure_gap[..., None])[..., 0]
        return Linearised(self, by_cell, condensed, stiffness, to_pressure.reshape(n, 4, 81), pressure_gap)

    def _cells(self, part, f, j, p, residual, couple, stiffness) -> None:  # noqa: ANN001
        """Fill in internal forces, residual[part] (e, 27, 3), pressure coupling (e, 27, 4, 3) and stiffness of the
        cells in the slice ``part``, from gradients f, determinants j and pressures p at their Gauss points."""
        stress, tangent = self.law.stress_tangent(f, j, p)
        by_node, n = self._by_node[part], len(j)
        weight = self.weight[part]
        along = (weight[..., None, None] * stress).swapaxes(2, 3)  # (e, q, J, i)
        residual[part] = by_node @ along.reshape(n, 81, 3)
        cofactor = weight[..., None, None] * cofactors(f).swapaxes(-1, -2)  # (e, q, J, i)
        spread = cofactor[:, :, :, None, :] * self.linear[:, None, :, None]
        couple[part] = (by_node @ spread.reshape(n, 81, 12)).reshape(n, 27, 4, 3)
        tangent = weight[..., None, None, None, None] * tangent.transpose(0, 1, 3, 2, 4, 5)  # (e, q, J, i, k, L)
        half = np.ascontiguousarray(tangent).reshape(n, 27, 27, 3) @ self._by_point[part]
        stiffness[part] = (by_node @ half.reshape(n, 81, 243)).reshape(n, 27, 3, 3, 27)


@dataclasses.dataclass
class Linearised:
    """A solid's linearised equations at one state, cell by cell, pressure eliminated.
    residual : (n_cells, 81) N, internal forces; condensed : the same plus what eliminating the pressures adds
    stiffness : (n_cells, 27, 3, 3, 27) N/m, (node, axis, axis, node)
    to_pressure : (n_cells, 4, 81) Pa/m, change of pressures per step of displacement; pressure_gap : (n_cells, 4) Pa,
        their change without a step"""

    solid: FiniteStrainSolid
    residual: np.ndarray
    condensed: np.ndarray
    stiffness: np.ndarray
    to_pressure: np.ndarray
    pressure_gap: np.ndarray

    def internal_force(self, *, condensed: bool = True) -> np.ndarray:
        """Return the internal force (3 n,) N on nodes, xyz each, summed over cells: of ``condensed``, which the Newton
        step needs, or (false) of ``residual``."""
        values = self.condensed if condensed else self.residual
        size = 3 * len(self.solid.mesh.nodes)
        return np.bincount(self.solid.dofs.ravel(), values.ravel(), minlength=size)

    def blocks(self) -> np.ndarray:
        """Return the tangent stiffness (n_blocks, 3, 3) N/m in the order of the solid's pattern."""
        return self.solid.pattern.gather(self.stiffness)

    def matrix(self):  # noqa: ANN201 (scipy is imported only where it is needed)
        """Assemble the tangent stiffness, scipy CSC (3 n, 3 n), N/m."""
        return self.solid.pattern.sparse(self.blocks()).tocsc()

    def pressure_step(self, step: np.ndarray) -> np.ndarray:
        """Return the change of the cells' pressures (n_cells, 4) Pa that goes with a step (n, 3) m of displacement."""
        local = step.reshape(-1)[self.solid.dofs]
        return np.einsum("epi,ei->ep", self.to_pressure, local) + self.pressure_gap
