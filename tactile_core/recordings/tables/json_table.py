"""JSON as a table: an array of records, one per line, or an object of arrays; fields are named ``a.b[2]``."""

from __future__ import annotations

import json
import os
from array import array
from collections.abc import Iterator
from itertools import chain, islice
from typing import Any, BinaryIO

import numpy as np

from ...errors import TactileError
from ..assemble import MAX_FRAMES
from .cells import LABEL, LOOKED_AT, MAX_COLUMNS, Cells, number
from .table import Table

MAX_JSON = 64 * 2**20  # bytes: twelve minutes of the widest records, in half a GB of memory (assumed enough)
BETWEEN = " \t\r\n,"
# A stamp of ROS messages: its seconds and nanoseconds become one number, ns.
STAMPS = {frozenset(("secs", "nsecs")), frozenset(("sec", "nanosec")), frozenset(("sec", "nsec"))}


def is_json(start: bytes) -> bool:
    """Return true if a file that starts with these bytes looks like JSON records."""
    begin = b"".join(start.removeprefix(b"\xef\xbb\xbf").split())[:2]
    return begin in (b'{"', b"[{", b"[[")


def read_json(path: str, file: BinaryIO) -> Table:
    """Return a table of a JSON file's records. Raises TactileError for damage, no records, too many fields or bytes."""
    if os.fstat(file.fileno()).st_size > MAX_JSON:
        raise TactileError(path, f"over {MAX_JSON // 2**20} MB of JSON", "less", "Split it, or write it as CSV or HDF5")
    file.seek(0)
    try:
        text = file.read().decode("utf-8-sig")
        records = _records(path, text)
        first = next(records, None)
        second = next(records, None)
        if second is None and isinstance(first, dict):
            return _of_object(path, first)
        return _of_records(path, [first, second], records)
    except UnicodeDecodeError as error:
        raise TactileError(f"{path}, byte {error.start}", "not UTF-8 text", "JSON", "Save it as UTF-8") from None
    except RecursionError as error:
        raise TactileError(path, "records within records without end", "flat ones", "Export it again") from error


def _records(path: str, text: str) -> Iterator[Any]:
    """Yield the records of a JSON array, or in sequence, but a last one that is cut off; TactileError for damage."""
    decode, place, count = json.JSONDecoder().raw_decode, _next(text, 0), 0
    if text[place : place + 1] == "[":
        place = _next(text, place + 1)
    while place < len(text) and text[place] != "]":
        try:
            record, place = decode(text, place)
        except ValueError as error:
            if count > 1 and text.find("\n", place) in (-1, len(text) - 1):
                return
            line = text.count("\n", 0, place) + 1
            raise TactileError(
                f"{path}, line {line}", f"damaged JSON ({error})", "a record", "Export it again"
            ) from error
        place, count = _next(text, place), count + 1
        yield record


def _next(text: str, place: int) -> int:
    while place < len(text) and text[place] in BETWEEN:
        place += 1
    return place


def _flat(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield (name, value) of each plain field in a record called `name`; inner fields are called as ``a.b[2]``."""
    if isinstance(value, dict):
        if frozenset(value) in STAMPS:
            seconds, parts = value.values()
            yield name, seconds * 10**9 + parts if isinstance(seconds, int) and isinstance(parts, int) else None
            return
        for key, item in value.items():
            yield from _flat(f"{name}.{key}".lower() if name else key.lower(), item)
    elif isinstance(value, list):
        for place, item in enumerate(value):
            yield from _flat(f"{name}[{place}]" if name else f"column{place + 1}", item)
    else:
        yield name, value


def _of_object(path: str, whole: dict[str, Any]) -> Table:
    """Return a table of a file's single object, `whole`: of its first list of records, or of its lists of numbers."""
    lists = dict(_lists("", whole))
    plain = {key: value for key, value in whole.items() if isinstance(value, str | int | float)}
    constants = {name: str(value) for name, value in _flat("", plain)}
    records = next((each for each in lists.values() if all(isinstance(one, dict) for one in each)), None)
    if records is None:
        longest = max(map(len, lists.values()), default=0)
        columns = {name: each for name, each in lists.items() if len(each) == longest}
        records = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    return _of_records(path, records, iter(()), constants)


def _lists(name: str, value: dict[str, Any]) -> Iterator[tuple[str, list[Any]]]:
    for key, item in value.items():
        inner = f"{name}.{key}" if name else key
        if isinstance(item, list) and len(item) > 1:
            yield inner, item
        elif isinstance(item, dict):
            yield from _lists(inner, item)


def _of_records(path: str, begin: list[Any], more: Iterator[Any], constants: dict[str, str] | None = None) -> Table:
    """Return a table of records, begin then more, NaN for missing fields; constants : name -> text, made labels"""
    records = chain((record for record in begin if isinstance(record, dict | list)), more)
    rows = (dict(_flat("", record)) for record in records)
    first = list(islice(rows, LOOKED_AT))
    names = list(dict.fromkeys(name for each in first for name in each))
    if not names or len(names) > MAX_COLUMNS:
        found = f"{len(names):,} fields" if names else "no records"
        advice = "Export the frames of the recording"
        raise TactileError(path, found, f"records of up to {MAX_COLUMNS:,} fields", advice)
    cells, values = Cells(names, [[_text(each.get(name)) for name in names] for each in first]), array("d")
    for each in chain(first, rows):
        numbers = (cells.value(place, _text(each.get(name))) for place, name in enumerate(names))
        values.extend(np.nan if value is None else value for value in numbers)
        if len(values) > MAX_FRAMES * len(names):
            raise TactileError(path, f"over {MAX_FRAMES:,} records", "fewer", "Split the recording")
    grid = np.frombuffer(values, float).reshape(-1, len(names))
    told = {
        name: np.full(len(grid), text, dtype=object)
        for name, text in (constants or {}).items()
        if LABEL.search(name) or number(text) is None
    }
    return Table(path, tuple(names), grid, np.arange(len(grid)), (), words=cells.words, texts=told)


def _text(value: Any) -> str:
    return "" if value is None else str(value)
