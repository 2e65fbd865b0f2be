"""Find the heights that the pixels of a pinhole camera see on a height map of the gel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import TactileError
from ..files.compiled import Loop, available
from ..sensors.camera import Camera

SETTLING_STEPS = 3  # to view the resting gel; each makes the error 1,000 times smaller over a dome
HIGHEST_GEL = 0.9  # share of the camera's height
STEEPEST = 0.05  # least 1 + slope . q / apparent height; below it the gel (nearly) hides a part of itself
MARCH_LEVELS, BISECTIONS = 64, 14  # of the search from above in that case: 2 mm / 64 / 2^14 is 2 nm


class Perspective:
    """A camera's view of height maps; searches start from what it sees of the resting gel.

    A pixel at q = (right, down) on the plane of height zero sees the point q s, s = 1 - h / apparent height, where h =
    height(q s): the first such point from the camera. Presses of 1.5 mm are found within 1 um (tests).
    rest : (H, W) float32, m, heights of the undeformed gel"""

    def __init__(self, camera: Camera, rest: np.ndarray) -> None:
        self.camera = camera
        self.right = camera.right.astype(np.float32)[None, :]
        self.down = camera.down.astype(np.float32)[:, None]
        self.middle = np.float32((camera.height - 1) / 2), np.float32((camera.width - 1) / 2)
        rows = np.arange(camera.height, dtype=np.float32)[:, None] - self.middle[0]
        columns = np.arange(camera.width, dtype=np.float32)[None, :] - self.middle[1]
        self.rows, self.columns = rows, columns
        self.inverse = np.float32(1 / camera.apparent_height)
        self._begin_at(rest)
        for _ in range(SETTLING_STEPS):
            self._begin_at(self(rest))

    def _begin_at(self, seen: np.ndarray) -> None:
        """Start each search at heights ``seen`` (H, W) m, near those that the pixels see."""
        self.start, self.start_near = seen, 1 - seen * self.inverse
        row, column = self._places(self.start_near)
        self.start_nearest = _nearest(row, column, self.camera.width)

    def __call__(self, height: np.ndarray) -> np.ndarray:
        """Return the heights (H, W) float32, m, that pixels see of a map ``height`` (H, W) float32, m, over the plane's
        pixels. Raises TactileError where the gel reaches the camera."""
        if height.max() >= HIGHEST_GEL * self.camera.apparent_height:
            found = f"{height.max() * 1e3:.1f} mm high"
            raise TactileError("height map", found, f"below the camera at {self.camera.apparent_height * 1e3:.1f} mm")
        steepness, least = self._steepness(height)
        if least < STEEPEST - 1:
            return self._from_above(height)
        if available():
            return seen_heights(
                height.ravel(), steepness.ravel(), self.start, self.start_near, self.start_nearest, self.rows[:, 0],
                self.columns[0], self.inverse,
            )  # fmt: skip
        # Newton's method: the tangent plane at q near is h = at + turn (seen - h). One step on the nearest pixels of
        # the map, one between them.
        turn = steepness.take(self.start_nearest)
        turn /= self.start_near
        seen = (height.take(self.start_nearest) + turn * self.start) / (1 + turn)
        near = 1 - seen * self.inverse
        row, column = self._places(near)
        turn = steepness.take(_nearest(row, column, self.camera.width))
        turn /= near
        return (bilinear(height, row, column) + turn * seen) / (1 + turn)

    def _steepness(self, height: np.ndarray) -> tuple[np.ndarray, float]:
        """Return (slope along p) |p| / apparent height at each place p from the picture's middle, (H, W), and its least
        value. height : (H, W) m"""
        slope_right, slope_down = slopes(height, self.camera)
        slope_right *= self.right * self.inverse
        slope_down *= self.down * self.inverse
        slope_right += slope_down
        return slope_right, float(slope_right.min())

    def _places(self, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return row and column, fractional, in the map, of the points q near that pixels q see; near : (H, W), s of
        the class"""
        row, column = near * self.rows, near * self.columns
        row += self.middle[0]
        column += self.middle[1]
        row = np.clip(row, 0, 2 * self.middle[0], out=row)
        return row, np.clip(column, 0, 2 * self.middle[1], out=column)

    def _from_above(self, height: np.ndarray) -> np.ndarray:
        """Find the heights (H, W) m that pixels see of a map ``height`` (H, W) m by a march down each ray: slower, but
        right where gel hides gel."""
        high, low = np.float32(height.max() + 1e-6), np.float32(height.min() - 1e-6)
        above = np.full(self.camera.shape, high)
        below = np.full(self.camera.shape, low)
        open_ = np.ones(self.camera.shape, bool)
        for level in np.linspace(high, low, MARCH_LEVELS + 1, dtype=np.float32)[1:]:
            hidden = open_ & (self.seen_of(height, np.full_like(above, level)) >= level)
            below[hidden] = level
            open_ &= ~hidden
            above[open_] = level
        for _ in range(BISECTIONS):
            middle = (above + below) / 2
            hidden = self.seen_of(height, middle) >= middle
            below = np.where(hidden, middle, below)
            above = np.where(hidden, above, middle)
        return (above + below) / 2

    def seen_of(self, values: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Return the values (H, W) float32 of a map at the points that pixels see; seen : (H, W) m, heights that they
        see"""
        return bilinear(values, *self._places(1 - seen * self.inverse))


def _nearest(row: np.ndarray, column: np.ndarray, width: int) -> np.ndarray:
    """Return flat indices (...) of the pixels nearest to fractional row, column (...) of a map ``width`` px wide."""
    index = (row + np.float32(0.5)).astype(np.int32)
    index *= np.int32(width)
    index += (column + np.float32(0.5)).astype(np.int32)
    return index.astype(np.intp)


def slopes(height: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return the slopes (H, W) of height (H, W) m to the picture's right, and down; second order, at edges too."""
    right, down = camera.pixel_size
    return _differences(height, 1, right), _differences(height, 0, down)


def _differences(values: np.ndarray, axis: int, step: float) -> np.ndarray:
    found = np.empty(values.shape, values.dtype)
    along, slope = values.swapaxes(0, axis), found.swapaxes(0, axis)
    np.subtract(along[2:], along[:-2], out=slope[1:-1])
    slope[0] = 4 * along[1] - 3 * along[0] - along[2]
    slope[-1] = 3 * along[-1] - 4 * along[-2] + along[-3]
    found *= np.float32(0.5 / step)
    return found


def bilinear(values: np.ndarray, row: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Interpolate ``values`` (h, w) float32, 2 x 2 or more, bilinearly at fractional row, column (...) within them."""
    if available() and values.dtype == row.dtype == column.dtype == np.float32 and row.ndim == 2:
        return interpolate(*map(np.ascontiguousarray, (values, row, column)))  # one kind of arrays is compiled
    height, width = values.shape
    # 32 bits turn into floats and back in half the time; all is done in place, as memory is what it waits for.
    i, j = row.astype(np.int32), column.astype(np.int32)
    np.minimum(i, np.int32(height - 2), out=i)
    np.minimum(j, np.int32(width - 2), out=j)
    t, s = row - i.astype(np.float32), column - j.astype(np.float32)
    i *= np.int32(width)
    i += j
    start, flat = i.astype(np.intp), np.ravel(values)
    upper = _between(flat, start, s)
    start += width
    lower = _between(flat, start, s)
    lower -= upper
    lower *= t
    upper += lower
    return upper


def map_lookup(right: np.ndarray, down: np.ndarray, camera: Camera) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that samples the gel's maps (H, W) at right, down (...) m, image frame, clipped to the map."""
    step_right, step_down = camera.pixel_size
    row = down * np.float32(1 / step_down) + np.float32(camera.height / 2 - 0.5)
    return lookup(row, right * np.float32(1 / step_right) + np.float32(camera.width / 2 - 0.5), camera.shape)


def lookup(row: np.ndarray, column: np.ndarray, shape: tuple[int, int]) -> Callable[[np.ndarray], np.ndarray]:
    """Return a function that samples maps of ``shape`` (H, W) bilinearly at row, column (n,), clipped to the map."""
    row, column = np.clip(row, 0, shape[0] - 1), np.clip(column, 0, shape[1] - 1)
    return lambda values: bilinear(values, row, column)


def _between(flat: np.ndarray, start: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Interpolate flat (n,) linearly between index start (...) and the next, by a share (...), 0 to 1; return (...)."""
    left = flat.take(start)
    right = flat[1:].take(start)
    right -= left
    right *= share
    left += right
    return left


@Loop
def seen_heights(height, steepness, start, start_near, start_nearest, rows, columns, inverse):  # noqa: ANN001, ANN201
    """Return the heights (H, W) m that pixels see, by the two Newton steps of ``Perspective.__call__`` in a compiled
    loop.
    height, steepness : (H W,), the map, m, and its ``Perspective._steepness``
    start : (H, W) m, heights near the sought ones; start_near : (H, W), 1 - start inverse
    start_nearest : (H, W) int, flat index of the map's place nearest to each point that start sees
    rows, columns : (H,), (W,) px, from the map's middle; inverse : 1 / apparent height, 1/m"""
    count, width = start.shape
    middle_row, middle_column = np.float32((count - 1) / 2), np.float32((width - 1) / 2)
    last_row, last_column = np.float32(2) * middle_row, np.float32(2) * middle_column
    one, half, least = np.float32(1), np.float32(0.5), np.float32(0)
    found = np.empty((count, width), np.float32)
    turn, there, near = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    seen, row, column = np.empty(width, np.float32), np.empty(width, np.float32), np.empty(width, np.float32)
    # By row: half the time of by pixel. In 32 bits: twice as many at a time.
    nearest, first = np.empty(width, np.int32), np.empty(width, np.int32)
    wide, most_row, most_column = np.int32(width), np.int32(count - 2), np.int32(width - 2)
    for a in range(count):
        for b in range(width):
            turn[b], there[b] = steepness[start_nearest[a, b]], height[start_nearest[a, b]]
        for b in range(width):
            share = turn[b] / start_near[a, b]
            seen[b] = (there[b] + share * start[a, b]) / (one + share)
            near[b] = one - seen[b] * inverse
            lower = min(max(near[b] * rows[a] + middle_row, least), last_row)
            right = min(max(near[b] * columns[b] + middle_column, least), last_column)
            nearest[b] = np.int32(lower + half) * wide + np.int32(right + half)
            i, j = min(np.int32(lower), most_row), min(np.int32(right), most_column)
            row[b], column[b], first[b] = lower - np.float32(i), right - np.float32(j), i * wide + j
        for b in range(width):
            turn[b], at = steepness[nearest[b]], first[b]
            upper = height[at] + (height[at + 1] - height[at]) * column[b]
            at += wide
            lower = height[at] + (height[at + 1] - height[at]) * column[b]
            there[b] = upper + (lower - upper) * row[b]
        for b in range(width):
            share = turn[b] / near[b]
            found[a, b] = (there[b] + share * seen[b]) / (one + share)
    return found


@Loop
def interpolate(values, row, column):  # noqa: ANN001, ANN201
    """Compute ``bilinear`` of values (h, w) at fractional row, column (a, b) in a compiled loop."""
    height, width = values.shape
    found = np.empty(row.shape, np.float32)
    for a in range(row.shape[0]):
        for b in range(row.shape[1]):
            i, j = min(np.int32(row[a, b]), height - 2), min(np.int32(column[a, b]), width - 2)
            t, s = row[a, b] - np.float32(i), column[a, b] - np.float32(j)
            upper = values[i, j] + (values[i, j + 1] - values[i, j]) * s
            lower = values[i + 1, j] + (values[i + 1, j + 1] - values[i + 1, j]) * s
            found[a, b] = upper + (lower - upper) * t
    return found
