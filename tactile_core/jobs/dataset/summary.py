"""Summarise each recording of a data set: shares, typical values, and the features that classifiers of labels read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...recordings import flags
from ...translation.trust_words import LOW_CONFIDENCE
from ..export.finished_job import Finished, Recorded

FIRST = 10  # frames, the first 0.1 s, against which a recording's change is taken
PARTS = 3  # of a recording, whose means are told apart (assumed)
MOST_SNAPSHOTS = 1000  # of a recording without time that are looked at (assumed enough)
RAW, NUMBERS, GEL, PICTURE = "electrodes", "force, place, pressure", "code of the gel", "picture, 8 x 6 squares"
SQUARES = (8, 6)
ARRAYS = {RAW: ("electrodes",), NUMBERS: ("force", "contact_center", "pressure"), GEL: ("latent_digit",)}


@dataclass(frozen=True)
class Summary:
    """Summary of a recording.

    touched : share of its frames in contact; guesses : share of those with low confidence
    flagged : flag -> share of all frames, without flags that no frame has
    explained, confidence, force : medians over frames in contact, force in N; NaN without contact
    labels : name -> text, "" if it changes within the recording
    features : kind (electrodes; force, place, pressure; code of the gel; picture) -> (n, k) of n examples: the whole
        recording, by changes since its first 0.1 s, or each snapshot; told : task -> (n,) the examples' labels"""

    recording: Recorded
    touched: float
    guesses: float
    flagged: dict[str, float]
    explained: float
    confidence: float
    force: float
    labels: dict[str, str]
    features: dict[str, np.ndarray]
    told: dict[str, np.ndarray] = field(default_factory=dict)

    def numbers(self) -> dict[str, Any]:
        """Return the recording's name, part, number of frames, labels and shares, for a report; None if unknown."""
        known = {"touched": self.touched, "guesses": self.guesses, "explained": self.explained,
                 "confidence": self.confidence, "force_n": self.force}  # fmt: skip
        rounded = {name: round(value, 4) if np.isfinite(value) else None for name, value in known.items()}
        about = {"recording": self.recording.name, "split": self.recording.split, "frames": self.recording.frames}
        return about | rounded | {"labels": self.labels, "flags": {k: round(v, 4) for k, v in self.flagged.items()}}


def summarise(source: Finished, tasks: Sequence[str], progress: Callable[[int, int], None]) -> list[Summary]:
    """Return a summary of each recording. tasks : labels to learn; progress : called with (recordings done, in all)"""
    found = []
    for number, one in enumerate(source.recordings, start=1):
        found.append(_summary(one, tasks))
        progress(number, len(source.recordings))
    return found


def _summary(one: Recorded, tasks: Sequence[str]) -> Summary:
    blocks = list(one.blocks(without=("image", "latent_signal", "latent_biotac")))
    held = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    touched = np.isfinite(held["contact_center"]).all(axis=1)
    force = np.linalg.norm(held["force"], axis=1)

    def typical(values: np.ndarray) -> float:
        known = values[touched & np.isfinite(values)]
        return float(np.median(known)) if len(known) else float("nan")

    guesses = float((held["confidence"][touched] < LOW_CONFIDENCE).mean()) if touched.any() else 0.0
    flagged = {name: float((held["flags"] & bit > 0).mean()) for name, bit in flags.names().items()}
    snapshots = bool(np.isnan(held["time"]).all())
    picked = np.linspace(0, one.frames - 1, min(one.frames, MOST_SNAPSHOTS)).astype(int) if snapshots else None
    features = {}
    for name, arrays in ARRAYS.items():
        if not set(arrays) <= set(held):
            continue  # a gel that was solved has no code
        values = np.concatenate([np.nan_to_num(held[array]).reshape(one.frames, -1) for array in arrays], axis=1)
        features[name] = values[picked] if picked is not None else _changes(values, max(1, FIRST // one.every))[None]
    at = picked if picked is not None else np.linspace(0, one.frames - 1, PARTS + 1).astype(int)
    squares = np.stack([_squares(one.picture(int(frame))) for frame in at])
    features[PICTURE] = squares if picked is not None else (squares[1:] - squares[0]).reshape(1, -1)
    told = {task: one.labels[task][picked if picked is not None else [0]] for task in tasks if task in one.labels}
    steady = {name: str(texts[0]) if (texts == texts[0]).all() else "" for name, texts in one.labels.items()}
    return Summary(
        one, float(touched.mean()), guesses, {name: share for name, share in flagged.items() if share},
        typical(held["explained"]), typical(held["confidence"]), typical(force), steady, features, told,
    )  # fmt: skip


def _changes(values: np.ndarray, first: int) -> np.ndarray:
    """Return the means (PARTS k,) of `PARTS` parts of values (T, k), each less that of the `first` frames."""
    parts = [part for part in np.array_split(values, PARTS) if len(part)]
    means = [parts[min(number, len(parts) - 1)].mean(axis=0) for number in range(PARTS)]
    return np.concatenate([mean - values[:first].mean(axis=0) for mean in means])


def _squares(picture: np.ndarray) -> np.ndarray:
    """Return the mean colours (SQUARES x 3,), 0 to 255, of the squares of picture (H, W, 3)."""
    down, across = (size // count for size, count in zip(picture.shape, SQUARES, strict=False))
    cut = picture[: down * SQUARES[0], : across * SQUARES[1]].astype(np.float32)
    return cut.reshape(SQUARES[0], down, SQUARES[1], across, 3).mean(axis=(1, 3)).ravel()
