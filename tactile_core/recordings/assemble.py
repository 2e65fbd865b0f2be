"""Build a Recording from columns, with the checks that all layouts share (bad cells, time stamps, sizes)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TactileError
from ..sensors import COUNT_MAX, SAMPLE_RATE, SOURCE, describe, electrode_count, title, typical_rest
from ..sensors.descriptor import names as known_sensors
from ..sensors.fluid_sensor import Fluid
from .electrode_faults import without_absent
from .flags import Flag
from .recording import Recording, Truth
from .time_stamps import seconds_of, tell_rate, time_jumps

MAX_FRAMES = 2_000_000  # 5.5 hours at 100 Hz; bounds the memory that a file can ask for (assumed enough)
MAX_BAD_SHARE = 0.2  # of the rows; with more, interpolation would make up the recording (assumed)
MAX_READING = 1e5  # counts; nothing a 12-bit sensor gives, in any unit of measurement seen, comes near (assumed)
MAX_PROBLEMS = 10_000  # kept as objects, so that a file full of them costs no memory
LOOKED_AT = 10_000  # rows, by which fingers that take turns are found
MOST_FINGERS = 5
TURNS = 5  # times the change in a whole turn, the change to the next row (assumed; without turns it is the smaller)
# Of a reading, times TURNS 10 counts at rest, beside what all electrodes move alike, as by hum of the mains (assumed:
# rows change by 5 counts and less; median differences of real units' rests, without their mean, are 21 and more).
NOISE = 6e-4
MIRRORED = -0.5  # correlation with a typical unit's rest over electrodes: .7 to .99 in 6 real units (assumed limit)
LEAST_MIRRORED = 300.0  # counts that nine in ten electrodes exceed, which changes do not (assumed; real units 400)
RAW = 0.3  # share of their median that nine in ten raw readings exceed (assumed); changes lie on both sides of 0
SHOWN = 8  # problems spelled out one by one; more are counted


@dataclass(frozen=True)
class Problem:
    """An unreadable cell or row of a file.
    frame : index of its frame; row : its row or line in the file; field : name of its column, "row" for a whole row
    found : what is there, in words; essential : true if an electrode or the time is concerned"""

    frame: int
    row: int
    field: str
    found: str
    essential: bool = True


class BadRows(TactileError):
    """Error for a recording with too many bad rows."""


def sensor_with(count: int) -> str:
    """Return the name of the sensor that has `count` electrodes; "" if there is none."""
    fluid = ((each, found) for each in known_sensors() if isinstance(found := describe(each), Fluid))
    return next((name for name, found in fluid if found.electrodes.count == count), "")


def check_electrodes(path: str, count: int, source: str, sensor: str = SOURCE) -> None:
    """Raise TactileError unless the sensor has `count` electrodes; source : where they were counted, in words."""
    wanted = electrode_count(sensor)
    if count == wanted:
        return
    found, advice = f"{count} electrodes", "Check which sensor made this recording"
    if like := sensor_with(count):
        found, advice = f"{found}: a {title(like)}", _advice(like)
    raise TactileError(f"{path}, {source}", found, f"the {wanted} electrodes of a {title(sensor)}", advice)


def _advice(sensor: str) -> str:
    """Return advice on translating recordings of a sensor that the networks are not for."""
    return (
        "Translate it by itself: the first recording, or --weights, says whose networks are taken. A sensor for which "
        f"none ship gets them in half an hour: `tactile pairs scenes/training --count 12000 --from {sensor} --out "
        "pairs.h5`, `tactile train pairs.h5 --out trained`, `tactile adapt RECORDINGS --out rest.toml`, `tactile "
        "convert RECORDING --out results --weights trained/weights --sensor rest.toml` (docs/extend.md)"
    )


def assemble(
    path: str,
    layout: str,
    *,
    electrodes: np.ndarray,
    stamps: np.ndarray | None,
    rows: np.ndarray | None = None,
    problems: Sequence[Problem] = (),
    row_word: str = "frame",
    truth: Truth | None = None,
    simulated: bool = False,
    about: dict[str, Any] | None = None,
    names: Sequence[str] = (),
    warnings: Sequence[str] = (),
    sensor: str = SOURCE,
    snapshots: bool = False,
    labels: dict[str, np.ndarray] | None = None,
    **channels: np.ndarray | None,
) -> Recording:
    """Check the columns of a file and return the Recording made of them.

    layout : the file's layout in words; electrodes : (T, 19) float, NaN at bad cells
    stamps : (T,) float, time stamps as in the file; None if it has none: 100 Hz is assumed
    rows : (T,) int, line or row of each frame in the file, which messages call `row_word`; None: 0, 1, 2 ...
    problems : unreadable cells that the reader found
    names : names of the electrodes' columns; "" for a column that is missing, which makes a dead channel
    snapshots : true if frames do not follow each other in time; their time is then NaN
    labels : name -> (T,) texts; channels : pdc, tac, tdc, pac, position, force, as in `Recording`, like the others
    Raises TactileError for no or too many frames, a wrong number of electrodes, over a fifth of the rows bad,
    electrodes that rest low where a unit's rest high, and rows of several fingers in turn."""
    frames = len(electrodes)
    _check_size(path, electrodes, sensor)
    rows = np.arange(frames) if rows is None else rows
    names = names or [f"E{j + 1}" for j in range(electrodes.shape[1])]
    electrodes, absent, notes = without_absent(path, electrodes, names, sensor)
    bad = ~((electrodes <= MAX_READING) & (electrodes >= -MAX_READING))  # NaN compares false
    problems = [*problems, *_unreadable(electrodes, bad, names, rows, problems)]
    if bad.any():
        electrodes = np.where(bad, np.nan, electrodes)
    notes = [*warnings, *notes]
    if stamps is None:
        stamps = np.arange(frames) / SAMPLE_RATE
        notes += [] if snapshots else [f"{os.path.basename(path)}: no time stamps; {SAMPLE_RATE:g} Hz assumed"]
    _check_share(path, np.any(bad, axis=1), problems, row_word)
    readings = electrodes[:LOOKED_AT][np.isfinite(electrodes[:LOOKED_AT]).all(axis=1)]
    if len(readings):
        _refuse_mirrored(path, np.where(absent, np.nan, np.median(readings, axis=0)), sensor)
    if not snapshots:
        _refuse_turns(path, readings)
    seconds, start, of_stamps = seconds_of(stamps)
    jumps, of_jumps = time_jumps(seconds, rows, row_word)
    clean: dict[str, Any] = {key: _finite(value) for key, value in channels.items() if value is not None}
    return Recording(
        name=Path(path).stem,
        path=path,
        layout=layout,
        time=np.full(frames, np.nan) if snapshots else seconds,
        start_time=start,
        electrodes=electrodes,
        rows=rows,
        flags=_flags(bad, problems, jumps) | np.uint16(Flag.DEAD_CHANNEL if absent.any() else 0),
        warnings=(*notes, *tell_problems(problems, row_word), *of_stamps, *tell_rate(seconds), *of_jumps),
        simulated=simulated,
        truth=truth,
        about=about or {},
        sensor=sensor,
        labels=labels or {},
        **clean,
    )


def _refuse_mirrored(path: str, levels: np.ndarray, sensor: str) -> None:
    """Raise TactileError if levels (e,) counts at rest (NaN: not judged) are low where a typical unit's are high."""
    typical, known = typical_rest(sensor), np.isfinite(levels)
    if typical is None:
        return
    levels, typical = levels[known], typical[known]
    if np.quantile(levels, 0.1) < LEAST_MIRRORED or np.median(levels) > COUNT_MAX / 2:
        return
    off, usual = levels - levels.mean(), typical - typical.mean()
    if off @ usual < MIRRORED * np.sqrt(off @ off * (usual @ usual)):
        found = f"levels of {levels.min():.0f} to {levels.max():.0f}, low where a unit's are high"
        expected = f"{typical.min():.0f} to {typical.max():.0f} as of a typical unit"
        top = f"{COUNT_MAX:g} counts, 3300 mV"
        advice = f"The file seems to hold the top of a range minus readings: subtract its electrodes from it ({top})"
        raise TactileError(f"{path}, electrodes", found, expected, advice)


def _refuse_turns(path: str, readings: np.ndarray) -> None:
    """Raise TactileError if rows of several fingers alternate: a row of readings (T, e) is like that some rows before,
    and unlike the last. Changes against rest are not judged: all fingers rest at 0, and any hum would stand out."""
    if len(readings) < TURNS * MOST_FINGERS:
        return
    low, level = np.quantile(readings, [0.1, 0.5])
    if low <= RAW * level:
        return
    apart = readings - readings.mean(axis=1, keepdims=True)

    def change(rows: int) -> float:
        """Return the median absolute change of all electrodes from a row to that `rows` later."""
        return float(np.median(np.abs(apart[rows:] - apart[:-rows])))

    for count in range(2, MOST_FINGERS + 1):
        if change(1) > TURNS * max(change(count), NOISE * level):
            found = f"rows of {count} fingers take turns: each is like that {count} rows before, unlike the one before"
            raise TactileError(path, found, "one recording", "Split the file: a file for each finger")


def _flags(bad: np.ndarray, problems: Sequence[Problem], jumps: np.ndarray) -> np.ndarray:
    """Return flags (T,) uint16 of frames with a bad cell or a problem, and of those before which time jumps.
    bad : (T, 19) bool, unreadable cells; jumps : (n,) int, indices of frames before which time jumps"""
    flags = np.where(bad.any(axis=1), Flag.REPAIRED, 0).astype(np.uint16)
    for problem in problems:
        flags[problem.frame] |= np.uint16(Flag.REPAIRED)
    flags[jumps] |= np.uint16(Flag.TIME_JUMP)
    return flags


def _finite(values: np.ndarray) -> np.ndarray:
    """Return values of any shape with infinity replaced by NaN; the array itself if all are finite."""
    finite = np.isfinite(values)
    return values if finite.all() else np.where(finite, values, np.nan)


def tell_problems(problems: Sequence[Problem], row_word: str) -> list[str]:
    """Return sentences on the first `SHOWN` problems, by row_word ("line" or "frame"), and on how many follow."""
    sentences = [
        f"{row_word} {p.row}, {p.field}: {p.found}; "
        + ("interpolated from the frames around it" if p.essential else "left empty")
        for p in problems[:SHOWN]
    ]
    if len(problems) > SHOWN:
        rest = problems[SHOWN:]
        sentences.append(f"{len(rest)} more bad cells, in {row_word}s {rest[0].row} to {max(p.row for p in rest)}")
    return sentences


def _check_size(path: str, electrodes: np.ndarray, sensor: str) -> None:
    if electrodes.ndim != 2:
        expected = f"(frames, {electrode_count(sensor)})"
        raise TactileError(f"{path}, electrodes", f"an array of shape {electrodes.shape}", expected)
    if len(electrodes) == 0:
        advice = "Check that the recording was written to its end"
        raise TactileError(path, "no data rows", "at least one frame", advice)
    if len(electrodes) > MAX_FRAMES:
        raise TactileError(path, f"{len(electrodes):,} frames", f"at most {MAX_FRAMES:,}", "Split the recording")
    check_electrodes(path, electrodes.shape[1], "electrodes", sensor)


def _unreadable(
    electrodes: np.ndarray, bad: np.ndarray, names: Sequence[str], rows: np.ndarray, known: Sequence[Problem]
) -> list[Problem]:
    """Return a problem for each impossible reading but `known` ones. electrodes, bad : (T, 19) readings, and bool
    names : the columns' names; rows : (T,) int, row of each frame in the file"""
    known_places = {(p.frame, "" if p.field == "row" else p.field) for p in known}
    found = []
    for frame, j in np.argwhere(bad)[:MAX_PROBLEMS]:
        if (frame, names[j]) not in known_places and (frame, "") not in known_places:
            found.append(Problem(int(frame), int(rows[frame]), names[j], f"{electrodes[frame, j]:g} is no reading"))
    return found


def _check_share(path: str, bad: np.ndarray, problems: Sequence[Problem], row_word: str) -> None:
    """Raise BadRows if over a fifth of the frames, or all, are bad: by bad (T,) bool, or by an essential problem."""
    bad = bad.copy()
    bad[[p.frame for p in problems if p.essential]] = True
    frames, count = len(bad), int(bad.sum())
    if count > max(1, MAX_BAD_SHARE * frames) or count == frames:
        first = next(p for p in problems if p.essential)
        where = f"{path}, {row_word} {first.row}, {first.field}"
        found = f"{first.found}; {count} of {frames} rows are bad"
        raise BadRows(where, found, f"at most {MAX_BAD_SHARE:.0%} of the rows", "Check the export of this file")
