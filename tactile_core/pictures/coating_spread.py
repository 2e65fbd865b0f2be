"""Light that spreads sideways in the coating: each place shows a mean of the light that falls around it.

Paint scatters light by some tenths of a millimetre (measured on photographs: docs/calibration.md). A Gaussian over the
picture stands for that in every preset; it gives a print's rim the softness of photographs."""

from __future__ import annotations

import numpy as np

from ..files.threads import in_one_thread
from ..sensors.camera import Camera

FINE = 2.5  # least coarse pixels in a standard deviation: a sum of such Gaussians is even to 1e-8 of its size
BLOCK = 80  # pixels per product of matrices, which leaves out the half of all weights that are zero
REACH = 4.0  # standard deviations; beyond lie 6e-5 of the light


class CoatingSpread:
    """Gaussian filter for pictures of one camera. deviation : m on the gel, its standard deviation; 0 for no filter"""

    def __init__(self, camera: Camera, deviation: float) -> None:
        self.none = deviation == 0
        if not self.none:
            right, down = camera.pixel_size
            # (step, weights): see ``_means``
            self.down, self.right = _means(camera.height, deviation / down), _means(camera.width, deviation / right)
            self._down, self._right = _blocks(self.down[1]), _blocks(self.right[1])

    @in_one_thread
    def __call__(self, pictures: np.ndarray) -> np.ndarray:
        """Return pictures (..., H, W) float32 smoothed; near an edge, the mean is over the part inside the picture."""
        if self.none:
            return pictures
        sums = _summed(_summed(pictures.swapaxes(-1, -2), self.right[0]).swapaxes(-1, -2), self.down[0])
        across = np.empty((*sums.shape[:-1], pictures.shape[-1]), np.float32)
        for pixels, runs, weights in self._right:
            np.matmul(sums[..., runs], weights.T, out=across[..., pixels])
        spread = np.empty(pictures.shape, np.float32)
        for pixels, runs, weights in self._down:
            np.matmul(weights, across[..., runs, :], out=spread[..., pixels, :])
        return spread


def _summed(pictures: np.ndarray, step: int) -> np.ndarray:
    """Return the sums (..., ceil(H / step), W) of ``step`` rows each of pictures (..., H, W); faster than
    np.add.reduceat."""
    sums = pictures[..., ::step, :].copy()
    for later in range(1, step):
        row = pictures[..., later::step, :]
        sums[..., : row.shape[-2], :] += row
    return sums


def _means(count: int, deviation: float) -> tuple[int, np.ndarray]:
    """Return the number of pixels in a run, and the weights (count, runs) of runs' sums in the Gaussian mean at each
    pixel of a side. deviation : px. To sum runs first costs a fraction of a full Gaussian."""
    step = max(int(deviation / FINE), 1)
    starts = step * np.arange(-(-count // step))
    ends = np.minimum(starts + step, count)
    narrower = np.sqrt(max(deviation**2 - (step**2 - 1) / 12, 1e-4))  # a run has spread the light already
    distance = (np.arange(count)[:, None] - (starts + ends - 1) / 2) / narrower
    weights = np.where(np.abs(distance) < REACH, np.exp(-(distance**2) / 2), 0)
    weights[np.arange(count), np.arange(count) // step] += 1e-12  # a width far below a pixel leaves its own alone
    weights /= (weights * (ends - starts)).sum(1, keepdims=True)
    return step, weights.astype(np.float32)


def _blocks(weights: np.ndarray) -> list[tuple[slice, slice, np.ndarray]]:
    """Cut weights (count, n) into blocks: slices of pixels, of the runs that have weight there, and these weights."""
    blocks = []
    for start in range(0, len(weights), BLOCK):
        part = weights[start : start + BLOCK]
        with_weight = np.flatnonzero(part.any(0))
        runs = slice(with_weight[0], with_weight[-1] + 1)
        blocks.append((slice(start, start + len(part)), runs, np.ascontiguousarray(part[:, runs])))
    return blocks


def evened(values: np.ndarray) -> np.ndarray:
    """Return the means of values (h, w) over 3 x 3 pixels; border values repeat."""
    for axis in (0, 1):
        total = np.moveaxis(values.copy(), axis, 0)
        along = np.moveaxis(values, axis, 0)
        total[1:] += along[:-1]
        total[:-1] += along[1:]
        total[0] += along[0]
        total[-1] += along[-1]
        values = np.moveaxis(total, 0, axis) * np.float32(1 / 3)
    return values
