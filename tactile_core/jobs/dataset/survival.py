"""Measure how much of a label survives the translation: accuracy of support vector machines on signals and pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .summary import RAW, Summary

RANDOM = "best of ten random maps of the electrodes"
ALWAYS = "always the commonest"
MAPS, WIDTH = 10, 24  # random maps, and the numbers of each
FOLDS, INNER = 5, 3  # outer: what is scored; inner: what chooses the classifier
MOST, FEWEST = 1000, 12  # examples of a task; with fewer nothing is shown (assumed)


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
