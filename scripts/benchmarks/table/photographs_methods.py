"""Pictures beside photographs: the DIGIT's pictures, ours beside others', on presses that were not fitted.

Photographs are of a 6 mm ball pressed into a DIGIT; those that the calibration was not fitted on are the truth. The
baseline is the background alone. Where and how deep the ball was pressed is three numbers a photograph, found once by
the fast picture.
"""

from __future__ import annotations

import numpy as np

from tactile_core.accuracy import row
from tactile_core.pictures.calibrate.ball_pictures import FastPictures
from tactile_core.pictures.calibrate.evaluate import evaluate_unit, mean_metrics
from tactile_core.pictures.calibrate.photo_metrics import metrics
from tactile_core.pictures.calibrate.photographs import Press, chosen, read_photographs
from tactile_core.pictures.mitsuba.variant import choose_variant
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration_file import load_calibration

from .method import Method, best_ms, peak_mb

BALL = 3e-3  # m, radius
NAMES = ("fast", "standard", "quality")  # the reference takes minutes: see docs/optics.md
UNITS = {"roi_l1": "levels", "roi_psnr": "dB", "roi_ssim": "1", "frame_l1": "levels", "lobe_iou": "1"}


def measure(name: str, quick: bool, presses: str) -> Method:
    """Measure one way of drawing the photographs in the folder ``presses``; a quick run takes no fewer.

    Raises TactileError for photographs that cannot be read, ModuleNotFoundError where mitsuba is missing.
    """
    unit, photographs = load_calibration(), read_photographs(presses)
    fitted = [press.name for press in photographs.presses if press.name in unit.fit.photographs]
    test = chosen(photographs, [press.name for press in photographs.presses if press.name not in fitted])
    tried = evaluate_unit(unit, test, BALL, search_radius=False)
    baseline, of = mean_metrics(tried)[1], f"{len(test.presses)} held-out photographs"
    pressed = FastPictures(unit)
    renderer = Renderer(unit, name, background=test.background, rest=pressed.rest)
    label = name if name == "fast" else f"{name}_{choose_variant().name}"
    heights = [pressed.heights(each.ball) for each in tried]
    ms = best_ms(lambda: renderer(heights[0]))
    each = [
        metrics(_drifted(renderer(height), one.press), one.press.picture, test.background, one.press.region)
        for height, one in zip(heights, tried, strict=True)
    ]
    values = _means(each)
    more = [
        row(f"photographs_{label}_{what}", values[what], unit_, baseline=baseline[what], of=of)
        for what, unit_ in UNITS.items()
    ]
    more += [
        row(
            f"photographs_{label}_of_{one.press.name}",
            found["roi_l1"],
            "levels",
            baseline=one.baseline["roi_l1"],
            of="region",
        )
        for found, one in zip(each, tried, strict=True)
    ]
    error = values["roi_l1"], "levels", baseline["roi_l1"]
    return Method("photographs", label, ms, peak_mb(), *error, f"{of}, mean error in the region", tuple(more))


def _drifted(picture: np.ndarray, press: Press) -> np.ndarray:
    """Add to a picture (H, W, 3) by how much the light had drifted in a photograph, as the baseline's does."""
    return np.rint(picture + press.drift).clip(0, 255)


def _means(rows: list[dict]) -> dict[str, float]:
    return {name: float(np.nanmean([found[name] for found in rows])) for name in UNITS}
