"""Contacts of both tiers, the laws that each must fulfil, and how far the fast one is from the full one."""

import numpy as np

from tactile_core.geometry.indenters import Indenter, Pose
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.press import CorrectedPress, FastContact
from tactile_core.mechanics.placement import DEPTH_LIMIT, Placement, pose_at, thickness_under
from tactile_core.mechanics.solve import Solution, solve

PENETRATION = 1e-6  # m, the target at any node
BALANCE = 1e-3  # of the whole force, where iterations end at 1e-7 to 3e-6 of the largest nodal force
PULL = 1e-4  # of the largest nodal force: likewise
MIDDLE = Placement(-8.2e-3, 1.13e-3)  # no node of either lattice, and off the plane of symmetry


def press(sensor: str, indenter: Indenter, place: Placement, friction: float) -> CorrectedPress:
    """An indenter in front of a sensor in the fast tier."""
    pose = pose_at(sensor, indenter, place)
    limit = DEPTH_LIMIT * thickness_under(sensor, indenter, pose)
    return CorrectedPress(compliance_of(sensor), indenter, pose, limit, friction)


def full(sensor: str, indenter: Indenter, place: Placement, depth: float, friction: float) -> Solution:
    """A contact in the full tier, solved once for all cases that look at it."""
    key = (sensor, id(indenter), place, depth, friction)
    if key not in _SOLVED:
        _SOLVED[key] = solve(sensor, indenter, place, depth=depth, tier="full", friction=friction), indenter
    return _SOLVED[key][0]


_SOLVED: dict[tuple, tuple[Solution, Indenter]] = {}  # with the indenter, whose id is in the key


def broken_fast(found: FastContact, indenter: Indenter, friction: float) -> tuple[str, ...]:
    """Laws that a contact of the fast tier does not fulfil; they are those of its linear model."""
    contact = found.linear
    if not contact.converged:
        return ("did not converge",)
    compliance = contact.compliance
    at = (compliance.surface.rest + contact.displacement)[compliance.touchable]
    gap, normal = contact.pose.distance(indenter, at)
    return (
        *_of_numbers(found.corrected.displacement, found.force),
        *_of_gaps(gap, np.isin(np.arange(len(gap)), contact.nodes)),
        *_of_forces(contact.nodal_force, normal[contact.nodes], friction),
        *_of_sum(contact.nodal_force, contact.force),
    )


def broken_full(found: Solution, sensor: str, indenter: Indenter, pose: Pose, friction: float) -> tuple[str, ...]:
    """Laws that a contact of a finite-strain tier does not fulfil; ``pose`` is where the indenter stands."""
    if not found.converged:
        return ("did not converge",)
    solid, state = found.volume
    smallest = solid.deformation(state.displacement)[1].min()
    inside_out = () if smallest > 0 else (f"a cell is turned inside out, det F {smallest:.3g}",)
    forces = solid.linearise(state).internal_force(condensed=False).reshape(-1, 3)
    between = np.zeros_like(forces) if found.between is None else found.between
    forces -= between
    free = solid.mesh.surface[~solid.mesh.clamped[solid.mesh.surface]]
    largest = max(np.linalg.norm(forces[free], axis=1).max(), 1e-12)
    gap, normal = pose.distance(indenter, solid.mesh.nodes[free] + state.displacement[free])
    bears = np.linalg.norm(forces[free], axis=1) > PULL * largest
    return (
        *inside_out,
        *_of_numbers(found.displacement, found.force),
        *_of_gaps(gap, bears & (found.depth > 0)),
        *_of_forces(forces[free][bears], normal[bears], friction),
        *_of_sum(forces[free], found.force - between.sum(axis=0)),
    )


def _of_numbers(*arrays: np.ndarray) -> tuple[str, ...]:
    return () if all(np.isfinite(array).all() for array in arrays) else ("numbers that are not finite",)


def _of_gaps(gap: np.ndarray, bears: np.ndarray) -> tuple[str, ...]:
    """No node in the indenter, and none that bears force away from it."""
    deepest, apart = -gap.min(), np.abs(gap[bears]).max(initial=0.0)
    found = []
    if deepest > PENETRATION:
        found.append(f"a node lies {deepest * 1e6:.2f} um in the indenter")
    if apart > PENETRATION:
        found.append(f"a node that bears force is {apart * 1e6:.2f} um off the indenter")
    return tuple(found)


def _of_forces(force: np.ndarray, normal: np.ndarray, friction: float) -> tuple[str, ...]:
    """No tension, and Coulomb's cone; force (k, 3) N on the nodes, normal (k, 3) out of the indenter."""
    if not len(force):
        return ()
    pressing = np.einsum("ki,ki->k", force, normal)
    across = np.linalg.norm(force - pressing[:, None] * normal, axis=1)
    largest, found = np.abs(pressing).max(), []
    if pressing.min() < -PULL * largest:
        found.append(f"a node is pulled with {-pressing.min():.3g} N of {largest:.3g}")
    # Friction slips to 1 % of the largest force; normals of a fast contact are those of the iteration before.
    if (across - friction * pressing).max() > 0.01 * largest:
        found.append(f"friction is {(across - friction * pressing).max() / largest:.2%} over Coulomb's")
    return tuple(found)


def _of_sum(nodal: np.ndarray, total: np.ndarray) -> tuple[str, ...]:
    off = np.linalg.norm(nodal.sum(axis=0) - total) / max(np.linalg.norm(total), 1e-12)
    return () if off < BALANCE or not total.any() else (f"forces are {off:.2%} out of balance",)


def over_stated(fast: Solution, truth: Solution) -> tuple[float, str]:
    """The larger of the force's and the shape's error over what a contact states of itself, and both in words."""
    force = abs(np.linalg.norm(fast.force) / np.linalg.norm(truth.force) - 1)
    moves = np.linalg.norm(truth.displacement, axis=1) > 10e-6
    off = np.linalg.norm(fast.displacement - truth.displacement, axis=1)
    shape = float(np.sqrt((off[moves] ** 2).mean())) if moves.any() else float(off.max())
    words = (
        f"force {force:.1%} off (states {fast.force_error:.1%}), shape {shape * 1e6:.1f} um rms "
        f"(states {fast.shape_error * 1e6:.1f}), single nodes {off.max() * 1e6:.0f} um"
    )
    return max(force / fast.force_error, shape / fast.shape_error), words
