"""Calibrations as readable TOML: one file a unit, lengths in mm; unknown and missing fields are refused."""

from __future__ import annotations

import functools
import os
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..errors import TactileError
from ..files import atomic, outside
from ..files.outside import read_toml_text
from . import digit
from .calibration import AMBIENT_TERMS, PHOTOGRAPHED_TERMS, Calibration, Coating, Fit, Markers, Response
from .calibration_text import FORMAT, as_text
from .camera import COLOURS, Camera, Led
from .descriptor import of_kind
from .gel_sensor import Gel

FORMER = "tactile-calibration-1"
WITHOUT_SPREAD = "tactile-calibration-2"  # whose coatings do not spread light
SHIPPED = digit.DESCRIPTOR.folder / digit.DESCRIPTOR.camera.calibration
LARGEST = 1e8  # of a unit's numbers, as the radiance of a spot of 0.05 mm; a fit's errors may be larger
ADVICE = "Make it again with `tactile calibrate`"

OPTIONAL = ("sensor", "markers")  # what may be left out: of a DIGIT, without dots
_TABLES = {
    "": ("format", "unit", "camera", "leds", "response", "ambient", "coating", "gel", "background", "noise", "fit"),
    "camera": ("width_px", "height_px", "px_per_mm_x", "px_per_mm_y", "centre_x_mm", "centre_z_mm",
               "apparent_height_mm", "right_z", "down_x"),
    "leds": COLOURS,
    "response": ("centre", "along_right_per_mm", "along_down_per_mm"),
    "ambient": (*COLOURS, "rise_per_mm"),
    "coating": ("bsdf", "albedo", "roughness", "gloss", "metallic", "spread_mm"),
    "gel": ("dome_scale", "index"),
    "background": ("photograph",),
    "noise": ("levels",),
    "markers": ("rows", "columns", "pitch_mm", "diameter_mm", "albedo"),
    "fit": ("note", "photographs", "ball_diameter_mm", "errors", "standard_errors", "not_identified"),
}  # fmt: skip


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


@functools.cache
def _shipped(sensor: str) -> Calibration:
    file = calibration_path(sensor)
    return load_calibration(file, sensor)


def _read(file: Path) -> Calibration:
    try:
        content = tomllib.loads(read_toml_text(file))
    except OSError as error:
        raise TactileError(file, f"cannot be read ({error.strerror})", "a file of `tactile calibrate`") from error
    except (ValueError, RecursionError) as error:
        raise TactileError(file, str(error), "a file of `tactile calibrate`", ADVICE) from error
    largest = max(map(abs, _finite({name: content[name] for name in content if name != "fit"})), default=0.0)
    if largest > LARGEST:
        raise TactileError(file, f"the number {largest:g}", f"millimetres, levels... up to {LARGEST:g}", ADVICE)
    try:
        return _Reader(content).calibration(file.parent)
    except TactileError as error:
        raise TactileError(f"{file}, {error.where}", error.found, error.expected, ADVICE) from error


def _finite(value: Any) -> Iterator[float]:
    """Yield all finite numbers in nested tables and lists."""
    if isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _finite(each)
    elif isinstance(value, (int, float)) and abs(value) <= sys.float_info.max:  # false for NaN
        yield value


class _Reader:
    """Reader of a parsed file; errors name the field."""

    def __init__(self, content: dict[str, Any]) -> None:
        self._content = content
        if content.get("format") == FORMER:
            expected = f"{FORMAT!r}, in which LEDs and coating make the picture at rest too"
            raise TactileError("format", f"{FORMER!r}, of an older version", expected)
        if content.get("format") == WITHOUT_SPREAD and isinstance(content.get("coating"), dict):
            self._content = content | {"format": FORMAT, "coating": {"spread_mm": 0.0} | content["coating"]}
        if isinstance(content.get("ambient"), dict):  # files of earlier versions have none
            self._content = self._content | {"ambient": {"rise_per_mm": [0.0, 0.0, 0.0]} | content["ambient"]}
        for table, names in _TABLES.items():
            if not table:
                optional = (name for name in OPTIONAL if name in self._content)
                self._check_names("top level", self._content, (*names, *optional))
            elif table in self._content:
                self._check_names(table, self._table(table), names)

    def _table(self, name: str) -> dict[str, Any]:
        table = self._content[name]
        if not isinstance(table, dict):
            raise TactileError(name, repr(table), "a table")
        return table

    def _check_names(self, where: str, table: dict[str, Any], names: Sequence[str]) -> None:
        unknown, missing = sorted(set(table) - set(names)), sorted(set(names) - set(table))
        if unknown:
            raise TactileError(where, f"unknown {', '.join(unknown)}", f"the fields {', '.join(names)}")
        if missing:
            raise TactileError(where, f"{', '.join(missing)} missing", f"the fields {', '.join(names)}")

    def calibration(self, folder: Path) -> Calibration:
        if self._content["format"] != FORMAT:
            raise TactileError("format", repr(self._content["format"]), repr(FORMAT))
        leds = self._led("red"), self._led("green"), self._led("blue")
        coating, photograph = self._coating(), self._photograph(folder)
        return Calibration(
            unit=_text("unit", self._content["unit"]),
            camera=self._camera(),
            leds=leds,
            response=self._response(),
            ambient=self._ambient(),
            coating=coating,
            gel_index=_number("gel, index", self._content["gel"]["index"]),
            dome_scale=_number("gel, dome_scale", self._content["gel"]["dome_scale"]),
            photograph=photograph,
            noise=_three("noise, levels", self._content["noise"]["levels"]),
            fit=self._fit(),
            photographed=(leds, coating.albedo) if photograph else None,
            markers=self._markers() if "markers" in self._content else None,
            ambient_rise=self._ambient_rise(),
        )

    def _ambient(self) -> tuple[tuple[float, ...], ...]:
        """Rows of one length, that of the first, which may be either."""
        table = self._content["ambient"]
        first = table[COLOURS[0]]
        long = isinstance(first, list) and len(first) == PHOTOGRAPHED_TERMS
        count = PHOTOGRAPHED_TERMS if long else AMBIENT_TERMS
        return tuple(_numbers(f"ambient, {led}", table[led], count) for led in COLOURS)

    def _ambient_rise(self) -> tuple[float, float, float]:
        red, green, blue = _three("ambient, rise_per_mm", self._content["ambient"]["rise_per_mm"])
        return 1e3 * red, 1e3 * green, 1e3 * blue

    def _markers(self) -> Markers:
        table = self._content["markers"]
        return Markers(
            _whole("markers, rows", table["rows"]),
            _whole("markers, columns", table["columns"]),
            1e-3 * _number("markers, pitch_mm", table["pitch_mm"]),
            1e-3 * _number("markers, diameter_mm", table["diameter_mm"]),
            _number("markers, albedo", table["albedo"]),
        )

    def _camera(self) -> Camera:
        table = self._content["camera"]
        number = {name: _number(f"camera, {name}", table[name]) for name in _TABLES["camera"]}
        return Camera(
            width=_whole("camera, width_px", table["width_px"]),
            height=_whole("camera, height_px", table["height_px"]),
            px_per_mm_x=number["px_per_mm_x"],
            px_per_mm_y=number["px_per_mm_y"],
            centre_x=number["centre_x_mm"] * 1e-3,
            centre_z=number["centre_z_mm"] * 1e-3,
            apparent_height=number["apparent_height_mm"] * 1e-3,
            right_z=_whole("camera, right_z", table["right_z"]),
            down_x=_whole("camera, down_x", table["down_x"]),
            sensor=_text("sensor", self._content.get("sensor", Camera.sensor)),
        )

    def _led(self, colour: str) -> Led:
        where, table = f"leds, {colour}", self._content["leds"][colour]
        if not isinstance(table, dict):
            raise TactileError(where, repr(table), "a table")
        self._check_names(where, table, ("position_mm", "radius_mm", "radiance"))
        x, y, z = _three(f"{where}, position_mm", table["position_mm"])
        radius = _number(f"{where}, radius_mm", table["radius_mm"])
        radiance = _number(f"{where}, radiance", table["radiance"])
        return Led(colour, (1e-3 * x, 1e-3 * y, 1e-3 * z), 1e-3 * radius, radiance)

    def _response(self) -> Response:
        table = {name: _rows(f"response, {name}", self._content["response"][name]) for name in _TABLES["response"]}
        along_right, along_down = (
            tuple(tuple(1e3 * value for value in row) for row in table[name])
            for name in ("along_right_per_mm", "along_down_per_mm")
        )
        return Response(table["centre"], along_right, along_down)

    def _coating(self) -> Coating:
        table = self._content["coating"]
        numbers = {name: _number(f"coating, {name}", table[name]) for name in ("roughness", "gloss", "metallic")}
        albedo = _three("coating, albedo", table["albedo"])
        spread = 1e-3 * _number("coating, spread_mm", table["spread_mm"])
        return Coating(_text("coating, bsdf", table["bsdf"]), albedo, **numbers, spread=spread)

    def _photograph(self, folder: Path) -> str:
        name = _text("background, photograph", self._content["background"]["photograph"])
        if name and Path(name).name != name:
            raise TactileError("background, photograph", repr(name), "the name of a file beside the calibration")
        return str(outside.inside(folder, name, "a photograph beside the calibration")) if name else ""

    def _fit(self) -> Fit:
        table = self._content["fit"]
        return Fit(
            note=_text("fit, note", table["note"]),
            photographs=_texts("fit, photographs", table["photographs"]),
            ball_diameter=1e-3 * _number("fit, ball_diameter_mm", table["ball_diameter_mm"]),
            errors=_named_numbers("fit, errors", table["errors"]),
            standard_errors=_named_numbers("fit, standard_errors", table["standard_errors"]),
            not_identified=_texts("fit, not_identified", table["not_identified"]),
        )


def _number(where: str, value: Any) -> float:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (number and abs(value) <= sys.float_info.max):  # NaN and whole numbers beyond floats, too
        raise TactileError(where, f"{value!r:.80}", "a finite number")
    return float(value)


def _whole(where: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TactileError(where, repr(value), "a whole number")
    return value


def _text(where: str, value: Any) -> str:
    if not isinstance(value, str):
        raise TactileError(where, repr(value), "text")
    return value


def _texts(where: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise TactileError(where, repr(value), "a list of texts")
    return tuple(_text(where, item) for item in value)


def _numbers(where: str, value: Any, count: int) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise TactileError(where, repr(value), f"a list of {count} numbers")
    return tuple(_number(where, item) for item in value)


def _three(where: str, value: Any) -> tuple[float, float, float]:
    first, second, third = _numbers(where, value, 3)
    return first, second, third


def _rows(where: str, value: Any) -> tuple[tuple[float, ...], ...]:
    if not isinstance(value, list) or len(value) != 3:
        raise TactileError(where, repr(value), "3 rows of 3 numbers")
    return tuple(_numbers(where, row, 3) for row in value)


def _named_numbers(where: str, value: Any) -> dict[str, float]:
    if not isinstance(value, dict):
        raise TactileError(where, repr(value), "a table of numbers")
    return {name: _number(f"{where}, {name}", item) for name, item in value.items()}


def write_calibration(path: str | os.PathLike, calibration: Calibration) -> None:
    """Write a calibration file, whole or not at all; equal calibrations give equal bytes.

    Numbers keep six digits. A photograph is named as it lies beside the file.
    """
    atomic.write_bytes(path, as_text(calibration).encode())
