"""Simulated signals as a sensor reads them, for tests: noise and gains that differ."""

from __future__ import annotations

import numpy as np

from tactile_core.sensors.readout import NOISE

GAIN = 0.1  # standard deviation a channel (assumed: docs/sources.md, BioTac read-out)


def as_read(change: np.ndarray, seed: int) -> np.ndarray:
    """Add seeded noise and gains to true changes (C, 19) counts."""
    random = np.random.default_rng(seed)
    gain = 1 + GAIN * random.standard_normal(change.shape)
    return (gain * change + NOISE * random.standard_normal(change.shape)).astype(np.float32)
