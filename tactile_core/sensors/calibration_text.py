"""The text of a calibration file; what each number means stands beside it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..files.outside import toml_quoted
from .calibration import Calibration, Fit, Markers
from .camera import COLOURS, Camera
from .descriptor import describe

FORMAT = "tactile-calibration-3"
MM, PER_MM = 1e3, 1e-3


def as_text(unit: Calibration) -> str:
    """Format a calibration, numbers with six digits; a photograph is named as it lies beside the file."""
    camera, coating, response = unit.camera, unit.coating, unit.response
    sensor = "" if camera.sensor == Camera.sensor else f"sensor = {_text(camera.sensor)}\n"
    leds = "\n".join(
        f"{led.colour} = {{ position_mm = {_text(led.position, MM)}, radius_mm = {_text(led.radius, MM)},"
        f" radiance = {_text(led.radiance)} }}"
        for led in unit.leds
    )
    ambient = "\n".join(f"{colour} = {_text(row)}" for colour, row in zip(COLOURS, unit.ambient, strict=True))
    return f"""\
# A {describe(camera.sensor).title} unit: picture = response(right, down) x radiance of the coating + ambient light, 8-bit values.
# Image frame: right, down, toward the camera; origin in the picture's middle on the plane of height zero.
format = {_text(FORMAT)}
unit = {_text(unit.unit)}
{sensor}
[camera]
width_px = {camera.width}
height_px = {camera.height}
px_per_mm_x = {_text(camera.px_per_mm_x)}  # at height zero
px_per_mm_y = {_text(camera.px_per_mm_y)}
centre_x_mm = {_text(camera.centre_x, MM)}  # of the gel, in the picture's middle
centre_z_mm = {_text(camera.centre_z, MM)}
apparent_height_mm = {_text(camera.apparent_height, MM)}  # of the pinhole
right_z = {camera.right_z}  # the way z goes to the right
down_x = {camera.down_x}  # the way x goes down

[leds]  # spheres: right, down, toward the camera; radiance of their surface in levels of their own channel
{leds}

[response]  # of the camera, levels a level: a row a channel of the picture, a column an LED
centre = {_text(response.centre)}
along_right_per_mm = {_text(response.along_right, PER_MM)}
along_down_per_mm = {_text(response.along_down, PER_MM)}

[ambient]  # of each LED, held in gel and acrylic, of right^i down^j / (10 mm)^(i + j), by i + j, then j
{ambient}
rise_per_mm = {_text(unit.ambient_rise, PER_MM)}  # more of it on higher gel

[coating]  # diffuse, roughplastic or principled; albedo of each LED's light
bsdf = {_text(coating.bsdf)}
albedo = {_text(coating.albedo)}
roughness = {_text(coating.roughness)}
gloss = {_text(coating.gloss)}
metallic = {_text(coating.metallic)}
spread_mm = {_text(coating.spread, MM)}  # of light, sideways in it: standard deviation

[gel]
dome_scale = {_text(unit.dome_scale)}  # of the public mesh's dome
index = {_text(unit.gel_index)}  # of gel and acrylic

[background]  # a photograph of the untouched gel, beside this file, is then the picture at rest
photograph = {_text(Path(unit.photograph).name)}

{"" if unit.markers is None else _markers(unit.markers)}\
[noise]  # standard deviation, grey levels, red, green, blue; used when asked for
levels = {_text(unit.noise)}

{_fit(unit.fit)}"""  # noqa: E501


def _markers(markers: Markers) -> str:
    return f"""\
[markers]  # dots printed on the gel, a square grid in the picture's middle; may be left out
rows = {markers.rows}  # down the picture
columns = {markers.columns}
pitch_mm = {_text(markers.pitch, MM)}
diameter_mm = {_text(markers.diameter, MM)}
albedo = {_text(markers.albedo)}  # share of the coating's light: 0 black

"""


def _fit(fit: Fit) -> str:
    return f"""\
[fit]
note = {_text(fit.note)}
ball_diameter_mm = {_text(fit.ball_diameter, MM)}
photographs = {_text(fit.photographs)}
not_identified = {_text(fit.not_identified)}

[fit.errors]  # on those photographs
{_named(fit.errors)}
[fit.standard_errors]  # in each parameter's unit; how units differ (assumed) counts as a measurement
{_named(fit.standard_errors)}"""


def _named(values: Mapping[str, float]) -> str:
    return "".join(f"{_text(name)} = {_text(value)}\n" for name, value in values.items())


def _text(value: Any, scale: float = 1.0) -> str:
    """Format a text, a number with six digits, or a list of such as TOML; numbers times ``scale``."""
    if isinstance(value, str):
        return toml_quoted(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(_text(each, scale) for each in value)}]"
    return f"{scale * value + 0.0:.6g}"
