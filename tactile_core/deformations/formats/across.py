"""ACROSS: ``trial_i/step_j/nodal_coords_SENSOR/env_k`` and ``net_force_vecs_SENSOR/env_k``, SENSOR biotac or digit."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ..deformation import Deformation, force, points

if TYPE_CHECKING:
    import h5py

NAME = "ACROSS: trial_i/step_j/nodal_coords_{biotac,digit}/env_k"
PATTERN = re.compile(
    r"trial_(?P<trial>\d{1,9})/step_(?P<step>\d{1,9})/nodal_coords_(?P<sensor>biotac|digit)/env_(?P<environment>\d{1,9})"
)


def read(file: h5py.File, found: re.Match) -> Deformation:
    """The frame whose nodes have this name."""
    name = found[0]
    where = int(found["trial"]), int(found["step"]), int(found["environment"])
    forces = name.replace("nodal_coords_", "net_force_vecs_")
    return Deformation(*where, found["sensor"], points(file, name), force(file, forces))
