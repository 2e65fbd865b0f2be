"""Observe a ``Gel`` for learning: picture, force and marker motion, and their Gymnasium space."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import sensors
from ..files.installed import needing
from ..sensors.calibration_file import load_calibration
from .gel import Gel

ROWS, COLUMNS = 9, 7  # of markers, as on printed gels (assumed): 1.9 mm apart in the shipped unit's picture
_MOST_FORCE, _MOST_MOTION = 100.0, 5e-3  # N, m: beyond what a gel bears and moves


def marker_nodes(gel: Gel, rows: int = ROWS, columns: int = COLUMNS) -> np.ndarray:
    """Return the indices (rows, columns) int of the nodes nearest to an even grid of markers over the gel's picture (of
    a BioTac, over the DIGIT's): rows from the tip along +x, columns along +z."""
    camera = gel._renderer.camera if sensors.is_gel(gel.sensor) else load_calibration().camera
    x = np.linspace(camera.gel_x.min(), camera.gel_x.max(), rows + 2)[1:-1]
    z = np.linspace(camera.gel_z.min(), camera.gel_z.max(), columns + 2)[1:-1]
    places = np.stack(np.meshgrid(x, z, indexing="ij"), -1).reshape(-1, 1, 2)
    away = np.square(places - gel.surface.rest[None, :, [0, 2]]).sum(axis=2)
    return away.argmin(axis=1).reshape(rows, columns)


def observe(gel: Gel, markers: np.ndarray, *, picture: bool = True) -> dict[str, np.ndarray]:
    """Return the last contact's "force" (3,) N, "markers" (rows, columns, 2) m, their motion along x and z, and, if
    asked, "picture" (H, W, 3) uint8. markers : (rows, columns) int, nodes of ``marker_nodes``"""
    moved = gel.contact.displacement[markers.ravel()][:, [0, 2]].reshape(*markers.shape, 2)
    seen = {"force": gel.contact.force.astype(np.float32), "markers": moved.astype(np.float32)}
    return seen | {"picture": gel.picture()} if picture else seen


def observation_space(markers: np.ndarray, *, picture: bool = True) -> Any:
    """Return the ``gymnasium.spaces.Dict`` of ``observe``. Raises ModuleNotFoundError without the extra [mujoco].
    markers : (rows, columns) int, nodes of ``marker_nodes``; picture : true if pictures are observed"""
    with needing("mujoco"):
        from gymnasium.spaces import Box, Dict

    camera = load_calibration().camera
    spaces = {
        "force": Box(-_MOST_FORCE, _MOST_FORCE, (3,), np.float32),
        "markers": Box(-_MOST_MOTION, _MOST_MOTION, (*markers.shape, 2), np.float32),
    }
    if picture:
        spaces["picture"] = Box(0, 255, (*camera.shape, 3), np.uint8)
    return Dict(spaces)
