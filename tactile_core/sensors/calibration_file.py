"""Calibrations as readable TOML: one file a unit, lengths in mm; unknown and missing fields are refused."""

from __future__ import annotations

import functools
import os
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from ..errors import TactileError
from ..files import atomic, outside
from ..files.outside import read_toml_text
from ..files.toml_text import as_toml
from . import calibration_tables as tables
from . import digit
from .calibration import AMBIENT_TERMS, PHOTOGRAPHED_TERMS, Calibration, Coating, Fit, Markers, Response
from .camera import COLOURS, Camera, Led
from .descriptor import describe, of_kind
from .gel_sensor import Gel

FORMAT = "tactile-calibration-3"
FORMER = "tactile-calibration-1"
WITHOUT_SPREAD = "tactile-calibration-2"  # whose coatings do not spread light
SHIPPED = digit.DESCRIPTOR.folder / digit.DESCRIPTOR.camera.calibration
LARGEST = 1e8  # of a unit's numbers, as the radiance of a spot of 0.05 mm; a fit's errors may be larger
ADVICE = "Make it again with `tactile calibrate`"


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
    found = _read(Path(path))
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


def write_calibration(path: str | os.PathLike, calibration: Calibration) -> None:
    """Write a calibration file, whole or not at all; equal calibrations give equal bytes.

    Numbers keep six digits. A photograph is named as it lies beside the file.
    """
    title = describe(calibration.camera.sensor).title
    head = (
        f"A {title} unit: picture = response(right, down) x radiance of the coating + ambient light, 8-bit values.",
        "Image frame: right, down, toward the camera; origin in the picture's middle on the plane of height zero.",
    )
    atomic.write_bytes(path, as_toml(_content(calibration), tables.NOTES, head).encode())


@functools.cache
def _shipped(sensor: str) -> Calibration:
    return load_calibration(calibration_path(sensor), sensor)


def _read(file: Path) -> Calibration:
    try:
        table = tomllib.loads(read_toml_text(file))
        _check_format(table, file)
        _check_numbers({name: table[name] for name in table if name != "fit"}, file, LARGEST)
        _check_numbers(table, file, sys.float_info.max)
        content = msgspec.convert({"sensor": None, "markers": None} | table, tables.CalibrationTables)
    except OSError as error:
        raise TactileError(file, f"cannot be read ({error.strerror})", "a file of `tactile calibrate`") from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "a file of `tactile calibrate`", ADVICE) from error
    try:
        return _calibration(content, file.parent)
    except TactileError as error:
        raise TactileError(f"{file}, {error.where}", error.found, error.expected, ADVICE) from error


def _check_format(table: dict[str, Any], file: Path) -> None:
    """Refuse other formats; a coating of before coatings spread light gets a spread of zero."""
    found = table.get("format")
    if found == FORMER:
        expected = f"{FORMAT!r}, in which LEDs and coating make the picture at rest too"
        raise TactileError(f"{file}, format", f"{FORMER!r}, of an older version", expected, ADVICE)
    if found not in (FORMAT, WITHOUT_SPREAD):
        raise TactileError(f"{file}, format", repr(found), repr(FORMAT), ADVICE)
    if found == WITHOUT_SPREAD and isinstance(table.get("coating"), dict):
        table["coating"].setdefault("spread_mm", 0.0)


def _check_numbers(table: dict[str, Any], file: Path, largest: float) -> None:
    """Raise TactileError for a number that is not finite or larger than that, naming where it stands."""
    for where, number in _numbers(table, ""):
        if not abs(number) <= largest:  # NaN, too
            expected = f"a finite number up to {largest:g}"
            raise TactileError(f"{file}, {where}", f"the number {number!r:.80}", expected, ADVICE)


def _numbers(value: Any, where: str) -> Iterator[tuple[str, float]]:
    """Yield all numbers in nested tables and lists, and the names that lead to them."""
    if isinstance(value, dict):
        for name, each in value.items():
            yield from _numbers(each, f"{where}, {name}" if where else name)
    elif isinstance(value, list):
        for each in value:
            yield from _numbers(each, where)
    elif isinstance(value, (int, float)):
        yield where, value


def _calibration(file: tables.CalibrationTables, folder: Path) -> Calibration:
    leds = _led("red", file.leds.red), _led("green", file.leds.green), _led("blue", file.leds.blue)
    photograph = _photograph(file.background.photograph, folder)
    fit = file.fit
    return Calibration(
        unit=file.unit,
        camera=_camera(file.camera, file.sensor or Camera.sensor),
        leds=leds,
        response=Response(
            file.response.centre,
            tuple(_scaled(1e3, row) for row in file.response.along_right_per_mm),
            tuple(_scaled(1e3, row) for row in file.response.along_down_per_mm),
        ),
        ambient=_ambient(file.ambient),
        coating=_coating(file.coating),
        gel_index=file.gel.index,
        dome_scale=file.gel.dome_scale,
        photograph=photograph,
        noise=file.noise.levels,
        fit=Fit(
            fit.note, tuple(fit.photographs), 1e-3 * fit.ball_diameter_mm, fit.errors, fit.standard_errors,
            tuple(fit.not_identified),
        ),
        photographed=(leds, file.coating.albedo) if photograph else None,
        markers=None if file.markers is None else _markers(file.markers),
        ambient_rise=_scaled(1e3, file.ambient.rise_per_mm),
    )  # fmt: skip


def _led(colour: str, table: tables.LedTable) -> Led:
    return Led(colour, _scaled(1e-3, table.position_mm), 1e-3 * table.radius_mm, table.radiance)


def _scaled(factor: float, values: Sequence[float]) -> tables.Three:
    first, second, third = values
    return factor * first, factor * second, factor * third


def _camera(table: tables.CameraTable, sensor: str) -> Camera:
    return Camera(
        width=table.width_px,
        height=table.height_px,
        px_per_mm_x=table.px_per_mm_x,
        px_per_mm_y=table.px_per_mm_y,
        centre_x=table.centre_x_mm * 1e-3,
        centre_z=table.centre_z_mm * 1e-3,
        apparent_height=table.apparent_height_mm * 1e-3,
        right_z=table.right_z,
        down_x=table.down_x,
        sensor=sensor,
    )


def _ambient(table: tables.AmbientTable) -> tuple[tuple[float, ...], ...]:
    """Return the rows of the three LEDs, all of one of two lengths."""
    rows = table.red, table.green, table.blue
    for colour, row in zip(COLOURS, rows, strict=True):
        if len(row) != len(rows[0]) or len(row) not in (AMBIENT_TERMS, PHOTOGRAPHED_TERMS):
            expected = f"{AMBIENT_TERMS} or {PHOTOGRAPHED_TERMS} in each row"
            raise TactileError(f"ambient, {colour}", f"{len(row)} numbers", expected)
    return tuple(map(tuple, rows))


def _coating(table: tables.CoatingTable) -> Coating:
    return Coating(
        table.bsdf, table.albedo, table.roughness, table.gloss, table.metallic, spread=1e-3 * table.spread_mm
    )


def _markers(table: tables.MarkersTable) -> Markers:
    return Markers(table.rows, table.columns, 1e-3 * table.pitch_mm, 1e-3 * table.diameter_mm, table.albedo)


def _photograph(name: str, folder: Path) -> str:
    if name and Path(name).name != name:
        raise TactileError("background, photograph", repr(name), "the name of a file beside the calibration")
    return str(outside.inside(folder, name, "a photograph beside the calibration")) if name else ""


def _content(unit: Calibration) -> tables.CalibrationTables:
    """Return what the file of a calibration holds."""
    camera, coating, markers, fit, response = unit.camera, unit.coating, unit.markers, unit.fit, unit.response
    content = {
        "format": FORMAT,
        "unit": unit.unit,
        "sensor": None if camera.sensor == Camera.sensor else camera.sensor,
        "camera": {
            "width_px": camera.width, "height_px": camera.height, "px_per_mm_x": camera.px_per_mm_x,
            "px_per_mm_y": camera.px_per_mm_y, "centre_x_mm": 1e3 * camera.centre_x,
            "centre_z_mm": 1e3 * camera.centre_z, "apparent_height_mm": 1e3 * camera.apparent_height,
            "right_z": camera.right_z, "down_x": camera.down_x,
        },
        "leds": {
            led.colour: {
                "position_mm": _scaled(1e3, led.position), "radius_mm": 1e3 * led.radius, "radiance": led.radiance
            }
            for led in unit.leds
        },
        "response": {
            "centre": response.centre,
            "along_right_per_mm": [_scaled(1e-3, row) for row in response.along_right],
            "along_down_per_mm": [_scaled(1e-3, row) for row in response.along_down],
        },
        "ambient": {
            **dict(zip(COLOURS, unit.ambient, strict=True)), "rise_per_mm": _scaled(1e-3, unit.ambient_rise)
        },
        "coating": {
            **{name: getattr(coating, name) for name in ("bsdf", "albedo", "roughness", "gloss", "metallic")},
            "spread_mm": 1e3 * coating.spread,
        },
        "gel": {"dome_scale": unit.dome_scale, "index": unit.gel_index},
        "background": {"photograph": Path(unit.photograph).name},
        "markers": markers and {
            "rows": markers.rows, "columns": markers.columns, "pitch_mm": 1e3 * markers.pitch,
            "diameter_mm": 1e3 * markers.diameter, "albedo": markers.albedo,
        },
        "noise": {"levels": unit.noise},
        "fit": {
            "note": fit.note, "ball_diameter_mm": 1e3 * fit.ball_diameter, "photographs": fit.photographs,
            "not_identified": fit.not_identified, "errors": dict(fit.errors),
            "standard_errors": dict(fit.standard_errors),
        },
    }  # fmt: skip
    return msgspec.convert(content, tables.CalibrationTables)
