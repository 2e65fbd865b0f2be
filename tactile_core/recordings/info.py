"""Describe a recording as text for users."""

from __future__ import annotations

import os
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from ..files.short_text import listed
from ..sensors import SAMPLE_RATE, electrode_count, title, typical_rest
from .flags import Flag, names
from .formats import HAND
from .labels import summary
from .preparer import Preparer
from .readers import pac_columns, read, sensor_of
from .recording import Recording
from .signal_kind import detect
from .signals import PrepareOptions, Signals

if TYPE_CHECKING:
    from .electrode_gains import ElectrodeGains, SensorFile

MOST_NOT_TAKEN = 40  # names that are spelled out; a file may have a thousand
SHOWN = 5  # texts of a label
TRANSLATED_BY = "`tactile convert RECORDING --sensor FILE`, with the unit's rest by `tactile adapt` (docs/extend.md)"
ADVICE = (
    "not known: a recording that begins in contact does not tell it; `tactile adapt RECORDINGS` finds it in several"
)


def describe(
    path: str | os.PathLike[str], options: PrepareOptions | None = None, unit: SensorFile | None = None
) -> str:
    """Return a short table, as text, of a recording's sensor, channels, rate, duration, tare, gaps and suspicious
    samples with their lines. A sensor without a typical rest is described by its readings alone.
    options : how to prepare its signals; unit : the unit's rest and gains, a file of `tactile adapt`
    Raises TactileError if the file is no recording, or not of the unit's sensor."""
    columns = None if options is None else options.columns
    sensor = sensor_of(path, columns)
    recording = read(path, columns, sensor, lean=True)
    gains = None if unit is None else unit.gains_for(path, recording.section, "--sensor", sensor)
    pac = pac_columns(path, columns) if recording.pac is None else recording.pac.shape[1]
    if typical_rest(sensor) is None:
        rows, table, warnings = _of_counts(recording, gains, pac), _counts(recording, gains), recording.warnings
    else:
        signals = Preparer(options, gains)(recording)
        least, largest = signals.change.min(axis=0), signals.change.max(axis=0)
        table = [("rest", signals.rest), ("least", least), ("largest", largest)]
        rows, warnings = _rows(recording, signals, pac), signals.warnings
    lines = [os.fspath(path), *(f"  {label:<11}{text}" for label, text in rows), ""]
    head = ("electrode", np.arange(1, recording.electrodes.shape[1] + 1))
    lines += [f"  {label:<10}" + "".join(f"{value:>6.0f}" for value in values) for label, values in (head, *table)]
    if warnings:
        lines += ["", "warnings"] + [f"  - {warning}" for warning in warnings]
    return "\n".join(lines)


def _rows(recording: Recording, signals: Signals, pac: int) -> list[tuple[str, str]]:
    report = signals.report
    origin = "simulated: " + str(recording.about.get("note", "")) if recording.simulated else "not marked as simulated"
    return [
        ("layout", recording.layout),
        ("sensor", f"{title(recording.sensor)}, {electrode_count(recording.sensor)} electrodes; {origin}"),
        ("channels", _channels(recording, pac)),
        ("labels", _labels(recording)),
        ("frames", f"{len(recording)} in {recording.row_word}s {recording.rows[0]} to {recording.rows[-1]}"),
        ("rate", f"{recording.rate:.2f} Hz (median)" if len(recording) > 1 else "one frame only"),
        ("duration", f"{recording.duration:.2f} s{_start(recording)}"),
        ("time", _time(recording)),
        ("kind", f"{signals.kind}: {report['kind_evidence']}"),
        ("polarity", f"{report['polarity']}: {report['polarity_evidence']}"),
        ("tare", f"{report['quiet_evidence']}{_parts(recording, signals)}"),
        ("drift", _drift(signals)),
        *unit_rows(signals),
        (
            "suspicious",
            f"{report['samples_glitch']} glitch samples, {report['samples_interpolated']} unreadable samples"
            f"{_places(recording, signals)}",
        ),
        ("flags", _flags(signals.flags)),
        *_not_taken(recording),
    ]


def _channels(recording: Recording, pac: int) -> str:
    held = [name for name in ("pdc", "tac", "tdc", "position", "force") if getattr(recording, name) is not None]
    if pac:
        held.insert(0, f"pac ({pac} a frame)")
    if recording.truth is not None:
        nodes = [f"{moved.shape[1]} {title(sensor)}" for sensor, moved in recording.truth.displacements.items()]
        pressed = " and traction" if recording.truth.tractions else ""
        held.append(f"truth ({' and '.join(nodes)} nodes{pressed})" if nodes else f"truth (force{pressed})")
    return ", ".join(["electrodes", *held])


def _not_taken(recording: Recording) -> list[tuple[str, str]]:
    return [("not taken", listed(recording.not_taken, MOST_NOT_TAKEN))] if recording.not_taken else []


def _labels(recording: Recording) -> str:
    counted = summary(recording.labels).items()
    held = [f"{name} ({', '.join(word or 'none' for word in list(words)[:SHOWN])})" for name, words in counted]
    return ", ".join(held) or "none"


def _start(recording: Recording) -> str:
    if not 0 < recording.start_time < 1e11:  # 1e11 s: the year 5138, beyond it no calendar
        return ""
    return f", from {datetime.fromtimestamp(recording.start_time, UTC):%Y-%m-%d %H:%M:%S} UTC"


def _time(recording: Recording) -> str:
    if len(recording) < 2:
        return "-"
    steps = 1e3 * np.diff(recording.time)
    jumps = int(np.sum(recording.flags & Flag.TIME_JUMP > 0))
    where = recording.rows[np.flatnonzero(recording.flags & Flag.TIME_JUMP)[:5]].tolist()
    ending = (
        f"; {jumps} jumps, before {recording.row_word} {', '.join(map(str, where))}{' …' * (jumps > 5)}"
        if jumps
        else "; no gaps"
    )
    return f"steps {steps.min():.1f} to {steps.max():.1f} ms{ending}"


def _parts(recording: Recording, signals: Signals) -> str:
    if not signals.report["quiet_parts"]:
        return ""
    spans = [f"{recording.rows[a]}-{recording.rows[b - 1]}" for a, b in signals.report["quiet_parts"]]
    return f", {recording.row_word}s {', '.join(spans[:6])}{' …' * (len(spans) > 6)}"


def _drift(signals: Signals) -> str:
    if not signals.report["drift_removed"]:
        return "not removed: " + ("its sign is lost" if signals.kind == "rectified" else "it needs two quiet parts")
    worst = int(np.argmax(np.abs(signals.drift)))
    return f"removed, up to {abs(signals.drift[worst]):.3f} counts/s (E{worst + 1})"


def unit_rows(signals: Signals) -> list[tuple[str, str]]:
    """Return pairs (label, words) of what is known of the unit: its file's note, its fluid film and its stiffness."""
    unit, film = signals.report.get("sensor", {}), signals.report["film"]
    rows = [("unit", unit["note"])] if unit.get("note") else []
    if film is not None:
        least, most = film["conductivity_since_rest"]
        thick = f"{film['thickness']:.2f} as thick as a typical unit's ({film['evidence']})"
        rows.append(("fluid film", f"{thick}; conductivity {least:.2f} to {most:.2f} of that at rest"))
    if "stiffness" in unit:
        known = "" if unit["stiffness_error"] is None else f" (to {unit['stiffness_error']:.0%})"
        rows.append(("stiffness", f"{signals.stiffness:.2f} of a typical unit's{known}: force and pressure times it"))
    return rows


def _places(recording: Recording, signals: Signals) -> str:
    rows = signals.report["rows_repaired"]
    return f", in {recording.row_word} {', '.join(map(str, rows[:12]))}{' …' * (len(rows) > 12)}" if rows else ""


def _flags(flags: np.ndarray) -> str:
    counted = [f"{name} {int(np.sum(flags & bit > 0))}" for name, bit in names().items() if np.any(flags & bit)]
    return ", ".join(counted) + f" of {len(flags)} frames" if counted else "none"


def _of_counts(recording: Recording, unit: ElectrodeGains | None, pac: int) -> list[tuple[str, str]]:
    """Return pairs (label, words) on a recording of unknown rest; pac : number of samples of PAC per frame"""
    electrodes = recording.electrodes
    finger = recording.about.get("finger")
    name = f", {HAND[finger]} ({finger})" if finger else ""
    whole = electrodes[np.isfinite(electrodes).all(axis=1)]
    kind, evidence = detect(whole) if len(whole) else ("unknown", "no line has a reading of every electrode")
    return [
        ("layout", recording.layout),
        ("sensor", f"{title(recording.sensor)}, {electrodes.shape[1]} electrodes{name}"),
        ("channels", ", ".join([_channels(recording, pac), *recording.about.get("labels", ())])),
        ("frames", f"{len(electrodes)} in {recording.row_word}s {recording.rows[0]} to {recording.rows[-1]}"),
        ("time", _time_of_sp(recording)),
        ("kind", f"{kind}: {evidence}"),
        ("rest", ADVICE if unit is None else unit.note),
        ("use", TRANSLATED_BY),
        *_not_taken(recording),
    ]


def _time_of_sp(recording: Recording) -> str:
    if np.isnan(recording.time).all():
        return "none: snapshots, one a line"
    if recording.start_time:
        return f"{recording.duration:.2f} s, {recording.rate:.2f} Hz (median)"
    return f"no time stamps; {len(recording) / SAMPLE_RATE:.2f} s at the sensor's {SAMPLE_RATE:g} Hz (assumed)"


def _counts(recording: Recording, unit: ElectrodeGains | None) -> list[tuple[str, np.ndarray]]:
    """Return (label, (e,) counts): rest (without a unit, the median), least and largest count (over rest, if known)."""
    if unit is None:
        counts, middle = recording.electrodes, ("median", np.nanmedian(recording.electrodes, axis=0))
    else:
        rest = np.array(unit.rest_counts)
        counts, middle = recording.electrodes - rest, ("rest", rest)
    return [middle, ("least", np.nanmin(counts, axis=0)), ("largest", np.nanmax(counts, axis=0))]
