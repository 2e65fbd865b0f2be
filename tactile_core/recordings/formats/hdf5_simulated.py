"""The project's own simulated recording; ``simulated.py`` describes, writes and reads it."""

from __future__ import annotations

from functools import partial

from ..simulated import FORMAT, read_simulated
from . import share

CONTAINER = "hdf5"
ELECTRODES_NAME = "electrodes"
NAME = f"HDF5 simulated recording ({FORMAT})"

score = partial(share, wanted=[f"format={FORMAT}"])
read = partial(read_simulated, layout=NAME)
