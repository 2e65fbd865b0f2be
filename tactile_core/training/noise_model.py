"""Signals as real electrodes give them: gains that differ, noise, whole counts, a sign that may be lost."""

from __future__ import annotations

import numpy as np

from ..sensors import COUNT_SIGN, REST_COUNTS
from ..sensors.readout import converted
from .options import Options


def measured(
    change: np.ndarray, rng: np.random.Generator, options: Options, rectified: float = 0.0, unit: float = 0.0,
    rest_counts: np.ndarray = REST_COUNTS,
) -> np.ndarray:  # fmt: skip
    """Simulate a sensor's reading (B, 20) of true changes (B, 19) counts: changes, and whether they are rectified.

    Rectified changes are given with the sign of a thinning film, as the networks read them.

    Gain error a channel, noise, whole counts, the ends of 12 bits. The rest lies near that of a typical unit
    (``rest_counts``, (19,)) and between whole counts, as the mean of many readings does.
    unit : share of frames read as a real unit is known: its gains spread more, its rest is off
    rectified : share of frames that lose their sign. They stand for recordings of unknown units, whose tare cannot be
        mended once folded: gains spread more, rest is off, channels may be missing
    Both are off by a share of the signal's size too, as no simulated contact is quite like a real one.
    """
    folded = rng.random((len(change), 1)) < rectified
    gain = 1.0 + options.gain * rng.standard_normal(change.shape)
    rest = rest_counts + rng.random(change.shape)
    noise = options.noise * rng.standard_normal(change.shape)
    real = rng.random((len(change), 1)) < unit
    if unit:
        gain = np.where(real, np.exp(options.unit_gain * rng.standard_normal(change.shape)), gain)
        noise += real * options.unit_offset * rng.standard_normal(change.shape)
    if rectified:
        strange = np.exp(options.rectified_gain * rng.standard_normal(change.shape))
        strange *= rng.random(change.shape) >= options.rectified_missing
        gain = np.where(folded, strange, gain)
        noise += folded * options.rectified_offset * rng.standard_normal(change.shape)
    if unit or rectified:
        size = np.linalg.norm(change, axis=1, keepdims=True)
        noise += (real | folded) * options.misfit * size * rng.standard_normal(change.shape)
    found = converted(rest + gain * change + noise) - rest
    found = np.where(folded, COUNT_SIGN * np.abs(found), found)
    return np.concatenate([found, folded], -1).astype(np.float32)
