"""Newton step of a contact with Coulomb friction, in the forces of all touching points at once.

Only the motions of slipping nodes are unknown; from motions the stiffness of the touching points
(``contact_stiffness``) gives forces. The system has two unknowns per slipping node, however many stick (``coulomb``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...files.compiled import Loop
from .active_set import UnsolvedError
from .coulomb import LARGEST_TILT, LARGEST_TURN, Motion, Points, Slipping, known_motion


class Change(NamedTuple):
    """Change of forces in a Newton step, in r columns: with a resting indenter and, if it may move, per metre of
    travel.
    forces : (3 k + c, r) N, on all points; bearing : (s, 3, r) N, of slipping nodes, without the turn of normals
    moved : (q, 3, r) m, motion of the nodes ``Slipping.curved``, relative to the indenter
    turns : (s, r) N, change of friction across its direction"""

    forces: np.ndarray
    bearing: np.ndarray
    moved: np.ndarray
    turns: np.ndarray


def change_of(
    stiffness: tuple[np.ndarray, np.ndarray], points: Points, motion: Motion, slipping: Slipping,
    direction: np.ndarray, *, deepens: bool,
) -> Change:  # fmt: skip
    """Solve the linear Newton step: gaps close, sticking nodes go back to their spots, slipping ones obey friction.
    stiffness : from ``ContactStiffness.among``: (j, j) N/m, and its rows' positions (j,) among all 3 k + c unknowns
    direction : (3,), in which the indenter moves if it ``deepens``
    Raises UnsolvedError if no motion of the slipping nodes balances their forces."""
    inverse, rows = stiffness
    known = known_motion(points, motion, slipping, direction, 2 if deepens else 1)
    forces = moving_forces(inverse, rows, known)
    bearing, moved = borne(forces, known, motion.moves, slipping, direction)
    count = len(slipping.at)
    if not count:
        return Change(forces, bearing, moved, np.empty((0, known.shape[1])))
    system, right = slip_system(inverse, rows, len(known), slipping, bearing)
    answer = np.ascontiguousarray(_solved(system, right))
    slide(known, answer, slipping)
    forces = moving_forces(inverse, rows, known)
    bearing, moved = borne(forces, known, motion.moves, slipping, direction)
    return Change(forces, bearing, moved, answer[count:])


def _solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve the system (j, j) for ``right`` (j, r); overwrites the matrix. Raises UnsolvedError if it is singular."""
    from scipy.linalg import lapack

    # LAPACK stores by columns: what it takes for the transposed matrix needs no copy.
    factor, pivots, failed = lapack.sgetrf(matrix.T, overwrite_a=1)
    if failed:
        raise UnsolvedError("no motion of the slipping nodes balances their forces")
    return lapack.sgetrs(factor, pivots, right, trans=1)[0].astype(float)


def moving_forces(inverse: np.ndarray, rows: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return forces (m, r) N that move the unknowns ``rows`` (j,) by ``motion`` (m, r) m; inverse : (j, j) N/m"""
    forces = np.zeros(motion.shape)
    forces[rows] = (motion[rows].T.astype(np.float32) @ inverse).T
    return forces


@Loop
def borne(forces, known, moves, slipping, direction):  # noqa: ANN001, ANN201
    """Return forces (s, 3, r) N of slipping nodes, without the turn of normals, and motion (q, 3, r) m of curved ones.

    forces, known : (3 k + c, r) N, m; moves : (k, 3) m; the motion returned is relative to the indenter, which moves
        along the unit vector ``direction`` (3,)"""
    at, curved, columns = slipping.at, slipping.curved, forces.shape[1]
    bearing, moved = np.empty((len(at), 3, columns)), np.empty((len(curved), 3, columns))
    for a in range(len(at)):
        for i in range(3):
            for column in range(columns):
                bearing[a, i, column] = forces[3 * at[a] + i, column]
    for p in range(len(curved)):
        node = at[curved[p]]
        for column in range(columns):
            for i in range(3):
                moved[p, i, column] = known[3 * node + i, column]
                moved[p, i, column] += moves[node, i] if column == 0 else -direction[i]
            for i in range(3):
                for j in range(3):
                    bearing[curved[p], i, column] -= slipping.turning[p, i, j] * moved[p, j, column]
    return bearing, moved


@Loop
def slip_system(inverse, rows, size, slipping, bearing):  # noqa: ANN001, ANN201
    """Return the system (2 s, 2 s) and right side (2 s, r) for s nodes' slip along friction, m, and its turn, N.

    Its rows demand that no force is left along t - mu n (``lean``, ``normal``), and that t turns as its slip does.
    inverse : (j, j) N/m, of the compliance; rows : (j,), among ``size`` unknowns; bearing : (s, 3, r) N, of ``borne``
    """
    s, columns, curved = len(slipping.at), bearing.shape[2], slipping.curved
    system, right = np.empty((2 * s, 2 * s), np.float32), np.zeros((2 * s, columns))
    bend, at, ways, place = np.empty(s, np.int64), np.empty(s, np.int64), np.empty((2, 3)), np.empty(size, np.int64)
    mixed = np.empty(len(rows), np.float32)
    for j in range(len(rows)):
        place[rows[j]] = j
    for a in range(s):
        at[a], bend[a] = place[3 * slipping.at[a]], -1
    for p in range(len(curved)):
        bend[curved[p]] = p
    normal, lean, across, against = slipping.normal, slipping.lean, slipping.across, slipping.against
    for a in range(s):
        node, first, second, third = slipping.at[a], inverse[at[a]], inverse[at[a] + 1], inverse[at[a] + 2]
        for i in range(3):
            ways[0, i], ways[1, i] = lean[node, i] - slipping.friction * normal[node, i], across[a, i]
        for way in range(2):
            x, y, z = np.float32(ways[way, 0]), np.float32(ways[way, 1]), np.float32(ways[way, 2])
            for j in range(len(rows)):
                mixed[j] = x * first[j] + y * second[j] + z * third[j]
            for i in range(3):
                for j in range(3 if bend[a] >= 0 else 0):
                    mixed[at[a] + j] -= np.float32(ways[way, i] * slipping.turning[bend[a], i, j])
                for column in range(columns):
                    right[way * s + a, column] -= ways[way, i] * bearing[a, i, column]
            line = system[way * s + a]
            for b in range(s):
                x, y, z, other = mixed[at[b]], mixed[at[b] + 1], mixed[at[b] + 2], slipping.at[b]
                line[b] = x * lean[other, 0] + y * lean[other, 1] + z * lean[other, 2]
                line[s + b] = -against[b] * (x * across[b, 0] + y * across[b, 1] + z * across[b, 2])
        system[s + a, s + a] -= np.float32(1)
    return system, right


@Loop
def slide(known, answer, slipping):  # noqa: ANN001, ANN201
    """Add the motion of slipping nodes to the prescribed one, ``known`` (3 k + c, r) m, in place. answer : (2 s, r),
    from ``slip_system``: each node's slip along friction, m, then the turn of its friction, N"""
    s, lean, across, against = len(slipping.at), slipping.lean, slipping.across, slipping.against
    for a in range(s):
        node = slipping.at[a]
        for i in range(3):
            for column in range(known.shape[1]):
                way = lean[node, i] * answer[a, column] - across[a, i] * against[a] * answer[s + a, column]
                known[3 * node + i, column] += way


@Loop
def advance(force, core, change, step, slipping):  # noqa: ANN001, ANN201
    """Return the forces (k, 3) N on nodes and (c,) N on core points after a ``Change``, from force and core before it.
    Those of slipping nodes turn by at most 1 rad (friction) and 0.3 rad (normals). step : m, the indenter's travel"""
    forces, bearing, moved, turns = change
    k, new, new_core, last = len(force), force.copy(), core.copy(), forces.shape[1] - 1
    for a in range(k):
        for i in range(3):
            new[a, i] += forces[3 * a + i, 0] + (step * forces[3 * a + i, 1] if last else 0.0)
    for p in range(len(core)):
        new_core[p] += forces[3 * k + p, 0] + (step * forces[3 * k + p, 1] if last else 0.0)
    normal, lean, across, curved = slipping.normal, slipping.lean, slipping.across, slipping.curved
    place, u, v, tilt = 0, np.empty(3), np.empty(3), np.empty(3)
    for a in range(len(slipping.at)):
        node, total = slipping.at[a], slipping.pressing[a]
        for i in range(3):
            total += normal[node, i] * (bearing[a, i, 0] + (step * bearing[a, i, 1] if last else 0.0))
        turn = turns[a, 0] + (step * turns[a, 1] if last else 0.0)
        turn = min(max(turn / slipping.limit[a], -LARGEST_TURN), LARGEST_TURN)
        for i in range(3):
            u[i] = normal[node, i]
            v[i] = np.cos(turn) * lean[node, i] + np.sin(turn) * across[a, i]
        if place < len(curved) and curved[place] == a:
            size = 0.0
            for i in range(3):
                tilt[i] = 0.0
                for j in range(3):
                    way = moved[place, j, 0] + (step * moved[place, j, 1] if last else 0.0)
                    tilt[i] += slipping.bend[place, i, j] * way
                size += tilt[i] * tilt[i]
            share, size = min(1.0, LARGEST_TILT / max(np.sqrt(size), 1e-12)), 0.0
            for i in range(3):
                u[i] += share * tilt[i]
                size += u[i] * u[i]
            for i in range(3):
                u[i] /= np.sqrt(size)
            place += 1
        onto = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
        size = 0.0
        for i in range(3):
            v[i] -= onto * u[i]
            size += v[i] * v[i]
        for i in range(3):
            new[node, i] = total * (u[i] + slipping.friction * v[i] / np.sqrt(size))
    return new, new_core
