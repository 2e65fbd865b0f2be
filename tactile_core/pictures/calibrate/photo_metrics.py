"""Metrics, for ``tactile calibrate --test``, of a picture against a photograph of a press, in grey levels."""

from __future__ import annotations

import numpy as np

from ...sensors.camera import COLOURS

PEAK = 255.0
LOBE = -10  # grey levels below the background, of a shadow's lobe in its colour
WINDOW = 7  # px, of the structural similarity's means (Wang et al., IEEE Trans. Image Process. 13, 2004: even window)
_C1, _C2 = (0.01 * PEAK) ** 2, (0.03 * PEAK) ** 2


def metrics(picture: np.ndarray, photograph: np.ndarray, background: np.ndarray, region: np.ndarray) -> dict:
    """Return metrics by name of a picture (H, W, 3) against a photograph (H, W, 3), levels: in the region (H, W) bool,
    mean absolute difference roi_l1, roi_psnr (dB), structural similarity roi_ssim, overlap of shadows lobe_iou; in all,
    frame_l1. background : (H, W, 3), untouched gel. lobe_iou is NaN if neither of the two has a shadow."""
    picture, photograph = picture.astype(float), photograph.astype(float)
    error = picture - photograph
    return {
        "roi_l1": float(np.abs(error[region]).mean()),
        "roi_psnr": psnr(error[region]),
        "roi_ssim": float(similarity(picture, photograph)[region].mean()),
        "frame_l1": float(np.abs(error).mean()),
        "lobe_iou": lobe_overlap(picture - background, photograph - background, region),
    }


def psnr(error: np.ndarray) -> float:
    """Compute 10 log10 (255^2 / mean square), dB, of errors (...) levels; no error counts as .001 level."""
    return float(10 * np.log10(PEAK**2 / max(float(np.square(error).mean()), 1e-6)))


def lobe_overlap(change: np.ndarray, true_change: np.ndarray, region: np.ndarray) -> float:
    """Return the intersection over union of both pictures' shadows (under -10 levels), mean over colours that have any.
    change, true_change : (H, W, 3) grey levels against the background; region : (H, W) bool, pixels that count"""
    overlaps = []
    for channel in range(len(COLOURS)):
        ours, true = ((each[..., channel] < LOBE) & region for each in (change, true_change))
        union = (ours | true).sum()
        if union:
            overlaps.append((ours & true).sum() / union)
    return float(np.mean(overlaps)) if overlaps else float("nan")


def similarity(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the structural similarity (H, W, 3) over 7 x 7 px of pictures one, other (H, W, 3), levels up
    to 255; edges are mirrored."""
    mean_one, mean_other = windowed(one), windowed(other)
    unbiased = WINDOW**2 / (WINDOW**2 - 1)
    var_one = unbiased * (windowed(one * one) - mean_one**2)
    var_other = unbiased * (windowed(other * other) - mean_other**2)
    covariance = unbiased * (windowed(one * other) - mean_one * mean_other)
    above = (2 * mean_one * mean_other + _C1) * (2 * covariance + _C2)
    return above / ((mean_one**2 + mean_other**2 + _C1) * (var_one + var_other + _C2))


def windowed(values: np.ndarray, width: int = WINDOW) -> np.ndarray:
    """Return the means of values (H, W, k) over squares of ``width`` px, odd; edges mirrored."""
    half = width // 2
    padded = np.pad(values, ((half + 1, half), (half + 1, half), (0, 0)), mode="symmetric")
    total = padded.cumsum(0).cumsum(1)
    across = total[:, width:] - total[:, :-width]
    return (across[width:] - across[:-width]) / width**2
