"""The one type every reader of deformed meshes yields, and the checked arrays it is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import TactileError
from ..recordings.store import damage_told

if TYPE_CHECKING:
    import h5py

MAX_NODES = 1_000_000  # the data sets at hand have 4,246 and 1,834 (bounds memory: 24 MB a frame)


@dataclass(frozen=True, eq=False)
class Deformation:
    """One frame of one simulated sensor.

    trial, step, environment : numbers in the file (trial 0 where it has none); sensor : "biotac" or "digit"
    nodes : (N, 3) float, m, in the simulation's frame; force : (3,) float, N, sum of the contact forces
    stresses : (E,) float, Pa, of the elements, or None
    """

    trial: int
    step: int
    environment: int
    sensor: str
    nodes: np.ndarray
    force: np.ndarray
    stresses: np.ndarray | None = None


def points(file: h5py.File, name: str) -> np.ndarray:
    """(N, 3) finite float. Raises TactileError."""
    values = _array(file, name)
    if values.ndim != 2 or values.shape[1] != 3 or not len(values):
        raise TactileError(f"{file.filename}, {name}", f"shape {values.shape}", "(nodes, 3)")
    return values


def force(file: h5py.File, name: str) -> np.ndarray:
    """(3,) finite float, the sum of several (assumed: contacts of one sensor). Raises TactileError."""
    values = _array(file, name)
    if not values.ndim or values.shape[-1] != 3:
        raise TactileError(f"{file.filename}, {name}", f"shape {values.shape}", "(3,) or (contacts, 3)")
    return values.reshape(-1, 3).sum(axis=0)


def numbers(file: h5py.File, name: str) -> np.ndarray:
    """(E,) finite float. Raises TactileError."""
    return _array(file, name).reshape(-1)


def _array(file: h5py.File, name: str) -> np.ndarray:
    where = f"{file.filename}, {name}"
    data = file.get(name)
    shape = getattr(data, "shape", None)
    if shape is None or data.dtype.kind not in "iuf":
        raise TactileError(where, "missing, or no array of numbers", "as beside the other arrays of the frame")
    if np.prod([float(length) for length in shape]) > 3 * MAX_NODES:
        raise TactileError(where, f"shape {shape}", f"at most {3 * MAX_NODES:,} numbers")
    with damage_told(where, "data"):
        values = np.asarray(data[()], np.float64)
    if not np.isfinite(values).all():
        raise TactileError(where, "a number that is not finite", "finite numbers")
    return values
