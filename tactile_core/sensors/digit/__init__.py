"""The DIGIT's gel as a domed, structured solid: outline, dome and the lattice of surface and mesh nodes."""

from __future__ import annotations

import functools

import numpy as np

from ...geometry.lattice import Lattice, grid_faces
from ..descriptor import Gel, of_kind
from ..profiles import read_heights

DESCRIPTOR = of_kind("digit", Gel)
_OUTLINE, _DOME, _LATTICE = DESCRIPTOR.outline, DESCRIPTOR.dome, DESCRIPTOR.lattice
HALF_WIDTH, X_TIP, X_BASE = _OUTLINE.half_width, _OUTLINE.tip_x, _OUTLINE.base_x
CORNER_RADIUS = _OUTLINE.corner_radius
ARC_X = X_TIP + HALF_WIDTH  # centre of the semicircular end
BACK_Y, THICKNESS = _DOME.back_y, _DOME.thickness

WINDOW_X, WINDOW_Z, WINDOW_NODES = _LATTICE.window_x, _LATTICE.window_z, _LATTICE.window_nodes
SPACING = (WINDOW_X[1] - WINDOW_X[0]) / (WINDOW_NODES[0] - 1)
RIM_TIP, RIM_BASE, RIM_SIDE = _LATTICE.rim_tip, _LATTICE.rim_base, _LATTICE.rim_side


def _dome_basis(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    t = np.clip((2 * x - X_TIP - X_BASE) / (X_BASE - X_TIP), -1, 1)
    chebyshev = np.cos(np.arange(_DOME.degree_along + 1) * np.arccos(t)[..., None])
    even = ((z / HALF_WIDTH) ** 2)[..., None] ** np.arange(_DOME.degree_across + 1)
    return (chebyshev[..., :, None] * even[..., None, :]).reshape(*x.shape, -1)


def outline_distance(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Distance, m, from a place (x, z) m of the plane to the gel's outline; 0 outside."""
    side = np.where(x < ARC_X, HALF_WIDTH - np.hypot(x - ARC_X, z), _half_width_at(x) - np.abs(z))
    return np.clip(np.minimum(side, X_BASE - x), 0, None)


@functools.cache
def _dome_coefficients() -> np.ndarray:
    table = read_heights(DESCRIPTOR.folder / _DOME.profile)
    x, z, height = table[:, 0] * 1e-3, table[:, 1] * 1e-3, table[:, 2] * 1e-3
    inside = np.isfinite(height) & (outline_distance(x, z) > _DOME.margin)
    return np.linalg.lstsq(_dome_basis(x[inside], z[inside]), height[inside], rcond=1e-10)[0]


def dome_height(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Height of the resting gel above its flat back, m, at (x, z) in m: even in z, smooth.

    Least squares of the profile table of the public mesh (docs/sources.md, DIGIT gel) by Chebyshev polynomials
    along and even powers across; the table is a faceted surface sampled on a grid, hence the smoothing.
    """
    x, z = np.broadcast_arrays(np.asarray(x, float), np.asarray(z, float))
    edge = np.clip(1 - outline_distance(x, z) / _DOME.edge_width, 0, 1)
    return _dome_basis(x, z) @ _dome_coefficients() - _DOME.edge_drop * edge**2


def dome_point(x: float, z: float) -> tuple[np.ndarray, np.ndarray]:
    """The place (3,) m of the resting surface at (x, z) m and its outward unit normal (3,)."""
    step = 1e-6  # m: differences over 2 um of a surface that is smooth over millimetres
    height = dome_height(np.array([x, x - step, x + step, x, x]), np.array([z, z, z, z - step, z + step]))
    normal = np.array([-(height[2] - height[1]) / (2 * step), -1.0, -(height[4] - height[3]) / (2 * step)])
    return np.array([x, BACK_Y - height[0], z]), normal / np.linalg.norm(normal)


def _half_width_at(x: np.ndarray) -> np.ndarray:
    tip = np.sqrt(np.maximum(HALF_WIDTH**2 - np.minimum(x - ARC_X, 0) ** 2, 0))
    into_corner = np.clip(x - (X_BASE - CORNER_RADIUS), 0, CORNER_RADIUS)
    return tip - CORNER_RADIUS + np.sqrt(CORNER_RADIUS**2 - into_corner**2)


def _tip_at(z: np.ndarray) -> np.ndarray:
    return ARC_X - np.sqrt(HALF_WIDTH**2 - z**2)


def _corner_block(steps_x: np.ndarray, steps_z: np.ndarray) -> np.ndarray:
    """Points (rows, columns, 2) between the window's tip corner (z > 0) and the arc, by transfinite interpolation.

    steps_x, steps_z : fractions 0..1 from the corner toward the arc.
    """
    corner = np.array([WINDOW_X[0], WINDOW_Z[1]])
    angle_a = np.arctan2(_half_width_at(corner[:1])[0], corner[0] - ARC_X)  # where the row of the corner meets the arc
    angle_b = np.arctan2(corner[1], _tip_at(corner[1:])[0] - ARC_X)  # where its column does
    angle_c = (angle_a + angle_b) / 2

    def arc(angle: np.ndarray) -> np.ndarray:
        return np.stack([ARC_X + HALF_WIDTH * np.cos(angle), HALF_WIDTH * np.sin(angle)], -1)

    u, v = steps_x[:, None, None], steps_z[None, :, None]
    a, b, c = arc(angle_a), arc(angle_b), arc(angle_c)
    u_zero, u_one = corner + v * (a - corner), arc(angle_b + (angle_c - angle_b) * v[..., 0])
    v_zero, v_one = corner + u * (b - corner), arc(angle_a + (angle_c - angle_a) * u[..., 0])
    bilinear = (1 - u) * (1 - v) * corner + (1 - u) * v * a + u * (1 - v) * b + u * v * c
    return (1 - u) * u_zero + u * u_one + (1 - v) * v_zero + v * v_one - bilinear


def plan_grid() -> np.ndarray:
    """Places (rows, columns, 2) = (x, z) m of the gel's lattice: even window, rim that follows the outline."""
    x = np.linspace(*WINDOW_X, WINDOW_NODES[0])
    z = np.linspace(*WINDOW_Z, WINDOW_NODES[1])
    base = np.linspace(x[-1], X_BASE, RIM_BASE + 1)[1:]
    along = np.concatenate([x, base])
    toward = np.arange(1, RIM_SIDE + 1) / RIM_SIDE
    upper = np.empty((len(along), RIM_SIDE, 2))
    upper[..., 0] = along[:, None]
    upper[..., 1] = z[-1] + toward * (_half_width_at(along) - z[-1])[:, None]
    inner = np.stack(np.broadcast_arrays(along[:, None], z[None, :]), -1)
    body = np.concatenate([(upper * [1, -1])[:, ::-1], inner, upper], axis=1)

    steps = np.arange(1, RIM_TIP + 1) / RIM_TIP
    tip = np.empty((RIM_TIP, len(z), 2))
    tip[..., 0] = x[0] + steps[:, None] * (_tip_at(z) - x[0])
    tip[..., 1] = z
    corner = _corner_block(steps, toward)
    tip_rows = np.concatenate([(corner * [1, -1])[:, ::-1], tip, corner], axis=1)[::-1]
    return np.concatenate([tip_rows, body], axis=0)


@functools.cache
def gel_surface() -> Lattice:
    """The gel's coated top surface at rest; rows grow with x, columns with z, outward is -y."""
    plan = plan_grid()
    rest = np.stack([plan[..., 0], BACK_Y - dome_height(plan[..., 0], plan[..., 1]), plan[..., 1]], -1)
    rows, columns = plan.shape[:2]
    window = (slice(RIM_TIP, RIM_TIP + WINDOW_NODES[0]), slice(RIM_SIDE, RIM_SIDE + WINDOW_NODES[1]))
    faces = grid_faces(rows, columns, closed=False)
    return Lattice(rest.reshape(-1, 3), faces, (rows, columns), window)
