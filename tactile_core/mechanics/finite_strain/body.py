"""The solid of one contact in the full or the reference tier, on a mesh graded round that contact."""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np

from ... import sensors
from ...geometry.indenters import Indenter, Pose
from ..penetration import BENDS, BLUNT, check_follows, penetration_between, sharpest
from ..solids.biotac_core import Core, facing_core
from ..solids.finite_strain import FiniteStrainSolid, NeoHookean
from ..solids.fluid_cavity import FluidCavity
from ..solids.graded_mesh import Footprint, GradedMesh, graded
from ..solids.hex_mesh import inner_faces, outer_faces
from ..solution import Sensor
from .newton import FiniteStrainContact
from .solved_contact import EXACT, ContactState, Tolerance

# m, load steps: without friction one step from rest will do, unless it fails and is halved; with friction a path.
ONE_STEP, FRICTION_STEP = 5e-3, 0.25e-3
# Gaps to 1/100 of the penetration that the target allows. A last step of 0.15 um left forces in balance to 1e-6.
_FULL = Tolerance(10e-9, 1e-7, 0.15e-6)
_FIRST_GEL, _FIRST_SKIN = 0.5, 0.7  # a ball on a half-space touches where it overlaps by half of the depth
_REACH = 1.5e-3  # m, nodes this far outside the indenter at the greatest depth may come to touch it
# Nodes wanted across the fine part of a graded mesh. Normals under a 7 mm ball 1.2 mm deep in the gel were 1.4 to 1.5
# degrees off with 10, 1.2 with 11, 1.0 with 12 at a fifth more time.
_ACROSS = 11
_SPACING = 0.3, 1.5  # lattice lines, least and most between nodes there
_MARGIN = 0.6  # of its size that the fine part reaches beyond the touching nodes
_LEAST_HALF = 1.2  # lattice lines, half of the smallest fine part


@dataclasses.dataclass(frozen=True)
class Body:
    """A sensor's solid with all that a contact on it needs.
    cavity : the fluid's volume, None on a gel; core_nodes : (k,), mesh nodes of the inner skin that may touch the core
    graded : the mesh, fine round the contact; it interpolates to the nodes of the sensor's surface lattice"""

    sensor: Sensor
    tier: Literal["full", "reference"]
    solid: FiniteStrainSolid
    cavity: FluidCavity | None
    core_nodes: np.ndarray
    graded: GradedMesh

    def contact(
        self, indenter: Indenter, pose: Pose, depth: float, friction: float, *, every_edge: bool = False
    ) -> FiniteStrainContact:
        """Return the contact problem of this body with an indenter that goes at most ``depth`` m in from ``pose``, its
        first touch.
        friction : Coulomb's coefficient
        every_edge : true to add penalty points also at edges near nodes at first touch, not only at full depth"""
        mesh = self.solid.mesh
        distance, _ = pose.moved(depth).distance(indenter, mesh.nodes[mesh.surface])
        near = mesh.surface[distance < _REACH]
        poses = (pose, pose.moved(depth)) if every_edge else (pose.moved(depth),)
        return FiniteStrainContact(
            self.solid, near[~mesh.clamped[near]], indenter, pose, cavity=self.cavity, friction=friction,
            core=Core(self.sensor) if len(self.core_nodes) else None, inner=self.core_nodes,
            factor=self.graded.factor, tolerance=_FULL if self.tier == "full" else EXACT,
            first_share=_first_share(self.sensor),
            faces=None if friction else self._faces(indenter, poses, near),  # friction holds nodes at edges
        )  # fmt: skip

    def _faces(self, indenter: Indenter, poses: tuple[Pose, ...], near: np.ndarray) -> np.ndarray | None:
        """Return the mesh's faces (f, 9) with all nodes among ``near`` (k,) if, in one of the poses, the indenter there
        is so sharp that nodes slide off, yet not too sharp for penalty points; else None."""
        mesh = self.solid.mesh
        if not BENDS <= min(sharpest(indenter, pose, mesh.nodes[near]) for pose in poses) < BLUNT:
            return None
        faces = outer_faces(mesh)
        return faces[np.isin(faces, near).all(axis=1)]

    def penetration_depth(self, touch: ContactState, indenter: Indenter) -> float:
        """Return the indenter's largest penetration, m, at the surface's nodes and between them in a solved contact,
        ``touch``. Raises PenetrationError if it is over 0.1 mm and 40 % of the depth, or nodes are behind it.
        """
        mesh = self.solid.mesh
        surface = self.graded.grid((mesh.nodes + touch.state.displacement)[mesh.surface])
        where, closed = f"{self.tier} tier, {self.sensor}", not sensors.is_gel(self.sensor)
        normals = touch.outer.normals[touch.outer.pressing > 0]
        check_follows(where, surface, indenter, touch.pose, touch.depth, normals, closed=closed)
        return penetration_between(where, surface, indenter, touch.pose, touch.depth, closed=closed)

    def displacement(self, touch: ContactState) -> np.ndarray:
        """Interpolate a contact's displacement (n, 3) m to the nodes of the sensor's surface lattice."""
        moved = touch.state.displacement[self.solid.mesh.surface]
        return self.graded.on_lattice(moved)

    def contact_patch(self, touch: ContactState) -> np.ndarray:
        """Mark (n,) bool the surface lattice's nodes whose nearest mesh node carries force."""
        flags = np.isin(self.solid.mesh.surface, touch.outer.nodes[touch.outer.pressing > 0])
        return self.graded.nearest_on_lattice(flags)


def graded_body(
    sensor: Sensor,
    indenter: Indenter,
    pose: Pose,
    depth: float,
    tier: Literal["full", "reference"] = "full",
    spacing: float = 1.0,
) -> Body:
    """Make a sensor's body, its mesh fine where the indenter, ``depth`` m in from ``pose`` at first touch, overlaps it.
    spacing : of the fine part's nodes, as a multiple of the tier's own (the reference tier's is half the full tier's)
    """
    place = _footprint(sensor, indenter, pose, depth)
    footprint = dataclasses.replace(place, spacing=spacing * place.spacing, refine=1 if tier == "full" else 2)
    fine = graded(sensor, footprint)
    mesh, material = fine.mesh, sensors.describe(sensor).material
    if sensors.is_gel(sensor):
        solid = FiniteStrainSolid(mesh, NeoHookean.from_material(material, split=True), fine.pattern)
        return Body(sensor, tier, solid, None, np.empty(0, int), fine)
    solid = FiniteStrainSolid(mesh, material, fine.pattern)
    free = mesh.inner[~mesh.clamped[mesh.inner]]
    cavity = FluidCavity(inner_faces(mesh), len(mesh.nodes))
    return Body(sensor, tier, solid, cavity, np.sort(free[facing_core(sensor, mesh.nodes[free])]), fine)


def _first_share(sensor: str) -> float:
    return _FIRST_GEL if sensors.is_gel(sensor) else _FIRST_SKIN


def _footprint(sensor: Sensor, indenter: Indenter, pose: Pose, depth: float) -> Footprint:
    """Return the rows and columns of the lattice where the indenter, ``depth`` m in, overlaps the resting surface."""
    lattice = sensors.sensor_surface(sensor)
    rows, columns = lattice.shape
    distance, _ = pose.moved(depth).distance(indenter, lattice.rest[: rows * columns])
    deepest = distance.min()
    inside = np.flatnonzero(distance <= (_first_share(sensor) * deepest if deepest < 0 else deepest))
    at = np.column_stack([inside // columns + (not sensors.is_gel(sensor)), inside % columns])
    low, high = at.min(axis=0).astype(float), at.max(axis=0).astype(float)
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, _LEAST_HALF) * (1 + _MARGIN)
    spacing = float(np.clip(2 * half.max() / _ACROSS, *_SPACING))
    return Footprint(tuple(middle - half), tuple(middle + half), spacing)
