"""An axisymmetric counterpart of the reference tier's solid: the same material and contact on a mesh of the half plane.

Cells are quadratic quadrilaterals with a linear discontinuous pressure. Coordinates (x, y, z) are (radius, axis, hoop).
A node keeps three degrees of freedom, the hoop's fixed, so that ``newton.FiniteStrainContact`` takes this solid as it
takes the three-dimensional one. Forces and energies are those of the whole turn.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from tactile_core.geometry.indenters import Indenter, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.finite_strain.solved_contact import ContactState, Tolerance
from tactile_core.mechanics.solids.block_pattern import BlockPattern
from tactile_core.mechanics.solids.elasticity import quadratic
from tactile_core.mechanics.solids.finite_strain import Linearised, NeoHookean, State
from tactile_core.sensors import Material

_POINT, _WEIGHT = np.polynomial.legendre.leggauss(3)
_ENTRIES = [0, 1, 3, 4, 8]  # of F (3, 3) as 9 numbers: those that axial symmetry leaves


@dataclasses.dataclass(frozen=True)
class QuadMesh:
    """Axisymmetric mesh.

    nodes : (n, 3) m, x >= 0 and z = 0; clamped : (n,) bool, nodes on the bonded side
    cells : (n_cells, 9) node numbers; entry a + 3 b is the node at (xi, eta) = (a - 1, b - 1)
    surface : (k,) node numbers of the free side, from the axis outward
    """

    nodes: np.ndarray
    cells: np.ndarray
    clamped: np.ndarray
    surface: np.ndarray

    @property
    def fixed(self) -> np.ndarray:
        """Mask (3 n,) bool of the fixed degrees of freedom: of clamped nodes, all hoops, and the radius on the axis."""
        fixed = np.repeat(self.clamped, 3).reshape(-1, 3)
        fixed[:, 2] = True
        fixed[self.nodes[:, 0] == 0, 0] = True
        return fixed.ravel()


def disc(radii: np.ndarray, heights: np.ndarray) -> QuadMesh:
    """Make the mesh of a disc bonded at y = 0 with its free side toward -y.

    radii (n,), heights (m,) : m, of the nodes, each beginning with 0; n and m odd
    The second radius is moved outward by a tenth: were that node in the middle of its cell, a constant pressure would
    put no force on the node on the axis, contact would lose that node, and the cell would buckle."""
    radii = np.r_[radii[0], 1.1 * radii[1], radii[2:]]
    nodes = np.zeros((len(radii), len(heights), 3))
    nodes[..., 0], nodes[..., 1] = radii[:, None], -heights
    ids = np.arange(nodes[..., 0].size).reshape(nodes.shape[:2])
    up = ids[:, ::-1]
    cells = [up[a : up.shape[0] - 2 + a : 2, b : up.shape[1] - 2 + b : 2] for b in range(3) for a in range(3)]
    clamped = np.zeros(ids.size, bool)
    clamped[ids[:, 0]] = True
    return QuadMesh(nodes.reshape(-1, 3), np.stack(cells, -1).reshape(-1, 9), clamped, ids[:, -1])


def graded(even: float, spacing: float, end: float, growth: float) -> np.ndarray:
    """Return an odd number of places, m, from 0 to ``end`` m: about ``spacing`` m apart up to ``even`` m, then in steps
    that grow by the factor ``growth``."""
    inside = np.linspace(0, even, 2 * max(round(even / spacing / 2), 1) + 1)
    steps = [spacing * growth]
    while sum(steps) < end - even:
        steps.append(steps[-1] * growth)
    steps += [steps[-1] * growth] * (len(steps) % 2)
    outside = even + np.cumsum(steps) * (end - even) / sum(steps)
    return np.r_[inside, outside]


class AxisymmetricSolid:
    """Residual and tangent of a ``QuadMesh`` of one material; the counterpart of ``FiniteStrainSolid``."""

    def __init__(self, mesh: QuadMesh, law: NeoHookean) -> None:
        self.mesh, self.law = mesh, law
        points, weights, shape, slopes = _reference()
        corners = mesh.nodes[mesh.cells][..., :2]
        jacobian = np.einsum("qak,ead->eqkd", slopes, corners)
        radius = np.einsum("qa,ea->eq", shape, corners[..., 0])
        self.weight = 2 * np.pi * radius * weights * np.linalg.det(jacobian)
        if not (self.weight > 0).all():
            raise ValueError("the mesh holds cells that are turned inside out")
        gradient = np.einsum("qak,eqdk->eqad", slopes, np.linalg.inv(jacobian))
        n, q = self.weight.shape
        self.strain = np.zeros((n, q, 5, 9, 3))  # d(entries of F) / d(node, axis)
        self.strain[:, :, 0, :, 0], self.strain[:, :, 1, :, 0] = gradient[..., 0], gradient[..., 1]
        self.strain[:, :, 2, :, 1], self.strain[:, :, 3, :, 1] = gradient[..., 0], gradient[..., 1]
        self.strain[:, :, 4, :, 0] = shape / radius[..., None]
        self.strain = self.strain.reshape(n, q, 5, 27)
        self.linear = np.column_stack([np.ones(len(points)), points])
        self.mass = np.einsum("eq,qp,qr->epr", self.weight, self.linear, self.linear) / law.bulk
        self.dofs = (3 * mesh.cells[..., None] + np.arange(3)).reshape(n, 27)
        self.pattern = BlockPattern(mesh.cells, mesh.clamped)

    def rest(self) -> State:
        """Return the state without displacement and pressure."""
        return State(np.zeros_like(self.mesh.nodes), np.zeros((len(self.mesh.cells), 3)))

    def deformation(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return F (n_cells, 9, 3, 3), the deformation gradient, and det F (n_cells, 9), by displacement (n, 3) m."""
        f, change = self._deformation(displacement)
        return f, 1 + change

    def _deformation(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return F and J - 1 = det F - 1 by a displacement (n, 3) m. J - 1 is summed from F - 1, since a large bulk
        modulus would magnify the rounding of J."""
        h = np.einsum("eqci,ei->eqc", self.strain, displacement.ravel()[self.dofs], optimize=True)
        rr, ra, ar, aa, hoop = np.moveaxis(h, -1, 0)
        plane = rr + aa + rr * aa - ra * ar
        f = np.zeros((*self.weight.shape, 9))
        f[..., _ENTRIES] = h
        return f.reshape(*self.weight.shape, 3, 3) + np.eye(3), plane + hoop + plane * hoop

    def linearise(self, state: State) -> Linearised:
        """Compute residual and tangent at a state. Raises FloatingPointError if a cell is turned inside out."""
        f, change = self._deformation(state.displacement)
        j = 1 + change
        if not (j > 0).all():
            raise FloatingPointError("a cell is turned inside out")
        stress, tangent = self.law.stress_tangent(f, j, state.pressure @ self.linear.T)
        cofactor = j[..., None, None] * np.linalg.inv(f).swapaxes(-1, -2)
        tangent = tangent.reshape(*j.shape, 9, 9)[..., _ENTRIES, :][..., _ENTRIES]
        stress, cofactor = (values.reshape(*j.shape, 9)[..., _ENTRIES] for values in (stress, cofactor))
        weighted = self.strain * self.weight[..., None, None]
        residual = np.einsum("eqci,eqc->ei", weighted, stress, optimize=True)
        couple = np.einsum("eqi,qp->epi", np.einsum("eqci,eqc->eqi", weighted, cofactor, optimize=True), self.linear)
        stiffness = (weighted.swapaxes(2, 3) @ (tangent @ self.strain)).sum(1)
        gap = (self.weight * change) @ self.linear - np.einsum("epr,er->ep", self.mass, state.pressure)
        to_pressure = np.linalg.solve(self.mass, couple)
        pressure_gap = np.linalg.solve(self.mass, gap[..., None])[..., 0]
        stiffness += couple.swapaxes(1, 2) @ to_pressure
        condensed = residual + np.einsum("epi,ep->ei", couple, pressure_gap)
        by_block = stiffness.reshape(len(j), 9, 3, 9, 3).swapaxes(3, 4)
        return Linearised(self, residual, condensed, by_block, to_pressure, pressure_gap)


def _reference() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return Gauss points (9, 2), weights (9,), shape functions (9, 9), slopes (9, 9, 2) of the reference square."""
    xi, eta = (axis.ravel() for axis in np.meshgrid(_POINT, _POINT, indexing="ij"))
    (fx, dx), (fy, dy) = (quadratic(t) for t in (xi, eta))
    shape, along, across = (np.einsum("qa,qb->qba", x, y).reshape(9, 9) for x, y in ((fx, fy), (dx, fy), (fx, dy)))
    return np.column_stack([xi, eta]), np.outer(_WEIGHT, _WEIGHT).ravel(), shape, np.stack([along, across], -1)


# Where the indenter has left, or cells are a thousand times as large as the contact, forces are rounding and their
# balance says nothing: a last step of 1e-13 m ends the iteration, too.
_TOLERANCE = Tolerance(gap=1e-9, balance=1e-8, step=1e-13)


def disc_mesh(
    radius: float, thickness: float, reach: float, spacing: float, fine_depth: float, growth: float = 1.1
) -> QuadMesh:
    """Make the mesh of a disc of a radius and thickness, m: nodes ``spacing`` m apart out to ``reach`` m and down to
    ``fine_depth`` m; beyond, steps grow by the factor ``growth``."""
    heights = thickness - graded(fine_depth, spacing, thickness, growth)[::-1]
    heights[0] = 0.0
    return disc(graded(reach, spacing, radius, growth), heights)


def pressed(mesh: QuadMesh, material: Material, ball: Indenter, reach: float) -> FiniteStrainContact:
    """Return the contact problem of a ball on the disc's middle; nodes within ``reach`` m of the axis can touch it."""
    near = mesh.surface[mesh.nodes[mesh.surface, 0] < reach]
    middle = mesh.nodes[mesh.surface[0]]
    solid = AxisymmetricSolid(mesh, NeoHookean.from_material(material))
    pose = pose_on(ball, middle, np.array([0, -1.0, 0]))
    return FiniteStrainContact(solid, near, ball, pose, fixed=mesh.fixed, tolerance=_TOLERANCE)


def contact_radius(contact: FiniteStrainContact, touch: ContactState) -> float:
    """Return a contact's radius, m, by places at rest: halfway between its last node and the first beyond it."""
    radii = np.sort(contact.solid.mesh.nodes[contact.touchable, 0])
    last = int(np.searchsorted(radii, contact.solid.mesh.nodes[touch.outer.nodes, 0].max()))
    return float(radii[last : last + 2].mean())
