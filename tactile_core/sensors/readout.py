"""The electronics between the electrodes and the numbers in a file: rest, gains, drift, noise, converter."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..errors import TactileError
from . import COUNT_MAX, REST_COUNTS, divider

NOISE = 1.5  # counts, standard deviation of the noisiest real recordings: translation must bear it (docs/sources.md)


@dataclasses.dataclass(frozen=True)
class Wiring:
    """Electronics between the film over an electrode and the number in a file; raises TactileError out of range.

    rest_spread : counts; each electrode rests at ``REST_COUNTS`` plus or minus up to this (assumed)
    gain_error : 1, standard deviation of the logarithm of each electrode's gain (assumed none)
    drift : counts/s; each electrode drifts evenly at up to this rate (88 counts in an hour: docs/sources.md)
    noise : counts, standard deviation in each frame (0.7 to ``NOISE`` in real recordings: docs/sources.md)
    tared : true subtracts the count at rest, as in files that hold changes alone"""

    rest_spread: float = 150.0
    gain_error: float = 0.0
    drift: float = 88 / 3600
    noise: float = 1.0
    tared: bool = False

    def __post_init__(self) -> None:
        room = float(min(REST_COUNTS.min(), COUNT_MAX - REST_COUNTS.max()))
        limits = {"rest_spread": room, "gain_error": 1.0, "drift": np.inf, "noise": np.inf}
        for name, largest in limits.items():
            value = getattr(self, name)
            if not (0 <= value <= largest and np.isfinite(value)):
                expected = "a finite number from 0" + (f" to {largest:g}" if np.isfinite(largest) else "")
                raise TactileError(f"wiring, {name}", repr(value), expected)


def converted(counts: np.ndarray) -> np.ndarray:
    """Round counts (...) to whole ones and clip them to the converter's 12 bits."""
    return np.clip(np.round(counts), 0, COUNT_MAX)


def readings(change: np.ndarray, time: np.ndarray, wiring: Wiring, seed: int) -> np.ndarray:
    """Return the readings of the 12-bit converter, (T, 19) int16 counts, for changes (T, 19) counts at times (T,) s.

    Changes are those of a unit that rests at ``REST_COUNTS``; they are converted to this unit's rest (divider), rounded
    and clipped to 0..4095, less the count at rest if ``wiring.tared``. Rest, gain, drift and noise have separate random
    streams: a longer recording begins with the same values, and one defect changes without the others."""
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4)]
    electrodes = change.shape[1]
    rest = REST_COUNTS + np.round(streams[0].uniform(-wiring.rest_spread, wiring.rest_spread, electrodes))
    gain = np.exp(wiring.gain_error * streams[1].standard_normal(electrodes))
    drift = streams[2].uniform(-wiring.drift, wiring.drift, electrodes)
    noise = wiring.noise * streams[3].standard_normal(change.shape)
    counts = rest + gain * divider.of_unit(change, rest) + drift * (time - time[0])[:, None] + noise
    counts = converted(counts)
    return (counts - rest if wiring.tared else counts).astype(np.int16)
