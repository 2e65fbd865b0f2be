"""Derivatives of a straight press by the motions of its indenter: of the surface's displacement and of the force.

Which nodes touch, stick and slip is held as it was found; with these the contact's equations are smooth, and their
linearisation gives the change of all nodal forces (the implicit function theorem). Where a node is about to touch, to
lift off, to stick or to slip, the derivative is that of the side on which it stands.
"""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np

from ..errors import TactileError
from ..geometry.indenters import Pose
from ..geometry.indenters.indenter import lengths
from ..geometry.node_vectors import cross, dot
from .fast import surface_response
from .fast.compliance_block import ComplianceBlock
from .fast.contact_state import Contact, sideways_share
from .fast.correction import correct
from .fast.edge_contact import EdgeContactProblem
from .fast.projection import first_contact
from .first_touch import touching_point
from .straight_press import StraightPress

MOTIONS = 6  # m along x, y and z of the sensor, then rad about these axes through the indenter's own origin
_STEP = 1e-9  # m and rad, of the learned correction's differences: it is smooth, and computed in double precision
_STUCK = 1e-6  # m, by which sticking nodes may be off where they landed: 20 times the solver's tolerance
_ALONG = 1e-3  # of the force, what frictionless nodal forces may have across the normals: 10 times the solver's


class PressDerivative(NamedTuple):
    """Change of a press for 1 m, 1 rad or 1 N of each of m inputs. displacement : (n, 3, m) m; force : (3, m) N."""

    displacement: np.ndarray
    force: np.ndarray

    def at_force(self, direction: np.ndarray) -> PressDerivative:
        """Return the change where the force along ``direction`` (3,) is given, and after the motions by it, per N."""
        bears = direction @ self.force
        onward = self.displacement[..., :3] @ direction, self.force[:, :3] @ direction
        per_newton = [each[..., None] / (bears[:3] @ direction) for each in onward]
        held = [each - by * bears for each, by in zip(self, per_newton, strict=True)]
        return PressDerivative(*(np.concatenate(each, -1) for each in zip(held, per_newton, strict=True)))


def pose_derivative(straight: StraightPress) -> PressDerivative:
    """Return the derivatives of a straight press by the ``MOTIONS`` of its indenter.

    Raises TactileError for a contact that was found by a detour, or holds its indenter between nodes or in creases.
    """
    contact = straight.found.linear
    if not len(contact.nodes):
        return PressDerivative(np.zeros((*contact.displacement.shape, MOTIONS)), np.zeros((3, MOTIONS)))
    change, (factor, added) = _linear(straight), ([], [])
    for k in range(MOTIONS):
        ahead, back = (correct(contact.compliance, change.contact_after(straight, k, step)) for step in (_STEP, -_STEP))
        factor.append((ahead.factor - back.factor) / (2 * _STEP))
        added.append((ahead.displacement - back.displacement) / (2 * _STEP))
    moved = [
        surface_response.displacement(contact.compliance, contact.nodes, force, contact.core_nodes, core)
        for force, core in zip(np.moveaxis(change.force, -1, 0), change.core.T, strict=True)
    ]
    force = np.outer(contact.force, factor) + straight.found.corrected.factor * change.force.sum(0)
    return PressDerivative(np.stack(moved, -1) + np.stack(added, -1), force)


class _Change(NamedTuple):
    """Change of a contact with each motion.

    force : (k, 3, 6) N; core : (c, 6) N; turn : (k, 3, 6), of the ``normal`` (k, 3) of the indenter at the touching
    nodes; depth : (6,) m, past first touch
    """

    force: np.ndarray
    core: np.ndarray
    normal: np.ndarray
    turn: np.ndarray
    depth: np.ndarray

    def contact_after(self, straight: StraightPress, k: int, step: float) -> Contact:
        """Return the contact a ``step`` along the k-th motion, without its displacement, for the correction alone."""
        contact = straight.found.linear
        force = contact.nodal_force + step * self.force[..., k]
        found = dataclasses.replace(
            contact, nodal_force=force, core_force=contact.core_force + step * self.core[:, k],
            depth=straight.found.depth + step * self.depth[k],
            sideways=sideways_share(force, self.normal + step * self.turn[..., k]),
        )  # fmt: skip
        vars(found)["displacement"] = np.zeros_like(contact.displacement)
        return found


class _Nodes(NamedTuple):
    """Touching nodes (k,), and what the indenter's motions change at them.

    force : (k, 3) N; normal : (k, 3); bend : (k, 3, 3) 1/m, of the indenter; off : (k, 3) m, from where they landed
    landed : (k, 3, 6), of where they land; carried : (k, 3, 6), of the indenter's own points there
    turned : (k, 3, 6), of the normals where nodes do not move
    """

    force: np.ndarray
    normal: np.ndarray
    bend: np.ndarray
    off: np.ndarray
    landed: np.ndarray
    carried: np.ndarray
    turned: np.ndarray


def _linear(straight: StraightPress) -> _Change:
    """Solve the linearised equations of the touching nodes, and of the skin that presses on the core."""
    contact = straight.found.linear
    nodes = _nodes(straight)
    _check(straight, nodes)
    block = ComplianceBlock(contact.compliance, contact.nodes, contact.core_nodes).matrix.astype(float)
    k, size = len(nodes.force), nodes.force.size
    of_force, of_move, right = _laws(nodes, contact.slipping, straight.press.problem.friction)
    matrix = block.copy()
    matrix[:size] = (of_move @ block[:size].reshape(k, 3, -1)).reshape(size, -1)
    for a in range(k):
        matrix[3 * a : 3 * a + 3, 3 * a : 3 * a + 3] += of_force[a]
    given = np.concatenate([right.reshape(size, MOTIONS), np.zeros((len(block) - size, MOTIONS))])
    largest = np.abs(matrix).max(axis=1, keepdims=True)  # rows are of forces or of motions
    change = np.linalg.solve(matrix / largest, given / largest)
    moves = (block[:size] @ change).reshape(k, 3, MOTIONS)
    return _Change(
        change[:size].reshape(k, 3, MOTIONS), change[size:], nodes.normal, nodes.turned + nodes.bend @ moves,
        _deepening(straight),
    )  # fmt: skip


def _nodes(straight: StraightPress) -> _Nodes:
    contact, indenter = straight.found.linear, straight.press.problem.indenter
    pose, at = contact.pose, contact.compliance.touchable[contact.nodes]
    rest = contact.compliance.surface.rest[at]
    points = rest + contact.displacement[at]
    _, normal = pose.distance(indenter, points)
    bend, carried = pose.curvature(indenter, points), _carried(pose, points)
    turned = np.concatenate([np.zeros((len(at), 3, 3)), _turns(normal)], -1) - bend @ carried
    last = pose.to_own(rest)
    own = first_contact(indenter, straight.press.pose.to_own(rest), last)
    met, spots = lengths(own - last) > 0, pose.from_own(own)  # others are drawn onto it, and stick as they arrive
    _, facing = pose.distance(indenter, spots)
    along = np.einsum("ai,aij->aj", facing, _carried(pose, spots)) * met[:, None]
    along /= np.where(met, facing @ pose.direction, 1)[:, None]
    landed = pose.direction[:, None] * along[:, None]
    return _Nodes(contact.nodal_force, normal, bend, points - spots, landed, carried, turned)


def _check(straight: StraightPress, nodes: _Nodes) -> None:
    """Raise TactileError where what is held does not describe the contact."""
    contact, problem = straight.found.linear, straight.press.problem
    if isinstance(problem, EdgeContactProblem):
        found = "an edge that is held out between nodes"
    elif not problem.friction and contact.sideways > _ALONG:
        found = "nodes in creases of the indenter"
    elif problem.friction and lengths(nodes.off)[~contact.slipping].max(initial=0.0) > _STUCK:
        found = "a contact that was found by a detour, on which friction depends"
    else:
        return
    raise TactileError("press, derivative", found, "one whose nodes bear on one face each", "Take differences")


def _laws(nodes: _Nodes, slipping: np.ndarray, friction: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equations of each node: (k, 3, 3) of its force's change, (k, 3, 3) of its motion, and (k, 3, 6), their sum.

    Sticking nodes move as where they landed. Slipping ones keep on the indenter; their force keeps to Coulomb's cone
    about the normal, which turns, and its friction opposite to the slip.
    """
    normal, pressing = nodes.normal, dot(nodes.force, nodes.normal)
    lean = nodes.force - pressing[:, None] * normal if friction else cross(normal, np.eye(3)[np.abs(normal).argmin(1)])
    lean /= np.maximum(lengths(lean), 1e-300)[:, None]
    across = cross(normal, lean)
    slip, limit = np.maximum(-dot(nodes.off, lean), 0), friction * pressing
    if not friction:
        slip[:] = 1.0  # no force across, as along
    steeper, aside = pressing * (1 + friction**2), limit * dot(nodes.off, normal) + slip * pressing
    of_force = np.stack([np.zeros_like(normal), lean - friction * normal, slip[:, None] * across], 1)
    of_move = np.stack(
        [
            normal,
            -steeper[:, None] * _across(lean, nodes.bend),
            limit[:, None] * across - aside[:, None] * _across(across, nodes.bend),
        ],
        1,
    )
    right = np.stack(
        [
            _across(normal, nodes.carried),
            steeper[:, None] * _across(lean, nodes.turned),
            limit[:, None] * _across(across, nodes.landed) + aside[:, None] * _across(across, nodes.turned),
        ],
        1,
    )
    sticks = ~slipping if friction else np.zeros(len(normal), bool)
    of_force[sticks], of_move[sticks], right[sticks] = 0.0, np.eye(3), nodes.landed[sticks]
    return of_force, of_move, right


def _across(vectors: np.ndarray, tables: np.ndarray) -> np.ndarray:
    """Products (k, m) of vectors (k, 3) with tables (k, 3, m)."""
    return np.einsum("ai,aij->aj", vectors, tables)


def _carried(pose: Pose, points: np.ndarray) -> np.ndarray:
    """Change (k, 3, 6) of points (k, 3) m of a body at a pose."""
    return np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), _turns(points - pose.apex)], -1)


def _turns(arms: np.ndarray) -> np.ndarray:
    """Change (k, 3, 3) of arms (k, 3) that turn about x, y and z."""
    return np.cross(np.eye(3), arms[:, None]).swapaxes(1, 2)


def _deepening(straight: StraightPress) -> np.ndarray:
    """Change (6,) of the depth past first touch."""
    touch, indenter = straight.press.pose, straight.press.problem.indenter
    point = touching_point(straight.found.linear.compliance.surface, indenter, touch)[None]
    _, normal = touch.distance(indenter, point)
    return (normal @ _carried(touch, point)[0])[0] / (normal[0] @ touch.direction)
