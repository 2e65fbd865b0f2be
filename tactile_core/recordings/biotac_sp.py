"""Describe recordings of a sensor whose counts at rest are not known, such as the BioTac SP with its 24 electrodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..sensors import SAMPLE_RATE
from .formats import HAND
from .recording import Recording
from .signal_kind import detect

if TYPE_CHECKING:
    from .electrode_gains import ElectrodeGains

TRANSLATED_BY = "`tactile convert RECORDING --sensor FILE`, with the unit's rest by `tactile adapt` (docs/extend.md)"
ADVICE = (
    "not known: a recording that begins in contact does not tell it; `tactile adapt RECORDINGS` finds it in several"
)


def describe_sp(
    path: str, recording: Recording, unit: ElectrodeGains | None, channels: str, not_taken: list[tuple[str, str]]
) -> str:
    """Describe sensor, channels, frames, rest and counts as a short table.

    unit : with the rest against which changes are taken; channels, not_taken : rows of the table, in words
    """
    count, electrodes = len(recording), recording.electrodes
    finger = recording.about.get("finger")
    name = f", {HAND[finger]} ({finger})" if finger else ""
    whole = electrodes[np.isfinite(electrodes).all(axis=1)]
    kind, evidence = detect(whole) if len(whole) else ("unknown", "no line has a reading of every electrode")
    rows = [
        ("layout", recording.layout),
        ("sensor", f"BioTac SP, {electrodes.shape[1]} electrodes{name}"),
        ("channels", ", ".join([channels, *recording.about.get("labels", ())])),
        ("frames", f"{count} in {recording.row_word}s {recording.rows[0]} to {recording.rows[-1]}"),
        ("time", _time(recording)),
        ("kind", f"{kind}: {evidence}"),
        ("rest", ADVICE if unit is None else unit.note),
        ("use", TRANSLATED_BY),
        *not_taken,
    ]
    lines = [path, *(f"  {label:<11}{text}" for label, text in rows), ""]
    lines += _counts(electrodes) if unit is None else _changes(electrodes, np.array(unit.rest_counts))
    if recording.warnings:
        lines += ["", "warnings"] + [f"  - {warning}" for warning in recording.warnings]
    return "\n".join(lines)


def _time(recording: Recording) -> str:
    if np.isnan(recording.time).all():
        return "none: snapshots, one a line"
    if recording.start_time:
        return f"{recording.duration:.2f} s, {recording.rate:.2f} Hz (median)"
    return f"no time stamps; {len(recording) / SAMPLE_RATE:.2f} s at the sensor's {SAMPLE_RATE:g} Hz (assumed)"


def _counts(counts: np.ndarray) -> list[str]:
    """Lines on counts (T, 24): each electrode's median, least and largest."""
    of = ("median", np.nanmedian(counts, axis=0)), ("least", np.nanmin(counts, axis=0)), (
        "largest", np.nanmax(counts, axis=0),
    )  # fmt: skip
    return _table(counts.shape[1], of)


def _changes(counts: np.ndarray, rest: np.ndarray) -> list[str]:
    """Lines on counts (T, 24) against counts at rest (24,)."""
    of = ("rest", rest), ("least", np.nanmin(counts - rest, axis=0)), ("largest", np.nanmax(counts - rest, axis=0))
    return _table(counts.shape[1], of)


def _table(count: int, rows: tuple[tuple[str, np.ndarray], ...]) -> list[str]:
    head = ("electrode", np.arange(1, count + 1))
    return [f"  {label:<10}" + "".join(f"{value:>6.0f}" for value in values) for label, values in (head, *rows)]
