"""The text of a calibration file, section by section; what each number means stands beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..files.outside import toml_quoted
from .calibration import Calibration, Coating, Fit, Markers, Response
from .camera import COLOURS, Camera, Led
from .descriptor import describe

FORMAT = "tactile-calibration-3"


def as_text(calibration: Calibration) -> str:
    """Format a calibration, numbers with six digits; a photograph is named as it lies beside the file."""
    sections = (
        _head(calibration),
        _camera_section(calibration.camera),
        _led_section(calibration.leds),
        _response_section(calibration.response),
        _ambient_section(calibration),
        _coating_section(calibration.coating),
        _gel_section(calibration),
        [] if calibration.markers is None else _markers_section(calibration.markers),
        [
            "[noise]  # standard deviation, grey levels, red, green, blue; used when asked for",
            f"levels = {_list(calibration.noise)}",
        ],
        _fit_section(calibration.fit),
    )
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def _head(calibration: Calibration) -> list[str]:
    sensor = calibration.camera.sensor
    return [
        f"# A {describe(sensor).title} unit: picture = response(right, down) x radiance of the coating + ambient light,"
        " 8-bit values.",
        "# Image frame: right, down, toward the camera; origin in the picture's middle on the plane of height zero.",
        f"format = {toml_quoted(FORMAT)}",
        f"unit = {toml_quoted(calibration.unit)}",
        *[f"sensor = {toml_quoted(sensor)}"] * (sensor != Camera.sensor),
    ]


def _camera_section(camera: Camera) -> list[str]:
    return [
        "[camera]",
        f"width_px = {camera.width}",
        f"height_px = {camera.height}",
        f"px_per_mm_x = {_digits(camera.px_per_mm_x)}  # at height zero",
        f"px_per_mm_y = {_digits(camera.px_per_mm_y)}",
        f"centre_x_mm = {_digits(1e3 * camera.centre_x)}  # of the gel, in the picture's middle",
        f"centre_z_mm = {_digits(1e3 * camera.centre_z)}",
        f"apparent_height_mm = {_digits(1e3 * camera.apparent_height)}  # of the pinhole",
        f"right_z = {camera.right_z}  # the way z goes to the right",
        f"down_x = {camera.down_x}  # the way x goes down",
    ]


def _led_section(leds: Sequence[Led]) -> list[str]:
    lines = [
        "[leds]  # spheres: right, down, toward the camera; radiance of their surface in levels of their own channel"
    ]
    for led in leds:
        position = [1e3 * value for value in led.position]
        place = f"position_mm = {_list(position)}, radius_mm = {_digits(1e3 * led.radius)}"
        lines.append(f"{led.colour} = {{ {place}, radiance = {_digits(led.radiance)} }}")
    return lines


def _response_section(response: Response) -> list[str]:
    lines = ["[response]  # of the camera, levels a level: a row a channel of the picture, a column an LED"]
    lines.append(f"centre = {_matrix(response.centre)}")
    for name, matrix in (("right", response.along_right), ("down", response.along_down)):
        per_mm = [[1e-3 * value for value in row] for row in matrix]
        lines.append(f"along_{name}_per_mm = {_matrix(per_mm)}")
    return lines


def _ambient_section(calibration: Calibration) -> list[str]:
    return [
        "[ambient]  # of each LED, held in gel and acrylic, of right^i down^j / (10 mm)^(i + j), by i + j, then j",
        *[f"{led} = {_list(row)}" for led, row in zip(COLOURS, calibration.ambient, strict=True)],
        f"rise_per_mm = {_list([1e-3 * share for share in calibration.ambient_rise])}  # more of it on higher gel",
    ]


def _coating_section(coating: Coating) -> list[str]:
    return [
        "[coating]  # diffuse, roughplastic or principled; albedo of each LED's light",
        f"bsdf = {toml_quoted(coating.bsdf)}",
        f"albedo = {_list(coating.albedo)}",
        *[f"{name} = {_digits(getattr(coating, name))}" for name in ("roughness", "gloss", "metallic")],
        f"spread_mm = {_digits(1e3 * coating.spread)}  # of light, sideways in it: standard deviation",
    ]


def _gel_section(calibration: Calibration) -> list[str]:
    return [
        "[gel]",
        f"dome_scale = {_digits(calibration.dome_scale)}  # of the public mesh's dome",
        f"index = {_digits(calibration.gel_index)}  # of gel and acrylic",
        "",
        "[background]  # a photograph of the untouched gel, beside this file, is then the picture at rest",
        f"photograph = {toml_quoted(Path(calibration.photograph).name)}",
    ]


def _markers_section(markers: Markers) -> list[str]:
    return [
        "[markers]  # dots printed on the gel, a square grid in the picture's middle; may be left out",
        f"rows = {markers.rows}  # down the picture",
        f"columns = {markers.columns}",
        f"pitch_mm = {_digits(1e3 * markers.pitch)}",
        f"diameter_mm = {_digits(1e3 * markers.diameter)}",
        f"albedo = {_digits(markers.albedo)}  # share of the coating's light: 0 black",
    ]


def _fit_section(fit: Fit) -> list[str]:
    return [
        "[fit]",
        f"note = {toml_quoted(fit.note)}",
        f"ball_diameter_mm = {_digits(1e3 * fit.ball_diameter)}",
        f"photographs = [{', '.join(map(toml_quoted, fit.photographs))}]",
        f"not_identified = [{', '.join(map(toml_quoted, fit.not_identified))}]",
        "",
        "[fit.errors]  # on those photographs",
        *_named(fit.errors),
        "",
        "[fit.standard_errors]  # in each parameter's unit; how units differ (assumed) counts as a measurement",
        *_named(fit.standard_errors),
    ]


def _named(values: Mapping[str, float]) -> list[str]:
    return [f"{toml_quoted(name)} = {_digits(value)}" for name, value in values.items()]


def _digits(value: float) -> str:
    """Format a number with six digits as TOML's float or integer."""
    return f"{value + 0.0:.6g}"


def _list(values: Sequence[float]) -> str:
    return "[" + ", ".join(map(_digits, values)) + "]"


def _matrix(rows: Sequence[Sequence[float]]) -> str:
    return "[" + ", ".join(map(_list, rows)) + "]"
