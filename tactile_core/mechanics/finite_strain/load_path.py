"""A path of contacts in the full and the reference tier, on a mesh graded round the deepest of them."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Literal

import numpy as np

from ...errors import TactileError
from ...geometry.indenters import Indenter, Pose
from ...sensors import sensor_surface, skin_of
from .. import error_estimate
from ..electrodes.biotac_sheet import biotac_sheet
from ..fast.sensing_points import electrode_feet
from ..force_search import touch_at_force
from ..penetration import PenetrationError, sharpest
from ..placement import same_line, surface_drop
from ..solution import OnDemand, Sensor, Solution, Step, centre_of_pressure
from .body import FRICTION_STEP, ONE_STEP, Body, graded_body
from .newton import FiniteStrainContact
from .solved_contact import ContactState, NoEquilibriumError

# Spacing of the finer mesh, over the full tier's, used where that finds no contact: 8 of 14 rings at random depths
# settled then, and five of five deeper than their wire's radius that had not, or had gone through.
_FINER = 0.5
# Failed load steps without friction, on the tier's own mesh and the finer one, after which another way is quicker
# (assumed).
_FEW_FAILURES = 4, 2
_FAILURES = NoEquilibriumError, PenetrationError  # after which another way is tried


class LoadPath:
    """A path of contacts of one indenter on one sensor; each call of ``to`` starts from the contact before.
    body, problem : the mesh in use now, and the contact on it; tier : ``full`` or ``reference``
    pose : at first touch; thickness : m, of the sensor there; limit : m, greatest depth in the search for a force
    depths : m, of the steps to come, guessed for forces; the mesh is made for the deepest
    friction : Coulomb's coefficient"""

    body: Body
    problem: FiniteStrainContact

    def __init__(
        self, sensor: Sensor, indenter: Indenter, pose: Pose, thickness: float, limit: float, depths: Sequence[float],
        tier: Literal["full", "reference"], friction: float,
    ) -> None:  # fmt: skip
        self.sensor, self.indenter, self.pose, self.tier, self.friction = sensor, indenter, pose, tier, friction
        self.thickness, self.limit = thickness, limit
        self.spacing = 1.0  # of the mesh's nodes, over the tier's own
        self.fading = False  # true while a step goes by friction that fades
        self.patient = False  # true for the last resort: short steps, and penalty points at every edge
        self.way: list[Pose] = []  # poses solved so far, which friction depends on
        self.made_for = max(depths, default=0.0)
        self.deeper = 1.0  # depth at which the last force was found, over its guess
        self._make()

    def _make(self) -> None:
        """Make the mesh and its contact problem, at rest."""
        self.body = graded_body(self.sensor, self.indenter, self.pose, self.made_for, self.tier, self.spacing)
        self.problem = self.body.contact(
            self.indenter, self.pose, self.made_for, self.friction, every_edge=self.patient
        )
        self.step = FRICTION_STEP if self.friction or self.spacing < 1 or self.patient else ONE_STEP
        if self.tier == "full" and not self.friction and not self.patient:
            self.problem.most_failures = _FEW_FAILURES[self.spacing < 1]
        self.last = self.problem.start()

    def to(self, step: Step, guess: float) -> Solution:
        """Solve the path's next step; guess : m, a depth near that at which a ``step`` by force reaches it.
        If no contact is found, tries in turn: a finer mesh, from the start (full tier); then, without friction,
        friction that fades to 0; short steps from the start and penalty points at every edge (full tier)."""
        before = self.last
        try:
            found = self._to(step, guess)
        except _FAILURES as failure:
            self.last = before
            found = self._otherwise(step, guess, failure)
        self.way.append(self.last.pose)
        return found

    def _otherwise(self, step: Step, guess: float, failure: TactileError) -> Solution:
        """Solve the step in ``to``'s other ways; guess : m. Raises ``failure``, or the finer mesh's error, if none
        can."""
        if self.tier == "full" and self.spacing == 1:
            self._remake(_FINER)
            try:
                return self._to(step, guess)
            except _FAILURES as finer:
                failure = finer
        if self.friction:
            raise failure
        if self.spacing < 1:
            self._remake(1.0)
        self.fading = True
        try:
            return self._to(step, guess)
        except _FAILURES:
            if self.tier != "full":
                raise failure from None
        finally:
            self.fading = False
        self._remake(1.0, patient=True)
        try:
            return self._to(step, guess)
        except _FAILURES:
            raise failure from None

    def _remake(self, spacing: float, *, patient: bool = False) -> None:
        self.spacing, self.patient = spacing, patient
        self._make()
        for pose in self.way if self.friction else ():
            self.last = self.problem.move(pose, self.last, self.step)

    def _to(self, step: Step, guess: float) -> Solution:
        pose = self.pose.slid(*step.slide)
        if step.force:
            self.last = self._at_force(pose, step.force, self.deeper * guess)
            self.deeper = self.last.depth / guess
        elif step.depth or self.last.depth:
            self.last = self._move(pose.moved(step.depth or 0.0), self.last)
        return self._solution(self.last)

    def _move(self, pose: Pose, before: ContactState) -> ContactState:
        if self.fading:
            return self.problem.move_by_friction(pose, before, FRICTION_STEP)
        return self.problem.move(pose, before, self.step)

    def _at_force(self, pose: Pose, force: float, guess: float) -> ContactState:
        """Find the contact at a force, N, along the motion from ``pose``, near the depth ``guess``, m."""
        where, slid_to = f"solve, {self.sensor}, {self.tier} tier", None
        if not same_line(self.last.pose, pose):
            slid_to = surface_drop(sensor_surface(self.sensor), self.indenter, self.pose, pose)
        return touch_at_force(
            lambda depth, before: self._move(pose.moved(depth), before), self.last, pose.direction, force, self.limit,
            where, guess, slid_to,
        )  # fmt: skip

    def _solution(self, touch: ContactState) -> Solution:
        mesh = self.body.solid.mesh
        below = self.body.penetration_depth(touch, self.indenter)
        gap = touch.outer.gaps(mesh.nodes + touch.state.displacement)
        table = error_estimate.expected_error(self.tier, self.sensor, touch.depth / self.thickness)
        pressing = int((touch.outer.pressing > 0).sum())
        stated = error_estimate.of_finite_strain(table, touch.depth, pressing, self._nodes_across(touch), below)
        slips = touch.outer.slipping[touch.outer.active]
        skin = len(mesh.inner) > 0
        return Solution(
            self.tier, True, touch.iterations, self.body.displacement(touch), self.body.contact_patch(touch),
            self.thickness, touch.force, float(touch.force @ touch.pose.direction), touch.depth, touch.fluid,
            centre_of_pressure(mesh.nodes[touch.outer.nodes], touch.outer.forces), float(-gap.min(initial=0.0)),
            float(slips.mean()) if len(slips) and self.friction else 0.0, len(touch.inner.nodes),
            OnDemand(
                electrode_gaps=functools.partial(_electrode_gaps, self.body, touch) if skin else _nothing,
                films=functools.partial(_films, self.body, touch) if skin else _nothing,
                traction=functools.partial(_no_traction, self.tier),
                errors=lambda: stated,
            ),
            touch.steps, (self.body.solid, touch.state),
            touch.push.loads(len(touch.state.displacement)) if touch.guarded else None,
        )  # fmt: skip

    def _nodes_across(self, touch: ContactState) -> float:
        """Return how many nodes of the full tier's mesh lie across the contact, where the indenter is sharpest."""
        mesh = self.body.solid.mesh
        rest = mesh.nodes[mesh.surface]
        nearest = rest[int(np.argmin(touch.pose.distance(self.indenter, rest)[0]))]
        spacing = float(np.partition(np.linalg.norm(rest - nearest, axis=1), 1)[1])
        radius = sharpest(self.indenter, touch.pose, rest + touch.state.displacement[mesh.surface])
        spacing *= 1 if self.tier == "full" else 2
        return float(2 * np.sqrt(min(radius, 1.0) * max(touch.depth, 0.0)) / spacing)


def _electrode_gaps(body: Body, touch: ContactState) -> np.ndarray:
    """Return the film's thickness (e,) m over each electrode of a fluid sensor."""
    feet, inner = electrode_feet(body.sensor), skin_of(body.sensor).skin_surface("inner")
    at_feet = np.einsum("ek,ekj->ej", feet.weights, _inner_skin(body, touch)[inner.faces[feet.face]])
    return feet.gap + np.einsum("ej,ej->e", at_feet, feet.outward)


def _films(body: Body, touch: ContactState) -> np.ndarray:
    """Return the film's thickness (k,) m at the nodes of the conducting sheet."""
    return biotac_sheet(body.sensor).films(_inner_skin(body, touch))


def _inner_skin(body: Body, touch: ContactState) -> np.ndarray:
    """Return the displacement (n, 3) m of the inner skin's lattice."""
    return body.graded.on_lattice(touch.state.displacement[body.solid.mesh.inner])


def _no_traction(tier: str) -> np.ndarray:
    found = f"asked of the {tier} tier, whose forces act on the nodes of its own mesh"
    advice = "Solve without --error, or write its surface by `tactile mesh`, with the force on each node"
    raise TactileError("solve, traction", found, "the fast tier", advice)


def _nothing() -> np.ndarray:
    return np.empty(0)
