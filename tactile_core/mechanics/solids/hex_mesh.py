"""Structured solids of 27-node hexahedra: the BioTac's skin and the DIGIT's gel."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ... import sensors

SKIN_LAYERS = 5  # nodes through the skin: two quadratic elements
# Through the gel, 0 = bonded back, 1 = surface: three quadratic elements, thinner toward the contact.
GEL_LAYERS = np.array([0.0, 0.25, 0.5, 0.65, 0.8, 0.9, 1.0])


@dataclasses.dataclass(frozen=True)
class HexMesh:
    """A solid of quadratic hexahedra.
    nodes : (n, 3) float64, m
    cells : (n_cells, 27) int, node a + 3 b + 9 c of a cell at (xi, eta, zeta) = (a, b, c) - 1
    clamped : (n,) bool, nodes that do not move
    surface : (n_surface,) int, nodes of the side that is touched, row by row (a ``skin_solid``'s poles last); in a mesh
        that is refined nowhere they are the nodes of the sensor's surface lattice
    inner : (n_inner,) int, likewise of the inner skin (empty for a gel)"""

    nodes: np.ndarray
    cells: np.ndarray
    clamped: np.ndarray
    surface: np.ndarray
    inner: np.ndarray


def hex_cells(ids: np.ndarray) -> np.ndarray:
    """Return the cells (n, 27) of 27-node hexahedra on a grid of node indices ``ids`` (odd, odd, odd).

    Repeated indices collapse an edge or a face, as at the skin's poles. Raises ValueError for an even size."""
    if any(size % 2 == 0 for size in ids.shape):
        raise ValueError(f"a grid of quadratic cells has odd sizes, got {ids.shape}")
    a, b, c = (slice(0, size - 2, 2) for size in ids.shape)
    corner = [ids[_shift(a, i), _shift(b, j), _shift(c, k)] for k in range(3) for j in range(3) for i in range(3)]
    return np.stack(corner, -1).reshape(-1, 27)


def _shift(part: slice, by: int) -> slice:
    return slice(part.start + by, part.stop + by, part.step)


def gel_solid(top: np.ndarray, back_y: float, layers: np.ndarray = GEL_LAYERS) -> HexMesh:
    """Return the gel below its surface ``top`` (rows, columns, 3) m, both odd, bonded at its flat back at ``back_y`` m.

    layers : places of the nodes through the gel, 0 = back, 1 = surface, an odd number"""
    back = top.copy()
    back[..., 1] = back_y
    nodes = back[..., None, :] + layers[:, None] * (top - back)[..., None, :]
    ids = np.arange(nodes[..., 0].size).reshape(nodes.shape[:-1])
    clamped = np.zeros(ids.size, bool)
    clamped[ids[..., 0]] = True
    return HexMesh(nodes.reshape(-1, 3), hex_cells(ids), clamped, ids[..., -1].ravel(), np.empty(0, int))


def skin_solid(outer: np.ndarray, inner: np.ndarray, glued: np.ndarray, layers: int = SKIN_LAYERS) -> HexMesh:
    """Return the skin between grids outer and inner (stations, columns, 3) m, whose first and last stations are poles.

    glued : (stations, columns) bool, inner points that do not move; layers : nodes through the skin, odd"""
    through = np.linspace(0, 1, layers)
    grid = inner[..., None, :] + through[:, None] * (outer - inner)[..., None, :]
    stations, columns = outer.shape[:2]
    ring = np.arange((stations - 2) * columns * layers).reshape(stations - 2, columns, layers)
    tip, base = ring.size + np.arange(layers), ring.size + layers + np.arange(layers)
    poles = [np.broadcast_to(pole, (1, columns, layers)) for pole in (tip, base)]
    ids = np.concatenate([poles[0], ring, poles[1]])
    nodes = np.concatenate([grid[1:-1].reshape(-1, 3), grid[0, 0], grid[-1, 0]])
    closed = np.concatenate([ids, ids[:, :1]], axis=1)

    def surface_ids(layer: int) -> np.ndarray:
        return np.concatenate([ring[..., layer].ravel(), tip[[layer]], base[[layer]]])

    clamped = np.zeros(len(nodes), bool)
    clamped[surface_ids(0)] = np.r_[glued[1:-1].ravel(), glued[0, 0], glued[-1, 0]]
    return HexMesh(nodes, hex_cells(closed), clamped, surface_ids(-1), surface_ids(0))


def inner_faces(mesh: HexMesh) -> np.ndarray:
    """Return the quadratic faces (n, 9) of the inner skin, outward from the fluid, node 3 a + b at (xi, eta) = (a, b) -
    1, as ``FluidCavity`` takes them."""
    faces = mesh.cells[:, :9]
    faces = faces[np.isin(faces, mesh.inner).all(axis=1)]
    return faces.reshape(-1, 3, 3).swapaxes(1, 2).reshape(-1, 9)


def outer_faces(mesh: HexMesh) -> np.ndarray:
    """Return the quadratic faces (n, 9) of the side that is touched, node 3 b + a at (xi, eta) = (a, b) - 1."""
    faces = mesh.cells[:, 18:]
    return faces[np.isin(faces, mesh.surface).all(axis=1)]


@functools.cache
def gel_mesh(sensor: str = sensors.TARGET) -> HexMesh:
    """Make the mesh of a sensor's gel, on the lattice of its surface; the DIGIT's has about 20,000 nodes."""
    shape = sensors.shape_of(sensor)
    surface = shape.surface()
    return gel_solid(surface.grid(surface.rest), shape.back_y)


@functools.cache
def skin_mesh(sensor: str = sensors.SOURCE) -> HexMesh:
    """Make the mesh of a sensor's skin, clamped where its inner side meets the core; the BioTac's has 18,200 nodes."""
    skin = sensors.skin_of(sensor)
    return skin_solid(skin.skin_grid("outer"), skin.skin_grid("inner"), glued_skin(sensor))


def solid_mesh(sensor: str) -> HexMesh:
    """Return the mesh of a sensor's solid: its gel, or its skin."""
    return gel_mesh(sensor) if sensors.is_gel(sensor) else skin_mesh(sensor)


@functools.cache
def glued_skin(sensor: str = sensors.SOURCE) -> np.ndarray:
    """Mark (stations, columns) bool the inner points of the skin's grid that lie on or in the core, or at its ends."""
    skin = sensors.skin_of(sensor)
    inner, held = skin.skin_grid("inner"), skin.descriptor.core
    x, y, z = inner.reshape(-1, 3).T
    radius = np.hypot(y - skin.axis_y, z)
    core = np.nan_to_num(skin.core_radius(x, np.arctan2(z, skin.axis_y - y)), nan=-1.0)
    glued = (core >= radius - held.attached) | (x > held.base_cap_x) | (x < held.tip_cap_x)
    return glued.reshape(inner.shape[:2])
