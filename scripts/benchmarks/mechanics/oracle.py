"""Check the finite-strain solid against scikit-fem, which assembles the same energy, forces, coupling and tangent;
derivatives of the material law are taken by complex steps."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid, State
from tactile_core.mechanics.solids.hex_mesh import HexMesh
from tactile_core.sensors import Material

from .block import block

TARGET = 1e-12  # relative; rounding of sums of a hundred products
_H = 1e-30  # complex step
_MATERIAL = Material(1e6, 0.49)


def skewed() -> FiniteStrainSolid:
    """Make 2 x 2 x 2 skewed cells. Edges are straight, since scikit-fem defines its hexahedra by eight corners."""
    planes = np.linspace(-1e-3, 1e-3, 5)
    mesh = block(planes, planes[::-1], planes)
    x, y, z = mesh.nodes.T / 1e-3
    nodes = mesh.nodes + 1e-4 * np.stack([y * z, 0.5 * z * x, x * y], -1) + 1e-4 * np.stack([y, z, x], -1)
    return FiniteStrainSolid(HexMesh(nodes, mesh.cells, mesh.clamped, mesh.surface, mesh.inner), _MATERIAL)


def disturbed(solid: FiniteStrainSolid) -> State:
    """Return a random finite deformation with random pressures, always the same."""
    random = np.random.default_rng(3)
    moved = solid.mesh.nodes @ random.uniform(-0.2, 0.2, (3, 3)).T
    moved += 2e-5 * random.standard_normal(moved.shape)
    return State(moved, 1e5 * random.standard_normal((len(solid.mesh.cells), 4)))


def differences() -> dict[str, float]:
    """Return name -> largest relative difference from scikit-fem: energy, force, condensed_force, tangent, ..."""
    solid = skewed()
    state = disturbed(solid)
    other = _Other(solid.mesh, state)
    lines = solid.linearise(state)
    step = np.random.default_rng(4).standard_normal(state.displacement.shape) * 1e-5
    pairs = {
        "energy": (solid.energy(state), other.energy),
        "force": (lines.internal_force(condensed=False), other.force),
        "condensed_force": (lines.internal_force(), other.force + other.couple.T @ other.solve(other.gap)),
        "tangent": (lines.matrix().toarray(), other.tangent + other.couple.T @ other.solve(other.couple)),
        "pressure_step": (
            lines.pressure_step(step).ravel(), other.solve(other.couple @ step.ravel() + other.gap),
        ),
    }  # fmt: skip
    return {name: float(np.abs(mine - its).max() / np.abs(its).max()) for name, (mine, its) in pairs.items()}


class _Other:
    """The same equations, of a mesh in a given state, assembled by scikit-fem: dense, its unknowns in our order."""

    def __init__(self, mesh: HexMesh, state: State) -> None:
        import skfem

        corners = np.array([0, 2, 6, 8, 18, 20, 24, 26])  # of our 27, (xi, eta, zeta) = -1 or 1
        cells = mesh.cells[:, corners]
        used, inverse = np.unique(cells, return_inverse=True)
        self.mesh = mesh
        points = mesh.nodes[used]
        topology = inverse.reshape(cells.shape)
        # scikit-fem's corners: (1,1,1) (1,1,0) (1,0,1) (0,1,1) (1,0,0) (0,1,0) (0,0,1) (0,0,0) of its unit cube
        its = topology[:, [7, 3, 5, 6, 1, 2, 4, 0]]
        hexes = skfem.MeshHex(points.T.copy(), its.T.copy(), sort_t=False)
        element = skfem.ElementVector(skfem.ElementHex2())
        self.basis = skfem.Basis(hexes, element, intorder=5)
        self.order = self._numbering()
        field = np.zeros(self.basis.N)
        field[self.order.ravel()] = state.displacement.ravel()
        local = 2 * self.basis.X - 1  # (3, q), our reference cube
        self.linear = np.concatenate([np.ones((1, local.shape[1])), local])
        self.pressure = np.einsum("ep,pq->eq", state.pressure, self.linear)
        self._assemble(self.basis.interpolate(field).grad)

    def _numbering(self) -> np.ndarray:
        """Return scikit-fem's number (n, 3) of each degree of freedom of our nodes, found by the nodes' places."""
        places = self.basis.doflocs.T
        axes, dofs = np.empty(self.basis.N, int), self.basis.dofs
        for table in (dofs.nodal_dofs, dofs.edge_dofs, dofs.facet_dofs, dofs.interior_dofs):
            axes[table] = np.arange(3)[:, None]
        order = np.empty((len(self.mesh.nodes), 3), int)
        for axis in range(3):
            mine = np.flatnonzero(axes == axis)
            distance = np.linalg.norm(self.mesh.nodes[:, None] - places[mine], axis=2)
            order[:, axis] = mine[distance.argmin(1)]
        return order

    def _assemble(self, gradient: np.ndarray) -> None:
        """Compute energy, force, tangent, and the pressures' coupling, mass and gap; stress and tangent are derivatives
        by complex steps of F. gradient : (3, 3, cell, point), of the displacement"""
        import skfem

        shear = _MATERIAL.youngs / (2 * (1 + _MATERIAL.poisson))
        bulk = _MATERIAL.youngs / (3 * (1 - 2 * _MATERIAL.poisson))
        f = gradient + np.eye(3)[:, :, None, None]
        weight, p = self.basis.dx, self.pressure
        change = _determinant(f) - 1
        self.energy = float((weight * (_density(f, shear) + p * change - p**2 / (2 * bulk))).sum())
        stress, cofactor, tangent = np.empty(f.shape), np.empty(f.shape), np.empty((3, 3, *f.shape))
        for i in range(3):
            for k in range(3):
                bumped = f.astype(complex)
                bumped[i, k] += 1j * _H
                stress[i, k] = _density(bumped, shear).imag / _H + p * _determinant(bumped).imag / _H
                cofactor[i, k] = _determinant(bumped).imag / _H
                tangent[:, :, i, k] = _stress(bumped, p, shear).imag / _H
        keep = self.order.ravel()
        self.force = np.asarray(
            skfem.LinearForm(lambda v, _: np.einsum("ij...,ij...->...", stress, v.grad)).assemble(self.basis)
        )[keep]
        form = skfem.BilinearForm(lambda u, v, _: np.einsum("ij...,ijkl...,kl...->...", v.grad, tangent, u.grad))
        self.tangent = form.assemble(self.basis).toarray()[np.ix_(keep, keep)]
        n = len(self.pressure)
        self.couple, self.mass, self.gap = np.zeros((4 * n, len(keep))), np.zeros((4 * n, 4 * n)), np.zeros(4 * n)
        for cell in range(n):
            here = np.zeros((n, 1))
            here[cell] = 1
            for k in range(4):
                shape = self.linear[k] * here
                form = skfem.LinearForm(lambda v, _, s=shape: s * np.einsum("ij...,ij...->...", cofactor, v.grad))
                self.couple[4 * cell + k] = np.asarray(form.assemble(self.basis))[keep]
                self.gap[4 * cell + k] = (weight * shape * (change - p / bulk)).sum()
                for m in range(4):
                    self.mass[4 * cell + k, 4 * cell + m] = (weight * shape * self.linear[m]).sum() / bulk

    def solve(self, values: np.ndarray) -> np.ndarray:
        """Return the pressures (4 n_cells,) to volume excesses ``values`` (4 n_cells,), or to columns of these."""
        return np.linalg.solve(self.mass, values)


def _determinant(f: np.ndarray) -> np.ndarray:
    """Return the determinants (...) of f (3, 3, ...), by cofactors of the first row, which admits complex steps."""
    minors = [f[1, (k + 1) % 3] * f[2, (k + 2) % 3] - f[1, (k + 2) % 3] * f[2, (k + 1) % 3] for k in range(3)]
    return sum(f[0, k] * minors[k] for k in range(3))


def _density(f: np.ndarray, shear: float) -> np.ndarray:
    """Return the isochoric neo-Hookean energy density (...) (docs/sources.md, Mechanics).
    f : (3, 3, ...), deformation gradient; shear : modulus, Pa"""
    return shear / 2 * (_determinant(f) ** (-2 / 3) * (f * f).sum((0, 1)) - 3)


def _stress(f: np.ndarray, p: np.ndarray, shear: float) -> np.ndarray:
    """Return the first Piola-Kirchhoff stress (3, 3, ...), complex as f is.
    f : (3, 3, ...), deformation gradient; p : (...) Pa, pressure; shear : modulus, Pa"""
    j = _determinant(f)
    inverse = np.moveaxis(np.linalg.inv(np.moveaxis(f, (0, 1), (-2, -1))), (-1, -2), (0, 1))
    return shear * j ** (-2 / 3) * (f - (f * f).sum((0, 1)) / 3 * inverse) + p * j * inverse


def rows(quick: bool) -> Iterator[Row]:
    """Yield a row for each of ``differences``; none if scikit-fem is not installed. quick : changes nothing"""
    try:
        found = differences()
    except ImportError:
        return
    for name, value in found.items():
        of = "8 skewed cells, random finite strain"
        yield row(f"oracle_{name}_difference", value, "1", TARGET, baseline=1.0, of=of)
