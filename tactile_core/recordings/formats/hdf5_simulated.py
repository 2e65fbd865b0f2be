"""The project's own simulated recording; ``simulated.py`` describes and writes it."""

from __future__ import annotations

from collections.abc import Collection

from ..array_store import Store
from ..recording import Recording
from ..simulated import FORMAT, read_simulated

CONTAINER = "hdf5"
ELECTRODES_NAME = "electrodes"
NAME = f"HDF5 simulated recording ({FORMAT})"


def score(keys: Collection[str]) -> float:
    """Return 1 where keys, the arrays' names and ``format=...``, have "format=tactile-recording-1", else 0."""
    return float(f"format={FORMAT}" in keys)


def read(store: Store) -> Recording:
    """Read counts and true values. Raises the errors of ``read_simulated``."""
    return read_simulated(store, NAME)
