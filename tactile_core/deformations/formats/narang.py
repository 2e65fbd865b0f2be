"""Narang et al. (biotac_sim): ``step_i/net_force_vecs|nodal_coords|elem_stresses/env_j``, of a BioTac."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from ..deformation import Deformation, force, numbers, points

if TYPE_CHECKING:
    import h5py

NAME = "Narang et al.: step_i/net_force_vecs|nodal_coords|elem_stresses/env_j"
PATTERN = re.compile(r"step_(?P<step>\d{1,9})/nodal_coords/env_(?P<environment>\d{1,9})")


def read(file: h5py.File, found: re.Match) -> Deformation:
    """The frame whose nodes have this name."""
    name = found[0]
    stresses = name.replace("nodal_coords", "elem_stresses")
    return Deformation(
        0, int(found["step"]), int(found["environment"]), "biotac", points(file, name),
        force(file, name.replace("nodal_coords", "net_force_vecs")),
        numbers(file, stresses) if stresses in file else None,
    )  # fmt: skip
