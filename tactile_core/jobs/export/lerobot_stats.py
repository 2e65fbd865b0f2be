"""Statistics of episodes for LeRobot's normalisation: of each feature's numbers, and of a picture's channels."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np

Stats = dict[str, dict[str, np.ndarray]]
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}  # LeRobot's
LEVELS = 256  # of a picture's channel


class EpisodeStats:
    """Collects an episode's rows: all numbers, and a histogram of the levels in each channel of its pictures."""

    def __init__(self) -> None:
        self._numbers: dict[str, list[np.ndarray]] = defaultdict(list)
        self._levels: dict[str, np.ndarray] = {}
        self._pictures = 0

    def add(self, rows: dict[str, np.ndarray]) -> None:
        """Add rows, name -> column: numbers (n, ...), pictures (n, H, W, 3) uint8, or words (no statistics)."""
        for name, values in rows.items():
            if values.dtype.kind in "fiu" and values.ndim < 4:
                self._numbers[name].append(values.reshape(len(values), -1))
            elif values.ndim == 4:
                counts = [np.bincount(values[..., channel].ravel(), minlength=LEVELS) for channel in range(3)]
                self._levels[name] = self._levels.get(name, 0) + np.array(counts)
                self._pictures += len(values)

    def summarise(self) -> Stats:
        """Return min, max, mean, std, quantiles and count of each feature; a picture's have shape (3, 1, 1)."""
        return {
            **{name: _of_numbers(np.concatenate(parts)) for name, parts in self._numbers.items()},
            **{name: _of_levels(counts, self._pictures) for name, counts in self._levels.items()},
        }


def _of_numbers(values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the statistics (k,) of values (n, k), by LeRobot's names."""
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0)
    return {
        "min": values.min(axis=0), "max": values.max(axis=0), "mean": values.mean(axis=0, dtype=np.float64),
        "std": values.std(axis=0, dtype=np.float64), "count": np.array([len(values)]),
        **dict(zip(QUANTILES, quantiles, strict=True)),
    }  # fmt: skip


def _of_levels(counts: np.ndarray, pictures: int) -> dict[str, np.ndarray]:
    """Return the statistics of channels given as histograms `counts` (3, LEVELS) of pixels; pictures : their number"""
    levels, shares = np.linspace(0, 1, LEVELS), counts / counts.sum(axis=1, keepdims=True)
    mean = shares @ levels
    below = np.cumsum(counts, axis=1) / counts.sum(axis=1, keepdims=True)
    found = {name: [np.searchsorted(channel, share) for channel in below] for name, share in QUANTILES.items()}
    found |= {"min": (counts > 0).argmax(axis=1), "max": LEVELS - 1 - (counts[:, ::-1] > 0).argmax(axis=1)}
    stats = {name: levels[np.array(place)] for name, place in found.items()}
    stats |= {"mean": mean, "std": np.sqrt(np.sum(shares * (levels - mean[:, None]) ** 2, axis=1))}
    return {**{name: value.reshape(3, 1, 1) for name, value in stats.items()}, "count": np.array([pictures])}


def aggregate(episodes: list[Stats]) -> Stats:
    """Return the statistics of all episodes together; quantiles are the episodes' means, as in LeRobot."""
    return {name: _together([episode[name] for episode in episodes]) for name in episodes[0]}


def _together(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    stack = {name: np.stack([part[name] for part in parts]) for name in parts[0]}
    count = stack["count"].sum(axis=0)
    weights = (stack["count"][:, 0] / count).reshape(-1, *[1] * (stack["mean"].ndim - 1))
    means = {name: np.sum(weights * stack[name], axis=0) for name in ("mean", *QUANTILES)}
    spread = np.sum(weights * (stack["std"] ** 2 + (stack["mean"] - means["mean"]) ** 2), axis=0)
    ends = {"min": stack["min"].min(axis=0), "max": stack["max"].max(axis=0)}
    return {**ends, **means, "std": np.sqrt(spread), "count": count}


def listed(stats: Stats) -> dict[str, dict[str, Any]]:
    """Return the statistics of features, by feature and statistic, with lists in place of arrays, for JSON."""
    return {name: {key: value.tolist() for key, value in one.items()} for name, one in stats.items()}
