"""Drift of the light between photographs: a smooth change of the whole picture, which is no press."""

from __future__ import annotations

import numpy as np

COARSE = 8  # px at 240 wide, over which means are taken first: drift has no finer structure
ROUNDS = 20  # of reweighting; it settles in about ten
SOFTNESS = 3.0  # grey levels: what lies farther from the drift than twice that hardly counts, as a press does (assumed)


def lighting_drift(change: np.ndarray) -> np.ndarray:
    """Return the drift (H, W, 3) float32 grey levels: the quadratic nearest most of a photograph's change (H, W, 3).

    By iteratively reweighted least squares with Geman and McClure's weights, from the median; a press that covers less
    than half of the picture counts for next to nothing.
    """
    height, width = change.shape[:2]
    step = max(COARSE * width // 240, 1)
    rows, columns = height // step, width // step
    coarse = change[: rows * step, : columns * step].reshape(rows, step, columns, step, 3).mean((1, 3), dtype=float)
    terms = _terms(_middles(rows, step, height), _middles(columns, step, width)).reshape(-1, 6)
    values = coarse.reshape(-1, 3)
    found = np.zeros((6, 3))
    found[0] = np.median(values, axis=0)
    for _ in range(ROUNDS):
        far = np.square(values - terms @ found).max(axis=1)  # a press shows in some channel
        weight = np.square(SOFTNESS**2 / (SOFTNESS**2 + far))[:, None]
        found = np.linalg.lstsq(np.sqrt(weight) * terms, np.sqrt(weight) * values, rcond=None)[0]
    whole = _terms(_middles(height, 1, height), _middles(width, 1, width))
    return (whole @ found).astype(np.float32)


def _middles(count: int, step: int, size: int) -> np.ndarray:
    """Middles (count,) of squares of `step` px, -1 to 1 over a picture's `size` px."""
    return 2 * (np.arange(count) + 0.5) * step / size - 1


def _terms(down: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Terms (H, W, 6): 1, right, down and their products."""
    down, right = np.meshgrid(down, right, indexing="ij")
    return np.stack([np.ones_like(down), right, down, right * right, right * down, down * down], axis=-1)
