"""What a camera sees of many height maps at once, with gradients: `pictures.perspective` in torch."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ...pictures.perspective import STEEPEST, Perspective
from ...sensors.camera import Camera
from ..trained_modules import keep


class BatchView(nn.Module):
    """`Perspective` for frames at once.

    A frame whose gel hides a part of itself from the camera is left to `Perspective`, and has no gradient.
    """

    def __init__(self, view: Perspective) -> None:
        super().__init__()
        self._view, self._middle, self._inverse = view, view.middle, float(view.inverse)
        keep(
            self, start=view.start, start_near=view.start_near, nearest=view.start_nearest, rows=view.rows,
            columns=view.columns, right=view.right * view.inverse, down=view.down * view.inverse,
        )  # fmt: skip

    def forward(self, height: Tensor) -> Tensor:
        """Return the heights (B, H, W) m that pixels see of heights (B, H, W) m under them."""
        slope_right, slope_down = slopes(height, self._view.camera)
        steepness = slope_right * self.right + slope_down * self.down
        turn = self._taken(steepness, self.nearest) / self.start_near
        seen = (self._taken(height, self.nearest) + turn * self.start) / (1 + turn)
        near = 1 - seen * self._inverse
        row, column = (
            (near * steps + middle).clamp(0, 2 * float(middle))
            for steps, middle in zip((self.rows, self.columns), self._middle, strict=True)
        )
        index = (row + 0.5).long() * height.shape[2] + (column + 0.5).long()
        turn = self._taken(steepness, index) / near
        seen = (bilinear(height, row, column) + turn * seen) / (1 + turn)
        hidden = steepness.detach().amin((1, 2)) < STEEPEST - 1
        return self._from_above(height, seen, hidden) if hidden.any() else seen

    def _from_above(self, height: Tensor, seen: Tensor, hidden: Tensor) -> Tensor:
        found = [torch.from_numpy(self._view(each)) for each in height.detach()[hidden].float().cpu().numpy()]
        return seen.index_put((hidden,), torch.stack(found).to(seen))

    @staticmethod
    def _taken(values: Tensor, index: Tensor) -> Tensor:
        """Values (B, H, W) at flat indices, the same for all frames or not."""
        return values.flatten(1).gather(1, index.expand_as(values).flatten(1)).view_as(values)


def slopes(height: Tensor, camera: Camera) -> tuple[Tensor, Tensor]:
    """Return the slopes of heights (B, H, W) m along the picture's right and down: `perspective.slopes`."""
    right, down = camera.pixel_size
    return _differences(height.mT, right).mT, _differences(height, down)


def _differences(values: Tensor, step: float) -> Tensor:
    """Slopes along the second axis, second order at its ends too."""
    first = 4 * values[:, 1] - 3 * values[:, 0] - values[:, 2]
    last = 3 * values[:, -1] - 4 * values[:, -2] + values[:, -3]
    return torch.cat([first[:, None], values[:, 2:] - values[:, :-2], last[:, None]], 1) * (0.5 / step)


def bilinear(values: Tensor, row: Tensor, column: Tensor) -> Tensor:
    """Interpolate values (B, h, w) at fractional places (B, a, b), or (a, b) for all frames alike, within them."""
    height, width = values.shape[1:]
    i, j = row.detach().long().clamp(max=height - 2), column.detach().long().clamp(max=width - 2)
    t, s = row - i, column - j
    flat, start = values.flatten(1), (i * width + j).expand(len(values), *row.shape[-2:])

    def between(first: Tensor) -> Tensor:
        left, right = (flat.gather(1, each.flatten(1)).view_as(each) for each in (first, first + 1))
        return left + (right - left) * s

    upper, lower = between(start), between(start + width)
    return upper + (lower - upper) * t
