"""Impedances of real electrodes at rest against models of the film, fitted on one unit and tried on the other.

The units are the two fingers of the PHAC set (outside data), at rest as their soft objects' trials 01 to 03 show it. An
electrode is read over a load of 10 kOhm, so that a reading E is an impedance of (4095 / E - 1) 10 kOhm (SynTouch,
BioTac SP manual). The interface is one resistance in series with each electrode. Errors are relative, rms over them.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_core import recordings
from tactile_core.accuracy import Row, row
from tactile_core.mechanics.electrodes.biotac_sheet import biotac_sheet
from tactile_core.mechanics.fast.sensing_points import electrode_feet
from tactile_core.sensors import COUNT_MAX
from tactile_core.translation.unit_rest import find_rest

from . import grips

LOAD = 10e3  # ohm


def rows(quick: bool, data: Path) -> Iterator[Row]:
    """Rows of each model; baseline: one number for all electrodes, fitted likewise. None without the outside data."""
    folder = data / "biotac_phac"
    if not folder.exists():
        return
    soft = grips.soft_to_choose_by(grips.find(folder))
    units = [impedance_at_rest(soft, finger) for finger in (0, 1)]
    sheet = biotac_sheet().resistances(biotac_sheet().film)
    ones = np.ones_like(sheet)
    models = {
        "gap": (1 / electrode_feet().gap)[:, None],
        "sheet": sheet[:, None],
        "sheet_and_interface": np.column_stack([sheet, ones]),
    }
    baseline = _cross_error(units, ones[:, None])
    for name, terms in models.items():
        of = f"fitted on the other finger; {_constants(units, terms)}"
        yield row(f"rest_impedance_{name}", _cross_error(units, terms), "percent rms", baseline=baseline, of=of)


def impedance_at_rest(paths: list[Path], finger: int) -> np.ndarray:
    """Impedance (19,) ohm of a unit's electrodes without contact."""
    rest = find_rest([recordings.read(f"{path}#{finger}") for path in paths])
    return (COUNT_MAX / rest.counts - 1) * LOAD


def _fitted(impedance: np.ndarray, terms: np.ndarray) -> np.ndarray:
    """Factors (k,) of terms (19, k) that leave the least relative error."""
    return np.linalg.lstsq(terms / impedance[:, None], np.ones(len(impedance)), rcond=None)[0]


def _cross_error(units: list[np.ndarray], terms: np.ndarray) -> float:
    """Fit the terms to each of two units and return their error on the other, per cent rms, the worse of the two."""
    pairs = ((units[0], units[1]), (units[1], units[0]))
    return max(100 * float(np.sqrt(np.mean((terms @ _fitted(a, terms) / b - 1) ** 2))) for a, b in pairs)


def _constants(units: list[np.ndarray], terms: np.ndarray) -> str:
    return "factors " + " and ".join(np.array2string(_fitted(unit, terms), precision=3) for unit in units)
