"""Read and write calibrations as TOML: one file per unit, lengths in mm, each number explained beside it. Fields that
are unknown or missing are refused.
"""

from __future__ import annotations

import dataclasses
import functools
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import TactileError, path_text
from ..files import atomic, outside
from ..files.outside import toml_value
from .calibration import Calibration, Coating, Fit, Markers, Response
from .camera import COLOURS, Camera, Led
from .descriptor import describe, of_kind
from .gel_sensor import GelSensor
from .toml_fields import MAY_MISS, file_beside, number, one_of, read_table, read_toml

FORMAT = "tactile-calibration-3"
WITHOUT_SPREAD = "tactile-calibration-2"  # whose coatings do not spread light
MM, PER_MM = 1e3, 1e-3  # of a file, in a metre and in 1/m
EXPECTED, ADVICE = "a file of `tactile calibrate`", "Make it again with `tactile calibrate`"


def load_calibration(
    path: str | os.PathLike | None = None, sensor: str | None = None, object_reflectance: float | None = None
) -> Calibration:
    """Load the calibration in a TOML file.

    path : of a file by ``tactile calibrate`` or by hand, lengths in mm (the result's in m); None for the one that ships
    sensor : name of the sensor whose calibration it must be; None for any, and without a path for the DIGIT
    object_reflectance : 0 black to 1 white, of what touches the gel; None for the file's
    The photograph of a background is sought beside the file. Raises TactileError naming file and field for an
    unreadable file, a field that is unknown, missing or out of range, and for a file of another sensor.

    >>> renderer = tactile.Renderer(tactile.load_calibration("unit.toml"))"""
    if object_reflectance is not None:
        unit = dataclasses.replace(load_calibration(path, sensor), object_reflectance=object_reflectance)
        if object_reflectance:
            unit.check_shows("object reflectance")
        return unit
    if path is None:
        return _shipped(describe(sensor or Camera.sensor).folder.name)
    file = Path(path_text(path, "load_calibration, path"))
    found = read_toml(file, lambda content: _calibration(content, file.parent), EXPECTED, ADVICE)
    if sensor not in (None, found.camera.sensor):
        advice = "Name one of that gel"
        raise TactileError(f"{os.fspath(path)}, sensor", repr(found.camera.sensor), repr(sensor), advice)
    return found


def calibration_of(given: Calibration | str | os.PathLike | None, where: str) -> Calibration:
    """Return ``given`` if it is a calibration; load it if it is a file's path; return the DIGIT's that ships for None.
    Raises TactileError, which names ``where``, for anything else, and what ``load_calibration`` raises."""
    if isinstance(given, str | os.PathLike | None):
        return load_calibration(given)
    if not isinstance(given, Calibration):
        raise TactileError(where, f"{given!r:.80}", "a Calibration, or its file", "tactile.load_calibration reads one")
    return given


def calibration_path(sensor: str) -> Path:
    """Return the file of the calibration that a gel's descriptor names. Raises TactileError if it names none."""
    gel = of_kind(sensor, GelSensor)
    if not gel.camera.calibration:
        advice = "Make one: `tactile calibrate --start FILE`, as docs/extend.md says"
        raise TactileError(f"sensor {sensor!r}, camera, calibration", "none", "a file beside the descriptor", advice)
    return gel.folder / gel.camera.calibration


SHIPPED = calibration_path(Camera.sensor)


@functools.cache
def _shipped(sensor: str) -> Calibration:
    return load_calibration(calibration_path(sensor), sensor)


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
class _Object:
    reflectance: float = number()


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
    object: _Object = dataclasses.field(default=_Object(0.0), metadata=MAY_MISS)


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
        object_reflectance=found.object.reflectance,
    )


def write_calibration(path: str | os.PathLike, calibration: Calibration) -> None:
    """Write a calibration file, whole or not at all. Equal calibrations give equal bytes: numbers have six digits."""
    atomic.write_bytes(path, to_toml(calibration).encode())


def to_toml(unit: Calibration) -> str:
    """Format a calibration as TOML, numbers with six digits; its photograph is named without a folder."""
    camera, coating, response = unit.camera, unit.coating, unit.response
    sensor = "" if camera.sensor == Camera.sensor else f"sensor = {toml_value(camera.sensor)}\n"
    ambient = "\n".join(f"{colour} = {toml_value(row)}" for colour, row in zip(COLOURS, unit.ambient, strict=True))
    return f"""\
# A {describe(camera.sensor).title} unit: picture = response(right, down) x radiance of the coating + ambient light, 8-bit values.
# Image frame: right, down, toward the camera; origin in the picture's middle on the plane of height zero.
format = {toml_value(FORMAT)}
unit = {toml_value(unit.unit)}
{sensor}
[camera]
width_px = {camera.width}
height_px = {camera.height}
px_per_mm_x = {toml_value(camera.px_per_mm_x)}  # at height zero
px_per_mm_y = {toml_value(camera.px_per_mm_y)}
centre_x_mm = {toml_value(camera.centre_x, MM)}  # of the gel, in the picture's middle
centre_z_mm = {toml_value(camera.centre_z, MM)}
apparent_height_mm = {toml_value(camera.apparent_height, MM)}  # of the pinhole
right_z = {camera.right_z}  # the way z goes to the right
down_x = {camera.down_x}  # the way x goes down

[leds]  # spheres: right, down, toward the camera; radiance of their surface in levels of their own channel
{_leds(unit)}

[response]  # of the camera, levels a level: a row a channel of the picture, a column an LED
centre = {toml_value(response.centre)}
along_right_per_mm = {toml_value(response.along_right, PER_MM)}
along_down_per_mm = {toml_value(response.along_down, PER_MM)}

[ambient]  # of each LED, held in gel and acrylic, of right^i down^j / (10 mm)^(i + j), by i + j, then j
{ambient}
rise_per_mm = {toml_value(unit.ambient_rise, PER_MM)}  # more of it on higher gel

[coating]  # diffuse, roughplastic or principled; albedo of each LED's light
bsdf = {toml_value(coating.bsdf)}
albedo = {toml_value(coating.albedo)}
roughness = {toml_value(coating.roughness)}
gloss = {toml_value(coating.gloss)}
metallic = {toml_value(coating.metallic)}
spread_mm = {toml_value(coating.spread, MM)}  # of light, sideways in it: standard deviation
transmission = {toml_value(coating.transmission)}  # light from a white object behind it, as a share of its own

[object]  # that touches the gel
reflectance = {toml_value(unit.object_reflectance)}  # 0 black to 1 white, where --object-reflectance says no other

[gel]
dome_scale = {toml_value(unit.dome_scale)}  # of the public mesh's dome
index = {toml_value(unit.gel_index)}  # of gel and acrylic

[background]  # a photograph of the untouched gel, beside this file, is then the picture at rest
photograph = {toml_value(Path(unit.photograph).name)}

{"" if unit.markers is None else _markers(unit.markers)}\
[noise]  # standard deviation, grey levels, red, green, blue; used when asked for
levels = {toml_value(unit.noise)}

{_fit(unit.fit)}"""  # noqa: E501


def _leds(unit: Calibration) -> str:
    return "\n".join(
        f"{led.colour} = {{ position_mm = {toml_value(led.position, MM)}, radius_mm = {toml_value(led.radius, MM)},"
        f" radiance = {toml_value(led.radiance)} }}"
        for led in unit.leds
    )


def _markers(markers: Markers) -> str:
    return f"""\
[markers]  # dots printed on the gel, a square grid in the picture's middle; may be left out
rows = {markers.rows}  # down the picture
columns = {markers.columns}
pitch_mm = {toml_value(markers.pitch, MM)}
diameter_mm = {toml_value(markers.diameter, MM)}
albedo = {toml_value(markers.albedo)}  # share of the coating's light: 0 black

"""


def _fit(fit: Fit) -> str:
    return f"""\
[fit]
note = {toml_value(fit.note)}
ball_diameter_mm = {toml_value(fit.ball_diameter, MM)}
photographs = {toml_value(fit.photographs)}
not_identified = {toml_value(fit.not_identified)}

[fit.errors]  # on those photographs
{_named(fit.errors)}
[fit.standard_errors]  # in each parameter's unit; how units differ (assumed) counts as a measurement
{_named(fit.standard_errors)}"""


def _named(values: Mapping[str, float]) -> str:
    return "".join(f"{toml_value(name)} = {toml_value(value)}\n" for name, value in values.items())
