"""Compiled loops of indenters' signed distances; the formulas stand in ``sphere``, ``box``, ``extrusion``, ``circle``.

Each takes points (n, 3) m, contiguous, and gives distances (n,) m and gradients (n, 3). nearest : m, see ``NEAREST``
"""

from __future__ import annotations

import numpy as np

from ...files.compiled import Loop


@Loop
def from_ball(points, radius, nearest):  # noqa: ANN001, ANN201
    """See ``Sphere.distance``."""
    distance, gradient = np.empty(len(points)), np.empty((len(points), 3))
    for p in range(len(points)):
        x, y, z = points[p, 0], points[p, 1], points[p, 2] - radius
        length = np.sqrt(x * x + y * y + z * z)
        if length < nearest:
            x, y, z, length = 0.0, 0.0, -nearest, nearest
        distance[p] = length - radius
        gradient[p, 0], gradient[p, 1], gradient[p, 2] = x / length, y / length, z / length
    return distance, gradient


@Loop
def from_box(points, middle, inner, edge):  # noqa: ANN001, ANN201
    """See ``Box.distance``; middle, inner : (3,) m."""
    distance, gradient = np.empty(len(points)), np.empty((len(points), 3))
    for p in range(len(points)):
        square, face, deepest = 0.0, 0, -np.inf
        for i in range(3):
            out = abs(points[p, i] - middle[i]) - inner[i]
            if out > deepest:
                face, deepest = i, out
            beyond = max(out, 0.0)
            gradient[p, i] = beyond
            square += beyond * beyond
        corner = np.sqrt(square)
        distance[p], far = corner - edge, corner
        if corner == 0:
            distance[p] += deepest
            gradient[p, face], far = 1.0, 1.0
        for i in range(3):
            gradient[p, i] = np.copysign(gradient[p, i], points[p, i] - middle[i]) / far
    return distance, gradient


@Loop
def from_cylinder(points, axis, middle, radius, half_span, edge, nearest):  # noqa: ANN001, ANN201
    """See ``extrusion.distance`` of a ``disc`` drawn out along an own axis about a middle (3,) m."""
    distance, gradient = np.empty(len(points)), np.empty((len(points), 3))
    first, second = (axis + 1) % 3, (axis + 2) % 3
    for p in range(len(points)):
        x, y = points[p, first] - middle[first], points[p, second] - middle[second]
        along = points[p, axis] - middle[axis]
        length = np.sqrt(x * x + y * y)
        if length < nearest:
            x, y, length = 0.0, -nearest, nearest
        side, end = length - radius, abs(along) - half_span
        across, beyond = max(side, 0.0), max(end, 0.0)
        corner = np.sqrt(across * across + beyond * beyond)
        distance[p], far = corner - edge, corner
        if corner == 0:
            distance[p] += max(side, end)
            across, beyond, far = (1.0, 0.0, 1.0) if side > end else (0.0, 1.0, 1.0)
        gradient[p, first], gradient[p, second] = across / far * (x / length), across / far * (y / length)
        gradient[p, axis] = np.copysign(beyond / far, along)
    return distance, gradient


@Loop
def from_circle(points, radius, nearest):  # noqa: ANN001, ANN201
    """See ``circle.circle_distance``."""
    distance, gradient = np.empty(len(points)), np.empty((len(points), 3))
    for p in range(len(points)):
        x, y, above = points[p, 0], points[p, 1], points[p, 2]
        around = np.sqrt(x * x + y * y)
        right, up = (x / around, y / around) if around >= nearest else (1.0, 0.0)
        outward = around - radius
        length = np.sqrt(outward * outward + above * above)
        if length < nearest:
            outward, above, length = 0.0, -nearest, nearest
        distance[p] = length
        gradient[p, 0], gradient[p, 1] = outward * right / length, outward * up / length
        gradient[p, 2] = above / length
    return distance, gradient
