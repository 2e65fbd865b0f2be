"""Sensing points on a skin's inner side: nearest to electrodes (feet), nodes that face the core, nodes beside it."""

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
    """Linear map from nodal displacements to changes of w gaps, and the gaps at rest.

    rows, columns, weights : (k,), entries of the map's sparse matrix (3 n_nodes, w); gap : (w,) m, at rest"""

    rows: np.ndarray
    columns: np.ndarray
    weights: np.ndarray
    gap: np.ndarray

    def matrix(self, size: int, points: np.ndarray) -> sparse.csc_array:
        """Return columns ``points`` (p,), sorted, of the map's sparse matrix (size, p); size : 3 n_nodes"""
        from scipy import sparse

        chosen = np.isin(self.columns, points)
        at = self.rows[chosen], np.searchsorted(points, self.columns[chosen])
        return sparse.csc_array((self.weights[chosen], at), shape=(size, len(points)))


def sensing_points_of(sensor: str, mesh: HexMesh) -> SensingPoints:
    """Return the sensing points of a sensor's ``mesh``: for each electrode the nearest point of the inner skin (within
    a triangle of nodes), then the inner nodes that are not clamped: those that face the core, then the others; empty
    for a gel."""
    if not len(mesh.inner):
        return SensingPoints(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0))
    feet = electrode_feet(sensor)
    corners = sensors.skin_of(sensor).skin_surface("inner").faces[feet.face]
    free, outward, gap = _free_nodes(sensor, mesh)
    nodes = mesh.inner[np.r_[corners.ravel(), free]]
    columns = np.r_[np.repeat(np.arange(len(feet.gap)), 3), len(feet.gap) + np.arange(len(free))]
    out = np.concatenate([(feet.weights[..., None] * feet.outward[:, None]).reshape(-1, 3), outward])
    return SensingPoints(axes_of(nodes), np.repeat(columns, 3), out.ravel(), np.r_[feet.gap, gap])


def sensing_nodes(sensor: str = sensors.SOURCE) -> np.ndarray:
    """Return the inner skin's free nodes (f,), numbered on its lattice, in the order of their sensing points: facing
    the core, then beside it. In the list of all sensing points those of the electrodes come before them."""
    mesh = skin_mesh(sensor)
    return np.r_[facing_nodes(sensor, mesh), _beside(sensor, mesh)]


@dataclasses.dataclass(frozen=True)
class ElectrodeFeet:
    """Point of the inner skin nearest to each of e electrodes: there the fluid film over the electrode ends.
    face : (e,) triangle in the inner surface's ``faces``; weights : (e, 3) of its nodes
    outward : (e, 3) unit, from the electrode; gap : (e,) m"""

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


def _free_nodes(sensor: str, mesh: HexMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the inner nodes that can move, (n,), those that face the core before those beside it, the direction (n, 3)
    from the core's nearest point to each, and its gap (n,) m; all mirror symmetric in z."""
    facing = facing_nodes(sensor, mesh)
    nodes = np.r_[facing, _beside(sensor, mesh)]
    mirrored, right = _right_images(sensor, nodes)
    outward, gap = (values[right] for values in above_core(sensor))
    over = slice(0, len(facing))
    gap[over], outward[over] = Core(sensor).distance(_inner(sensor)[right[over]])
    return nodes, np.where(mirrored[:, None], outward * [1.0, 1.0, -1.0], outward), gap


def _inner(sensor: str) -> np.ndarray:
    """Return the resting inner skin's nodes (n, 3) m."""
    return sensors.skin_of(sensor).skin_surface("inner").rest


def _right_images(sensor: str, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which inner-skin nodes (n,) have z < 0, (n,) bool, and the nodes (n,), for these their mirror images."""
    rest = _inner(sensor)
    mirrored = rest[nodes, 2] < -ON_PLANE
    return mirrored, np.where(mirrored, mirror_nodes(rest)[nodes], nodes)


def _beside(sensor: str, mesh: HexMesh) -> np.ndarray:
    """Return the inner nodes that can move and do not face the core; with each its mirror image is among them."""
    free = ~mesh.clamped[mesh.inner]
    free &= free[mirror_nodes(_inner(sensor))]
    free[facing_nodes(sensor, mesh)] = False
    return np.flatnonzero(free)


def facing_nodes(sensor: str, mesh: HexMesh) -> np.ndarray:
    """Return the inner lattice's nodes (f,), ascending, that may press on the core; mirror images are among them."""
    inner = _inner(sensor)
    faces = facing_core(sensor, inner) & ~mesh.clamped[mesh.inner]
    return np.flatnonzero(faces & faces[mirror_nodes(inner)])


def images(sensor: str, mesh: HexMesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return, for each of ``count`` sensing points, the index (count,) of the point to solve in its place, and whether
    that is its mirror image, (count,) bool: true for free nodes at z < 0; all others are solved themselves.
    """
    source, mirrored = np.arange(count), np.zeros(count, bool)
    first = count
    for nodes in (_beside(sensor, mesh), facing_nodes(sensor, mesh)) if count else ():
        first -= len(nodes)
        here = slice(first, first + len(nodes))
        mirrored[here], right = _right_images(sensor, nodes)
        source[here] = first + np.searchsorted(nodes, right)
    return source, mirrored
