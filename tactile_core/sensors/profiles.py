"""The two profile tables that ship with the package: shapes of the public sensor meshes, sampled."""

from __future__ import annotations

import numpy as np

from ..files.shipped import shipped


def load_profile(name: str) -> np.ndarray:
    """Read rows of ``data/<name>`` as floats, millimetres and degrees as the table's header says, nan where a ray
    missed.
    """
    with shipped(name).open("r", encoding="ascii") as lines:
        return np.loadtxt(lines, delimiter=",", skiprows=1)
