"""Tables of a calibration file, lengths in mm, and the comments beside them."""

from __future__ import annotations

import msgspec

Three = tuple[float, float, float]
Matrix = tuple[Three, Three, Three]


class Table(msgspec.Struct, forbid_unknown_fields=True):
    """Table of the file."""


class CameraTable(Table):
    """Camera and how it looks at the gel."""

    width_px: int
    height_px: int
    px_per_mm_x: float
    px_per_mm_y: float
    centre_x_mm: float
    centre_z_mm: float
    apparent_height_mm: float
    right_z: int
    down_x: int


class LedTable(Table):
    """A light: a sphere."""

    position_mm: Three
    radius_mm: float
    radiance: float


class LedsTable(Table):
    """The lights, by colour."""

    red: LedTable
    green: LedTable
    blue: LedTable


class ResponseTable(Table):
    """Levels of each channel by each light."""

    centre: Matrix
    along_right_per_mm: Matrix
    along_down_per_mm: Matrix


class AmbientTable(Table):
    """Light scattered in gel and acrylic."""

    red: list[float]
    green: list[float]
    blue: list[float]
    rise_per_mm: Three = (0.0, 0.0, 0.0)  # files of earlier versions have none


class CoatingTable(Table):
    """Paint on the gel."""

    bsdf: str
    albedo: Three
    roughness: float
    gloss: float
    metallic: float
    spread_mm: float


class GelTable(Table):
    """Gel and acrylic."""

    dome_scale: float
    index: float


class BackgroundTable(Table):
    """The picture at rest."""

    photograph: str


class NoiseTable(Table):
    """Noise of the camera."""

    levels: Three


class MarkersTable(Table):
    """Dots on the gel."""

    rows: int
    columns: int
    pitch_mm: float
    diameter_mm: float
    albedo: float


class FitTable(Table):
    """How it was fitted."""

    note: str
    ball_diameter_mm: float
    photographs: list[str]
    not_identified: list[str]
    errors: dict[str, float]
    standard_errors: dict[str, float]


class CalibrationTables(Table):
    """Content of the file, by what stands in it; a DIGIT's names no sensor, and dots may be left out."""

    format: str
    unit: str
    sensor: str | None
    camera: CameraTable
    leds: LedsTable
    response: ResponseTable
    ambient: AmbientTable
    coating: CoatingTable
    gel: GelTable
    background: BackgroundTable
    markers: MarkersTable | None
    noise: NoiseTable
    fit: FitTable


NOTES = {
    "camera.px_per_mm_x": "at height zero",
    "camera.centre_x_mm": "of the gel, in the picture's middle",
    "camera.apparent_height_mm": "of the pinhole",
    "camera.right_z": "the way z goes to the right",
    "camera.down_x": "the way x goes down",
    "leds": "spheres: right, down, toward the camera; radiance of their surface in levels of their own channel",
    "response": "of the camera, levels a level: a row a channel of the picture, a column an LED",
    "ambient": "of each LED, held in gel and acrylic, of right^i down^j / (10 mm)^(i + j), by i + j, then j",
    "ambient.rise_per_mm": "more of it on higher gel",
    "coating": "diffuse, roughplastic or principled; albedo of each LED's light",
    "coating.spread_mm": "of light, sideways in it: standard deviation",
    "gel.dome_scale": "of the public mesh's dome",
    "gel.index": "of gel and acrylic",
    "background": "a photograph of the untouched gel, beside this file, is then the picture at rest",
    "markers": "dots printed on the gel, a square grid in the picture's middle; may be left out",
    "markers.rows": "down the picture",
    "markers.albedo": "share of the coating's light: 0 black",
    "noise": "standard deviation, grey levels, red, green, blue; used when asked for",
    "fit.errors": "on those photographs",
    "fit.standard_errors": "in each parameter's unit; how units differ (assumed) counts as a measurement",
}
