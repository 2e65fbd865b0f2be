"""Compiled loops of the frictionless solver; the formulas stand in ``frictionless`` and ``compliance_block``."""

from __future__ import annotations

import numpy as np

from ...files.compiled import Loop


@Loop
def normal_compliance(matrix, normal, c, ridge):  # noqa: ANN001, ANN201
    """See ``ComplianceBlock.normal``."""
    k = len(normal)
    gaps, half = np.empty((k + c, k + c)), np.empty(3 * k + c)
    for a in range(k):
        x, y, z = normal[a, 0], normal[a, 1], normal[a, 2]
        first, second, third = matrix[3 * a], matrix[3 * a + 1], matrix[3 * a + 2]
        for j in range(len(half)):
            half[j] = x * first[j] + y * second[j] + z * third[j]
        for b in range(k):
            gaps[a, b] = half[3 * b] * normal[b, 0] + half[3 * b + 1] * normal[b, 1] + half[3 * b + 2] * normal[b, 2]
        for p in range(c):
            gaps[a, k + p] = gaps[k + p, a] = half[3 * k + p]
    for p in range(c):
        for q in range(c):
            gaps[k + p, k + q] = matrix[3 * k + p, 3 * k + q]
    for a in range(k + c):
        gaps[a, a] *= 1 + ridge
    return gaps


@Loop
def tangent_response(matrix, k, nodes, tangent, normal, touching, core):  # noqa: ANN001, ANN201
    """Compute what unit forces along weighted tangents (q, 3) at ``nodes`` (q,) move.

    Returns the motion along them (q, q), and of the gaps (q, t + d) of the touching nodes (t,) and of the points
    (d,) that press on the core.
    """
    q, t, d = len(nodes), len(touching), len(core)
    among, onto_gaps = np.empty((q, q)), np.empty((q, t + d))
    for each in range(q):
        x, y, z = tangent[each, 0], tangent[each, 1], tangent[each, 2]
        first, second, third = matrix[3 * nodes[each]], matrix[3 * nodes[each] + 1], matrix[3 * nodes[each] + 2]
        for b in range(t):
            total = 0.0
            for i in range(3):
                j = 3 * touching[b] + i
                total += (x * first[j] + y * second[j] + z * third[j]) * normal[touching[b], i]
            onto_gaps[each, b] = total
        for b in range(d):
            j = 3 * k + core[b]
            onto_gaps[each, t + b] = x * first[j] + y * second[j] + z * third[j]
        for other in range(q):
            total = 0.0
            for i in range(3):
                j = 3 * nodes[other] + i
                total += (x * first[j] + y * second[j] + z * third[j]) * tangent[other, i]
            among[each, other] = total
    return among, onto_gaps
