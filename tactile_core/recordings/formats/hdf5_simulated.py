"""The project's own simulated recording; ``simulated.py`` describes and writes it."""

from __future__ import annotations

from collections.abc import Collection

from ..recording import Recording
from ..simulated import FORMAT, read_simulated
from ..store import Store

CONTAINER = "hdf5"
ELECTRODES_NAME = "electrodes"
NAME = f"HDF5 simulated recording ({FORMAT})"


def score(keys: Collection[str]) -> float:
    return float(f"format={FORMAT}" in keys)


def read(store: Store) -> Recording:
    return read_simulated(store, NAME)
