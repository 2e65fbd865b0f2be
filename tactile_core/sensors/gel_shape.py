"""A gel's shape from its descriptor: outline, dome, and the lattice of its surface, on which its mesh is built."""

from __future__ import annotations

import functools

import numpy as np

from ..errors import TactileError
from ..geometry.lattice import Lattice, grid_faces
from .descriptor import of_kind
from .gel_sensor import ROUND, Dome, GelSensor
from .profiles import read_heights


@functools.cache
def shape_of(name: str) -> GelShape:
    """Return the shape of a sensor's gel. Raises TactileError for a sensor without one."""
    return GelShape(of_kind(name, GelSensor))


class GelShape:
    """The resting gel of a descriptor: lengths in m, places (x, z) on its plane, outward is -y.
    half_width, tip_x, base_x : of the outline; arc_x : x of a round tip's centre
    back_y : y of the flat back; thickness : at the apex; spacing : of the lattice's window along x"""

    def __init__(self, descriptor: GelSensor) -> None:
        self.descriptor = descriptor
        self._outline, self._body, self._lattice = descriptor.outline, descriptor.body, descriptor.lattice
        self.half_width, self.tip_x, self.base_x = self._outline.half_width, self._outline.tip_x, self._outline.base_x
        self.arc_x = self.tip_x + self.half_width
        self.back_y, self.thickness = self._body.back_y, self._body.thickness
        window = self._lattice.window_x
        self.spacing = (window[1] - window[0]) / (self._lattice.window_nodes[0] - 1)

    def outline_distance(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return how far (...) m places x, z (...) m of the plane lie inside the gel's outline; 0 outside."""
        side = self._half_width_at(x) - np.abs(z)
        if self._outline.tip == ROUND:
            side = np.where(x < self.arc_x, self.half_width - np.hypot(x - self.arc_x, z), side)
        else:
            side = np.minimum(side, x - self.tip_x)
        return np.clip(np.minimum(side, self.base_x - x), 0, None)

    def dome_height(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the resting gel's height (...) m above its flat back at x, z (...) m: the thickness or, with a [dome],
        a smooth fit to its profile (least squares by Chebyshev polynomials in x, even powers of z), less the edge's
        drop near the outline."""
        x, z = np.broadcast_arrays(np.asarray(x, float), np.asarray(z, float))
        edge = np.clip(1 - self.outline_distance(x, z) / self._body.edge_width, 0, 1)
        dome = self.descriptor.dome
        top = self.thickness if dome is None else self._dome_basis(dome, x, z) @ self._dome_coefficients(dome)
        return top - self._body.edge_drop * edge**2

    def _dome_basis(self, dome: Dome, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        t = np.clip((2 * x - self.tip_x - self.base_x) / (self.base_x - self.tip_x), -1, 1)
        chebyshev = np.cos(np.arange(dome.degree_along + 1) * np.arccos(t)[..., None])
        even = ((z / self.half_width) ** 2)[..., None] ** np.arange(dome.degree_across + 1)
        return (chebyshev[..., :, None] * even[..., None, :]).reshape(*x.shape, chebyshev.shape[-1] * even.shape[-1])

    @functools.cache  # noqa: B019 - shapes are few and kept by ``shape_of`` anyway
    def _dome_coefficients(self, dome: Dome) -> np.ndarray:
        path = self.descriptor.folder / dome.profile
        table = read_heights(path)
        x, z, height = table[:, 0] * 1e-3, table[:, 1] * 1e-3, table[:, 2] * 1e-3
        within = self.outline_distance(x, z) > dome.margin
        holes = within & ~np.isfinite(height)
        if holes.any():
            at = 1e3 * x[holes][0], 1e3 * z[holes][0]
            raise TactileError(f"{path}, x_mm {at[0]:g}, z_mm {at[1]:g}", "an open profile: no height", "a closed dome")
        basis = self._dome_basis(dome, x[within], z[within])
        found, _, rank, _ = np.linalg.lstsq(basis, height[within], rcond=1e-10)
        if rank < basis.shape[1]:
            few = f"{within.sum()} heights inside margin_mm, which determine {rank} of {basis.shape[1]} coefficients"
            raise TactileError(path, few, "more of them", "Give more heights, or lower degree_along or degree_across")
        return found

    def dome_point(self, x: float, z: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the place (3,) m of the resting surface at (x, z) m and its outward unit normal (3,)."""
        step = 1e-6  # m: differences over 2 um of a surface that is smooth over millimetres
        height = self.dome_height(np.array([x, x - step, x + step, x, x]), np.array([z, z, z, z - step, z + step]))
        normal = np.array([-(height[2] - height[1]) / (2 * step), -1.0, -(height[4] - height[3]) / (2 * step)])
        return np.array([x, self.back_y - height[0], z]), normal / np.linalg.norm(normal)

    def thickness_below(self, point: np.ndarray) -> float:
        """Return the distance, m, from a point (3,) m of the resting surface along its inward normal to the back."""
        on_dome, outward = self.dome_point(float(point[0]), float(point[2]))
        return float((self.back_y - on_dome[1]) / -outward[1])

    def _half_width_at(self, x: np.ndarray) -> np.ndarray:
        """Return the outline's half width (...) m at x (...) m, rounded at the ends."""
        corner = self._outline.corner_radius
        if self._outline.tip == ROUND:
            tip = np.sqrt(np.maximum(self.half_width**2 - np.minimum(x - self.arc_x, 0) ** 2, 0))
            into_corner = np.clip(x - (self.base_x - corner), 0, corner)
        else:
            tip = np.full(np.shape(x), self.half_width)
            into_corner = np.clip(np.maximum(x - (self.base_x - corner), self.tip_x + corner - x), 0, corner)
        return tip - corner + np.sqrt(corner**2 - into_corner**2)

    def _tip_at(self, z: np.ndarray) -> np.ndarray:
        if self._outline.tip == ROUND:
            return self.arc_x - np.sqrt(self.half_width**2 - z**2)
        return np.full(np.shape(z), self.tip_x)

    def _corner_block(self, steps_x: np.ndarray, steps_z: np.ndarray) -> np.ndarray:
        """Return points (rows, columns, 2) = (x, z) m from the window's corner at the tip (z > 0) to a round tip.
        steps_x, steps_z : (rows,), (columns,), fractions 0 to 1 of the way along either axis"""
        corner = np.array([self._lattice.window_x[0], self._lattice.window_z[1]])
        # where the row of the corner meets the arc, and where its column does
        angle_a = np.arctan2(self._half_width_at(corner[:1])[0], corner[0] - self.arc_x)
        angle_b = np.arctan2(corner[1], self._tip_at(corner[1:])[0] - self.arc_x)
        angle_c = (angle_a + angle_b) / 2

        def arc(angle: np.ndarray) -> np.ndarray:
            return np.stack([self.arc_x + self.half_width * np.cos(angle), self.half_width * np.sin(angle)], -1)

        u, v = steps_x[:, None, None], steps_z[None, :, None]
        a, b, c = arc(angle_a), arc(angle_b), arc(angle_c)
        u_zero, u_one = corner + v * (a - corner), arc(angle_b + (angle_c - angle_b) * v[..., 0])
        v_zero, v_one = corner + u * (b - corner), arc(angle_a + (angle_c - angle_a) * u[..., 0])
        bilinear = (1 - u) * (1 - v) * corner + (1 - u) * v * a + u * (1 - v) * b + u * v * c
        return (1 - u) * u_zero + u * u_one + (1 - v) * v_zero + v * v_one - bilinear

    def plan_grid(self) -> np.ndarray:
        """Return places (rows, columns, 2) = (x, z) m of the gel's lattice: even window, rim along the outline."""
        lattice = self._lattice
        x = np.linspace(*lattice.window_x, lattice.window_nodes[0])
        z = np.linspace(*lattice.window_z, lattice.window_nodes[1])
        along = np.concatenate([x, np.linspace(x[-1], self.base_x, lattice.rim_base + 1)[1:]])
        if self._outline.tip != ROUND:
            along = np.concatenate([np.linspace(self.tip_x, x[0], lattice.rim_tip + 1)[:-1], along])
        toward = np.arange(1, lattice.rim_side + 1) / lattice.rim_side
        upper = np.empty((len(along), lattice.rim_side, 2))
        upper[..., 0] = along[:, None]
        upper[..., 1] = z[-1] + toward * (self._half_width_at(along) - z[-1])[:, None]
        inner = np.stack(np.broadcast_arrays(along[:, None], z[None, :]), -1)
        body = np.concatenate([(upper * [1, -1])[:, ::-1], inner, upper], axis=1)
        return np.concatenate([self._round_rim(x, z, toward), body], axis=0) if self._outline.tip == ROUND else body

    def _round_rim(self, x: np.ndarray, z: np.ndarray, toward: np.ndarray) -> np.ndarray:
        """Return the rows (rim, columns, 2) = (x, z) m of the lattice between the window and a round tip.
        x, z : m, of the window's rows and columns; toward : fractions 0 to 1 of the way from the window to the side"""
        rim = self._lattice.rim_tip
        steps = np.arange(1, rim + 1) / rim
        tip = np.empty((rim, len(z), 2))
        tip[..., 0] = x[0] + steps[:, None] * (self._tip_at(z) - x[0])
        tip[..., 1] = z
        corner = self._corner_block(steps, toward)
        return np.concatenate([(corner * [1, -1])[:, ::-1], tip, corner], axis=1)[::-1]

    @functools.cache  # noqa: B019 - shapes are few and kept by ``shape_of`` anyway
    def surface(self) -> Lattice:
        """Return the gel's coated top surface at rest; rows grow with x, columns with z, outward is -y."""
        plan, lattice = self.plan_grid(), self._lattice
        rest = np.stack([plan[..., 0], self.back_y - self.dome_height(plan[..., 0], plan[..., 1]), plan[..., 1]], -1)
        rows, columns = plan.shape[:2]
        along, across = lattice.window_nodes
        window = slice(lattice.rim_tip, lattice.rim_tip + along), slice(lattice.rim_side, lattice.rim_side + across)
        faces = grid_faces(rows, columns, closed=False)
        return Lattice(rest.reshape(-1, 3), faces, (rows, columns), window)
