"""Summarise each recording of a data set, shares, typical values and features, and measure how much of a label survives
the translation: the accuracy of support vector machines on features of signals and pictures."""

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
RANDOM = "best of ten random maps of the electrodes"
ALWAYS = "always the commonest"
MAPS, WIDTH = 10, 24  # random maps, and the numbers of each
FOLDS, INNER = 5, 3  # outer: what is scored; inner: what chooses the classifier
MOST, FEWEST = 1000, 12  # examples of a task; with fewer nothing is shown (assumed)
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


@dataclass(frozen=True)
class Row:
    """Accuracy of a classifier. task : name of the label that it predicts; by : features, or baseline
    right : share of examples predicted right, 0..1; error : its standard error; examples, classes : their numbers"""

    task: str
    by: str
    right: float
    error: float
    examples: int
    classes: int

    def numbers(self) -> dict[str, Any]:
        """Return the fields by name, the shares rounded to four digits, for a report."""
        return vars(self) | {"right": round(self.right, 4), "error": round(self.error, 4)}


def installed() -> bool:
    """Return true if scikit-learn is installed and works."""
    try:
        import sklearn.svm  # noqa: F401
    except ImportError:
        return False
    return True


def rows(task: str, summaries: list[Summary], apart: str, progress: Callable[[int, int], None]) -> list[Row]:
    """Return how well the label `task` is predicted from each kind of features, from the best of ten random maps of the
    electrodes, and by its commonest value; [] for one value, one group or too few examples. Needs scikit-learn.
    apart : label whose values are held out together; "" holds out single recordings (of snapshots, tenths of each)
    progress : called with (classifiers made, in all)"""
    told = [(one, one.told[task]) for one in summaries if task in one.told]
    labels = np.concatenate([texts for _, texts in told]) if told else np.array([])
    groups = np.concatenate([_groups(one, len(texts), apart) for one, texts in told]) if told else labels
    use = np.flatnonzero(labels != "")
    use = use[np.linspace(0, len(use) - 1, min(len(use), MOST)).astype(int)] if len(use) else use
    labels, groups = labels[use], groups[use]
    if len(use) < FEWEST or len(set(labels)) < 2 or len(set(groups)) < 2:
        return []
    by = {name: np.concatenate([one.features[name] for one, _ in told])[use] for name in told[0][0].features}
    rng = np.random.default_rng(0)
    maps = [by[RAW] @ rng.standard_normal((by[RAW].shape[1], WIDTH)) for _ in range(MAPS)]
    found: dict[str, float] = {}
    steps = len(by) + MAPS
    for number, (name, values) in enumerate([*by.items(), *((RANDOM, each) for each in maps)], start=1):
        found[name] = max(found.get(name, 0.0), _right(values, labels, groups))
        progress(number, steps)
    found[ALWAYS] = float(max(np.mean(labels == value) for value in set(labels)))
    count, classes = len(labels), len(set(labels))
    return [Row(task, name, share, float(np.sqrt(share * (1 - share) / count)), count, classes)
            for name, share in found.items()]  # fmt: skip


def _groups(one: Summary, count: int, apart: str) -> np.ndarray:
    """Return each example's group (count,), held out together: its label `apart`, its recording, or a tenth of it."""
    if apart in one.told:
        return one.told[apart]
    name = one.recording.name
    tenths = np.arange(count) * 10 // count
    return np.array([f"{name} {tenth}" for tenth in tenths], object) if count > 1 else np.array([name], object)


def _right(values: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> float:
    """Return a support vector machine's accuracy, 0..1, its width and penalty chosen within the training examples.
    values : (n, k) features; labels : (n,) to predict; groups : (n,) names of groups that are held out together"""
    from sklearn.model_selection import GridSearchCV, GroupKFold
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.svm import SVC

    labels = labels.astype(str)
    grid = {"svc__C": [1, 10, 100], "svc__gamma": ["scale", 0.1 / values.shape[1]]}
    right = 0
    for known, unseen in GroupKFold(min(FOLDS, len(set(groups)))).split(values, labels, groups):
        classes, counts = np.unique(labels[known], return_counts=True)
        if len(classes) == 1:
            right += int((labels[unseen] == classes[0]).sum())
            continue
        learner = make_pipeline(StandardScaler(), SVC(C=10))
        if counts.min() > 1:  # else there is nothing to choose by
            learner = GridSearchCV(learner, grid, cv=min(INNER, counts.min()))
        right += int((learner.fit(values[known], labels[known]).predict(values[unseen]) == labels[unseen]).sum())
    return right / len(labels)
