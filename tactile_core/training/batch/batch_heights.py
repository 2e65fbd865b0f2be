"""Height maps of many displaced gels at once, with gradients: `pictures.height_map` in torch."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from ...geometry.cubic_spline import EvenSpline
from ...pictures.height_map import MOVE_ITERATIONS, MOVE_TOLERANCE, SMALLEST_AREA, HeightMapper
from ..trained_modules import keep


class BatchHeights(nn.Module):
    """`HeightMapper` for frames at once. Where a gel folds over itself the height is a guess, as there."""

    def __init__(self, mapper: HeightMapper) -> None:
        super().__init__()
        self._surface, self._axes = mapper.surface, (mapper.along, mapper.across)
        (down, right), (down_slope, right_slope) = mapper.to_fine
        keep(
            self, down=down, right=right, down_slope=down_slope, right_slope=right_slope, rest=mapper.rest,
            rest_y=mapper.rest_y, to_rows=mapper.to_pixels[0], to_columns=mapper.to_pixels[1],
            along=mapper.along.to_coefficients, across=mapper.across.to_coefficients, places=mapper.fine_places,
            at_rest=down @ mapper.rest_y @ right.T,
        )  # fmt: skip

    def forward(self, displacement: Tensor) -> Tensor:
        """Return the heights (B, H, W) m of displacements (B, n_nodes, 3) m."""
        (rows, columns), window = self._surface.shape, self._surface.window or ()
        move = displacement[:, : rows * columns].unflatten(1, (rows, columns))[:, *window].double()
        tables = torch.stack([move[..., 0], move[..., 2], self.rest_y + move[..., 1]], 1)
        coefficients = self.along @ tables @ self.across.T
        source = self._source(tables[:, :2].detach(), coefficients[:, :2].detach())
        if torch.is_grad_enabled() and coefficients.requires_grad:
            source = self._following(source, coefficients[:, :2])
        height = self._look_up(coefficients[:, 2:], source)[:, 0].view(len(move), *self.at_rest.shape)
        raised = (height - self.at_rest) * move.detach().any(-1).flatten(1).any(1)[:, None, None]
        return self.rest + self.to_rows @ raised.to(self.rest) @ self.to_columns

    def _source(self, move: Tensor, coefficients: Tensor) -> Tensor:
        """Search the rest places (B, 2, N) m of gel points that moved to the refined grid's nodes.

        As `HeightMapper._source`, step by step, so that what its tolerance leaves is the same.
        move : (B, 2, rows, columns) m, sideways; coefficients : of its splines
        """
        by_x, by_z = self.down_slope @ move @ self.right.T, self.down @ move @ self.right_slope.T
        miss = (self.down @ move @ self.right.T).flatten(2)
        inverse = _inverse(by_x.flatten(2), by_z.flatten(2))
        target = self.places.expand_as(miss)
        source, active = target, torch.ones_like(miss[:, :1], dtype=torch.bool)
        for _ in range(MOVE_ITERATIONS):
            step = -(inverse * miss[:, None]).sum(2) * active
            source, active = source + step, active & (miss.abs().amax(1, keepdim=True) > MOVE_TOLERANCE)
            if not active.any():
                break
            before, miss = miss, source - target + self._look_up(coefficients, source)
            wanted = (inverse * (miss - before)[:, None]).sum(2)
            along = (step * wanted).sum(1, keepdim=True)
            correction = (step - wanted) / torch.where(along == 0, torch.inf, along)
            inverse = inverse + correction[:, :, None] * (step[:, :, None] * inverse).sum(1)[:, None]
        return source

    def _following(self, source: Tensor, coefficients: Tensor) -> Tensor:
        """Give the places found (B, 2, N) the gradient of the implicit function X + u(X) = x; they stay where they are.

        One step of Newton's method has it (Krantz and Parks, The Implicit Function Theorem).
        """
        with torch.no_grad():
            by_x, by_z = (self._look_up(coefficients, source, slope) for slope in ((1, 0), (0, 1)))
        moved = self._look_up(coefficients, source)
        step = -(_inverse(by_x, by_z) * (moved - moved.detach())[:, None]).sum(2)
        return source + step

    def _look_up(self, coefficients: Tensor, place: Tensor, slope: tuple[int, int] = (0, 0)) -> Tensor:
        """Splines with coefficients (B, k, rows, columns) at places (B, 2, N) m; (B, k, N), or their slopes."""
        (row, down), (column, right) = (
            _weights(axis, at, order, self.rest.dtype)
            for axis, at, order in zip(self._axes, place.unbind(1), slope, strict=True)
        )
        flat, width = coefficients.flatten(2).to(self.rest), coefficients.shape[-1]
        kinds = flat.shape[1]
        found = torch.zeros((), dtype=flat.dtype, device=flat.device)
        for i, share in enumerate(down):
            for j, other in enumerate(right):
                index = ((row + i) * width + column + j)[:, None].expand(-1, kinds, -1)
                found = found + flat.gather(2, index) * (share * other)[:, None]
        return found


def _weights(axis: EvenSpline, position: Tensor, slope: int, dtype: torch.dtype) -> tuple[Tensor, list[Tensor]]:
    """The first of four coefficients at positions (B, N) and their weights: `bspline_weights` or `bspline_slopes`."""
    place = ((position - axis.start) / axis.step).clamp(0, axis.count - 1)
    cell = place.detach().long().clamp(max=axis.count - 2)
    t = (place - cell).to(dtype)
    s = 1 - t
    if slope:
        return cell, [each / (2 * axis.step) for each in (-s * s, 3 * t * t - 4 * t, 4 * s - 3 * s * s, t * t)]
    middle, next_one = 2 / 3 - t * t * (1 - t / 2), 2 / 3 - s * s * (1 - s / 2)
    return cell, [s * s * s / 6, middle, next_one, t * t * t / 6]


def _inverse(by_x: Tensor, by_z: Tensor) -> Tensor:
    """Return the inverse (B, 2, 2, N) of I + du/dX, from du/dx and du/dz (B, 2, N)."""
    (a, c), (b, d) = (1 + by_x[:, 0], by_x[:, 1]), (by_z[:, 0], 1 + by_z[:, 1])
    determinant = (a * d - b * c).clamp(min=SMALLEST_AREA)
    rows = torch.stack([d, -b], 1), torch.stack([-c, a], 1)
    return torch.stack(rows, 1) / determinant[:, None, None]
