"""Metrics of one sliding recording: the protocol's, of a translation and of methods without one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tactile_core import sensors

from . import slide_set
from .slide_set import Slide

CONTACT, SILENT = 15.0, 2.0  # PDC counts: surely in contact; contact lost (notes of the set)
CENTRE_FRAMES, SILENT_FRAMES = 100, 30  # fewer frames of a recording give no metric (protocol)


def rank_correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Spearman's; NaN where one of them does not change."""
    from scipy.stats import rankdata

    a, b = rankdata(a), rankdata(b)
    return float(np.corrcoef(a, b)[0, 1]) if min(a.std(), b.std()) >= 1e-9 else np.nan


def rank(strength: np.ndarray, recording: Slide) -> float:
    """Rank correlation of a smooth strength (T,) with the pressure, the part that follows the pose taken off both."""
    label = slide_set.without_pose(recording.pressure, recording.arm)
    return rank_correlation(slide_set.without_pose(strength, recording.arm), label)


def silence(strength: np.ndarray, recording: Slide) -> float:
    """Median of a smooth strength (T,) where contact is lost, over its 95 % level; NaN where it is not lost."""
    lost = recording.pressure < SILENT
    if lost.sum() <= SILENT_FRAMES:
        return np.nan
    return float(np.median(strength[lost]) / np.percentile(strength, 95))


def roughness(strength: np.ndarray) -> float:
    """Standard deviation of the second difference over that of the signal (T,), unfiltered."""
    return float(np.diff(strength, 2).std() / (strength.std() + 1e-12))


def spread(centre: np.ndarray, recording: Slide) -> np.ndarray:
    """Standard deviation of places (T, k) while surely in contact, (k,); NaN where that is too short."""
    contact = recording.pressure > CONTACT
    return centre[contact].std(axis=0) if contact.sum() > CENTRE_FRAMES else np.full(centre.shape[1], np.nan)


def largest_step(strength: np.ndarray, repaired: np.ndarray) -> float:
    """Largest step into or out of a repaired sample over the largest step elsewhere; NaN where none was repaired."""
    steps = np.abs(np.diff(strength))
    touched = repaired[1:] | repaired[:-1]
    if not touched.any() or touched.all():
        return np.nan
    return float(steps[touched].max() / max(steps[~touched].max(), 1e-12))


@dataclass(frozen=True, eq=False)
class SlideMetrics:
    """Metrics of one recording. ranks, silences, roughs : by the strength's name; spreads : by the place's, mm."""

    ranks: dict[str, float]
    silences: dict[str, float]
    roughs: dict[str, float]
    spreads: dict[str, np.ndarray]


def metrics(recording: Slide, time: np.ndarray, found: Mapping[str, np.ndarray], centre: np.ndarray) -> SlideMetrics:
    """Measure a translated recording, and what needs no translation: electrode 1, the sum and the rms of all.

    time : (T,) unix s of the translation's frames; found : strength by name, each (T,); centre : (T, 2) mm
    """
    raw, smooth = recording.electrodes, recording.smooth
    strengths = {
        "electrode_1": smooth[:, 0],
        "electrode_sum": smooth.sum(axis=1),
        "electrode_rms": np.sqrt(np.square(smooth).mean(axis=1)),
    }
    for name, values in found.items():
        strengths[name] = slide_set.lowpass(np.interp(recording.time, time, values))
    weights = np.square(smooth)
    weighed = weights @ (1e3 * sensors.electrodes()[:, [0, 2]]) / np.maximum(weights.sum(axis=1, keepdims=True), 1e-9)
    centre = np.column_stack([np.interp(recording.time, time, column) for column in centre.T])
    return SlideMetrics(
        ranks={name: rank(values, recording) for name, values in strengths.items()},
        silences={name: silence(values, recording) for name, values in strengths.items()},
        roughs={name: roughness(values) for name, values in {"electrode_sum": raw.sum(axis=1), **found}.items()},
        spreads={"centre": spread(centre, recording), "electrodes": spread(weighed, recording)},
    )
