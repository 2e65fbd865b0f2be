"""Contact of a rigid indenter with a finite-strain solid: Newton's method with an exact active set.

A touching node may slide on the indenter but not leave along its normal: its degrees of freedom are turned into the
indenter's frame and the normal one is prescribed, so the matrix stays symmetric positive definite. Friction holds it by
a spring that slips at mu times the normal force (``contact_set``). The BioTac's fluid adds one unknown, its pressure,
by a bordered solve; its core is a second obstacle, for the inner skin.
"""

from __future__ import annotations

import copy
import dataclasses

import numpy as np

from ...geometry.indenters import Indenter, Pose
from ..penetration import BEHIND
from ..placement import between
from ..solids.finite_strain import FiniteStrainSolid, State
from ..solids.fluid_cavity import FluidCavity
from ..solids.sparse_cholesky import DampedFactor, LinearSystem, NotPositiveDefiniteError, PatternFactor, held_back
from .contact_set import ContactSet, Obstacle, PlacedIndenter
from .penalty_points import LET_THROUGH, NO_PUSH, PenaltyPoints, Push
from .solved_contact import EXACT, ContactState, NoEquilibriumError, NotConvergedError, Tolerance

SLIDING_TOLERANCE = 3e-6  # of the largest forces: with friction the balance converges linearly
MAX_ITERATIONS, MAX_GUARDED = 40, 60  # the second with penalty points: they slow the end (assumed)
MOST_FAILURES = 8  # load steps that may fail on one path: bounds its time (assumed; one path with 8 was still found)
_EASY = 8  # iterations at most of a load step after which the next may be longer again (assumed)
SMALLEST_STEP = 1 / 16  # of a load step, or of the way where that is less; if that fails, the path has ended
# Stiffness of penalty points, over a node's own: contacts with stiff ones are found only from those with softer ones.
_SPRING, _STIFF = 10.0, 40.0
_FRICTION_SWEEPS = 3  # solves with one factor, in which friction follows the normal forces
_FAILURES = NotConvergedError, FloatingPointError, NotPositiveDefiniteError, np.linalg.LinAlgError  # of a load step


class FiniteStrainContact:
    """Contact of an indenter with a solid, along a path of growing depth or of poses.

    touchable : (m,) mesh nodes that the indenter may touch; pose : of the indenter at depth 0
    fixed : (3 n,) bool, degrees of freedom that do not move, xyz node by node; None: those of the clamped nodes
    cavity : incompressible fluid in the solid, or None; ``pre_inflation`` m3 is added to its volume at rest
    core : a rigid body inside that the mesh nodes ``inner`` (k,) may touch, without friction; None: there is none
    friction : Coulomb's coefficient, between indenter and sensor
    factor : solver for the solid's sparsity pattern; None: makes one; tolerance : when iterations end
    first_share : a press from rest begins with the nodes that overlap by this share of the largest overlap
    faces : (f, 9) quadratic faces of the surface that get ``PenaltyPoints`` if the contact fails
    """

    def __init__(
        self,
        solid: FiniteStrainSolid,
        touchable: np.ndarray,
        indenter: Indenter,
        pose: Pose,
        *,
        cavity: FluidCavity | None = None,
        pre_inflation: float = 0.0,
        fixed: np.ndarray | None = None,
        core: Obstacle | None = None,
        inner: np.ndarray | None = None,
        friction: float = 0.0,
        factor: PatternFactor | None = None,
        tolerance: Tolerance = EXACT,
        first_share: float = 0.0,
        faces: np.ndarray | None = None,
    ) -> None:
        self.solid, self.touchable, self.indenter, self.pose, self.cavity = solid, touchable, indenter, pose, cavity
        self.fixed = (np.repeat(solid.mesh.clamped, 3) if fixed is None else fixed).reshape(-1, 3)
        self.volume = pre_inflation + (cavity.volume(solid.mesh.nodes) if cavity else 0.0)
        self.core, self.inner = core, np.empty(0, int) if inner is None or core is None else inner
        self.friction, self.tolerance, self.first_share = friction, tolerance, first_share
        self.most_failures = MOST_FAILURES
        self._factor = DampedFactor(solid, factor or PatternFactor())
        self._penalty = None if faces is None else PenaltyPoints(faces)
        if cavity:
            rows, columns, _ = cavity.hessian(solid.mesh.nodes)
            self._cavity_places = solid.pattern.find(rows, columns)

    def start(self) -> ContactState:
        """Return the undeformed state; a pre-inflated skin finds its shape in the first step."""
        return ContactState(0.0, self.pose, self.solid.rest(), ContactSet.none(), ContactSet.none(), NO_PUSH)

    def press(self, depth: float, start: ContactState | None = None, step: float = 0.1e-3) -> ContactState:
        """Solve the contact at ``depth`` m, reached from ``start`` (None: from rest) in load steps of at most ``step``
        m.
        A depth no greater than the start's returns the start. A step that fails is halved. Raises NoEquilibriumError,
        which states how far it came, if a sixteenth of a step fails, or more than 8 have failed."""
        touch = start or self.start()
        if depth <= touch.depth + 1e-12:
            return dataclasses.replace(touch, steps=0)
        touch = self._follow(touch, self.pose.moved(depth), step / (depth - touch.depth))
        return dataclasses.replace(touch, depth=depth)

    def move(self, pose: Pose, start: ContactState, step: float = 0.1e-3) -> ContactState:
        """Solve the contact at another pose (a slide, a tilt, a lift), from the solved ``start``, in load steps of at
        most ``step`` m of travel; a turn counts as travel on an arm of 5 mm. Raises what ``press`` does."""
        way = float(np.linalg.norm(pose.apex - start.pose.apex))
        turned = float(np.abs(pose.axes - start.pose.axes).max()) * _TURN_ARM
        touch = self._follow(start, pose, step / max(way, turned, 1e-12))
        return dataclasses.replace(touch, depth=float((pose.apex - self.pose.apex) @ self.pose.direction))

    def move_by_friction(self, pose: Pose, start: ContactState, step: float = 0.1e-3) -> ContactState:
        """Solve a contact without friction at another pose: go there from ``start`` with friction, in load steps of
        ``step`` m, and let it fade to 0. On the way it keeps nodes from sliding off the indenter's edges.
        Raises NoEquilibriumError."""
        touch = self._rubbed(_FADING[0]).move(pose, start, step)
        try:
            for friction in _FADING[1:]:
                touch = dataclasses.replace(self._rubbed(friction)._solve(pose, touch), depth=touch.depth)
            return dataclasses.replace(self._stiffened(self._solve(pose, touch)), steps=touch.steps)
        except _FAILURES:
            found = "no equilibrium as friction fades"
            raise NoEquilibriumError("finite-strain solver", found, "friction, or a smaller depth") from None

    def _rubbed(self, friction: float) -> FiniteStrainContact:
        """Return this contact problem with friction; it then needs no penalty points."""
        rubbed = copy.copy(self)
        rubbed.friction, rubbed._penalty = friction, None
        return rubbed

    def _follow(self, start: ContactState, pose: Pose, step: float) -> ContactState:
        """Go straight to a pose, in load steps of at most a share ``step`` of the way. Raises what ``press`` does.

        A load step that fails is tried once more with penalty points, then halved."""
        touch, done, size, steps, failures = start, 0.0, step, 0, 0
        while done < 1 - 1e-9:
            goal = min(done + size, 1.0)
            try:
                touch = self._solve(between(start.pose, pose, goal), touch)
                done, size = goal, min(step, 2 * size) if touch.iterations <= _EASY else size
            except _FAILURES:
                steps += 1
                if self._penalty and not touch.guarded:
                    touch = dataclasses.replace(touch, guarded=True)
                    continue
                size, failures = min(size, goal - done) / 2, failures + 1
                if size < min(step, 1.0) * SMALLEST_STEP or failures > self.most_failures:
                    found = f"no equilibrium beyond {done:.0%} of the way"
                    expected = "a shorter way, or less depth or force"
                    raise NoEquilibriumError("finite-strain solver", found, expected) from None
            else:
                steps += 1
        return dataclasses.replace(self._stiffened(touch), steps=steps)

    def _solve(self, pose: Pose, start: ContactState, spring: float = _SPRING) -> ContactState:
        """Solve one load step from a solved contact. spring : stiffness of penalty points, over a typical node's"""
        state, fluid = start.state.copy(), start.fluid
        at = self._at(state)
        outer = start.outer.carried(
            PlacedIndenter(self.indenter, pose), self.touchable, at, start.pose, self.friction,
            _GRIP * self._factor.stiffness, self.first_share,
        )  # fmt: skip
        if (outer.normals @ pose.direction).min(initial=1.0) < BEHIND:
            raise NotConvergedError  # the indenter would pass the nodes that it should push
        inner = start.inner.carried(self.core, self.inner, at)
        self._factor.damping, imbalance, sizes = 0.0, 1.0, [0.0, 0.0]
        for iteration in range(1, (MAX_GUARDED if start.guarded else MAX_ITERATIONS) + 1):
            push = self._push(start, outer, at, spring)
            step, rise, imbalance, pressure_step, slide = self._newton(state, outer, inner, fluid, push, imbalance)
            share = self._share(state, step) * (slide if iteration > 1 else 1.0)
            state.displacement += share * step
            state.pressure += share * pressure_step
            fluid += share * rise
            at = self._at(state)
            settled = [touching.update(at, self.tolerance.gap) for touching in (outer, inner)]
            enough = max(self.tolerance.balance, SLIDING_TOLERANCE) if outer.slips else self.tolerance.balance
            small = np.abs(step).max() < self.tolerance.step and not outer.slips and not self._factor.damping
            if all(settled) and share == 1 and (small or max(outer.imbalance, imbalance) < enough):
                push = self._push(start, outer, at, spring)
                found = ContactState(start.depth, pose, state, outer, inner, push, start.guarded, fluid, iteration)
                if start.guarded or not self._lets_through(found):
                    return found
                return self._solve(pose, dataclasses.replace(found, guarded=True))
            sizes.append(float(np.abs(step).max()))
            if abs(sizes[-1] - sizes[-3]) < _SAME * sizes[-1]:
                raise NotConvergedError  # nodes alternate between two faces of the indenter
            self._factor.relax()
        raise NotConvergedError

    def _share(self, state: State, step: np.ndarray) -> float:
        """Return the largest share of a step (n, 3) m, of 1, 1/2, 1/4 and 1/8, in which every Gauss point keeps over
        0.3 of its volume. Raises FloatingPointError if there is none."""
        before = self.solid.deformation(state.displacement)[1]
        for share in _SHARES:
            if (self.solid.deformation(state.displacement + share * step)[1] > _KEPT_VOLUME * before).all():
                return share
        raise FloatingPointError("a cell would be turned inside out")

    def _push(self, start: ContactState, outer: ContactSet, at: np.ndarray, spring: float) -> Push:
        """Return the push of the indenter on the penalty points; none if the contact is not ``guarded``.
        at : (n, 3) m, the mesh's nodes now; spring : stiffness of a point, over a typical node's"""
        if not (start.guarded and outer.obstacle and self._penalty):
            return NO_PUSH
        return self._penalty.push(outer.obstacle, at, spring * self._factor.stiffness)

    def _lets_through(self, touch: ContactState) -> bool:
        """Return true if the indenter is over 50 um deep at a penalty point."""
        obstacle, at = touch.outer.obstacle, self._at(touch.state)
        return bool(self._penalty and obstacle and self._penalty.deepest(obstacle, at) > LET_THROUGH)

    def _stiffened(self, touch: ContactState) -> ContactState:
        """Solve on with stiff penalty points; return the contact unchanged if it needs none, or if that fails.

        The penetration that remains is checked afterwards (``penetration``).
        """
        if not touch.guarded or not self._lets_through(touch):
            return touch
        try:
            return self._solve(touch.pose, touch, _STIFF)
        except _FAILURES:
            return touch

    def _at(self, state: State) -> np.ndarray:
        return self.solid.mesh.nodes + state.displacement

    def _newton(
        self, state: State, outer: ContactSet, inner: ContactSet, fluid: float, push: Push, unrest: float
    ) -> tuple[np.ndarray, float, float, np.ndarray, float]:
        """Solve for a Newton step. outer, inner : contact with indenter and core; fluid : Pa, its pressure
        push : on penalty points; unrest : the last step's relative imbalance
        Returns the steps of displacement (n, 3) m and of the fluid's pressure Pa, the relative imbalance before them,
        the cells' pressure step (n_cells, 4) Pa, and the share of the step that friction allows."""
        lines = self.solid.linearise(state)
        largest = np.abs(lines.internal_force(condensed=False)).max()
        pattern, at = self.solid.pattern, self._at(state)
        blocks, residual = lines.blocks(), lines.internal_force().reshape(-1, 3)
        swell, excess = np.zeros_like(residual), 0.0
        if self.cavity:
            swell, excess = self.cavity.gradient(at).reshape(-1, 3), self.cavity.volume(at) - self.volume
            residual = residual - fluid * swell
            np.add.at(blocks, self._cavity_places, -fluid * self.cavity.hessian(at)[2])
        push.add_to(residual, blocks, pattern)
        held, step = self.fixed.copy(), np.zeros_like(residual)
        nodes = np.concatenate([outer.nodes, inner.nodes])
        frames = np.concatenate([touching.begin(at) for touching in (outer, inner)])
        bending = np.concatenate([outer.bending(at), inner.bending(at)])
        blocks[pattern.diagonal[nodes]] -= held_back(bending, blocks[pattern.diagonal[nodes]])
        blocks[pattern.diagonal[outer.nodes]] += outer.gripping(min(unrest, _MOST_ALONG))
        held[nodes] = np.einsum("nij,ni->nj", frames**2, self.fixed[nodes]) > 0.5
        for touching in (outer, inner):
            held[touching.nodes], step[touching.nodes] = touching.prescribe(held[touching.nodes])
        pattern.turn(blocks, nodes, frames)
        matrix = pattern.sparse(blocks)
        for values in (residual, swell):
            values[nodes] = np.einsum("nji,nj->ni", frames, values[nodes])
        system = LinearSystem(
            self._factor.solver(blocks, held), matrix, residual, step, np.where(held, 0.0, swell), excess
        )
        step, reaction, rise = self._pull(system, swell, outer)
        for touching in (outer, inner):
            touching.press(reaction[touching.nodes])
        loose = ~held
        force, stiffness = (float((values[loose] * step[loose]).sum()) for values in (residual, reaction - residual))
        slide = outer.slide_share(step[outer.nodes], force, stiffness)
        pulled = residual.copy()
        pulled[outer.nodes] -= outer.rubbing_in_frames()
        imbalance = float(np.abs(pulled[loose]).max(initial=0.0) / max(largest, 1e-12))
        excess_share = abs(excess) / max(self.volume, 1e-12)
        step[nodes] = np.einsum("nij,nj->ni", frames, step[nodes])
        return step, rise, max(imbalance, excess_share), lines.pressure_step(step), slide

    def _pull(self, system: LinearSystem, swell: np.ndarray, outer: ContactSet) -> tuple[np.ndarray, np.ndarray, float]:
        """Solve a Newton step's linear system: return the step (n, 3) m, reactions (n, 3) N and the rise of the fluid's
        pressure, Pa. Friction of ``outer`` is updated to the normal forces.
        swell : (n, 3) m2, gradient of the fluid's volume"""
        rise, prescribed = 0.0, system.prescribed
        known = (system.matrix @ prescribed.ravel()).reshape(-1, 3)
        under_pressure = system.solve(swell) if self.cavity else swell
        for _ in range(_FRICTION_SWEEPS if outer.slips else 1):
            load = -system.residual - known
            load[outer.nodes] += outer.rubbing_in_frames()
            step = prescribed + system.solve(load)
            if self.cavity:
                lost = system.excess + float((swell * step).sum())
                rise = -lost / float((system.loose_swell * under_pressure).sum())
                step = step + rise * under_pressure
            reaction = system.residual + (system.matrix @ step.ravel()).reshape(-1, 3) - rise * swell
            outer.follow(reaction[outer.nodes])
        return step, reaction, rise


_FADING = 0.78, 0.3, 0.1, 0.03  # coefficients of friction that fades (assumed: from ``FRICTION``, a third each time)
_GRIP = 30.0  # stiffness of friction's springs over a node's own: they yield some micrometres at most
_SHARES, _SAME = (1.0, 0.5, 0.25, 0.125), 1e-6  # of a step; relative, of two steps that swing to and fro (assumed)
_MOST_ALONG = 0.6  # of the secant's stiffness, for springs that slip while forces are far from balance (assumed)
_KEPT_VOLUME = 0.3  # least share of its volume that a Gauss point keeps in one step
_TURN_ARM = 5e-3  # m, lever arm at which a turn counts as travel: about a fingertip's radius
