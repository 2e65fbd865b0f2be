"""Direction of slip of real BioTac SPs: what of it is left in translated quantities, beside the readings themselves.

A folder a class (n, s, e, w, t, cw, aw), a CSV file a recording, named after its object and a number. Every recording
begins in contact; rest is found in all of them together, without their classes. A classifier sees a recording's mean
in six parts, spread and pace of each number, as changes from the first 0.1 s or as they are, and is judged in five
folds and with one object left out. The first 0.1 s alone, before anything slips, is a leak's measure; random
nonlinear maps to as many numbers are a bar that a translation that means anything has to pass.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from tactile_core import recordings
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.recordings import PrepareOptions, Recording
from tactile_core.recordings.electrode_gains import ElectrodeGains, prepare_unit
from tactile_core.recordings.signals import Signals
from tactile_core.translation.gel_place import on_gel
from tactile_core.translation.network_sizes import PLACE
from tactile_core.translation.translate import pass_over
from tactile_core.translation.translator import Translator
from tactile_core.translation.unit_rest import find_rest_sp

FIRST = 10  # frames, the first 0.1 s
SEGMENTS = 6
MAPS, SEED = 24, 1000  # random maps; seed of the first
USUAL, SWING = 3300.0, 150.0  # counts: a random map's zero and scale (of the readings, not of a class)
MISSPELT = {"strippes": "striped"}  # an object's name in some files
STRENGTH = 0.3  # C of the logistic regression, the inverse of its ridge
Features = list[np.ndarray]  # a vector a recording


def find(folder: Path, sensor: str) -> list[tuple[str, str, Recording]]:
    """Class, object and content of each recording. Raises TactileError for a folder without any, and for bad files."""
    paths = sorted(folder.glob("*/*.csv"))
    if not paths:
        raise TactileError(folder, "no CSV file in a folder of it", "a folder a class, a recording a file")
    named = [(path.parent.name, re.split("[^a-z]", path.name.lower())[0], path) for path in paths]
    return [(kind, MISSPELT.get(of, of), recordings.read(path, sensor=sensor)) for kind, of, path in named]


def unit_of(found: list[tuple[str, str, Recording]]) -> ElectrodeGains:
    """The rest of the unit that made all recordings, without gains."""
    rest = find_rest_sp([recording for _, _, recording in found])
    ones = [1.0] * len(rest.counts)
    return ElectrodeGains("", ones, [0.0] * len(ones), rest.counts.tolist(), rest.spread.tolist())


def translated(network: Translator, signals: Signals, time: np.ndarray) -> np.ndarray:
    """Numbers (T, 6) of the contact: (x, z) mm on the gel, force N, depth of the gel's dent mm, all frames followed."""
    whole = pass_over(network, signals, time)(np.arange(len(time)))
    place, found = on_gel(network.nets.frames["MVD"], whole.state[:, :PLACE]), whole.translation
    depth = found.displacement_digit[:, :, 1].max(axis=1, keepdims=True)
    return np.concatenate([1e3 * place, found.force, 1e3 * depth], axis=1)


def random_maps(width: int, electrodes: int) -> Iterator[Callable[[np.ndarray], np.ndarray]]:
    """Maps without meaning from readings (T, e) to (T, width): tanh of a random mix."""
    for number in range(MAPS):
        mix = np.random.default_rng(SEED + number).standard_normal((electrodes, width)) / electrodes**0.5
        yield lambda counts, mix=mix: np.tanh((counts - USUAL) / SWING @ mix)


def summary(values: np.ndarray) -> np.ndarray:
    """Mean of each number in each of the parts of a recording (T, k), its spread and its pace."""
    means = [part.mean(0) for part in np.array_split(values, SEGMENTS)]
    return np.concatenate([*means, values.std(0), np.abs(np.diff(values, axis=0)).mean(0)])


def change(values: np.ndarray) -> np.ndarray:
    """Values (T, k) less their mean over the first 0.1 s."""
    return values - values[:FIRST].mean(0)


def features(network: Translator, found: list[tuple[str, str, Recording]]) -> dict[str, Features]:
    """Vectors of all recordings, by what they are made of."""
    unit, sets = unit_of(found), {}
    for polarity, name in (("auto", "translated"), ("rises", "translated, wrong polarity")):
        numbers = []
        for _, _, recording in found:
            signals = prepare_unit(recording, PrepareOptions(polarity=polarity), unit)
            numbers.append(translated(network, signals, recording.time))
        sets[f"{name}, change"] = [summary(change(each)) for each in numbers]
        sets[f"{name}, absolute"] = [summary(each) for each in numbers]
    counts = [recording.electrodes for _, _, recording in found]
    sets["readings, change"] = [summary(change(each)) for each in counts]
    sets["readings, absolute"] = [summary(each) for each in counts]
    sets["swing of their sum"] = [np.atleast_1d(np.ptp(each.sum(1))) for each in counts]
    sets["first 0.1 s alone"] = [each[:FIRST].mean(0) for each in counts]
    width = numbers[0].shape[1]
    for number, onto in enumerate(random_maps(width, counts[0].shape[1])):
        sets[f"random map {number}, change"] = [summary(change(onto(each))) for each in counts]
    return sets


def rows(network: Translator, folder: Path) -> Iterator[Row]:
    """Yield a row a set of numbers and way of judging; of the random maps the best and the middle one.

    Raises TactileError where scikit-learn, whose folds and regression the protocol names, is not installed.
    """
    found = find(folder, network.source)
    kinds, objects = (np.array([each[index] for each in found]) for index in (0, 1))
    chance, of = float(np.unique(kinds, return_counts=True)[1].max() / len(kinds)), f"{len(found)} recordings"
    random: list[tuple[float, float]] = []
    for name, vectors in features(network, found).items():
        shares = accuracies(np.stack(vectors), kinds, objects)
        if name.startswith("random map"):
            random.append(shares)
        else:
            yield from _rows(name, shares, chance, of)
    for what, of_all in (("best", np.max), ("median", np.median)):
        yield from _rows(f"{what} of {MAPS} random maps, change", tuple(of_all(random, axis=0)), chance, of)


def _rows(name: str, shares: tuple[float, float], chance: float, of: str) -> Iterator[Row]:
    for share, way in zip(shares, ("five folds", "one object left out"), strict=True):
        yield row(f"{name}; {way}", float(share), "1", baseline=chance, of=of, at_least=True)


def accuracies(vectors: np.ndarray, kinds: np.ndarray, objects: np.ndarray) -> tuple[float, float]:
    """Shares of recordings whose class is found, in five folds and with one object left out."""
    try:
        from sklearn.linear_model import LogisticRegression
        from sklearn.model_selection import GroupKFold, StratifiedKFold, cross_val_predict
        from sklearn.pipeline import make_pipeline
        from sklearn.preprocessing import StandardScaler
    except ImportError as error:
        raise TactileError("scikit-learn", "not installed", "it, for its folds", "pip install scikit-learn") from error
    model = make_pipeline(StandardScaler(), LogisticRegression(C=STRENGTH, max_iter=1000))
    folds = (StratifiedKFold(5, shuffle=True, random_state=0), None), (GroupKFold(len(np.unique(objects))), objects)
    found = (cross_val_predict(model, vectors, kinds, cv=fold, groups=of) for fold, of in folds)
    first, second = (float((each == kinds).mean()) for each in found)
    return first, second
