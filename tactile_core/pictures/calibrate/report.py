"""Report an evaluation of a calibration: rows with the baseline beside them, and a sheet of pictures."""

from __future__ import annotations

import io
import math
import os

import numpy as np

from ...accuracy import Row, row
from ...files import atomic
from .evaluate import TARGETS, Evaluation, mean_metrics

LARGEST_SHEET = 20  # presses; more would make a picture that nobody opens
GAP, MAGNIFIED = 4, 2  # px between pictures; factor of the difference, round grey 128


def rows_of(tried: list[Evaluation], name: str) -> list[Row]:
    """Make one row a metric, means over presses; name : of the set of photographs."""
    ours, baseline = mean_metrics(tried)
    rows = []
    for metric, (unit, target, better) in TARGETS.items():
        value, beside = (None if math.isnan(values[metric]) else values[metric] for values in (ours, baseline))
        if value is None:
            target = None
        rows.append(row(metric, value, unit, target, baseline=beside, of=name, at_least=better > 0))
    return rows


def rows_by_press(tried: list[Evaluation]) -> list[Row]:
    """Make one row a metric and press, and rows of where the ball was found."""
    rows = []
    for each in tried:
        name = each.press.name
        places = {"right": each.ball.right, "down": each.ball.down, "depth": each.ball.depth}
        rows += [row(f"press_{what}", 1e3 * value, "mm", of=name) for what, value in places.items()]
        for metric, (unit, _, _) in TARGETS.items():
            value, beside = each.metrics.get(metric, math.nan), each.baseline.get(metric, math.nan)
            if math.isfinite(value):
                rows.append(row(metric, value, unit, baseline=beside if math.isfinite(beside) else None, of=name))
    return rows


def write_sheet(path: str | os.PathLike, tried: list[Evaluation]) -> None:
    """Write each press's photograph, render and difference (twice, on grey) as a PNG; equal input, equal bytes."""
    from PIL import Image, ImageDraw

    shown = tried[:LARGEST_SHEET]
    height, width = shown[0].picture.shape[:2]
    columns = 1 if len(shown) < 3 else 2
    lines = math.ceil(len(shown) / columns)
    cell = (height + 18, 3 * (width + GAP) + GAP)
    sheet = Image.new("RGB", (columns * cell[1], lines * cell[0] + 16), "white")
    draw = ImageDraw.Draw(sheet)
    draw.text((GAP, 2), f"photograph, render, difference x {MAGNIFIED}", fill="black")
    for k, each in enumerate(shown):
        top, left = 16 + k // columns * cell[0], k % columns * cell[1] + GAP
        difference = 128 + MAGNIFIED * (each.picture.astype(float) - each.press.picture)
        for j, picture in enumerate((each.press.picture, each.picture, difference.clip(0, 255).astype(np.uint8))):
            sheet.paste(Image.fromarray(picture), (left + j * (width + GAP), top + 14))
        metrics, baseline = each.metrics, each.baseline
        text = f"{each.press.name}  {metrics['roi_psnr']:.1f} dB (baseline {baseline['roi_psnr']:.1f})"
        text += f"  {metrics['roi_l1']:.1f} levels (baseline {baseline['roi_l1']:.1f})  {'; '.join(each.flags)}"
        draw.text((left, top), text.encode("ascii", "replace").decode(), fill="black")
    content = io.BytesIO()
    sheet.save(content, "PNG")
    atomic.write_bytes(path, content.getvalue())
