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
    """Return 1 if "format=tactile-recording-1" is among keys, the arrays' names and ``format=...``, else 0."""
    return float(f"format={FORMAT}" in keys)


def read(store: Store) -> Recording:
    """Return the recording with its true values. Raises TactileError for misfits, and for a file without electrodes."""
    return read_simulated(store, NAME)
