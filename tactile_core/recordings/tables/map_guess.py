"""Guess the map of a recording's columns: from their names, and where they have none, from what they hold."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import Any, cast

import numpy as np

from ...sensors import COUNT_MAX, ELECTRODES
from ..time_stamps import Unit, is_likely, unit_of
from .column_map import CHANNELS, ColumnMap
from .table import Table

NUMBERED = re.compile(r"(.*?)(\d+)(\D*)$", re.DOTALL)
NUMBER = re.compile(r"\d+")
INDEXED = re.compile(r"\[\d+\]$")
TIME = re.compile(r"(?<!cen)time|stamp|clock|elapsed|(?:^|[^a-z])ts?(?:[^a-z]|$)|(?:secs?|seconds)(?:[^a-z]|$)|second$")
CLOCK_LIKE = re.compile(r"\d:\d\d")
UNIT = re.compile(r"(?:^|[^a-z])(ns|us|ms|s)(?:[^a-z]|$)")
NO_TAC = re.compile(r"biotac|contact|tactile")  # words that hold a channel's name
ELECTRODE = re.compile(r"electrode|(?:^|[^a-z])(?:elec|ele|el|e)[^a-z]*$")
NOT_READ = re.compile(r"offset|time|stamp|pac|temp|force|joint")  # series of these are no electrodes
PROCESSED = re.compile(r"tare|filt|smooth|norm|scale|delta|diff|change|mean|std")  # read only where no raw series is
VALUE = re.compile(r"value|reading|count|data|signal")
RAW = 0.35 * COUNT_MAX  # least counts at rest (docs/sources.md, BioTac read-out: from 2,000 on)
SLIDE = 45  # columns of the slide set's layout, of which some files have lost the header
# Numbers of channels in the logs of the sensor's own driver, beside 17 to 35 of the electrodes (SynTouch's C example).
DRIVER = {"17": {"pdc": "1", "tac": "2", "tdc": "3"}}


def guess(names: Collection[str], table: Table | None = None) -> list[ColumnMap]:
    """Return a guessed map for each finger in a file, the best first; one without electrodes if none are found.
    names : names of all columns in lower case; for arrays name -> length (those of other lengths are ignored)
    table : some rows of the file, for columns whose names tell nothing, or None"""
    found = []
    for each in _series(names):
        near = _as_long(names, each)
        found.append(_timed(_beside(each, near), near, table))
    if not found and table is not None:
        found = [_timed(each, names, table) for each in _long(table) or _by_values(table)]
    return found or [_timed(_beside((), names), names, table)]


def with_unit(columns: ColumnMap, table: Table) -> ColumnMap:
    """Return the map with the unit of its time, by the column's name, or by the stamps in a table."""
    unit = UNIT.search(columns.time.rpartition("/")[2].replace("_", " "))
    stamps = table.column(columns.time)
    stamps = stamps[np.isfinite(stamps)]
    found = cast(Unit, unit[1]) if unit else unit_of(stamps) if len(stamps) else "s"
    return replace(columns, time_unit=found)


def _as_long(names: Collection[str], electrodes: tuple[str, ...]) -> Collection[str]:
    """Return the names of arrays as long as the electrodes'; the names themselves if they come without lengths."""
    if not isinstance(names, dict):
        return names
    frames = names[next(filter(None, electrodes))]
    return [name for name, each in names.items() if each == frames]


def _series(names: Collection[str]) -> list[tuple[str, ...]]:
    """Return runs of 19 names that differ in a number: called electrodes (some may be ""), not processed, if any."""
    series: dict[tuple[str, str], dict[int, str]] = {}
    for name in names:
        for found in NUMBER.finditer(name):
            if len(found[0]) < 4:
                series.setdefault((name[: found.start()], name[found.end() :]), {})[int(found[0])] = name
    runs = []
    for (before, after), each in series.items():
        if NOT_READ.search(before + after):
            continue
        called = bool(ELECTRODE.search(before + after) or ELECTRODE.search(before.rstrip("[_ .")))
        rank = not called, bool(PROCESSED.search(before + after))
        for first, last in _consecutive(sorted(each)):
            if last - first == ELECTRODES - 1:
                runs.append((rank, tuple(each[number] for number in range(first, first + ELECTRODES))))
        least = 0 if 0 in each else 1
        partial = ELECTRODES // 2 < len(each) < ELECTRODES and max(each) < least + ELECTRODES and min(each) >= least
        if partial and called:
            runs.append((rank, tuple(each.get(number, "") for number in range(least, least + ELECTRODES))))
    best = min((rank for rank, _ in runs), default=None)
    return [names for rank, names in runs if rank == best]


def _consecutive(numbers: list[int]) -> list[tuple[int, int]]:
    """Return pairs (first, last) of the runs of consecutive integers among rising `numbers`."""
    breaks = [place for place in range(1, len(numbers)) if numbers[place] != numbers[place - 1] + 1]
    starts, ends = [0, *breaks], [*breaks, len(numbers)]
    return [(numbers[start], numbers[end - 1]) for start, end in zip(starts, ends, strict=True) if end > start]


def _beside(electrodes: tuple[str, ...], names: Collection[str]) -> ColumnMap:
    """Return the map of the electrodes and of pdc, tac and tdc: for each, of the columns so called, the one whose full
    name is most like the electrodes'. names : of all columns"""
    like = next(filter(None, electrodes), "")
    channels: dict[str, Any] = {
        word: _nearest((name for name in names if _is_called(word, name)), like) for word in CHANNELS
    }
    stem = like.rpartition("[")[0]
    if stem and electrodes == tuple(f"{stem}[{place}]" for place in range(ELECTRODES)):
        electrodes = (stem,)
    return ColumnMap(electrodes, **channels)


def _is_called(word: str, name: str) -> bool:
    """Return true if a column's name holds the channel `word`, such as "pdc", and no index of an array's column."""
    return word in NO_TAC.sub("", name.rpartition("/")[2]) and not INDEXED.search(name)


def _nearest(names: Iterable[str], like: str) -> str:
    """Return the name that begins and ends most like `like`, of several the shortest; "" if there are no names."""
    like = like.partition("[")[0]
    return max(names, key=lambda name: (_alike(name, like) + _alike(name[::-1], like[::-1]), -len(name)), default="")


def _alike(name: str, other: str) -> int:
    """Return the number of characters that two names have in common at their beginning."""
    pairs = zip(name, other, strict=False)
    return next((place for place, (one, two) in enumerate(pairs) if one != two), min(len(name), len(other)))


def is_time(name: str) -> bool:
    """Return true if a column's name looks like that of time, such as ``time`` or ``stamp``."""
    return bool(TIME.search(name.lower().rpartition("/")[2]))


def _timed(columns: ColumnMap, names: Collection[str], table: Table | None) -> ColumnMap:
    """Return the map with the time's column and unit."""
    like = next(filter(None, columns.electrodes), "")
    taken = columns.names()
    timed = [name for name in names if is_time(name) and name not in taken]
    if table is not None:
        timed = [name for name in timed if all(map(CLOCK_LIKE.search, table.words.get(name, ())))]  # the reader says it
        unnamed = [name for name in names if name.startswith("column") and name not in (*taken, *table.words)]
        timed += [name for name in unnamed if is_likely(table.column(name))]
    found = replace(columns, time=_nearest(timed, like))
    return with_unit(found, table) if found.time and table is not None and found.time not in table.words else found


def _long(table: Table) -> list[ColumnMap]:
    """Return the maps of a long table, one per column that may hold values; [] if no column names 19 channels."""
    for place, name in enumerate(table.header):
        if name in table.words:
            held = [word.lower() for word in table.words[name]]
        else:
            numbers = np.unique(table.values[:, place])
            held = [f"{number:g}" for number in numbers] if len(numbers) < len(table.values) / 2 else []
        series = _series(held) if len(held) < 1000 else []
        if not series:
            continue
        channels: dict[str, Any] = DRIVER.get(series[0][0], {}) or {
            word: next((each for each in held if word in each), "") for word in CHANNELS
        }
        values = [each for each in table.header if VALUE.search(each) and each not in table.words and each != name]
        values = values or [
            each for each in table.header[place + 1 :] if RAW < np.nanmedian(table.column(each)) <= COUNT_MAX
        ]
        return [ColumnMap(series[0], channel=name, value=value, **channels) for value in values]
    return []


def _by_values(table: Table) -> list[ColumnMap]:
    """Return the map of columns without names: electrodes are the 19 neighbouring columns with the highest counts, or
    the last 19 if none look like counts. A table with names gets a map without electrodes."""
    names = table.header
    if not names[0].startswith("column") or len(names) < ELECTRODES:
        return [_beside((), names)]
    medians = np.array([0.0 if name in table.words else np.nanmedian(table.column(name)) for name in names])
    medians[(medians < RAW) | (medians > COUNT_MAX)] = 0.0
    starts = range(len(names) - ELECTRODES + 1)
    fits = [start for start in starts if (medians[start : start + ELECTRODES] > 0).sum() > ELECTRODES // 2]
    best = max(fits, key=lambda start: medians[start : start + ELECTRODES].sum(), default=len(names) - ELECTRODES)
    found = ColumnMap(tuple(names[best : best + ELECTRODES]))
    return [replace(found, tdc=names[1], tac=names[2], pdc=names[3]) if len(names) == SLIDE else found]
