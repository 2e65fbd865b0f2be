"""CSV recordings of a BioTac SP, 24 electrodes a finger: read and described; no weights that translate them ship."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from ..errors import TactileError
from ..sensors import SAMPLE_RATE
from ..sensors.biotac_sp import ELECTRODES
from .assemble import MAX_READING, tell_problems
from .column_map import ColumnMap
from .formats import csv_biotac_sp
from .readers import container_of, reading
from .signal_kind import detect
from .table import read_header, read_table

FINGERS = {"ff": "first finger", "mf": "middle finger", "rf": "ring finger", "lf": "little finger", "th": "thumb"}
NAMES = ("{}_e{}", "{}_biotac_{}")  # of a finger's electrodes, in the two public sets
NOT_TRANSLATED = "not translated: the weights that ship are of a BioTac with 19 electrodes, none are of a BioTac SP"


@dataclass(frozen=True, eq=False)
class SpRecording:
    """Content of a file, unchanged: one frame a line, in file order, without time stamps.

    fingers : by "ff", "mf", "rf", "lf", "th", (T, 24) float counts, NaN where the file is unreadable
    rows : (T,) int, line of each frame, the header is line 1
    others : names of the columns that are no electrodes, such as object and slipped
    warnings : sentences for the user
    """

    path: str
    fingers: dict[str, np.ndarray]
    rows: np.ndarray
    others: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def labelled(self) -> bool:
        """Return true where lines carry labels, as snapshots of grasps do; without, they follow each other in time."""
        return bool(self.others)


def recognised(path: str | os.PathLike[str], columns: ColumnMap | None = None) -> bool:
    """Return true for a CSV file with a BioTac SP's columns that no map names otherwise.

    Raises TactileError for a file that cannot be read.
    """
    path = os.fspath(path)
    if columns is not None:
        return False
    with reading(path):
        return container_of(path) == "csv" and csv_biotac_sp.score(read_header(path)) > 0


def read_sp(path: str | os.PathLike[str]) -> SpRecording:
    """Read a BioTac SP's recording.

    Raises TactileError for a finger of which a column is missing, and for electrodes without any reading.
    """
    path = os.fspath(path)
    with reading(path):
        table = read_table(path)
    named = {finger: _columns(table.header, finger) for finger in FINGERS}
    named = {finger: columns for finger, columns in named.items() if columns}
    if not named:
        raise TactileError(f"{path}, line 1", "no finger's electrodes", "ff_e1 .. ff_e24 or ff_biotac_1 ..")
    wanted = [name for columns in named.values() for name in columns]
    fingers = {}
    for finger, columns in named.items():
        counts = table.columns(columns)
        counts = np.where(np.abs(counts) <= MAX_READING, counts, np.nan)
        silent = np.flatnonzero(np.isnan(counts).all(axis=0))
        if len(silent):
            raise TactileError(f"{path}, {columns[silent[0]]}", "no reading in any line", "counts, 0 to 4095")
        fingers[finger] = counts
    lost = [problem for problem in table.essential(wanted) if problem.essential]
    others = tuple(name for name in table.header if name not in wanted)
    return SpRecording(path, fingers, table.lines, others, (*table.warnings, *tell_problems(lost, "line")))


def _columns(header: tuple[str, ...], finger: str) -> list[str]:
    """Names of a finger's 24 columns, in the style that the file has most of; none where it has none."""
    styles = [[style.format(finger, number) for number in range(1, ELECTRODES + 1)] for style in NAMES]
    most = max(styles, key=lambda names: len(set(names) & set(header)))
    return most if set(most) & set(header) else []


def describe_sp(path: str | os.PathLike[str]) -> str:
    """Describe sensor, fingers, frames and counts as a short table, and that it is not translated.

    Raises what ``read_sp`` raises.
    """
    recording = read_sp(path)
    fingers = ", ".join(f"{FINGERS[finger]} ({finger})" for finger in recording.fingers)
    count = len(recording.rows)
    time = (
        "no time stamps; snapshots, one a line, labelled: " + ", ".join(recording.others)
        if recording.labelled
        else f"no time stamps; {count / SAMPLE_RATE:.2f} s at the sensor's {SAMPLE_RATE:g} Hz (assumed)"
    )
    rows = [
        ("layout", csv_biotac_sp.NAME),
        ("sensor", f"BioTac SP, {ELECTRODES} electrodes a finger: {fingers}"),
        ("frames", f"{count} in lines {recording.rows[0]} to {recording.rows[-1]}"),
        ("time", time),
        ("use", NOT_TRANSLATED),
    ]
    lines = [recording.path, *(f"  {label:<11}{text}" for label, text in rows)]
    for finger, counts in recording.fingers.items():
        lines += ["", *_counts(finger, counts)]
    if recording.warnings:
        lines += ["", "warnings"] + [f"  - {warning}" for warning in recording.warnings]
    return "\n".join(lines)


def _counts(finger: str, counts: np.ndarray) -> list[str]:
    """Lines on one finger's counts (T, 24): what they are, and each electrode's median, least and largest."""
    whole = counts[np.isfinite(counts).all(axis=1)]
    kind, evidence = detect(whole) if len(whole) else ("unknown", "no line has a reading of every electrode")
    table = [
        ("electrode", np.arange(1, ELECTRODES + 1)), ("median", np.nanmedian(counts, axis=0)),
        ("least", np.nanmin(counts, axis=0)), ("largest", np.nanmax(counts, axis=0)),
    ]  # fmt: skip
    return [f"  {finger:<11}{kind}: {evidence}"] + [
        f"  {label:<10}" + "".join(f"{value:>6.0f}" for value in values) for label, values in table
    ]
