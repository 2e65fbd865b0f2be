"""Labels of frames, such as object, material or trial: (T,) texts that translation ignores and results keep."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import groupby

import numpy as np

LONGEST = 200  # characters kept of a text (assumed enough for a label)
MOST_WORDS = 20  # of a label that a summary counts one by one


def labels_of(columns: Mapping[str, Iterable[str]]) -> dict[str, np.ndarray]:
    """Return columns as labels, name -> (T,) object array of str, shortened, fit for HDF5; empty ones are dropped."""
    found = {}
    for name, column in columns.items():
        found[_plain(name).replace("/", "_").strip(". ")] = [_plain(text) for text in column]
    return {name: np.array(column, dtype=object) for name, column in found.items() if name and any(column)}


def _plain(text: str) -> str:
    return text[:LONGEST].replace("\0", "").encode(errors="replace").decode().strip()


def summary(labels: Mapping[str, np.ndarray]) -> dict[str, dict[str, int]]:
    """Return name -> text -> number of frames, of labels name -> (T,) texts; rare texts are counted together."""
    found = {}
    for name, column in labels.items():
        counts = Counter(column.tolist()).most_common()
        found[name] = dict(counts[:MOST_WORDS])
        if len(counts) > MOST_WORDS:
            found[name][f"{len(counts) - MOST_WORDS} more"] = sum(count for _, count in counts[MOST_WORDS:])
    return found


Runs = dict[str, list[tuple[str, int]]]  # name -> texts in order, each with the number of frames in a row that have it


def extend(runs: Runs, labels: Mapping[str, np.ndarray], start: int, stop: int) -> None:
    """Add labels (stop - start,) of frames start to stop to ``runs``: name -> pairs (text, frames in a row)."""
    for name in {**runs, **labels}:
        held = runs.setdefault(name, [("", start)] * bool(start))
        column = labels[name].tolist() if name in labels else [""] * (stop - start)
        held += [(text, len(list(same))) for text, same in groupby(column)]


def unfold(runs: Runs) -> dict[str, np.ndarray]:
    """Return labels, name -> (T,) texts, from runs: name -> pairs (text, number of frames in a row with it)."""
    return {
        name: np.array([text for text, frames in each for _ in range(frames)], dtype=object)
        for name, each in runs.items()
    }
