"""Read the table of a fluid sensor's electrodes, beside its descriptor."""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np

from ..errors import TactileError
from ..files.text_file import read_small

COLUMNS = ("name", "x_mm", "y_mm", "z_mm", "rest_counts")


@dataclasses.dataclass(frozen=True)
class Places:
    """Electrodes of a sensor, mm in its maker's frame.

    sensing : (n, 3), electrodes that are read; rest_counts : (n,), of a typical unit without contact
    excitation : (m, 3), those that feed the current
    """

    sensing: np.ndarray
    rest_counts: np.ndarray
    excitation: np.ndarray


def read_places(path: Path) -> Places:
    """Read a table of ``COLUMNS``; electrodes without counts at rest are those of the excitation.

    Raises TactileError naming file and row.
    """
    rows = list(csv.reader(read_small(path).splitlines()))
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
