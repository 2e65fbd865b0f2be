"""Sensing points of a skin's inner side: the feet over electrodes, nodes over the core, and nodes beside it."""

from __future__ import annotations

import dataclasses
import functools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ... import sensors
from ...sensors import unrolling
from ..solids.biotac_core import Core, above_core, facing_core
from ..solids.hex_mesh import HexMesh, skin_mesh
from .condense import axes_of, mirror_nodes

if TYPE_CHECKING:
    from scipy import sparse

ON_PLANE = 1e-9  # m, z of nodes on the mirror plane but for rounding


class SensingPoints(NamedTuple):
    """Linear map from nodal displacements to changes of w gaps, sparse (3 n_nodes, w), and the gaps at rest.

    rows, columns : (k,) int; weights : (k,); gap : (w,) m
    """

    rows: np.ndarray
    columns: np.ndarray
    weights: np.ndarray
    gap: np.ndarray

    def matrix(self, size: int, points: np.ndarray) -> sparse.csc_array:
        """Return columns ``points`` (p,), sorted, of the matrix (size, p); size : 3 n_nodes"""
        from scipy import sparse

        chosen = np.isin(self.columns, points)
        at = self.rows[chosen], np.searchsorted(points, self.columns[chosen])
        return sparse.csc_array((self.weights[chosen], at), shape=(size, len(points)))


def sensing_points_of(sensor: str, mesh: HexMesh) -> SensingPoints:
    """List the points: feet over electrodes, each in a triangle of nodes; inner nodes over the core, then beside it."""
    if not len(mesh.inner):
        return SensingPoints(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0))
    feet = electrode_feet(sensor)
    corners = sensors.skin_of(sensor).skin_surface("inner").faces[feet.face]
    core_nodes, core_out, core_gap = _over_core(sensor, mesh)
    side_nodes, side_out, side_gap = _beside_core(sensor, mesh)
    nodes = mesh.inner[np.r_[corners.ravel(), core_nodes, side_nodes]]
    single = len(core_nodes) + len(side_nodes)
    columns = np.r_[np.repeat(np.arange(len(feet.gap)), 3), len(feet.gap) + np.arange(single)]
    out = np.concatenate([(feet.weights[..., None] * feet.outward[:, None]).reshape(-1, 3), core_out, side_out])
    return SensingPoints(axes_of(nodes), np.repeat(columns, 3), out.ravel(), np.r_[feet.gap, core_gap, side_gap])


def sensing_nodes(sensor: str = sensors.SOURCE) -> np.ndarray:
    """Return the inner skin's free nodes (f,) in the order of their sensing points, which follow the electrodes'."""
    mesh = skin_mesh(sensor)
    return np.r_[facing_nodes(sensor, mesh), _beside(sensor, mesh)]


@dataclasses.dataclass(frozen=True)
class ElectrodeFeet:
    """Ends of the film over each of e electrodes, on the inner skin.

    face : (e,) triangle; weights : (e, 3) of its nodes; outward : (e, 3) unit, from the electrode; gap : (e,) m"""

    face: np.ndarray
    weights: np.ndarray
    outward: np.ndarray
    gap: np.ndarray


@functools.cache
def electrode_feet(sensor: str = sensors.SOURCE) -> ElectrodeFeet:
    """Find the resting inner skin's point nearest to each electrode; gaps .49 to 1.76 mm (published: .51 to 1.76)."""
    positions = sensors.electrodes(sensor)
    face, weights, place = unrolling.closest_on_triangles(sensors.skin_of(sensor).skin_surface("inner"), positions)
    gap = np.linalg.norm(place - positions, axis=1)
    return ElectrodeFeet(face, weights, (place - positions) / gap[:, None], gap)


def _over_core(sensor: str, mesh: HexMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Free inner nodes under the pad that face the core: node, its normal there (n, 3), gap (n,) m; even in z."""
    nodes = facing_nodes(sensor, mesh)
    mirrored, right = _right_images(sensor, nodes)
    gap, outward = Core(sensor).distance(_inner(sensor)[right])
    return nodes, np.where(mirrored[:, None], outward * [1.0, 1.0, -1.0], outward), gap


def _beside_core(sensor: str, mesh: HexMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Free inner nodes that never meet the core: node, direction from its nearest point (n, 3), gap (n,) m."""
    nodes = _beside(sensor, mesh)
    mirrored, right = _right_images(sensor, nodes)
    outward, gap = above_core(sensor)
    return nodes, np.where(mirrored[:, None], outward[right] * [1.0, 1.0, -1.0], outward[right]), gap[right]


def _inner(sensor: str) -> np.ndarray:
    """Resting inner skin (n, 3) m."""
    return sensors.skin_of(sensor).skin_surface("inner").rest


def _right_images(sensor: str, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mark inner-skin nodes (n,) with z < 0, (n,) bool, and return each node (n,), or its mirror image for these."""
    rest = _inner(sensor)
    mirrored = rest[nodes, 2] < -ON_PLANE
    return mirrored, np.where(mirrored, mirror_nodes(rest)[nodes], nodes)


def _beside(sensor: str, mesh: HexMesh) -> np.ndarray:
    """Free inner nodes that do not face the core, each with its mirror image."""
    free = ~mesh.clamped[mesh.inner]
    free &= free[mirror_nodes(_inner(sensor))]
    free[facing_nodes(sensor, mesh)] = False
    return np.flatnonzero(free)


def facing_nodes(sensor: str, mesh: HexMesh) -> np.ndarray:
    """Return the inner nodes (f,) that may come to press on the core, each with its mirror image."""
    inner = _inner(sensor)
    faces = facing_core(sensor, inner) & ~mesh.clamped[mesh.inner]
    return np.flatnonzero(faces & faces[mirror_nodes(inner)])


def images(sensor: str, mesh: HexMesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return for each of ``count`` sensing points itself or its image with z >= 0, (count,), and if it is the image."""
    source, mirrored = np.arange(count), np.zeros(count, bool)
    first = count
    for nodes in (_beside(sensor, mesh), facing_nodes(sensor, mesh)) if count else ():
        first -= len(nodes)
        here = slice(first, first + len(nodes))
        mirrored[here], right = _right_images(sensor, nodes)
        source[here] = first + np.searchsorted(nodes, right)
    return source, mirrored
