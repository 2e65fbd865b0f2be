"""Heights of the displaced gel under the camera's pixels.

A height is the position of the coating toward the camera, in metres. It grows with y of the shared frame: an
indentation raises it. Zero is the plane ``camera.height_zero_y``, which touches the resting gel's lowest point, so the
dome is part of the map: about 0 in the middle, up to 1.7 mm where the resting gel falls away. Sideways motion is
included: each value is that of the gel point that has moved there. A pixel stands for the place where it looks at the
plane of height zero; its height is the one straight over it. ``perspective`` finds what its slanted ray meets."""

from __future__ import annotations

import contextlib
import contextvars
import functools
import logging
from collections.abc import Iterator

import numpy as np

from ..errors import TactileError
from ..files.compiled import available
from ..files.threads import in_one_thread
from ..geometry.cubic_spline import bspline_weights
from ..geometry.lattice import Lattice
from ..sensors.calibration import Calibration
from ..sensors.calibration_file import load_calibration
from ..sensors.camera import Camera
from .height_loops import heights_above

_log = logging.getLogger(__name__)
_folded: contextvars.ContextVar[list[int] | None] = contextvars.ContextVar("folded", default=None)

REFINEMENT = 2  # grid for the sideways search, intervals per node interval; measured: tests/pictures/test_height_map.py
MOVE_TOLERANCE = 1e-7  # m, of the sideways search: times a slope of 1, below a tenth of a grey level
MOVE_ITERATIONS = 12  # 2 or 3 do for presses, 6 for firm grips; where 12 do not, the surface folds over itself
BEYOND_WINDOW = 1e-3  # m that a picture may reach past the window (17 px/mm: 0.7 mm); the edge is held there
NEGLIGIBLE = 1e-12  # weight of a node in a pixel, of 1 in all: a hundred-thousandth of float32's rounding
FARTHEST = 10e-3  # m that a node moves, twice the thickest gel (assumed)
# m, and times its largest move inward, that a gel may move outward: dragged at a friction of 5, .55 mm and 2.3 times
OUTWARD, MORE_OUTWARD = 0.1e-3, 3.0
SMALLEST_AREA = 0.2  # a cell of gel pressed to less than this share of its area is about to fold: steps stay finite


@contextlib.contextmanager
def folds_counted() -> Iterator[list[int]]:
    """Yield a list; each height map made inside the block appends its number of folded places instead of logging it."""
    folded: list[int] = []
    token = _folded.set(folded)
    try:
        yield folded
    finally:
        _folded.reset(token)


class HeightMapper:
    """Makes height maps of one surface under one camera; its spline matrices are computed once.

    surface : a lattice with an evenly spaced ``window`` that covers the camera's picture, but for 1 mm at its edges
    camera : None for the shipped calibration's
    Raises TactileError if the picture reaches further than that.
    """

    def __init__(self, surface: Lattice, camera: Camera | None = None) -> None:
        camera = camera or load_calibration().camera
        self.surface, self.camera = surface, camera
        check_covered(surface, camera)
        self.along, self.across = surface.window_axes
        self._fine_along, self._fine_across = self.along.refined(REFINEMENT), self.across.refined(REFINEMENT)
        fine = self._fine_along.nodes, self._fine_across.nodes
        # [order of the derivative][along x, across z]
        self.to_fine = [(self.along.matrix(fine[0], k), self.across.matrix(fine[1], k)) for k in (0, 1)]
        self.to_pixels = [
            _short(self._fine_along.matrix(camera.gel_x)), _short(self._fine_across.matrix(camera.gel_z)).T.copy()
        ]  # fmt: skip
        self.fine_places = np.stack(np.meshgrid(*fine, indexing="ij")).reshape(2, -1)
        self.rest_y = surface.window_rest[..., 1] - camera.height_zero_y
        down, right = self.along.matrix(camera.gel_x), self.across.matrix(camera.gel_z)
        self.rest = (down @ self.rest_y @ right.T).astype(np.float32)
        self.rest.flags.writeable = False

    @in_one_thread
    def __call__(self, displacement: np.ndarray) -> np.ndarray:
        """Return heights (H, W) float32, m, of displacement (n_nodes, 3) m; or (T, H, W) of (T, n_nodes, 3).

        They are twice differentiable by place if the surface does not fold, and exactly ``rest`` if nothing moves. A
        point that comes from outside the window counts as the window's edge. Raises TactileError for another shape, a
        value that is not finite, and positions in place of displacements."""
        displacement = np.asarray(displacement)
        expected = (len(self.surface.rest), 3)
        if displacement.ndim not in (2, 3) or displacement.shape[-2:] != expected:
            raise TactileError("displacement", f"shape {displacement.shape}", f"{expected} or (T, {expected[0]}, 3)")
        if not np.isfinite(displacement).all():
            raise TactileError("displacement", "values that are not finite", "metres", "Repair the frame first")
        if (farthest := np.abs(displacement).max(initial=0)) > FARTHEST:
            found, advice = f"up to {farthest:.3g}", "Divide millimetres by 1000; take the resting surface off places"
            raise TactileError("displacement", found, f"at most {FARTHEST:g} m, more than a gel yields", advice)
        outward, inward = -displacement[..., 1].min(initial=0), displacement[..., 1].max(initial=0)
        if outward > max(OUTWARD, MORE_OUTWARD * inward):
            found = f"up to {1e3 * outward:.2f} mm out of the gel, {1e3 * inward:.2f} mm into it"
            raise TactileError("displacement", found, "a pressed gel, which moves along +y", "Change the sign of y")
        if displacement.ndim == 2:
            return self._one(displacement)
        maps = np.empty((len(displacement), *self.camera.shape), np.float32)
        for k, frame in enumerate(displacement):
            maps[k] = self._one(frame)
        return maps

    def covers(self, x: np.ndarray, z: np.ndarray) -> bool:
        """Return true if all places x, z (n,) m lie on the even part of the resting surface."""
        ends = ((spline.nodes[0], spline.nodes[-1]) for spline in (self.along, self.across))
        return all(low <= place.min() and place.max() <= high for place, (low, high) in zip((x, z), ends, strict=True))

    def follow(
        self, displacement: np.ndarray, x: np.ndarray, z: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return places x, z and heights (n,) m under displacement (n_nodes, 3) m of points at rest at x, z (n,) m."""
        move = self.surface.grid(displacement)[self.surface.window].astype(float)
        tables = np.stack([move[..., 0], move[..., 2], self.rest_y + move[..., 1]])
        coefficients = self.along.to_coefficients @ tables @ self.across.to_coefficients.T
        along_x, along_z, height = self._look_up(coefficients, x, z).astype(float).T
        return x + along_x, z + along_z, height

    def _one(self, displacement: np.ndarray) -> np.ndarray:
        move = self.surface.grid(displacement)[self.surface.window].astype(float)
        if not move.any():
            return self.rest.copy()
        down, right = self.to_pixels
        return self.rest + down @ self._raised(move).astype(np.float32) @ right

    def _raised(self, move: np.ndarray) -> np.ndarray:
        """Return the change of height (fine rows, fine columns) m over the fixed places of the refined grid.
        move : (rows, columns, 3) m, displacement of the window's nodes"""
        down, right = self.to_fine[0]
        if not move[..., [0, 2]].any():
            return down @ move[..., 1] @ right.T
        tables = np.stack([move[..., 0], move[..., 2], self.rest_y + move[..., 1]])
        coefficients = self.along.to_coefficients @ tables @ self.across.to_coefficients.T
        height, lost = self._moved_heights(tables[:2], coefficients)
        if lost:
            _say_folded(lost, len(height))
        return height.reshape(len(down), len(right)) - down @ self.rest_y @ right.T

    def _moved_heights(self, move: np.ndarray, coefficients: np.ndarray) -> tuple[np.ndarray, int]:
        """Return heights (n,) m of the gel points that have moved to the refined grid's nodes, and the number not
        found.
        move : (2, rows, columns) m, sideways displacement x, z of the window's nodes
        coefficients : (3, rows + 2, columns + 2), of its splines and the height's"""
        (down, right), (down_slope, right_slope) = self.to_fine
        to_x, to_z = _inverse(down_slope @ move @ right.T, down @ move @ right_slope.T)
        miss = (down @ move @ right.T).reshape(2, -1)
        if not available():
            x, z, lost = self._source(coefficients[:2], to_x, to_z, miss)
            return self._look_up(coefficients[2:], x, z)[:, 0], lost
        axes = self.along, self.across
        return heights_above(
            coefficients, *self.fine_places, to_x, to_z, miss, np.array([axis.start for axis in axes]),
            np.array([axis.step for axis in axes]), MOVE_TOLERANCE, MOVE_ITERATIONS,
        )  # fmt: skip

    def _source(
        self, coefficients: np.ndarray, to_x: np.ndarray, to_z: np.ndarray, miss: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """Return where gel points now at the refined grid's nodes rested, x, z (n,) m, and the number not found.

        Solves X + u(X) = x, u the sideways displacement, from X = x by Broyden's method (1965): Newton's first step,
        then rank-one updates of the inverse Jacobian, so that nothing is differentiated again.
        coefficients : (2, rows + 2, columns + 2), of the splines of u; to_x, to_z : (2, n), rows of the Jacobian's
            inverse; miss : (2, n) m, u at the start"""
        target = self.fine_places
        source = target.copy()
        active, inverse = np.arange(target.shape[1]), np.stack([to_x, to_z])
        for _ in range(MOVE_ITERATIONS):
            step = -np.einsum("ijn,jn->in", inverse, miss)
            source[:, active] += step
            far = np.abs(miss).max(0) > MOVE_TOLERANCE
            active, before = active[far], miss[:, far]
            step, inverse = np.compress(far, step, axis=1), np.compress(far, inverse, axis=2)
            if not len(active):
                break
            miss = source[:, active] - target[:, active] + self._look_up(coefficients, *source[:, active]).T
            wanted = np.einsum("ijn,jn->in", inverse, miss - before)
            along = (step * wanted).sum(0)
            correction = (step - wanted) / np.where(along == 0, np.inf, along)
            inverse += np.einsum("in,kn,kjn->ijn", correction, step, inverse)
        return *source, len(active)

    def _look_up(self, coefficients: np.ndarray, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Evaluate k splines at places x, z (n,) m; return (n, k) float32, right to .1 nm in values of 1 mm.
        coefficients : (k, rows, columns), of the splines"""
        (row, t), (column, s) = self.along.cells(x), self.across.cells(z)
        weights_x, weights_z = bspline_weights(t.astype(np.float32)), bspline_weights(s.astype(np.float32))
        windows = np.lib.stride_tricks.sliding_window_view(coefficients, (4, 4), axis=(1, 2)).transpose(1, 2, 0, 3, 4)
        patches = np.ascontiguousarray(windows, np.float32).reshape(-1, len(coefficients), 16)
        patches = patches.take(row * windows.shape[1] + column, axis=0)
        weights = (weights_x[:, None] * weights_z).reshape(16, -1).T
        return np.einsum("nkp,np->nk", patches, weights)


def _say_folded(count: int, places: int) -> None:
    """Add ``count``, the folded of a map's ``places``, to the list of ``folds_counted``, or else log a warning."""
    folded = _folded.get()
    if folded is None:
        _log.warning("gel surface folds over itself at %d of %d places: height there is a guess", count, places)
    else:
        folded.append(count)


def check_covered(surface: Lattice, camera: Camera) -> None:
    """Raise TactileError for a surface without an evenly spaced window, or a picture that reaches over 1 mm past it."""
    if surface.window is None:
        raise TactileError("surface", "no evenly spaced window", "one", "Use a gel's: sensors.sensor_surface(name)")
    rest = surface.window_rest
    across, down = camera.pixel_size
    for name, nodes, seen, pixel in (
        ("x", rest[:, 0, 0], camera.gel_x, down),
        ("z", rest[0, :, 2], camera.gel_z, across),
    ):
        low, high = seen.min() - pixel / 2, seen.max() + pixel / 2  # edges, alike at every number of pixels
        if low < nodes[0] - BEYOND_WINDOW or high > nodes[-1] + BEYOND_WINDOW:
            raise TactileError(
                f"camera, {name}", f"picture {low * 1e3:.2f}..{high * 1e3:.2f} mm",
                f"inside the surface's even window {nodes[0] * 1e3:.2f}..{nodes[-1] * 1e3:.2f} mm",
                _nearer(name, seen, nodes),
            )  # fmt: skip


def _nearer(name: str, seen: np.ndarray, nodes: np.ndarray) -> str:
    """Advise a scale, px per mm, at which a picture lies inside the surface's nodes along one axis.
    name : the axis, "x" or "z"; seen : (p,) m, places of its pixels; nodes : (n,) m"""
    room = 2e3 * min(seen.mean() - nodes[0], nodes[-1] - seen.mean())
    if room <= 0:
        return f"Its centre_{name}_mm lies outside"
    axis = "y" if name == "x" else "x"
    return f"Raise px_per_mm_{axis} to {len(seen) / room:.1f} (the picture's width lies along z, its height along x)"


def _short(matrix: np.ndarray) -> np.ndarray:
    """Convert a spline's ``matrix`` to float32, tiny weights to zero: processors are ten times slower at subnormals."""
    return np.where(np.abs(matrix) > NEGLIGIBLE, matrix, 0).astype(np.float32)


def _inverse(by_x: np.ndarray, by_z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return both rows, (2, n) each, of the inverse of I + du/dX at n = rows x columns nodes; u is the sideways
    displacement (x, z). by_x, by_z : (2, rows, columns), du/dx and du/dz"""
    a, c = 1 + by_x[0].ravel(), by_x[1].ravel()
    b, d = by_z[0].ravel(), 1 + by_z[1].ravel()
    determinant = np.maximum(a * d - b * c, SMALLEST_AREA)
    return np.stack([d, -b]) / determinant, np.stack([-c, a]) / determinant


def gel_mapper(camera: Camera | None = None) -> HeightMapper:
    """Return the ``HeightMapper`` of a camera's gel, made once per camera; camera : None for the shipped DIGIT's"""
    return _gel_mapper(camera or load_calibration().camera)


@functools.cache
def _gel_mapper(camera: Camera) -> HeightMapper:
    return HeightMapper(camera.surface, camera)


def height_map(displacement: np.ndarray, camera: Camera | None = None) -> np.ndarray:
    """Return heights (H, W) float32, m, of a camera's gel under displacement (n_nodes, 3) m; (T, H, W) under (T,
    n_nodes, 3). camera : None for the shipped DIGIT's"""
    return gel_mapper(camera)(displacement)


def rest_height_map(camera: Camera | None = None) -> np.ndarray:
    """Return the heights (H, W) float32, m, of a camera's undeformed gel: its dome."""
    return gel_mapper(camera).rest.copy()


def of_unit(heights: np.ndarray, calibration: Calibration) -> np.ndarray:
    """Convert heights (H, W) or (T, H, W) m of the sensor's typical gel to float32 of a unit whose dome is
    ``dome_scale`` (of its calibration) times as high; what a contact raises stays."""
    heights = np.asarray(heights, np.float32)
    if calibration.dome_scale == 1:
        return heights
    return heights - np.float32(1 - calibration.dome_scale) * gel_mapper(calibration.camera).rest
