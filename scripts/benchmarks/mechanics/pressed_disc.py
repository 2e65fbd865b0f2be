"""A ball pressed into the middle of a disc that is bonded below: the axisymmetric solid in the production contact."""

from __future__ import annotations

import numpy as np

from tactile_core.geometry.indenters import Indenter, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.finite_strain.solved_contact import ContactState, Tolerance
from tactile_core.mechanics.solids.neo_hookean import NeoHookean
from tactile_core.sensors import Material

from .axisymmetric import AxisymmetricSolid, QuadMesh, disc, graded

# Where the indenter has left, or cells are a thousand times as large as the contact, forces are rounding and their
# balance says nothing: a last step of 1e-13 m ends the iteration, too.
_TOLERANCE = Tolerance(gap=1e-9, balance=1e-8, step=1e-13)


def disc_mesh(
    radius: float, thickness: float, reach: float, spacing: float, fine_depth: float, growth: float = 1.1
) -> QuadMesh:
    """Nodes ``spacing`` m apart out to ``reach`` and down to ``fine_depth``, steps growing by ``growth`` beyond."""
    heights = thickness - graded(fine_depth, spacing, thickness, growth)[::-1]
    heights[0] = 0.0
    return disc(graded(reach, spacing, radius, growth), heights)


def pressed(mesh: QuadMesh, material: Material, ball: Indenter, reach: float) -> FiniteStrainContact:
    """The contact of a ball that touches the middle; nodes within ``reach`` m of the axis may touch it."""
    near = mesh.surface[mesh.nodes[mesh.surface, 0] < reach]
    middle = mesh.nodes[mesh.surface[0]]
    solid = AxisymmetricSolid(mesh, NeoHookean.from_material(material))
    pose = pose_on(ball, middle, np.array([0, -1.0, 0]))
    return FiniteStrainContact(solid, near, ball, pose, fixed=mesh.fixed, tolerance=_TOLERANCE)


def contact_radius(contact: FiniteStrainContact, touch: ContactState) -> float:
    """Radius at rest, m: halfway between the last node that touches and the first that does not."""
    radii = np.sort(contact.solid.mesh.nodes[contact.touchable, 0])
    last = int(np.searchsorted(radii, contact.solid.mesh.nodes[touch.nodes, 0].max()))
    return float(radii[last : last + 2].mean())
