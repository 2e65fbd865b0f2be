"""Compiled loops of the friction solver: what ``friction`` and ``stick_slip`` do in numpy, where the formulas stand.

Arrays: force, place, normal, ... (k, 3) float64, bool masks, ``matrix`` (3 k + c, 3 k + c) float32 of the block.
"""

from __future__ import annotations

import numpy as np

from ...files.compiled import Loop


@Loop
def respond(matrix, force, core):  # noqa: ANN001, ANN201
    """Compute the displacement (k, 3) m of nodes and motion (c,) m of the core's points under forces (k, 3), (c,) N."""
    k, c = force.shape[0], core.shape[0]
    size = 3 * k + c
    moved, displacement, core_moved = np.zeros(size), np.empty((k, 3)), np.empty(c)
    for row in range(size):
        load = force[row // 3, row % 3] if row < 3 * k else core[row - 3 * k]
        if load != 0.0:
            line = matrix[row]
            for column in range(size):
                moved[column] += load * line[column]
    for a in range(k):
        for i in range(3):
            displacement[a, i] = moved[3 * a + i]
    for p in range(c):
        core_moved[p] = moved[3 * k + p]
    return displacement, core_moved


@Loop
def reduce_to_law(force, core, active, slips, normal, friction, lean):  # noqa: ANN001, ANN201
    """Reduce guessed forces to Coulomb's law, in place; ``lean`` (k, 3) is set to the direction of friction."""
    k = force.shape[0]
    for a in range(k):
        for i in range(3):
            lean[a, i] = 0.0
            if not active[a]:
                force[a, i] = 0.0
        if not slips[a]:
            continue
        pressing = force[a, 0] * normal[a, 0] + force[a, 1] * normal[a, 1] + force[a, 2] * normal[a, 2]
        square = 0.0
        for i in range(3):
            lean[a, i] = force[a, i] - pressing * normal[a, i]
            square += lean[a, i] ** 2
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


@Loop
def linearise(moved, place, off, gap, normal, moves, slip, gap_then):  # noqa: ANN001, ANN201
    """Compute motion from the place (k, 3), slip from the spots (k, 3) and gaps (k,) m of the moved nodes."""
    for a in range(place.shape[0]):
        onto, along = 0.0, 0.0
        for i in range(3):
            moves[a, i] = moved[a, i] - place[a, i]
            onto += normal[a, i] * moves[a, i]
            along += off[a, i] * normal[a, i]
        for i in range(3):
            slip[a, i] = (off[a, i] - along * normal[a, i]) + moves[a, i] - onto * normal[a, i]
        gap_then[a] = gap[a] + onto


@Loop
def moving_forces(inverse, rows, motion):  # noqa: ANN001, ANN201
    """Forces (m, r) N that move the points of ``rows`` (j,) by their ``motion`` (m, r) m; inverse : (j, j) float32."""
    forces, sums = np.zeros(motion.shape), np.empty(len(rows), np.float32)
    for column in range(motion.shape[1]):
        sums[:] = 0
        for i in range(len(rows)):
            way, line = np.float32(motion[rows[i], column]), inverse[i]
            if way != 0:
                for j in range(len(rows)):
                    sums[j] += way * line[j]
        for j in range(len(rows)):
            forces[rows[j], column] = sums[j]
    return forces


@Loop
def known_motion(active, slip, gap, normal, lean, core_gap, slipping, direction, columns):  # noqa: ANN001, ANN201
    """Prescribed motion (3 k + c, columns) m of touching points; ``slipping`` nodes may slip in addition."""
    k = len(slip)
    motion = np.zeros((3 * k + len(core_gap), columns))
    for a in range(k):
        for i in range(3 if active[a] else 0):
            motion[3 * a + i, 0] = -(slip[a, i] + gap[a] * normal[a, i])
            for column in range(1, columns):
                motion[3 * a + i, column] = direction[i]
    for p in range(len(core_gap)):
        if active[k + p]:
            motion[3 * k + p, 0] = -core_gap[p]
    for a in slipping:
        for column in range(columns):
            along = 0.0
            for i in range(3):
                along += lean[a, i] * motion[3 * a + i, column]
            for i in range(3):
                motion[3 * a + i, column] -= lean[a, i] * along
    return motion


@Loop
def slipping_frames(slipping, normal, lean, force, slip, curved, bend, friction, least):  # noqa: ANN001, ANN201
    """See ``stick_slip.Slipping``: across (s, 3), pressing, limit and against (s,), and turning (q, 3, 3)."""
    s = len(slipping)
    across, pressing, limit, against = np.empty((s, 3)), np.zeros(s), np.empty(s), np.zeros(s)
    turning = np.empty((len(curved), 3, 3))
    for a in range(s):
        node = slipping[a]
        for i in range(3):
            j, h = (i + 1) % 3, (i + 2) % 3
            across[a, i] = normal[node, j] * lean[node, h] - normal[node, h] * lean[node, j]
            pressing[a] += force[node, i] * normal[node, i]
            against[a] -= slip[node, i] * lean[node, i]
        limit[a] = friction * max(pressing[a], least)
        against[a] = max(against[a], 0.0) / limit[a]
    for p in range(len(curved)):
        node = slipping[curved[p]]
        for j in range(3):
            onto = 0.0
            for i in range(3):
                onto += lean[node, i] * bend[p, i, j]
            for i in range(3):
                turning[p, i, j] = pressing[curved[p]] * (bend[p, i, j] - friction * normal[node, i] * onto)
    return across, pressing, limit, against, turning


@Loop
def borne(forces, motion, moves, slipping, curved, turning, direction):  # noqa: ANN001, ANN201
    """See ``stick_slip.Step._borne``: what slipping nodes bear (s, 3, r) N, and curved ones' motion (q, 3, r) m."""
    columns = forces.shape[1]
    bearing, moved = np.empty((len(slipping), 3, columns)), np.empty((len(curved), 3, columns))
    for a in range(len(slipping)):
        for i in range(3):
            for column in range(columns):
                bearing[a, i, column] = forces[3 * slipping[a] + i, column]
    for p in range(len(curved)):
        node = slipping[curved[p]]
        for column in range(columns):
            for i in range(3):
                moved[p, i, column] = motion[3 * node + i, column]
                moved[p, i, column] += moves[node, i] if column == 0 else -direction[i]
            for i in range(3):
                for j in range(3):
                    bearing[curved[p], i, column] -= turning[p, i, j] * moved[p, j, column]
    return bearing, moved


@Loop
def slip_system(inverse, rows, size, slipping, normal, lean, across, against, curved, turning, bearing, friction):  # noqa: ANN001, ANN201
    """System (2 s, 2 s) float32 and right (2 s, r) of the unknowns of slipping nodes; see ``stick_slip.Step``.

    rows : (j,) of the inverse, among ``size`` degrees of freedom
    """
    s, columns = len(slipping), bearing.shape[2]
    system, right = np.empty((2 * s, 2 * s), np.float32), np.zeros((2 * s, columns))
    bend, at, ways, place = np.empty(s, np.int64), np.empty(s, np.int64), np.empty((2, 3)), np.empty(size, np.int64)
    for j in range(len(rows)):
        place[rows[j]] = j
    for a in range(s):
        at[a], bend[a] = place[3 * slipping[a]], -1
    for p in range(len(curved)):
        bend[curved[p]] = p
    mixed = np.empty(inverse.shape[1], np.float32)
    for a in range(s):
        node, first, second, third = slipping[a], inverse[at[a]], inverse[at[a] + 1], inverse[at[a] + 2]
        for i in range(3):
            ways[0, i], ways[1, i] = lean[node, i] - friction * normal[node, i], across[a, i]
        for way in range(2):
            x, y, z = np.float32(ways[way, 0]), np.float32(ways[way, 1]), np.float32(ways[way, 2])
            for j in range(len(mixed)):
                mixed[j] = x * first[j] + y * second[j] + z * third[j]
            for i in range(3):
                for j in range(3 if bend[a] >= 0 else 0):
                    mixed[at[a] + j] -= np.float32(ways[way, i] * turning[bend[a], i, j])
                for column in range(columns):
                    right[way * s + a, column] -= ways[way, i] * bearing[a, i, column]
            line = system[way * s + a]
            for b in range(s):
                x, y, z, other = mixed[at[b]], mixed[at[b] + 1], mixed[at[b] + 2], slipping[b]
                line[b] = x * lean[other, 0] + y * lean[other, 1] + z * lean[other, 2]
                line[s + b] = -against[b] * (x * across[b, 0] + y * across[b, 1] + z * across[b, 2])
        system[s + a, s + a] -= np.float32(1)
    return system, right


@Loop
def slide(motion, answer, slipping, lean, across, against):  # noqa: ANN001, ANN201
    """Add the slip that belongs to the slipping nodes' unknowns (2 s, r) to ``motion`` (3 k + c, r) m."""
    s = len(slipping)
    for a in range(s):
        for i in range(3):
            for column in range(motion.shape[1]):
                way = lean[slipping[a], i] * answer[a, column] - across[a, i] * against[a] * answer[s + a, column]
                motion[3 * slipping[a] + i, column] += way


@Loop
def advance(  # noqa: ANN201
    force, core, forces, step, slipping, normal, lean, across, pressing, limit, curved, bend, bearing, moved, turns,  # noqa: ANN001
    friction, largest_turn, largest_tilt,  # noqa: ANN001
):  # fmt: skip
    """Compute forces (k, 3), (c,) N after a Newton step; forces : (3 k + c, r), for rest and for a metre of ``step``.

    turns : (s, r) N, of friction across itself
    """
    k, new, new_core, last = len(force), force.copy(), core.copy(), forces.shape[1] - 1
    for a in range(k):
        for i in range(3):
            new[a, i] += forces[3 * a + i, 0] + (step * forces[3 * a + i, 1] if last else 0.0)
    for p in range(len(core)):
        new_core[p] += forces[3 * k + p, 0] + (step * forces[3 * k + p, 1] if last else 0.0)
    place, u, v, tilt = 0, np.empty(3), np.empty(3), np.empty(3)
    for a in range(len(slipping)):
        node, total = slipping[a], pressing[a]
        for i in range(3):
            total += normal[node, i] * (bearing[a, i, 0] + (step * bearing[a, i, 1] if last else 0.0))
        turn = turns[a, 0] + (step * turns[a, 1] if last else 0.0)
        turn = min(max(turn / limit[a], -largest_turn), largest_turn)
        for i in range(3):
            u[i] = normal[node, i]
            v[i] = np.cos(turn) * lean[node, i] + np.sin(turn) * across[a, i]
        if place < len(curved) and curved[place] == a:
            size = 0.0
            for i in range(3):
                tilt[i] = 0.0
                for j in range(3):
                    way = moved[place, j, 0] + (step * moved[place, j, 1] if last else 0.0)
                    tilt[i] += bend[place, i, j] * way
                size += tilt[i] ** 2
            share, size = min(1.0, largest_tilt / max(np.sqrt(size), 1e-12)), 0.0
            for i in range(3):
                u[i] += share * tilt[i]
                size += u[i] ** 2
            for i in range(3):
                u[i] /= np.sqrt(size)
            place += 1
        onto = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
        size = 0.0
        for i in range(3):
            v[i] -= onto * u[i]
            size += v[i] ** 2
        for i in range(3):
            new[node, i] = total * (u[i] + friction * v[i] / np.sqrt(size))
    return new, new_core


def sort(  # noqa: ANN201
    force, core, active, slips, normal, lean, off, gap, core_gap, turned, stuck_again, left, friction, least, noise,  # noqa: ANN001
    gap_tolerance, slip_tolerance, sideways_tolerance, beyond, most_spare, wavers, may_be_empty,  # noqa: ANN001
):  # fmt: skip
    """Sort points into touching and slipping ones after a step, and check whether nodes are where they belong.

    Returns active (k + c,), slips (k,), changed, settled, the largest gap, m, of what touches, and that or the deepest
    place in the indenter. ``force`` of nodes that touch again, ``stuck_again`` and ``left`` (k,) are updated in place.
    may_be_empty : whether no contact at all is an answer
    """
    new_active, new_slips, changed, any_active, deepest, widest, wide_slip, tilted, size = _sort_points(
        force, core, active, slips, normal, lean, off, gap, core_gap, turned, stuck_again, friction, least, noise,
        gap_tolerance, slip_tolerance, beyond, most_spare, wavers,
    )  # fmt: skip
    settled = not changed and (any_active or may_be_empty) and deepest >= -gap_tolerance and widest <= gap_tolerance
    if settled and wide_slip <= slip_tolerance and tilted <= sideways_tolerance * size:
        return new_active, new_slips, changed, True, 0.0, 0.0
    wrong = _come_back(force, active, new_active, new_slips, normal, off, gap, turned, left, friction, least)
    return new_active, new_slips, changed, False, wrong, max(-deepest, wrong)


@Loop
def _sort_points(  # noqa: ANN202
    force, core, active, slips, normal, lean, off, gap, core_gap, turned, stuck_again, friction, least, noise,  # noqa: ANN001
    gap_tolerance, slip_tolerance, beyond, most_spare, wavers,  # noqa: ANN001
):  # fmt: skip
    """Sort points into touching and slipping ones, for `sort`.

    Also returns whether any node touched, the least gap of all, the largest gap and slip of what touched, m, how far
    forces turn with their normals, N, and the size of the whole force, N.
    """
    k, c = force.shape[0], core.shape[0]
    new_active, new_slips = np.empty(k + c, np.bool_), np.zeros(k, np.bool_)
    changed, any_active, deepest, widest, wide_slip, tilted = False, False, np.inf, 0.0, 0.0, 0.0
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
            slip_square += slip**2
            sideways += (force[a, i] - pressing * normal[a, i]) ** 2
            length += force[a, i] ** 2
        for i in range(3):
            tilted += (turned[a, i] - normal[a, i]) ** 2 * length
        sideways = np.sqrt(sideways)
        touches = pressing >= -least if active[a] else gap[a] < -noise
        new_active[a] = touches
        changed |= (active[a] and not touches) or (not active[a] and gap[a] < -gap_tolerance)
        if touches and active[a]:
            spare = least if stuck_again[a] < wavers else most_spare
            if slips[a]:
                new_slips[a] = slip_lean <= slip_tolerance
            else:
                new_slips[a] = sideways > friction * pressing * (1 + beyond) + spare
            changed |= new_slips[a] != slips[a]
        if slips[a] and not new_slips[a] and touches:
            stuck_again[a] += 1
        deepest = min(deepest, gap[a])
        if active[a]:
            any_active = True
            widest = max(widest, abs(gap[a]))
            free = slip_square
            if slips[a] and sideways > 0:  # what a node slips along its friction is free
                share = 0.0
                for i in range(3):
                    share += (off[a, i] - onto * normal[a, i]) * (force[a, i] - pressing * normal[a, i])
                free -= (share / max(sideways, 1e-30)) ** 2
            wide_slip = max(wide_slip, free)
    for p in range(c):
        touches = core[p] >= -least if active[k + p] else core_gap[p] < -noise
        new_active[k + p] = touches
        changed |= (active[k + p] and not touches) or (not active[k + p] and core_gap[p] < -gap_tolerance)
    size = np.sqrt(whole[0] ** 2 + whole[1] ** 2 + whole[2] ** 2)
    wide_slip = np.sqrt(max(wide_slip, 0.0))
    return new_active, new_slips, changed, any_active, deepest, widest, wide_slip, np.sqrt(tilted), size


@Loop
def _come_back(force, active, new_active, new_slips, normal, off, gap, turned, left, friction, least):  # noqa: ANN001, ANN202
    """Let nodes that touch again slip, and mark those that left; returns the largest gap, m, of what touches."""
    wrong = 0.0
    for a in range(len(left)):
        back = left[a] and new_active[a] and not active[a]
        left[a] = left[a] or (active[a] and not new_active[a])
        if new_active[a]:
            wrong = max(wrong, abs(gap[a]))
        if not back:
            continue
        onto, far = 0.0, 0.0
        for i in range(3):
            onto += off[a, i] * normal[a, i]
        for i in range(3):
            far += (off[a, i] - onto * normal[a, i]) ** 2
        far = np.sqrt(far)
        if far > 0:
            new_slips[a] = True
            for i in range(3):
                force[a, i] = least * (turned[a, i] - friction * (off[a, i] - onto * normal[a, i]) / far)
    return wrong
