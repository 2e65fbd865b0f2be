"""Calibrations as readable TOML: one file a unit, lengths in mm; unknown and missing fields are refused."""

from __future__ import annotations

import dataclasses
import functools
import os
from pathlib import Path
from typing import Any

from ..errors import TactileError
from ..files import atomic, outside
from .calibration import Calibration, Coating, Fit, Markers, Response
from .calibration_text import FORMAT, as_text
from .camera import Camera, Led
from .descriptor import of_kind
from .gel_sensor import Gel
from .toml_fields import MAY_MISS, file_beside, number, one_of, read_table, read_toml

WITHOUT_SPREAD = "tactile-calibration-2"  # whose coatings do not spread light
EXPECTED, ADVICE = "a file of `tactile calibrate`", "Make it again with `tactile calibrate`"


def load_calibration(path: str | os.PathLike | None = None, sensor: str | None = None) -> Calibration:
    """Load the calibration in a TOML file; None for the one that ships with a sensor's descriptor, None the DIGIT's.

    path : written by ``tactile calibrate``, or by hand; its lengths are in mm, those of the result in m
    sensor : name of the sensor whose calibration it must be; None for any
    A background's photograph is looked for beside the file. Raises TactileError naming file and field for what cannot
    be read, is unknown, missing or out of its range, and for a file of another sensor.

    >>> renderer = tactile.Renderer(tactile.load_calibration("unit.toml"))
    """
    if path is None:
        return _shipped(sensor or Camera.sensor)
    file = Path(path)
    found = read_toml(file, lambda content: _calibration(content, file.parent), EXPECTED, ADVICE)
    if sensor not in (None, found.camera.sensor):
        raise TactileError(
            f"{os.fspath(path)}, sensor", repr(found.camera.sensor), repr(sensor), "Name one of that gel"
        )
    return found


def calibration_path(sensor: str) -> Path:
    """Return the file of the calibration that a gel's descriptor names. Raises TactileError where it names none."""
    gel = of_kind(sensor, Gel)
    if not gel.camera.calibration:
        advice = "Make one: `tactile calibrate --start FILE`, as docs/extend.md says"
        raise TactileError(f"sensor {sensor!r}, camera, calibration", "none", "a file beside the descriptor", advice)
    return gel.folder / gel.camera.calibration


SHIPPED = calibration_path(Camera.sensor)


@functools.cache
def _shipped(sensor: str) -> Calibration:
    file = calibration_path(sensor)
    return load_calibration(file, sensor)


@dataclasses.dataclass(frozen=True)
class _Leds:
    red: Led = dataclasses.field(metadata={"given": {"colour": "red"}})
    green: Led = dataclasses.field(metadata={"given": {"colour": "green"}})
    blue: Led = dataclasses.field(metadata={"given": {"colour": "blue"}})


@dataclasses.dataclass(frozen=True)
class _Ambient:
    red: tuple[float, ...] = number()
    green: tuple[float, ...] = number()
    blue: tuple[float, ...] = number()
    rise: tuple[float, float, float] = number("per_mm", default=(0.0, 0.0, 0.0), may_miss=True)


@dataclasses.dataclass(frozen=True)
class _Gel:
    dome_scale: float = number()
    index: float = number()


@dataclasses.dataclass(frozen=True)
class _Background:
    photograph: str = file_beside()


@dataclasses.dataclass(frozen=True)
class _Noise:
    levels: tuple[float, float, float] = number()


@dataclasses.dataclass(frozen=True)
class _File:
    """The tables of a file."""

    unit: str
    camera: Camera
    leds: _Leds
    response: Response
    ambient: _Ambient
    coating: Coating
    gel: _Gel
    background: _Background
    noise: _Noise
    fit: Fit
    format: str = one_of((FORMAT, WITHOUT_SPREAD))
    markers: Markers | None = dataclasses.field(default=None, metadata=MAY_MISS)
    sensor: str = dataclasses.field(default=Camera.sensor, metadata=MAY_MISS)


def _calibration(content: dict[str, Any], folder: Path) -> Calibration:
    found = read_table(_File, content)
    leds, ambient = (found.leds.red, found.leds.green, found.leds.blue), found.ambient
    photograph = found.background.photograph
    if photograph:
        photograph = str(outside.inside(folder, photograph, "a photograph beside the calibration"))
    return Calibration(
        unit=found.unit,
        camera=dataclasses.replace(found.camera, sensor=found.sensor),
        leds=leds,
        response=found.response,
        ambient=(ambient.red, ambient.green, ambient.blue),
        coating=found.coating,
        gel_index=found.gel.index,
        dome_scale=found.gel.dome_scale,
        photograph=photograph,
        noise=found.noise.levels,
        fit=found.fit,
        photographed=(leds, found.coating.albedo) if photograph else None,
        markers=found.markers,
        ambient_rise=ambient.rise,
    )


def write_calibration(path: str | os.PathLike, calibration: Calibration) -> None:
    """Write a calibration file, whole or not at all; equal calibrations give equal bytes.

    Numbers keep six digits. A photograph is named as it lies beside the file.
    """
    text = as_text(calibration)
    atomic.write_bytes(path, text.encode())
