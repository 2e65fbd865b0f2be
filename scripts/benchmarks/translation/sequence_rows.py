"""Rows of followed contacts on the test set of sequences: presses, rolls and slides, each read by a unit of its own.

Truth is the fast tier's (``benchmarks/make/make_sequences.py`` says how far that is off). The baseline of each row is
the same networks, each frame alone.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.table.translation import plain_signals
from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.sensors import SAMPLE_RATE
from tactile_core.training.step_errors import LEAST_PATCH
from tactile_core.translation.contact_patch import contact_patch
from tactile_core.translation.translate import Translation, Translator

from .followed_rows import FORCE, PEAK, PLACE, TOUCHED
from .noise import GAIN, NOISE

FILE = Path(__file__).resolve().parents[3] / "scenes" / "training" / "test_sequences.npz"
MOTIONS = "presses", "rolls", "slides"
UNITS = {"place": "mm", "force": "%", "peak": "%", "iou": "1"}
TARGETS = {"place": PLACE, "force": FORCE, "peak": PEAK, "iou": 0.55}  # docs/sources.md, Targets
SEED = 11  # of gains and noise

Truth = dict[str, np.ndarray]
Errors = dict[str, np.ndarray]  # by UNITS, a number a judged frame


def rows(network: Translator, file: Path = FILE, every: int = 1) -> list[Row]:
    """Medians over frames from 0.1 N on, of all sequences and of those of each motion; places 90 % stay below.

    every : of as many sequences one is judged
    """
    truth = {name: values[::every] for name, values in read(file).items()}
    time = np.arange(truth["force"].shape[1]) / SAMPLE_RATE
    followed, alone, motion = [], [], []
    for number, signal in enumerate(truth["signal"]):
        signals = plain_signals(read_by_a_unit(signal, np.random.default_rng([SEED, number])))
        one = {name: values[number] for name, values in truth.items()}
        followed.append(judged(network.followed(signals, time), one))
        alone.append(judged(network(signals), one))
        motion.append(np.full(len(followed[-1]["force"]), truth["motion"][number]))
    both, kind = (_joined(followed), _joined(alone)), np.concatenate(motion)
    found = []
    for figure, unit in UNITS.items():
        of = f"{len(kind)} frames of {len(truth['signal'])} sequences; baseline: each frame alone"
        found.append(_row(f"sequence_{figure}", figure, both, slice(None), of, unit, TARGETS[figure]))
        for number, name in enumerate(MOTIONS):
            found.append(_row(f"sequence_{figure}", figure, both, kind == number, name, unit))
    value, null = (_quantile(each["place"], 90) for each in both)
    return [*found, row("sequence_place_90", value, "mm", null=null, of=f"{len(kind)} frames")]


def read(file: Path = FILE) -> Truth:
    """Read the arrays of the test set, as ``make_sequences.described`` names them."""
    with np.load(file, allow_pickle=False) as found:
        return {name: found[name] for name in found.files}


def read_by_a_unit(signal: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """True changes (T, 19) counts as read by a unit whose gains stay, float32."""
    gain = 1 + GAIN * random.standard_normal(signal.shape[1])
    return (gain * signal + NOISE * random.standard_normal(signal.shape)).astype(np.float32)


def judged(found: Translation, truth: Truth) -> Errors:
    """Errors of the frames of a sequence that press with 0.1 N and more; a contact that is lost is infinitely far."""
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


def _joined(parts: list[Errors]) -> Errors:
    return {name: np.concatenate([part[name] for part in parts]) for name in UNITS}


def _row(
    name: str, figure: str, both: tuple[Errors, Errors], some: np.ndarray | slice, of: str, unit: str,
    target: float | None = None,
) -> Row:  # fmt: skip
    value, null = (_quantile(each[figure][some], 50) for each in both)
    return row(name, value, unit, target, null=null, of=of, at_least=figure == "iou")


def _quantile(values: np.ndarray, level: int) -> float | None:
    """The value that so many per cent stay below; None where that is a lost contact."""
    found = float(np.nanpercentile(values, level, method="higher"))
    return found if np.isfinite(found) else None
