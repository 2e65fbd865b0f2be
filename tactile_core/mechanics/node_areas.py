"""Area of a sensor's surface that belongs to each of its nodes; force over area is traction."""

from __future__ import annotations

import functools

import numpy as np

from .solids.elasticity import quadratic
from .solids.hex_mesh import outer_faces, solid_mesh

_GAUSS = np.sqrt(0.6) * np.array([-1.0, 0, 1]), np.array([5.0, 8, 5]) / 9


@functools.cache
def node_areas(sensor: str) -> np.ndarray:
    """Return the area (n,) m2 of each resting surface node of a sensor: the integral of its shape function.
    Faces are quadratic: an even pressure loads corners, edges and middles as 1 : 4 : 16. The areas have the same
    ratios, so that nodal forces divided by them give the even pressure back. The array is shared and read-only."""
    mesh = solid_mesh(sensor)
    faces, areas = outer_faces(mesh), np.zeros(len(mesh.nodes))
    corners = mesh.nodes[faces].reshape(-1, 3, 3, 3)  # face, b along eta, a along xi, axis
    for xi, by_xi in zip(*_GAUSS, strict=True):
        for eta, by_eta in zip(*_GAUSS, strict=True):
            (along, slope_along), (across, slope_across) = quadratic(xi), quadratic(eta)
            first = np.einsum("fbai,b,a->fi", corners, across, slope_along)
            second = np.einsum("fbai,b,a->fi", corners, slope_across, along)
            area = by_xi * by_eta * np.linalg.norm(np.cross(first, second), axis=1)
            np.add.at(areas, faces, area[:, None] * np.outer(across, along).ravel())
    areas = areas[mesh.surface]
    areas.flags.writeable = False
    return areas


def traction(sensor: str, nodes: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the traction (n, 3) Pa on a resting surface with force (k, 3) N on ``nodes`` (k,); zero elsewhere.

    Its sum, weighted by ``node_areas``, is the sum of the forces."""
    areas = node_areas(sensor)
    found = np.zeros((len(areas), 3))
    found[nodes] = force / areas[nodes, None]
    return found
