"""A unit's scene as a file that any Mitsuba 3 renders: XML, the gel as PLY, and the camera's response as EXR.

NAME.xml        LEDs, coating, housing, camera, Mitsuba's path integrator; `mitsuba NAME.xml` writes the radiance
NAME.ply        the gel, mm
NAME.camera.exr response and ambient light, which convert radiance to 8-bit levels, as in ``jobs.render``

Mitsuba's materials do not spread light sideways: the XML's first comment and the EXR's `coating_spread_px` give the
Gaussian, standard deviation in pixels, to apply to the radiance. The file's camera has square pixels, as wide as the
unit's, and its pinhole is at the unit's apparent height, as Mitsuba's camera cannot look through the window and keep
the unit's even grid: gel 1 mm up is off by up to a third of a pixel."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...errors import TactileError
from ...files import atomic
from ...files.exr_file import write_exr
from ...sensors.calibration import Calibration
from ...sensors.camera import COLOURS, Camera
from ..background import by_led, raised_light
from ..perspective import Perspective
from ..presets import SPACING
from .gel_mesh import MM, GelMesh
from .gel_scene import lamps, material, walls

VERSION = "3.0.0"  # of the scene format
PATHS, DEPTH = 256, 6
STARTS = b"<?xml version='1.0' encoding='utf-8'?>\n<scene", b"ply\n", b"v/1\1"  # of the files
# Mitsuba's XML has a tag for each kind of plugin.
_TAGS = {
    "path": "integrator", "perspective": "sensor", "hdrfilm": "film", "box": "rfilter", "multijitter": "sampler",
    "ply": "shape", "sphere": "shape", "rectangle": "shape", "area": "emitter", "point": "emitter",
    "diffuse": "bsdf", "roughplastic": "bsdf", "principled": "bsdf",
}  # fmt: skip


def _files(path: str | os.PathLike) -> tuple[Path, Path, Path]:
    """Return the paths of a scene's .xml, .ply and .camera.exr. Raises TactileError for another ending than .xml."""
    path = Path(path)
    if path.suffix != ".xml":
        raise TactileError(path, f"the ending {path.suffix!r}", "a name that ends in .xml")
    return path, path.with_suffix(".ply"), path.with_suffix(".camera.exr")


def claim_scene(path: str | os.PathLike, *, overwrite: bool) -> None:
    """Raise TactileError unless a scene's files can be written. overwrite : true replaces older files of their kind"""
    for file, start in zip(_files(path), STARTS, strict=True):
        if overwrite:
            atomic.claim_over(file, start, f"scene's {file.suffix}", "Name another --scene-out")
        else:
            atomic.claim(file, "Name another --scene-out, or add --overwrite")


def write_scene(path: str | os.PathLike, unit: Calibration, height_map: np.ndarray) -> None:
    """Write the scene of a height_map (H, W) m of the unit's own gel to the path and beside it; files
    appear whole or not at all. Raises TactileError for another ending than .xml and heights that are not finite."""
    path, shape, eye = _files(path)
    mesh, height_map = GelMesh(unit.camera, SPACING / 2), np.asarray(height_map, np.float32)
    square = square_pixels(unit.camera)
    atomic.write_bytes(shape, _ply(mesh, height_map))
    view = dataclasses.replace(unit, camera=square)
    rows = np.rint((np.arange(square.height) + 0.5) * unit.camera.height / square.height - 0.5).astype(int)
    seen = Perspective(unit.camera, height_map)(height_map)[rows]
    ambient = by_led(view, np.moveaxis(raised_light(view, seen), 0, -1)).sum(-1)
    spread = f"{unit.coating.spread / square.pixel_size[0]:.6g}"
    about = {"calibration": unit.unit, "coating_spread_px": spread}
    write_exr(eye, camera_planes(view, ambient), about)
    content = {
        "integrator": {"type": "path", "max_depth": DEPTH, "hide_emitters": True},
        "eye": _eye(square),
        "gel": {"type": "ply", "filename": shape.name,
                "coating": material(unit.coating, unit.gel_index)},
        **lamps(unit), **walls(unit, mesh),
    }  # fmt: skip
    root = ElementTree.Element("scene", version=VERSION)
    left_out = f" left out: the coating spreads light, a Gaussian of {spread} px over the radiance "
    root.append(ElementTree.Comment(left_out))
    for name, value in content.items():
        _add(root, name, value)
    ElementTree.indent(root)
    atomic.write_bytes(path, ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def square_pixels(camera: Camera) -> Camera:
    """Return the camera with the same view in square pixels: the number of rows changes, right to half a row."""
    rows = round(camera.height * camera.px_per_mm_x / camera.px_per_mm_y)
    return dataclasses.replace(camera, height=rows, px_per_mm_y=camera.px_per_mm_x)


def camera_planes(unit: Calibration, ambient: np.ndarray) -> dict[str, np.ndarray]:
    """Return an EXR file's planes (H, W) by name, response.R.red and ambient.R etc. ambient : (H, W, 3) levels"""
    response = unit.pixel_response.astype(np.float32)
    planes = {f"ambient.{name}": ambient[..., k] for k, name in enumerate("RGB")}
    for k, name in enumerate("RGB"):
        planes |= {f"response.{name}.{led}": response[..., k, j] for j, led in enumerate(COLOURS)}
    return planes


def _eye(camera: Camera) -> dict[str, Any]:
    half, distance = camera.width / 2 * camera.pixel_size[0], camera.apparent_height
    frame = np.diag([-1.0, 1.0, -1.0, 1.0])  # looks along -z, up is y
    frame[2, 3] = distance * MM
    return {
        "type": "perspective", "fov_axis": "x", "fov": 2 * math.degrees(math.atan(half / distance)),
        "near_clip": 1.0, "far_clip": 1e3, "to_world": frame,
        "sampler": {"type": "multijitter", "sample_count": PATHS},
        "film": {"type": "hdrfilm", "width": camera.width, "height": camera.height, "pixel_format": "rgb",
                 "component_format": "float32", "filter": {"type": "box"}},
    }  # fmt: skip


def _add(parent: ElementTree.Element, name: str, value: Any) -> None:
    """Add a plugin, colour, number, text or transform as XML, as the field ``name`` of ``parent``."""
    if isinstance(value, Mapping) and value["type"] == "rgb":
        _field(parent, "rgb", name, ", ".join(f"{each:.9g}" for each in value["value"]))
    elif isinstance(value, Mapping):
        plugin = ElementTree.SubElement(parent, _TAGS[value["type"]], type=value["type"])
        if parent.tag == "scene":  # names must differ over the whole file
            plugin.set("id", name)
        for key, each in value.items():
            if key != "type":
                _add(plugin, key, each)
    elif isinstance(value, np.ndarray):
        transform = ElementTree.SubElement(parent, "transform", name=name)
        ElementTree.SubElement(transform, "matrix", value=" ".join(f"{each:.9g}" for each in value.ravel()))
    elif isinstance(value, list):
        place = {k: f"{v:.9g}" for k, v in zip("xyz", value, strict=True)}
        ElementTree.SubElement(parent, "point", {"name": name, **place})
    elif isinstance(value, bool):
        _field(parent, "boolean", name, "true" if value else "false")
    else:
        kind = {int: "integer", str: "string"}.get(type(value), "float")
        _field(parent, kind, name, value if isinstance(value, str) else f"{value:.9g}")


def _field(parent: ElementTree.Element, kind: str, name: str, value: str) -> None:
    ElementTree.SubElement(parent, kind, name=name, value=value)


def _ply(mesh: GelMesh, height: np.ndarray) -> bytes:
    """Return the gel of ``height`` (H, W) m with normals as binary PLY."""
    vertices = np.hstack([mesh.vertices(height), mesh.normals(height)]).astype("<f4")
    fields = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{fields}"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(mesh.faces), [("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, mesh.faces
    return header.encode() + vertices.tobytes() + faces.tobytes()
