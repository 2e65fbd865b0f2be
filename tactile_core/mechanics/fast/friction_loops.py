"""Compiled loops of the friction solver: what ``friction`` and ``stick_slip`` do in numpy, where the formulas stand.

Arrays: force, place, normal, ... (k, 3) float64, bool masks, ``matrix`` (3 k + c, 3 k + c) float32 of the block.
"""

from __future__ import annotations

import numpy as np

from ...files.compiled import Loop
from .mirror_symmetry import axes_of


@Loop
def respond(matrix, force, core):  # noqa: ANN001, ANN201
    """Compute the displacement (k, 3) m of nodes and motion (c,) m of the core's points under forces (k, 3), (c,) N."""
    k, c = force.shape[0], core.shape[0]
    size = 3 * k + c
    moved = np.zeros(size)
    for row in range(size):
        load = force[row // 3, row % 3] if row < 3 * k else core[row - 3 * k]
        if load != 0.0:
            line = matrix[row]
            for column in range(size):
                moved[column] += load * line[column]
    return moved[: 3 * k].copy().reshape(k, 3), moved[3 * k :].copy()


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


def assemble(  # noqa: ANN201
    matrix, k, stuck, core_at, slipping, normal, lean, force, slip, gap, core_gap, moves, curved, bend, direction,  # noqa: ANN001
    friction, ridge, least,  # noqa: ANN001
):  # fmt: skip
    """Assemble the system of a Newton step and its two right sides; see ``stick_slip.Step``.

    stuck, slipping : nodes (t,), (s,) that stick and slip; core_at : (d,) points that press
    curved : (q,), which of the slipping nodes' normals turn; bend : (q, 3, 3) 1/m
    Returns system (j, j) float32, right (j, 2), carry (j,), across (s, 3) and pressing (s,) of the slipping nodes.
    """
    s, q = len(slipping), len(curved)
    n = 3 * len(stuck) + len(core_at)
    base, total = n + 3 * s, n + 2 * s + 3 * q
    index = np.concatenate([axes_of(stuck), 3 * k + core_at, axes_of(slipping)])
    across, pressing, turning = np.empty((s, 3)), np.empty(s), np.empty((q, 3, 3))
    columns, system = np.empty((base, total), np.float32), np.empty((total, total), np.float32)
    right, carry = np.zeros((total, 2)), np.zeros(total)
    _slipping_frames(slipping, normal, lean, force, curved, bend, friction, across, pressing, turning)
    _fill_columns(matrix, index, n, slipping, normal, lean, across, curved, turning, friction, ridge, columns)
    _fill_rows(columns, n, slipping, normal, across, curved, system)
    _fill_right(
        stuck, core_at, slipping, normal, lean, across, pressing, slip, gap, core_gap, moves, curved, turning,
        direction, friction, least, system, right, carry,
    )  # fmt: skip
    return system, right, carry, across, pressing


@Loop
def _slipping_frames(slipping, normal, lean, force, curved, bend, friction, across, pressing, turning):  # noqa: ANN001, ANN202
    """Directions across friction, normal forces, and the turn of curved nodes' forces; see ``stick_slip.Slipping``."""
    for a in range(len(slipping)):
        node = slipping[a]
        across[a, 0] = normal[node, 1] * lean[node, 2] - normal[node, 2] * lean[node, 1]
        across[a, 1] = normal[node, 2] * lean[node, 0] - normal[node, 0] * lean[node, 2]
        across[a, 2] = normal[node, 0] * lean[node, 1] - normal[node, 1] * lean[node, 0]
        pressing[a] = 0.0
        for i in range(3):
            pressing[a] += force[node, i] * normal[node, i]
    for p in range(len(curved)):
        node = slipping[curved[p]]
        for j in range(3):
            onto = 0.0
            for i in range(3):
                onto += lean[node, i] * bend[p, i, j]
            for i in range(3):
                turning[p, i, j] = pressing[curved[p]] * (bend[p, i, j] - friction * normal[node, i] * onto)


@Loop
def _fill_columns(matrix, index, n, slipping, normal, lean, across, curved, turning, friction, ridge, columns):  # noqa: ANN001, ANN202
    """Rows ``index`` (m,) of the matrix in the unknowns' columns, (m, total)."""
    s = len(slipping)
    line = np.empty(matrix.shape[1], np.float32)
    for r in range(len(index)):
        for j in range(len(line)):
            line[j] = matrix[index[r], j]
        line[index[r]] *= np.float32(1 + ridge)
        for b in range(n):
            columns[r, b] = line[index[b]]
        for a in range(s):
            pushed, turned = 0.0, 0.0
            for i in range(3):
                entry = line[3 * slipping[a] + i]
                pushed += entry * (normal[slipping[a], i] + friction * lean[slipping[a], i])
                turned += entry * across[a, i]
            columns[r, n + a] = pushed
            columns[r, n + s + a] = turned
        for p in range(len(curved)):
            for j in range(3):
                felt = 0.0
                for i in range(3):
                    felt += line[3 * slipping[curved[p]] + i] * turning[p, i, j]
                columns[r, n + 2 * s + 3 * p + j] = felt


@Loop
def _fill_rows(columns, n, slipping, normal, across, curved, system):  # noqa: ANN001, ANN202
    """The system's rows (total, total): those of slipping nodes along their normals and across, and of curved ones."""
    s, total = len(slipping), system.shape[1]
    for r in range(n):
        for b in range(total):
            system[r, b] = columns[r, b]
    for a in range(s):
        node = slipping[a]
        for b in range(total):
            x, y, z = columns[n + 3 * a, b], columns[n + 3 * a + 1, b], columns[n + 3 * a + 2, b]
            system[n + a, b] = x * normal[node, 0] + y * normal[node, 1] + z * normal[node, 2]
            system[n + s + a, b] = x * across[a, 0] + y * across[a, 1] + z * across[a, 2]
    for p in range(len(curved)):
        for i in range(3):
            at = n + 2 * s + 3 * p + i
            for b in range(total):
                system[at, b] = -columns[n + 3 * curved[p] + i, b]
            system[at, at] += np.float32(1)


@Loop
def _fill_right(  # noqa: ANN202
    stuck, core_at, slipping, normal, lean, across, pressing, slip, gap, core_gap, moves, curved, turning, direction,  # noqa: ANN001
    friction, least, system, right, carry,  # noqa: ANN001
):  # fmt: skip
    """Right sides (total, 2), what carries force along the motion (total,), and friction's stiffness in the system."""
    t, d, s = len(stuck), len(core_at), len(slipping)
    n = 3 * t + d
    for a in range(t):
        for i in range(3):
            right[3 * a + i, 0] = -(slip[stuck[a], i] + gap[stuck[a]] * normal[stuck[a], i])
            right[3 * a + i, 1] = direction[i]
            carry[3 * a + i] = direction[i]
    for p in range(d):
        right[3 * t + p, 0] = -core_gap[core_at[p]]
    for a in range(s):
        node, against = slipping[a], 0.0
        for i in range(3):
            away = slip[node, i] + gap[node] * normal[node, i]
            right[n + a, 0] -= normal[node, i] * away
            right[n + s + a, 0] -= across[a, i] * away
            right[n + a, 1] += normal[node, i] * direction[i]
            right[n + s + a, 1] += across[a, i] * direction[i]
            carry[n + a] += direction[i] * (normal[node, i] + friction * lean[node, i])
            carry[n + s + a] += direction[i] * across[a, i]
            against -= slip[node, i] * lean[node, i]
        system[n + s + a, n + s + a] += np.float32(max(against, 0.0) / (friction * max(pressing[a], least)))
    for p in range(len(curved)):
        for i in range(3):
            at = n + 2 * s + 3 * p + i
            right[at, 0] = moves[slipping[curved[p]], i]
            right[at, 1] = -direction[i]
            for j in range(3):
                carry[at] += direction[j] * turning[p, j, i]


@Loop
def advance(  # noqa: ANN201
    force, core, answer, step, stuck, core_at, slipping, normal, lean, across, pressing, curved, bend, friction, least,  # noqa: ANN001
    largest_turn, largest_tilt,  # noqa: ANN001
):  # fmt: skip
    """Compute forces (k, 3), (c,) N after a Newton step; answer : (j, 2), for rest and for a metre of ``step``."""
    t, d, s = len(stuck), len(core_at), len(slipping)
    n = 3 * t + d
    new, new_core = force.copy(), core.copy()
    for a in range(t):
        for i in range(3):
            new[stuck[a], i] += answer[3 * a + i, 0] + step * answer[3 * a + i, 1]
    for p in range(d):
        new_core[core_at[p]] += answer[3 * t + p, 0] + step * answer[3 * t + p, 1]
    place, u, v, tilt = 0, np.empty(3), np.empty(3), np.empty(3)
    for a in range(s):
        node = slipping[a]
        turn = (answer[n + s + a, 0] + step * answer[n + s + a, 1]) / (friction * max(pressing[a], least))
        turn = min(max(turn, -largest_turn), largest_turn)
        for i in range(3):
            u[i] = normal[node, i]
            v[i] = np.cos(turn) * lean[node, i] + np.sin(turn) * across[a, i]
        if place < len(curved) and curved[place] == a:
            at, size = n + 2 * s + 3 * place, 0.0
            for i in range(3):
                tilt[i] = 0.0
                for j in range(3):
                    tilt[i] += bend[place, i, j] * (answer[at + j, 0] + step * answer[at + j, 1])
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
        total = pressing[a] + answer[n + a, 0] + step * answer[n + a, 1]
        for i in range(3):
            new[node, i] = total * (u[i] + friction * v[i] / np.sqrt(size))
    return new, new_core


def sort(  # noqa: ANN201
    force, core, active, slips, normal, lean, off, gap, core_gap, turned, stuck_again, left, friction, least, noise,  # noqa: ANN001
    gap_tolerance, slip_tolerance, sideways_tolerance, beyond, beyond_wavering, wavers, may_be_empty,  # noqa: ANN001
):  # fmt: skip
    """Sort points into touching and slipping ones after a step, and check whether nodes are where they belong.

    Returns active (k + c,), slips (k,), changed, settled, the largest gap, m, of what touches, and that or the deepest
    place in the indenter. ``force`` of nodes that touch again, ``stuck_again`` and ``left`` (k,) are updated in place.
    may_be_empty : whether no contact at all is an answer
    """
    new_active, new_slips, changed, any_active, deepest, widest, wide_slip, tilted, size = _sort_points(
        force, core, active, slips, normal, lean, off, gap, core_gap, turned, stuck_again, friction, least, noise,
        gap_tolerance, slip_tolerance, beyond, beyond_wavering, wavers,
    )  # fmt: skip
    settled = not changed and (any_active or may_be_empty) and deepest >= -gap_tolerance and widest <= gap_tolerance
    if settled and wide_slip <= slip_tolerance and tilted <= sideways_tolerance * size:
        return new_active, new_slips, changed, True, 0.0, 0.0
    wrong = _come_back(force, active, new_active, new_slips, normal, off, gap, turned, left, friction, least)
    return new_active, new_slips, changed, False, wrong, max(-deepest, wrong)


@Loop
def _sort_points(  # noqa: ANN202
    force, core, active, slips, normal, lean, off, gap, core_gap, turned, stuck_again, friction, least, noise,  # noqa: ANN001
    gap_tolerance, slip_tolerance, beyond, beyond_wavering, wavers,  # noqa: ANN001
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
            over = beyond if stuck_again[a] < wavers else beyond_wavering
            if slips[a]:
                new_slips[a] = slip_lean <= slip_tolerance
            else:
                new_slips[a] = sideways > friction * pressing * (1 + over) + least
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
