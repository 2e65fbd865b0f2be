"""Describe a sensor in words, from its descriptor."""

from __future__ import annotations

import numpy as np

from . import electrodes, sensor_surface, shape_of, skin_of
from .calibration_file import load_calibration
from .descriptor import describe, passed_over
from .electrodes import table_of
from .fluid_sensor import Fluid
from .gel_sensor import GelSensor


def about(name: str) -> str:
    """Return lines on a sensor's kind, size, material, surface, sources. TactileError for an unknown or bad sensor."""
    found, surface = describe(name), sensor_surface(name)
    gel = isinstance(found, GelSensor)
    apart = f"; {1e3 * shape_of(name).spacing:.2g} mm apart where the camera looks" if gel else ""
    size = " x ".join(f"{1e3 * each:.2f}" for each in np.ptp(surface.rest, axis=0)[[0, 2]])
    lines = [
        f"{name}: {found.title}",
        *(_of_gel(name, found) if isinstance(found, GelSensor) else _of_skin(name, found)),
        f"size: {size} mm along and across the finger",
        f"material: Young's modulus {1e-6 * found.material.youngs:g} MPa, Poisson's ratio {found.material.poisson:g}",
        f"surface: {len(surface.rest)} nodes, {len(surface.faces)} triangles{apart}",
        f"descriptor: {found.folder}",
        *(f"source: {source}" for source in found.sources),
        *(f"not read: {each}, since a sensor that ships has its name; rename the folder" for each in passed_over(name)),
    ]
    return "\n".join(lines)


def _of_gel(name: str, gel: GelSensor) -> list[str]:
    form = "flat" if gel.dome is None else "domed"
    picture = "no calibration"
    if gel.camera.calibration:
        picture = f"calibration {gel.camera.calibration}, {load_calibration(None, name).unit}"
    return [f"kind: gel, {form}, {1e3 * shape_of(name).thickness:g} mm thick at its apex; {picture}"]


def _of_skin(name: str, skin: Fluid) -> list[str]:
    readout = f"{skin.readout.bits} bits at {skin.readout.rate:g} Hz"
    words = f"{1e3 * skin_of(name).thickness:g} mm thick over fluid; {readout}"
    count, table = skin.electrodes.count, table_of(name)
    there = f"in {table.name}, all inside the body" if table.is_file() else f"whose table {table.name} is not there"
    if table.is_file():
        electrodes(name)  # raises for one that is not
    return [f"kind: fluid, a skin {words}", f"electrodes: {count}, {there}"]
