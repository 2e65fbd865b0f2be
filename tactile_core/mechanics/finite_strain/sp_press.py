"""A rigid plate pressed onto the BioTac SP: skin inflated by its fluid, then touched, without friction."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ...sensors import biotac_sp
from ..solids.finite_strain import FiniteStrainSolid
from ..solids.fluid_cavity import FluidCavity
from ..solids.mooney_rivlin import MooneyRivlin
from .newton import FiniteStrainContact
from .solved_contact import ContactState
from .sp_mesh import half_ellipsoid_mesh

INTERVALS = (24, 16, 8)  # nodes every 0.6 mm across the pad, 0.9 mm along it
MIRROR_TOLERANCE = 1e-9  # of a plate's normal across the finger, below which half of the skin is enough
_FAR = 1.0  # m, where a plate is out of the way
_PRESSURE_TOLERANCE = 1e-6  # of the initial pressure
_STRIDE = 0.02  # of the empty volume, pumped in at once: 0.05 is the whole of it


class Plate(Indenter):
    """A flat without end: the half space z >= 0 of its own frame."""

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See ``Indenter``."""
        return -points[:, 2], np.broadcast_to([0.0, 0.0, -1.0], points.shape)

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """See ``Indenter``: none."""
        return np.zeros((len(points), 3, 3))

    def support(self, direction: np.ndarray) -> np.ndarray:
        """See ``Indenter``: the middle, its own origin."""
        return np.zeros(3)


@dataclasses.dataclass(frozen=True)
class Pressed:
    """Step of a press. advance : m, of the plate past first touch of the resting skin (negative: before it).

    skin : (k, 3) m, nodes of the whole deformed outer skin; force : N, normal, ``FORCE_SCALE`` in it
    pressure : Pa, of the fluid, likewise; volume : m3, of the fluid; core_gap : m, least between inner skin and core
    """

    advance: float
    skin: np.ndarray
    force: float
    pressure: float
    volume: float
    core_gap: float


class SpPress:
    """A BioTac SP in front of a plate through ``point`` (3,) m that moves along the unit vector ``into`` (3,)."""

    def __init__(
        self,
        point: np.ndarray,
        into: np.ndarray,
        intervals: tuple[int, int, int] = INTERVALS,
        outer: np.ndarray = biotac_sp.OUTER,
        thickness: float = biotac_sp.THICKNESS,
    ) -> None:
        """A plate that leans neither to +y nor to -y is solved on half of the skin.

        outer : (3,) m, semi-axes; thickness : m, by which the inner ones are less
        """
        self.mirrored = abs(into[1]) < MIRROR_TOLERANCE
        inner = outer - thickness
        self.mesh, fixed, faces = half_ellipsoid_mesh(outer, inner, intervals, mirrored=self.mirrored)
        self.solid = FiniteStrainSolid(self.mesh, MooneyRivlin(biotac_sp.C10, biotac_sp.C01, biotac_sp.BULK))
        self.cavity = FluidCavity(faces, len(self.mesh.nodes))
        surface = self.mesh.surface
        self.contact = FiniteStrainContact(self.solid, surface, Plate(), _facing(point, into), self.cavity, fixed=fixed)
        self.rest, self.clearance = self._at_rest()

    @property
    def fluid_volume(self) -> float:
        """Volume of the fluid, m3, which the initial pressure sets and no press changes."""
        return (2 if self.mirrored else 1) * self.contact.volume

    def steps(self, advances: np.ndarray) -> list[Pressed]:
        """The path: the plate at ``advances`` (n,) m from ``point``, growing; the first ones need not touch yet.

        Raises TactileError where a step finds no equilibrium.
        """
        touch, found = self.rest, []
        for advance in advances:
            if advance > self.clearance:
                touch = self.contact.press(float(advance), touch)
            found.append(self._pressed(float(advance), touch))
        return found

    def _at_rest(self) -> tuple[ContactState, float]:
        """The skin inflated and just touched, and the advance at which it is.

        A secant search, the plate out of the way, for the volume of fluid that makes the initial pressure.
        """
        pose, empty = self.contact.pose, self.contact.volume
        away = pose.moved(-_FAR)
        touch = dataclasses.replace(self.contact.start(), pose=away)
        target, known, more = biotac_sp.INITIAL_PRESSURE, (0.0, empty), _STRIDE * empty
        while abs(touch.fluid - target) > _PRESSURE_TOLERANCE * target:
            self.contact.volume += more
            touch = self.contact.move(away, touch)
            slope = (self.contact.volume - known[1]) / (touch.fluid - known[0])
            known = touch.fluid, self.contact.volume
            more = float(np.clip((target - touch.fluid) * slope, -_STRIDE * empty, _STRIDE * empty))
        at = self.mesh.nodes + touch.state.displacement
        clearance = float(pose.distance(Plate(), at[self.mesh.surface])[0].min())
        return dataclasses.replace(touch, pose=pose.moved(clearance), depth=clearance), clearance

    def _pressed(self, advance: float, touch: ContactState) -> Pressed:
        at = self.mesh.nodes + touch.state.displacement
        copies = 2 if self.mirrored else 1
        skin, inner = at[self.mesh.surface], at[self.mesh.inner]
        if self.mirrored:
            skin = np.concatenate([skin, skin[skin[:, 1] > 1e-9] * [1, -1, 1]])
        scale = biotac_sp.FORCE_SCALE
        force = copies * scale * float(touch.force @ touch.pose.direction)
        gap = float((np.linalg.norm(inner, axis=1) - biotac_sp.core_radius(inner)).min())
        volume = copies * self.cavity.volume(at)
        return Pressed(advance - self.clearance, skin, force, scale * touch.fluid, volume, gap)


def _facing(point: np.ndarray, into: np.ndarray) -> Pose:
    axis = -into
    first = np.cross([0.0, 1.0, 0.0], axis)
    first /= np.linalg.norm(first)
    return Pose(np.asarray(point, float), np.column_stack([first, np.cross(axis, first), axis]))
