"""Read the tables of sensors' descriptors that hold shapes of resting surfaces, sampled."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from ..errors import TactileError
from ..files.outside import read_small

_RADII = "x_mm,theta_deg,r_outer_mm,r_inner_mm,r_core_mm"
_HEIGHTS = "x_mm,z_mm,top_height_mm,bottom_height_mm"
_AROUND = 72  # angles of a station, every 5 degrees


def read_radii(path: Path) -> np.ndarray:
    """Read a skin's stations (n, 72, 5): x, angle and radii of outer skin, inner skin and core, mm and degrees; NaN
    where a ray missed. Raises TactileError unless each station has every 5 degrees from -180 to 175, at least two have
    the outer skin all round, and it has no gaps between the first and the last of these."""
    rows = _table(path, _RADII)
    angles = -180 + 360 / _AROUND * np.arange(_AROUND)
    if len(rows) % _AROUND or not (rows[:, 1].reshape(-1, _AROUND) == angles).all():
        raise TactileError(path, "stations that do not close round the axis", "each from -180 to 175 degrees, every 5")
    stations = rows.reshape(-1, _AROUND, 5)
    there = np.isfinite(stations[..., 2])
    whole = np.flatnonzero(there.all(axis=1))
    if len(whole) < 2:
        raise TactileError(path, "an open profile: no two stations with the outer skin all round", "a closed skin")
    between = slice(whole[0], whole[-1] + 1)
    if not there[between].all():
        station, column = (int(each[0]) for each in np.nonzero(~there[between]))
        where = f"{path}, x_mm {stations[whole[0] + station, 0, 0]:g}, theta_deg {angles[column]:g}"
        expected = "a closed skin between its first and last whole station"
        raise TactileError(where, "an open profile: no outer radius", expected)
    return stations


def read_heights(path: Path) -> np.ndarray:
    """Read a gel's heights (n, 4): x, z, top and bottom, mm; NaN off the gel. Raises TactileError for another table."""
    return _table(path, _HEIGHTS)


def table_text(path: Path) -> str:
    """Read the text of a table beside a descriptor. Raises TactileError for one that is missing or no text."""
    try:
        return read_small(path)
    except (OSError, UnicodeDecodeError) as error:
        raise TactileError(path, f"cannot be read ({error})", "the table that sensor.toml names") from error


def _table(path: Path, header: str) -> np.ndarray:
    first, _, rest = table_text(path).partition("\n")
    if first.strip() != header:
        raise TactileError(f"{path}, row 1", first, header)
    try:
        rows = np.loadtxt(io.StringIO(rest), delimiter=",", ndmin=2)
    except ValueError as error:
        raise TactileError(path, str(error), f"numbers under {header}") from error
    if rows.shape[1] != header.count(",") + 1:
        raise TactileError(path, f"rows of {rows.shape[1]} numbers", f"numbers under {header}")
    return rows
