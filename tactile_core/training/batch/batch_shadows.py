"""Soft shadows of one LED on many gels at once, with gradients: `pictures.cast_shadows` in torch."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from ...pictures.cast_shadows import FREE, GRID_STEP, ShadowCaster, disc_tables, march_steps
from ..trained_modules import keep
from .batch_view import bilinear

Span = tuple[Tensor, Tensor]  # first and last (B,) of rows or columns, of each frame


class BatchShadows(nn.Module):
    """`ShadowCaster` for frames at once, each marched over its own box of the polar grid."""

    def __init__(self, caster: ShadowCaster) -> None:
        super().__init__()
        self._caster, self._up = caster, float(caster.foot[2])
        share, moment = disc_tables()
        keep(
            self, row=caster.row, column=caster.column, pixel_row=caster.pixel_row, pixel_column=caster.pixel_column,
            radii=caster.radii, distance=caster.distance, share=share, moment=moment,
        )  # fmt: skip

    def sight(self, mapped: Tensor, edge: Tensor, margin: int) -> tuple[Tensor, tuple[slice, slice]]:
        """Return the height of the LED's centre above the horizon, in its radii, and the box of pixels it is for.

        As `ShadowCaster.sight`, in the least box (B, h, w) that holds those of all frames.
        mapped : (B, H, W) m, the mapped field; edge : (B, H, W) bool, where shadows may begin, somewhere in each frame
        """
        edges = _bounds(edge, margin)
        box, inside = _common(edges)
        highest = mapped.detach()[:, *box].masked_fill(~inside, -math.inf).amax((1, 2))
        heights = highest.tolist(), mapped.detach().amin((1, 2)).tolist()
        reach = torch.tensor(list(map(self._caster.reach, *heights)), device=mapped.device)
        last_row, last_column = (size - 1 for size in self._caster.polar_shape)
        polar = _span(self.row[box], inside, last_row), _span(self.column[box], inside, last_column, reach)
        some, valid = _common(polar)
        sight = self._march(bilinear(mapped, self.pixel_row[some], self.pixel_column[some]), valid, some, reach)
        starts = [each.start for each in some]
        shadow = sight.detach() < FREE
        limits = tuple((first - at, last - at) for (first, last), at in zip(polar, starts, strict=True))
        shaded = _bounds(shadow, 1, limits)
        height, width = mapped.shape[1:]
        inside = _boxed(shaded, [range(size) for size in sight.shape[1:]])
        pixels = _span(self.pixel_row[some], inside, height - 1), _span(self.pixel_column[some], inside, width - 1)
        box, seen = _common(pixels)
        row, column = (
            _limited(each[box] - at, span)
            for each, at, span in zip((self.row, self.column), starts, shaded, strict=True)
        )
        seen = seen & shadow.flatten(1).any(1)[:, None, None]
        return torch.where(seen, bilinear(sight, row, column), FREE), box

    def _march(self, field: Tensor, valid: Tensor, some: tuple[slice, ...], reach: Tensor) -> Tensor:
        """See `ShadowCaster._march`; the step to the horizon is searched first, then the gradient is its one rise's."""
        with torch.no_grad():
            source = field.masked_fill(~valid, -math.inf)
            best = torch.full_like(field, -math.inf)
            step = torch.zeros_like(field, dtype=torch.long)
            for k in march_steps(min(int(reach.max()), field.shape[2] - 1)):
                rise = (source[..., :-k] - field[..., k:]) * (1 / (k * GRID_STEP))
                better = (rise > best[..., k:]) & (k <= reach)[:, None, None]
                best[..., k:] = torch.where(better, rise, best[..., k:])
                step[..., k:] = torch.where(better, k, step[..., k:])
            from_column = torch.arange(field.shape[2], device=field.device) - step
        rise = (field.gather(2, from_column) - field) / (step.clamp(min=1) * GRID_STEP)
        sight = ((self._up - field) / self.distance[some[1]] - rise) * self.radii[some]
        return torch.where(valid & (step > 0), sight.clamp(-1, FREE), FREE)

    def disc_share(self, sight: Tensor) -> tuple[Tensor, Tensor]:
        """Return `cast_shadows.disc_share`'s table at sight (B, H, W), with the gradients of its two formulas."""
        place = ((sight.detach() + 1) * ((len(self.share) - 1) / 2)).long()
        chord = (1 - sight.detach().square()).clamp(min=0).sqrt() * (2 / math.pi)
        step = sight - sight.detach()
        return self.share[place] + chord * step, self.moment[place] - chord * sight.detach() * step


def _bounds(mask: Tensor, margin: int, limits: tuple[Span, ...] | None = None) -> tuple[Span, ...]:
    """Rows and columns that enclose the true part of masks (B, h, w), ``margin`` further within limits, or the mask."""
    spans: list[Span] = []
    for axis, size in ((2, mask.shape[1]), (1, mask.shape[2])):
        line = mask.any(axis).long()
        first, last = line.argmax(1) - margin, size - 1 - line.flip(1).argmax(1) + margin
        if limits is None:
            spans.append((first.clamp(min=0), last.clamp(max=size - 1)))
        else:
            low, high = limits[len(spans)]
            spans.append((torch.maximum(first, low), torch.minimum(last, high)))
    return tuple(spans)


def _common(spans: tuple[Span, ...]) -> tuple[tuple[slice, slice], Tensor]:
    """Return the box that holds the boxes of all frames, and which (B, h, w) of its places lie in each frame's."""
    rows, columns = (slice(int(first.min()), int(last.max()) + 1) for first, last in spans)
    return (rows, columns), _boxed(spans, [range(each.start, each.stop) for each in (rows, columns)])


def _boxed(spans: tuple[Span, ...], places: list[range]) -> Tensor:
    """Masks (B, h, w) of the rows and columns among places that lie in each frame's."""
    row, column = (
        (at >= first[:, None]) & (at <= last[:, None])
        for (first, last), at in zip(
            spans, (torch.tensor(each, device=spans[0][0].device) for each in places), strict=True
        )
    )
    return row[:, :, None] & column[:, None, :]


def _span(wanted: Tensor, among: Tensor, highest: int, more: Tensor | int = 0) -> Span:
    """See `cast_shadows._span`: of the values wanted (h, w) at the places of masks (B, h, w)."""
    first = wanted.masked_fill(~among, math.inf).amin((1, 2)).floor().long().clamp(0, highest - 1)
    last = (wanted.masked_fill(~among, -math.inf).amax((1, 2)).ceil().long() + more).clamp(max=highest)
    return first, torch.maximum(last, first + 1)


def _limited(place: Tensor, span: Span) -> Tensor:
    first, last = (each[:, None, None] for each in span)
    return torch.minimum(torch.maximum(place, first), last)
