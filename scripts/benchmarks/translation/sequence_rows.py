"""Measure translation that follows a contact through frames, on sequences of 0.4 s, each read by a unit of its own.
Presses, rolls and slides of the test set, whose truth is the fast tier's (``benchmarks/make/make_sequences.py`` says
how far that is off), are read right after a tare, and with the rest some counts off. The baseline of each row is the
same networks, each frame translated alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.table.translation_methods import plain_signals
from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.sensors import SAMPLE_RATE
from tactile_core.training.step_errors import LEAST_PATCH, joined
from tactile_core.translation.gel_place import contact_patch
from tactile_core.translation.translate import pass_over
from tactile_core.translation.translator import Translation, Translator

from .test_set import GAIN, NOISE

FILE = Path(__file__).resolve().parents[3] / "scenes" / "training" / "test_sequences.npz"
MOTIONS = "presses", "rolls", "slides"
UNITS = {"place": "mm", "force": "%", "peak": "%", "iou": "1"}
TARGETS = {"place": 0.35, "force": 5.0, "peak": 14.0, "iou": 0.55}  # docs/sources.md, Targets
TOUCHED = 0.1  # N, from which on a contact's place and force are judged
SEED = 11  # of gains, noise and rest
REST_OFF = 3.0  # counts: what an electrode drifts by in two minutes since the tare, at most (88 counts in an hour)

Truth = dict[str, np.ndarray]
Errors = dict[str, np.ndarray]  # by UNITS, a number per judged frame


def rows(network: Translator, every: int = 1) -> list[Row]:
    """Return rows of median errors over frames above 0.1 N: of all sequences, of each motion, and with a wrong rest.
    every : take one sequence in ``every``"""
    truth = {name: values[::every] for name, values in read().items()}
    kind = np.repeat(truth["motion"], (truth["force"] > TOUCHED).sum(axis=1))
    number, everything = len(truth["motion"]), slice(None)
    whole = f"{len(kind)} frames of {number} sequences; baseline: each frame alone"
    motions = {name: kind == which for which, name in enumerate(MOTIONS)}
    off = f"{number} sequences, rest up to {REST_OFF:g} counts off; baseline: each frame alone"
    found = []
    for name, rest_off, parts in (
        ("sequence", 0.0, {whole: everything, **motions}), ("sequence_rest_off", REST_OFF, {off: everything}),
    ):  # fmt: skip
        both = measured(network, truth, rest_off)
        for metric, unit in UNITS.items():
            for of, part in parts.items():
                value, baseline = (median(each[metric][part]) for each in both)
                target, larger = TARGETS[metric] if of == whole else None, metric == "iou"
                found.append(row(f"{name}_{metric}", value, unit, target, baseline=baseline, of=of, at_least=larger))
    return found


def measured(network: Translator, truth: Truth, rest_off: float) -> tuple[Errors, Errors]:
    """Return the errors of all sequences with contacts followed, then with each frame translated alone.
    rest_off : counts, largest error of the rest"""
    time = np.arange(truth["force"].shape[1]) / SAMPLE_RATE
    followed, alone = [], []
    for number, signal in enumerate(truth["signal"]):
        signals = plain_signals(read_by_a_unit(signal, np.random.default_rng([SEED, number]), rest_off))
        one = {name: values[number] for name, values in truth.items()}
        followed.append(judged(pass_over(network, signals, time)(np.arange(len(time))).translation, one))
        alone.append(judged(network(signals), one))
    return joined(iter(followed)), joined(iter(alone))


def read() -> Truth:
    """Read the test set by name, (S, 40, ...): signal counts, force N, center m, peak m, patch bits; motion (S,)."""
    with np.load(FILE, allow_pickle=False) as found:
        return {name: found[name] for name in found.files}


def read_by_a_unit(signal: np.ndarray, random: np.random.Generator, rest_off: float = 0.0) -> np.ndarray:
    """Return the change (T, 19) counts that a unit with random gains, noise and a wrong rest reads.
    signal : (T, 19) counts, the true change; rest_off : counts, largest error of the rest"""
    gain = 1 + GAIN * random.standard_normal(signal.shape[1])
    found = gain * signal + NOISE * random.standard_normal(signal.shape)
    return (found + random.uniform(-rest_off, rest_off, signal.shape[1])).astype(np.float32)


def judged(found: Translation, truth: Truth) -> Errors:
    """Return errors of a sequence's frames above 0.1 N, by name: place, mm, infinite for a lost contact; force and
    peak, %; iou, the overlap of contact patches, NaN if the true patch is small."""
    on = truth["force"] > TOUCHED
    surface = sensors.digit_surface()
    patch = np.unpackbits(truth["patch"][on], axis=1, count=len(surface.rest)).astype(bool)
    predicted = contact_patch(found.displacement_digit[on], surface)
    overlap = (predicted & patch).sum(1) / np.maximum((predicted | patch).sum(1), 1)
    away = accuracy.lengths(found.contact_center[on] - truth["center"][on])
    peak = accuracy.height(found.displacement_digit[on]).max(1)
    return {
        "place": 1e3 * np.where(np.isfinite(away), away, np.inf),
        "force": 100 * np.abs(accuracy.lengths(found.force[on]) / truth["force"][on] - 1),
        "peak": 100 * np.abs(peak / truth["peak"][on] - 1),
        "iou": np.where(patch.sum(1) >= LEAST_PATCH, overlap, np.nan),
    }


def median(values: np.ndarray) -> float | None:
    """Return the median of values (n,) without NaN; None if it is infinite, a lost contact."""
    found = float(np.nanpercentile(values, 50, method="higher"))
    return found if np.isfinite(found) else None
