"""A press in the full or the reference tier, at depths or at forces, with all that a paired contact keeps of it."""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np

from ... import sensors
from ...errors import TactileError
from ...geometry.indenters import Indenter, Pose
from ...sensors import biotac
from ..electrodes.biotac_sheet import biotac_sheet
from ..fast.sensing_points import electrode_feet
from ..first_touch import surface_drop
from ..pose_path import same_line
from .body import Body, Sensor, graded_body
from .contact_state import ContactState
from .tolerance import Tolerance

Tier = Literal["full", "reference"]

FORCE_TOLERANCE = 2e-3  # relative, of the force asked for: a contact is taken as it is
# m of a load step with friction: against half of it 0.1 to 0.2 % of force, 0.3 to 3 um rms, under a ball and a cube.
_STEP = 0.5e-3
# Looser than the tier's own, in four fifths of the time; no displacement differed by 0.01 um.
_TOLERANCE = Tolerance(20e-9, 1e-4, 1e-6)
# Relative, of the force: a contact this near to it is joined by a line with another one. Single contacts on the DIGIT
# 4 % off, joined with the press's contact before, were 0.3 to 0.7 um rms, 4 um at most, off the ones solved exactly.
_NEAR = 0.05
_MOST_TRIES = 5  # contacts solved for one force


@dataclasses.dataclass(frozen=True)
class FullContact:
    """A contact in the full tier, m, N, Pa, by the indenter on the sensor.

    displacement : (n, 3), of the surface lattice; patch : (n,) bool, nodes that carry force
    force : (3,); axial_force : along the motion; depth : from the press's own pose
    pressure : rise of the fluid's; centre : (2,) = (x, z), of pressure, on the resting surface
    electrode_gaps : (19,), film over the electrodes; films : (k,), at the nodes of the sheet; (0,) on the DIGIT
    """

    displacement: np.ndarray
    patch: np.ndarray
    force: np.ndarray
    axial_force: float
    depth: float
    pressure: float
    centre: np.ndarray
    electrode_gaps: np.ndarray
    films: np.ndarray


class FullPress:
    """An indenter in front of one sensor in the full tier; contacts follow each other.

    pose : at first touch; reach : m, the greatest depth, for which the mesh is made; friction : Coulomb's coefficient
    tier : its cells; the tolerances are the full tier's in both
    """

    def __init__(
        self, sensor: Sensor, indenter: Indenter, pose: Pose, reach: float, friction: float, tier: Tier = "full"
    ) -> None:
        self.pose, self.indenter, self.sensor = pose, indenter, sensor
        self.body = graded_body(sensor, indenter, pose, reach, tier)
        self.problem = self.body.contact(indenter, pose, reach, friction)
        self.problem.tolerance = _TOLERANCE
        self.last = self.problem.start()

    def at_depth(self, depth: float, pose: Pose | None = None) -> FullContact:
        """The contact at a depth, m, of the press's pose or of a slid one.

        Raises TactileError where none is found, or the indenter sinks in between the nodes, as ``at_force`` does.
        """
        self.last = self.problem.move((pose or self.pose).moved(depth), self.last, _STEP)
        self.body.penetration_depth(self.last, self.indenter)
        return full_contact(self.body, self.last)

    def at_force(self, force: float, guess: float, pose: Pose | None = None) -> FullContact:
        """The contact at a force along the motion, N, near the depth ``guess``, m.

        Of two contacts, one of them within 5 % of the force, it is the one on the line through both, see ``on_line``.
        Loads are never taken back, as friction remembers them: a contact beyond the force is solved again from the one
        before. Raises TactileError where none is found.
        """
        pose = pose or self.pose
        begin, depth, before = self.last, guess, None
        tried = [(self.surface_drop(pose), 0.0)]
        if same_line(begin.pose, pose):
            before, tried = full_contact(self.body, begin), [(begin.depth, _axial(begin))]
        for _ in range(_MOST_TRIES):
            touch = self.last = self.problem.move(pose.moved(depth), begin, _STEP)
            found = full_contact(self.body, touch)
            miss = abs(found.axial_force / force - 1)
            enough = miss <= FORCE_TOLERANCE
            if enough or (before and miss <= _NEAR):
                self.body.penetration_depth(touch, self.indenter)
                return found if enough else on_line(before, found, force)
            tried.append((depth, found.axial_force))
            before, begin = found, begin if found.axial_force > force else touch
            depth = _next_depth(tried, force)
        raise TactileError(f"full tier, {self.sensor}", f"{found.axial_force:.4g} N", f"{force:.4g} N", "Another force")

    def surface_drop(self, pose: Pose) -> float:
        """Additional distance, m, to the resting surface under a slid pose, against the press's own pose."""
        return surface_drop(sensors.sensor_surface(self.sensor), self.indenter, self.pose, pose)


def full_contact(body: Body, touch: ContactState) -> FullContact:
    """Extract from a solved contact the values that a paired contact needs."""
    mesh = body.solid.mesh
    weight = np.linalg.norm(touch.outer.forces, axis=1)
    centre = weight @ mesh.nodes[touch.nodes][:, [0, 2]] / max(weight.sum(), 1e-30)
    gaps, films = film(body, touch) if len(mesh.inner) else (np.empty(0), np.empty(0))
    return FullContact(
        body.displacement(touch), body.contact_patch(touch), touch.force, _axial(touch), touch.depth, touch.fluid,
        centre, gaps, films,
    )  # fmt: skip


def film(body: Body, touch: ContactState) -> tuple[np.ndarray, np.ndarray]:
    """Film over each electrode (19,) m, as ``Contact.electrode_gaps`` has it, and at the nodes of the sheet (k,) m."""
    feet, inner = electrode_feet(), biotac.skin_surface("inner")
    moved = body.graded.on_lattice(touch.state.displacement[body.solid.mesh.inner])
    at_feet = np.einsum("ek,ekj->ej", feet.weights, moved[inner.faces[feet.face]])
    return feet.gap + np.einsum("ej,ej->e", at_feet, feet.outward), biotac_sheet().films(moved)


def on_line(first: FullContact, second: FullContact, force: float) -> FullContact:
    """The contact at a force along the motion, N, on the line through two: straight over F^(2/3), as depth nearly is.

    What touches, and how its force is spread, are those of the second.
    """
    r0, r1, goal = (max(f, 0.0) ** (2 / 3) for f in (first.axial_force, second.axial_force, force))
    share = (goal - r0) / (r1 - r0)
    joined = {
        name: (1 - share) * getattr(first, name) + share * getattr(second, name)
        for name in ("displacement", "depth", "pressure", "electrode_gaps", "films")
    }
    scaled = second.force * force / second.axial_force
    return dataclasses.replace(second, **joined, force=scaled, axial_force=force)


def _axial(touch: ContactState) -> float:
    return float(touch.force @ touch.pose.direction)


def _next_depth(tried: list[tuple[float, float]], force: float) -> float:
    """Depth, m, for a force, N, from the two (depth, force) nearest to it: F^(2/3) is nearly straight, as Hertz's."""
    (d0, f0), (d1, f1) = sorted(tried, key=lambda one: abs(one[1] - force))[:2]
    r0, r1, goal = (max(f, 0.0) ** (2 / 3) for f in (f0, f1, force))
    if (r1 - r0) * (d1 - d0) <= 0:
        raise TactileError("full tier", "a force that falls with depth", "one that grows")
    return d0 + (goal - r0) / (r1 - r0) * (d1 - d0)
