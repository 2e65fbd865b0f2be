"""Average over a few frames around each: less noise without delay, for complete recordings."""

from __future__ import annotations

import numpy as np

LONGEST = 101  # frames, a second: beyond, touch itself is smoothed away (assumed)
# Frames where the user gives none. Rectified signals need it: folded noise does not average out in the networks.
RECTIFIED, SIGNED = 3, 1


def smooth(values: np.ndarray, frames: int) -> np.ndarray:
    """Average values (T, k) over each frame and (frames - 1) / 2 to each side, fewer at the ends; ``frames`` is odd."""
    if frames == 1:
        return values
    total = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0, dtype=np.float64)])
    frame = np.arange(len(values))
    first, last = np.maximum(frame - frames // 2, 0), np.minimum(frame + frames // 2 + 1, len(values))
    return (total[last] - total[first]) / (last - first)[:, None]
