"""Measure the gain by tracking a contact through its recording: the one that ships, read by units of other gains.

The baseline of each row is the same networks, each frame alone. Truth is the fast tier's, as the recording is
simulated.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.recordings import Recording, Signals, prepare, read
from tactile_core.translation.translate import pass_over
from tactile_core.translation.translator import Translation, Translator

SHIPPED = Path(__file__).resolve().parents[3] / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
UNITS = 8  # of gains drawn 10 % apart
NOISE, GAIN = 1.1, 0.1  # counts beside the recording's own 1.0, together 1.5; as the test contacts are read
TOUCHED = 0.1  # N, from which on a contact's place and force are judged
PLACE, FORCE, PEAK = 0.35, 5.0, 14.0  # mm, %, %: the targets, of whole recordings (docs/sources.md, Targets)


def rows(network: Translator, file: Path = SHIPPED) -> list[Row]:
    """Medians over frames in contact and units, and 90 % quantiles of place; steps between neighbouring frames."""
    recording = read(file)
    signals = prepare(recording)
    units = [_read_by(signals, np.random.default_rng(seed)) for seed in range(UNITS)]
    every = np.arange(len(recording))
    followed = _judged(recording, [pass_over(network, unit, recording.time)(every).translation for unit in units])
    alone = _judged(recording, [network(unit) for unit in units])
    of = f"{len(followed['place'])} frames of {UNITS} units; baseline: each frame alone"
    metrics = [
        ("followed_place", "place", 50, "mm", PLACE), ("followed_place_90", "place", 90, "mm", None),
        ("followed_step", "step", 50, "mm", None), ("followed_force", "force", 50, "%", FORCE),
        ("followed_force_90", "force", 90, "%", None), ("followed_peak", "peak", 50, "%", PEAK),
        ("followed_touch_wrong", "wrong", None, "1", None),
    ]  # fmt: skip
    return [
        row(name, _over(followed[kind], level), unit, target, baseline=_over(alone[kind], level), of=of)
        for name, kind, level, unit, target in metrics
    ]


def _over(values: np.ndarray, level: int | None) -> float:
    return float(np.mean(values) if level is None else np.percentile(values, level))


def _read_by(signals: Signals, random: np.random.Generator) -> Signals:
    """Return the same touch as another unit reads it."""
    gain = 1 + GAIN * random.standard_normal(signals.change.shape[1])
    return dataclasses.replace(
        signals, change=signals.change * gain + NOISE * random.standard_normal(signals.change.shape)
    )


def _judged(recording: Recording, found: list[Translation]) -> dict[str, np.ndarray]:
    """Errors of place mm, force %, peak %, step mm of frames in contact; wrong : (T,) bool, touch misjudged."""
    truth, rest = recording.truth, sensors.digit_surface().rest
    force = accuracy.lengths(truth.force)
    on = force > TOUCHED
    center, peak = (
        accuracy.dent_center(truth.displacement_digit, rest),
        accuracy.lengths(truth.displacement_digit).max(1),
    )
    errors: dict[str, list[np.ndarray]] = {name: [] for name in ("place", "force", "peak", "step", "wrong")}
    for each in found:
        away = 1e3 * accuracy.lengths(each.contact_center - center)
        touched = np.isfinite(away)
        steps = 1e3 * accuracy.lengths(np.diff(each.contact_center, axis=0))
        errors["place"].append(np.where(touched, away, np.inf)[on])  # a contact that is lost is not near
        errors["force"].append(100 * np.abs(accuracy.lengths(each.force)[on] / force[on] - 1))
        errors["peak"].append(100 * np.abs(accuracy.lengths(each.displacement_digit).max(1)[on] / peak[on] - 1))
        errors["step"].append(steps[(on[1:] & on[:-1]) & np.isfinite(steps)])
        errors["wrong"].append(np.where(force > 0, on & ~touched, touched))
    return {name: np.concatenate(values) for name, values in errors.items()}
