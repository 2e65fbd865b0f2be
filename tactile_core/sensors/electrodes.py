"""Read a fluid sensor's tables: electrodes, and simulated contacts."""

from __future__ import annotations

import csv
import dataclasses
import functools
import os
from pathlib import Path

import numpy as np

from ..errors import TactileError
from .descriptor import OWN, of_kind
from .fluid_sensor import Fluid
from .profiles import table_text

COLUMNS = ("name", "x_mm", "y_mm", "z_mm", "rest_counts")

SP_COLUMNS = ("id", "core_x", "core_y", "core_z", "skin_x", "skin_y", "skin_z", "note", "u", "v")  # of bsadr/biotac


@dataclasses.dataclass(frozen=True)
class Places:
    """Electrodes of a sensor, mm in its maker's frame.
    sensing : (n, 3), places of those that are read
    rest_counts : (n,), of a typical unit without contact; NaN if unknown
    excitation : (m, 3), places of those that feed the current"""

    sensing: np.ndarray
    rest_counts: np.ndarray
    excitation: np.ndarray


@functools.cache
def places_of(name: str) -> Places:
    """Read the electrodes of a sensor from their table, beside its descriptor or in ``$TACTILE_SENSORS/<name>/``.
    Raises TactileError for a sensor without electrodes, and for a table that is missing or bad."""
    found, path = of_kind(name, Fluid), table_of(name)
    table = found.electrodes.places
    if not path.is_file():
        raise TactileError(
            path, "there is no such file", f"the places of the electrodes of a {found.title}",
            f"Put {table} ({found.sources[0]}) into the folder {name} of a folder that ${OWN} names",
        )  # fmt: skip
    places = read_places(path)
    if len(places.sensing) != found.electrodes.count:
        expected = f"the {found.electrodes.count} of the descriptor of {name!r}"
        raise TactileError(path, f"{len(places.sensing)} electrodes that are read", expected)
    return places


def table_of(name: str) -> Path:
    """Return the path of a sensor's table of electrodes, whether or not the file exists."""
    found, own = of_kind(name, Fluid), os.environ.get(OWN)
    path = found.folder / found.electrodes.places
    return path if path.is_file() or not own else Path(own) / name / found.electrodes.places


def typical_rest(name: str) -> np.ndarray | None:
    """Return the counts (e,) of a sensor's typical unit at rest; None if they, or their table, are missing. Raises
    TactileError for a bad table."""
    rest = places_of(name).rest_counts if table_of(name).is_file() else np.array([np.nan])
    return rest if np.isfinite(rest).all() else None


@functools.cache
def contacts_of(name: str) -> np.ndarray | None:
    """Load the counts, float64 (contacts, electrodes), by which simulated contacts change readings, to judge recordings
    by; None without such a table. Raises TactileError for a sensor without electrodes, or a bad table."""
    found = of_kind(name, Fluid)
    return _table(found, found.electrodes.contacts)


def contact_pressures_of(name: str) -> np.ndarray | None:
    """Load the fluid's pressure rise (contacts,) float64 Pa in each row of ``contacts_of``; None without a table."""
    found = of_kind(name, Fluid)
    return _table(found, found.electrodes.contact_pressures)


def _table(sensor: Fluid, file: str) -> np.ndarray | None:
    try:
        return np.load(sensor.folder / file, allow_pickle=False).astype(np.float64) if file else None
    except (OSError, ValueError) as error:
        found = f"cannot be read ({error})"
        raise TactileError(sensor.folder / file, found, "the table of numpy that sensor.toml names") from error


def read_places(path: Path) -> Places:
    """Read the electrodes in a CSV of name, x_mm, y_mm, z_mm, rest_counts, those without counts as the excitation's; or
    in bsadr/biotac's table of a BioTac SP, where ids below zero are the excitation's. Raises TactileError naming file
    and row."""
    rows = list(csv.reader(table_text(path).splitlines()))
    if rows and tuple(rows[0]) == SP_COLUMNS:
        return _read_sp(path, rows[1:])
    if not rows or tuple(rows[0]) != COLUMNS:
        raise TactileError(f"{path}, row 1", ",".join(rows[0]) if rows else "nothing", ",".join(COLUMNS))
    places, rest = [], []
    for number, row in enumerate(rows[1:], start=2):
        try:
            _, x, y, z, counts = row
            places.append((float(x), float(y), float(z)))
            rest.append(float(counts) if counts else np.nan)
        except ValueError as error:
            raise TactileError(f"{path}, row {number}", ",".join(row), ",".join(COLUMNS)) from error
    read, level = np.array(places).reshape(-1, 3), np.array(rest)
    sensing = np.isfinite(level)
    if not np.isfinite(read).all() or not sensing.any():
        raise TactileError(path, "no electrode that is read, or a place that is no number", "finite places, mm")
    return Places(read[sensing], level[sensing], read[~sensing])


def _read_sp(path: Path, rows: list[list[str]]) -> Places:
    """Return the electrodes in rows of the table's cells, sorted by id; the excitation's ids are -1, -2, ..."""
    places: dict[int, tuple[float, ...]] = {}
    for at, row in enumerate(rows, start=2):
        try:
            places[int(row[0])] = float(row[1]), float(row[2]), float(row[3])
        except (ValueError, IndexError) as error:
            raise TactileError(f"{path}, row {at}", ",".join(row), ",".join(SP_COLUMNS)) from error
    sensing, fed = ([places[n] for n in sorted(places, key=abs) if n * sign > 0] for sign in (1, -1))
    if sorted(places) != [*range(-len(fed), 0), *range(1, len(sensing) + 1)] or not (sensing and fed):
        expected = "1, 2, ... of those read, -1, -2, ... of the excitation"
        raise TactileError(path, "numbers that leave some out", expected)
    found = Places(np.array(sensing), np.full(len(sensing), np.nan), np.array(fed))
    if not (np.isfinite(found.sensing).all() and np.isfinite(found.excitation).all()):
        raise TactileError(path, "a place that is no number", "finite places, mm")
    return found
