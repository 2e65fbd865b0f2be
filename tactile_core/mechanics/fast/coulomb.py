"""Coulomb's law at touching points: which stick and which slip, and the parts of a Newton step in their forces.

A sticking node bears any force and may not move. A slipping node closes its gap, and two things are unknown: how far it
moves along friction, whose size its normal force decides, and the turn of friction across that, which stays opposite to
the slip. Where the normal turns as a slipping node moves along a curved indenter the force turns with it.

Loops (``files.compiled``) over arrays of k surface nodes and c points over the core: force, place, normal, ... (k, 3)
float64, masks bool, ``matrix`` (3 k + c, 3 k + c) float32 of the block. P. Alart, A. Curnier, Computer Methods in
Applied Mechanics and Engineering 92, 1991, 353-375.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...files.compiled import Loop

# Loops are compiled with these numbers: they stand in the file whose change compiles the loops again.
FORCE_NOISE = 1e-9  # N: below what single precision of the compliance resolves
GAP_NOISE = 1e-9  # m: likewise
SLIP_TOLERANCE = 0.05e-6  # m, motion of a sticking node that counts as none: a quarter of the gaps' tolerance
LARGEST_TURN = 1.0  # rad, of a slipping node's friction in one step
LARGEST_TILT = 0.3  # rad, of a normal in one step
BEYOND = 1e-9  # relative, by which a sticking force may pass its limit before the node slips
WAVERS = 2  # times that a node has stuck again before it may pass its limit by ``Law.spare``


class Law(NamedTuple):
    """Coulomb's law. friction : its coefficient; gap_tolerance : m, gap up to which a point counts as touching
    spare : N by which friction may exceed its limit on a node that keeps changing between stick and slip"""

    friction: float
    spare: float
    gap_tolerance: float


class Points(NamedTuple):
    """Points of an iterate: their forces and places.
    force : (k, 3) N, on the nodes; core : (c,) N, of the points that press on the core
    active : (k + c,) bool, which touch; slips : (k,) bool
    normal, lean : (k, 3), unit, of the indenter, and along friction (0 where nodes stick): f = p (normal + mu lean)
    gap : (k,) m; core_gap : (c,) m; off : (k, 3) m, offset of nodes from the indenter's spots they stick to
    """

    force: np.ndarray
    core: np.ndarray
    active: np.ndarray
    slips: np.ndarray
    normal: np.ndarray
    lean: np.ndarray
    gap: np.ndarray
    core_gap: np.ndarray
    off: np.ndarray


class Motion(NamedTuple):
    """Start of a Newton step. moves : (k, 3) m, of nodes from ``motion_from``'s ``place``; gap : (k,) m, after that
    slip : (k, 3) m, after that, sideways from the spots of the indenter that they stick to"""

    moves: np.ndarray
    slip: np.ndarray
    gap: np.ndarray


class Slipping(NamedTuple):
    """The s slipping nodes, and how their forces may change.
    at : (s,), their indices; normal, lean : (k, 3) of all nodes, as in ``Points``; across : (s, 3), unit, normal x lean
    pressing, limit : (s,) N, normal force and the most that friction can be
    against : (s,) m/N, slip against friction over ``limit``: how far a node moves across friction under 1 N
    curved : (q,), positions in ``at`` of those whose normals turn; bend : (q, 3, 3) 1/m, second derivatives of the
        distance there; turning : (q, 3, 3) N/m, change of their forces with their motion, at the same normal forces
    friction : Coulomb's coefficient"""

    at: np.ndarray
    normal: np.ndarray
    lean: np.ndarray
    across: np.ndarray
    pressing: np.ndarray
    limit: np.ndarray
    against: np.ndarray
    curved: np.ndarray
    bend: np.ndarray
    turning: np.ndarray
    friction: float


class Sorted(NamedTuple):
    """Points sorted after a step, and how far the step is from Coulomb's law.
    active : (k + c,) bool, which touch; slips : (k,) bool; changed : true if either has; touched : true if any node did
    deepest : m, least gap of all nodes; widest, slid : m, largest gap and forbidden slip of nodes that touched
    tilted : N, by which forces turn with their normals; size : N, of the whole force
    """

    active: np.ndarray
    slips: np.ndarray
    changed: bool
    touched: bool
    deepest: float
    widest: float
    slid: float
    tilted: float
    size: float


@Loop
def reduce_to_law(force, core, active, slips, normal, friction):  # noqa: ANN001, ANN201
    """Reduce a guessed force and core to Coulomb's law, in place: f = p (n + mu t), p >= 0, on a node that slips.

    Returns unit directions t (k, 3) of friction, elsewhere called ``lean``; slipping nodes without one stick then.
    force : (k, 3) N; core : (c,) N; active : (k + c,), slips : (k,), bool; normal : (k, 3); friction : mu"""
    k = force.shape[0]
    lean = np.zeros((k, 3))
    for a in range(k):
        for i in range(3 if not active[a] else 0):
            force[a, i] = 0.0
        if not slips[a]:
            continue
        pressing = force[a, 0] * normal[a, 0] + force[a, 1] * normal[a, 1] + force[a, 2] * normal[a, 2]
        square = 0.0
        for i in range(3):
            lean[a, i] = force[a, i] - pressing * normal[a, i]
            square += lean[a, i] * lean[a, i]
        long = np.sqrt(square)
        if long == 0.0:
            slips[a] = False
            continue
        pressing = max(pressing, 0.0)
        for i in range(3):
            lean[a, i] /= long
            force[a, i] = pressing * (normal[a, i] + friction * lean[a, i])
    for p in range(core.shape[0]):
        core[p] = max(core[p], 0.0) if active[k + p] else 0.0
    return lean


@Loop
def motion_from(place, moved, off, gap, normal):  # noqa: ANN001, ANN201
    """Return the ``Motion`` of nodes from ``place`` (k, 3) m to ``moved`` (k, 3) m. At ``place`` are known their gap
    (k,) m, normal (k, 3) and off (k, 3) m, offset from the spots that they stick to."""
    moves, slip, gap_then = np.empty(place.shape), np.empty(place.shape), np.empty(len(gap))
    for a in range(place.shape[0]):
        onto, along = 0.0, 0.0
        for i in range(3):
            moves[a, i] = moved[a, i] - place[a, i]
            onto += normal[a, i] * moves[a, i]
            along += off[a, i] * normal[a, i]
        for i in range(3):
            slip[a, i] = (off[a, i] - along * normal[a, i]) + moves[a, i] - onto * normal[a, i]
        gap_then[a] = gap[a] + onto
    return Motion(moves, slip, gap_then)


@Loop
def slipping_nodes(at, points, motion, curved, bend, friction):  # noqa: ANN001, ANN201
    """Return the ``Slipping`` of the nodes ``at`` (s,) of ``points``; curved, bend, friction : as described there"""
    s = len(at)
    across, pressing, limit, against = np.empty((s, 3)), np.zeros(s), np.empty(s), np.zeros(s)
    turning = np.empty((len(curved), 3, 3))
    normal, lean = points.normal, points.lean
    for a in range(s):
        node = at[a]
        for i in range(3):
            j, h = (i + 1) % 3, (i + 2) % 3
            across[a, i] = normal[node, j] * lean[node, h] - normal[node, h] * lean[node, j]
            pressing[a] += points.force[node, i] * normal[node, i]
            against[a] -= motion.slip[node, i] * lean[node, i]
        limit[a] = friction * max(pressing[a], FORCE_NOISE)
        against[a] = max(against[a], 0.0) / limit[a]
    for p in range(len(curved)):
        node = at[curved[p]]
        for j in range(3):
            onto = 0.0
            for i in range(3):
                onto += lean[node, i] * bend[p, i, j]
            for i in range(3):
                turning[p, i, j] = pressing[curved[p]] * (bend[p, i, j] - friction * normal[node, i] * onto)
    return Slipping(at, normal, lean, across, pressing, limit, against, curved, bend, turning, friction)


@Loop
def known_motion(points, motion, slipping, direction, columns):  # noqa: ANN001, ANN201
    """Return the prescribed motion (3 k + c, columns) m of touching points; not the slip along friction, which is
    unknown.
    The first column closes gaps and takes sticking nodes back to their spots, the second is a metre of ``direction``.
    """
    k, normal, lean = len(motion.slip), points.normal, points.lean
    known = np.zeros((3 * k + len(points.core_gap), columns))
    for a in range(k):
        for i in range(3 if points.active[a] else 0):
            known[3 * a + i, 0] = -(motion.slip[a, i] + motion.gap[a] * normal[a, i])
            for column in range(1, columns):
                known[3 * a + i, column] = direction[i]
    for p in range(len(points.core_gap)):
        if points.active[k + p]:
            known[3 * k + p, 0] = -points.core_gap[p]
    for a in slipping.at:
        for column in range(columns):
            along = 0.0
            for i in range(3):
                along += lean[a, i] * known[3 * a + i, column]
            for i in range(3):
                known[3 * a + i, column] -= lean[a, i] * along
    return known


@Loop
def sort_points(points, turned, stuck_again, law):  # noqa: ANN001, ANN201
    """Return which points touch and which slip after a step, as ``Sorted``.
    points : as they are after the step, except active, slips, normal and lean, which are those before it
    turned : (k, 3), normals after the step; stuck_again : (k,) int, counts each node's changes from slip to stick"""
    force, core, active, slips, normal, lean, gap, core_gap, off = points
    k, c = force.shape[0], core.shape[0]
    new_active, new_slips = np.empty(k + c, np.bool_), np.zeros(k, np.bool_)
    changed, touched, deepest, widest, slid, tilted = False, False, np.inf, 0.0, 0.0, 0.0
    whole = np.zeros(3)
    for a in range(k):
        pressing, onto = 0.0, 0.0
        for i in range(3):
            pressing += force[a, i] * normal[a, i]
            onto += off[a, i] * normal[a, i]
            whole[i] += force[a, i]
        slip_lean, sideways, length, slip_square = 0.0, 0.0, 0.0, 0.0
        for i in range(3):
            slip = off[a, i] - onto * normal[a, i]
            slip_lean += slip * lean[a, i]
            slip_square += slip * slip
            aside = force[a, i] - pressing * normal[a, i]
            sideways += aside * aside
            length += force[a, i] * force[a, i]
        for i in range(3):
            turn = turned[a, i] - normal[a, i]
            tilted += turn * turn * length
        sideways = np.sqrt(sideways)
        touches = pressing >= -FORCE_NOISE if active[a] else gap[a] < -GAP_NOISE
        new_active[a] = touches
        changed |= (active[a] and not touches) or (not active[a] and gap[a] < -law.gap_tolerance)
        if touches and active[a]:
            spare = FORCE_NOISE if stuck_again[a] < WAVERS else law.spare
            if slips[a]:
                new_slips[a] = slip_lean <= SLIP_TOLERANCE
            else:
                new_slips[a] = sideways > law.friction * pressing * (1 + BEYOND) + spare
            changed |= new_slips[a] != slips[a]
        if slips[a] and not new_slips[a] and touches:
            stuck_again[a] += 1
        deepest = min(deepest, gap[a])
        if active[a]:
            touched = True
            widest = max(widest, abs(gap[a]))
            free = slip_square
            if slips[a] and sideways > 0:  # what a node slips along its friction is free
                share = 0.0
                for i in range(3):
                    share += (off[a, i] - onto * normal[a, i]) * (force[a, i] - pressing * normal[a, i])
                share /= max(sideways, 1e-30)
                free -= share * share
            slid = max(slid, free)
    for p in range(c):
        touches = core[p] >= -FORCE_NOISE if active[k + p] else core_gap[p] < -GAP_NOISE
        new_active[k + p] = touches
        changed |= (active[k + p] and not touches) or (not active[k + p] and core_gap[p] < -law.gap_tolerance)
    size = np.sqrt(whole[0] * whole[0] + whole[1] * whole[1] + whole[2] * whole[2])
    slid = np.sqrt(max(slid, 0.0))
    return Sorted(new_active, new_slips, changed, touched, deepest, widest, slid, np.sqrt(tilted), size)


@Loop
def come_back(points, after, turned, left, friction):  # noqa: ANN001, ANN201
    """Let nodes that touch again slip instead of stick, since sticking is what pulled them off. Return the largest gap,
    m, of the nodes that touch now.
    points, after : argument and result of ``sort_points``; turned : (k, 3), new normals; friction : Coulomb's
        coefficient
    left : (k,) bool, nodes that have left so far. Updates it, the nodes' forces and ``after.slips`` in place."""
    force, _, active, _, normal, _, gap, _, off = points
    wrong = 0.0
    for a in range(len(left)):
        back = left[a] and after.active[a] and not active[a]
        left[a] = left[a] or (active[a] and not after.active[a])
        if after.active[a]:
            wrong = max(wrong, abs(gap[a]))
        if not back:
            continue
        onto, far = 0.0, 0.0
        for i in range(3):
            onto += off[a, i] * normal[a, i]
        for i in range(3):
            aside = off[a, i] - onto * normal[a, i]
            far += aside * aside
        far = np.sqrt(far)
        if far > 0:
            after.slips[a] = True
            for i in range(3):
                force[a, i] = FORCE_NOISE * (turned[a, i] - friction * (off[a, i] - onto * normal[a, i]) / far)
    return wrong
