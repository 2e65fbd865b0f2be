"""The electronics between the electrodes and the numbers in a file: rest, drift, noise, converter."""

from __future__ import annotations

import numpy as np

from . import COUNT_MAX, REST_COUNTS, divider

NOISE = 1.5  # counts, standard deviation of the noisiest real recordings: translation must bear it (docs/sources.md)
REST_SPREAD = 150.0  # counts; each electrode rests at ``REST_COUNTS`` plus or minus up to this (assumed)


def converted(counts: np.ndarray) -> np.ndarray:
    """Round counts (...) to whole ones and clip them to the converter's 12 bits."""
    return np.clip(np.round(counts), 0, COUNT_MAX)


def readings(change: np.ndarray, time: np.ndarray, seed: int, *, noise: float, drift: float) -> np.ndarray:
    """Return the readings of the 12-bit converter, (T, 19) int16 counts, for change (T, 19) counts at time (T,) s.
    seed : of rest, drift and noise
    noise : counts, standard deviation in each frame (0.7 to ``NOISE`` in real recordings: docs/sources.md)
    drift : counts/s; each electrode drifts evenly, up or down, by this at most (88 counts in an hour: docs/sources.md)
    The change is that of a unit that rests at ``REST_COUNTS``. It is converted (``divider``) to a unit whose rest is
    drawn at random; the readings are rounded and clipped to 0..4095. Rest, drift and noise have random streams of their
    own: a longer recording begins with the same values, and changing one of the three leaves the others."""
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4)]  # the second: unused
    electrodes = change.shape[1]
    rest = REST_COUNTS + np.round(streams[0].uniform(-REST_SPREAD, REST_SPREAD, electrodes))
    drifted = streams[2].uniform(-drift, drift, electrodes) * (time - time[0])[:, None]
    counts = rest + divider.of_unit(change, rest) + drifted + noise * streams[3].standard_normal(change.shape)
    return converted(counts).astype(np.int16)
