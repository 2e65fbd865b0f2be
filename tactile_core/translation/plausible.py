"""Draw contacts from a frame's posterior, which shows the uncertainty of its place and force."""

from __future__ import annotations

import numpy as np

from .gel_place import on_gel
from .network_sizes import PLACE, STATE
from .networks import COMPRESSED_LIMIT, Networks
from .posterior import FORCE_SCALE, Posterior, touches

SEED = 0  # the same recording, the same contacts
NAMES = "sample_center", "sample_force"


def draw(posterior: Posterior, frames: np.ndarray, count: int) -> np.ndarray:
    """Draw states (T, count, STATE) from a posterior of frames (T,), whose numbers are the only seeds."""
    drawn = np.empty((len(frames), count, STATE), np.float32)
    for row, frame in enumerate(frames):
        random = np.random.default_rng([SEED, int(frame)])
        share = posterior.weight[row].astype(np.float64)
        which = random.choice(len(share), count, p=share / share.sum())
        noise = random.standard_normal((count, STATE), dtype=np.float32)
        drawn[row] = posterior.mean[row, which] + posterior.spread[row, which] * noise
    return drawn


def contacts(nets: Networks, states: np.ndarray, shift: np.ndarray) -> dict[str, np.ndarray]:
    """Map states (T, count, STATE) to the DIGIT, by ``NAMES``.

    sample_center : (T, count, 2) = (x, z) m, moved by shift (2,) m, NaN without contact; sample_force : (T, count) N
    """
    shape = states.shape[:2]
    flat = states.reshape(-1, STATE)
    center = on_gel(nets.frames["MVD"], flat[:, :PLACE]) + shift
    touched = touches(flat)
    force = FORCE_SCALE * np.sinh(np.clip(flat[:, PLACE], 0, COMPRESSED_LIMIT))
    center = np.where(touched[:, None], center, np.nan).reshape(*shape, 2)
    return dict(zip(NAMES, (center, np.where(touched, force, 0).reshape(shape)), strict=True))
