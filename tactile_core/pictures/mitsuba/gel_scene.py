"""A unit as a scene of Mitsuba's: coated gel, LEDs that shine, housing walls; in mm, right, up and toward the camera.

Each LED has a band of its own: R, G and B of Mitsuba's spectra are the light of the red, green and blue LED; the
calibration's response converts them to the camera's colours. LEDs and coating lie in one medium, gel and acrylic."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...sensors.calibration import DIFFUSE, PRINCIPLED, Calibration, Coating
from ...sensors.camera import Led
from .gel_mesh import MM, GelMesh, triangle_mesh

PIGMENT_INDEX = 1.5  # of the clear coat of a glossy paint: acrylic and polyurethane binders
LEAST_STEP = 1e-3  # between indices: reflects a ten millionth
# Of an LED's distance: Mitsuba samples a smaller sphere's cone to no better than 0.1 % in single precision.
POINTLIKE = 0.01
WALL_GAP = 1.0  # mm round the LEDs, and above them
_BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0] * 3}}


def gel_shape(mi: Any, mesh: GelMesh, height: np.ndarray, unit: Calibration, *, smooth: bool) -> Any:
    """Return the coated gel of height (H, W) m as a mesh of Mitsuba's; smooth : true gives its vertices normals"""
    gel = mesh.shape(mi, height, smooth=smooth)
    gel.set_bsdf(mi.load_dict(material(unit.coating, unit.gel_index)))
    return gel


def material(coating: Coating, gel_index: float) -> dict[str, Any]:
    """Return a coating as Mitsuba's plugin; gel_index : refractive index of the gel on it"""
    albedo = {"type": "rgb", "value": list(coating.albedo)}
    if coating.bsdf == DIFFUSE:
        return {"type": "diffuse", "reflectance": albedo}
    if coating.bsdf == PRINCIPLED:
        return {
            "type": "principled", "base_color": albedo, "roughness": coating.roughness,
            "metallic": coating.metallic, "specular": coating.gloss,
        }  # fmt: skip
    return {
        "type": "roughplastic", "diffuse_reflectance": albedo, "alpha": coating.roughness, "int_ior": PIGMENT_INDEX,
        "ext_ior": _outer_index(gel_index), "specular_reflectance": {"type": "rgb", "value": [coating.gloss] * 3},
    }  # fmt: skip


def _outer_index(gel_index: float) -> float:
    """Return gel_index, changed a little if it equals the clear coat's: Mitsuba refuses equal indices."""
    return gel_index if abs(gel_index - PIGMENT_INDEX) > LEAST_STEP else PIGMENT_INDEX - LEAST_STEP


def lamps(unit: Calibration) -> dict[str, Any]:
    """Return the LEDs, by colour, as Mitsuba's plugins: black spheres that shine, or points if they are very small."""
    return {led.colour: _lamp(led) for led in unit.leds}


def _lamp(led: Led) -> dict[str, Any]:
    brightness = [0.0, 0.0, 0.0]
    brightness[led.channel] = led.radiance * led.radius**2
    return sphere_lamp(led.position, led.radius, brightness)


def sphere_lamp(position: Sequence[float], radius: float, brightness: Sequence[float]) -> dict[str, Any]:
    """Return a lamp as Mitsuba's plugin. position : (right, down, toward the camera) m
    radius : m; a lamp of 0, or of less than 0.01 of its distance, is a point
    brightness : (3,) radiance x radius^2, levels m2, in the bands of the red, green and blue LED"""
    if radius < POINTLIKE * np.linalg.norm(position):
        intensity = [value * np.pi * MM**2 for value in brightness]  # of an evenly bright disc
        return {"type": "point", "position": to_scene(position), "intensity": {"type": "rgb", "value": intensity}}
    radiance = [value / radius**2 for value in brightness]
    return {
        "type": "sphere", "center": to_scene(position), "radius": radius * MM,
        "bsdf": _BLACK,
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
    }  # fmt: skip


def plugin_names(unit: Calibration) -> list[str]:
    """Return the names of Mitsuba's plugins of the coating and of each LED."""
    return [unit.coating.bsdf, *(lamp["type"] for lamp in lamps(unit).values())]


def change_numbers(mi: Any, lights: Any, gel: Any, unit: Calibration) -> None:
    """Give loaded LEDs and gel another unit's numbers, in place. lights, gel : results of ``traverse`` on their scenes.
    The plugins stay the same, so nothing is compiled again."""
    for name, lamp in lamps(unit).items():
        if lamp["type"] == "point":
            lights[f"{name}.position"] = lamp["position"]
            lights[f"{name}.intensity.value"] = mi.Color3f(lamp["intensity"]["value"])
        else:
            place = mi.ScalarTransform4f().translate(lamp["center"]).scale(lamp["radius"])
            lights[f"{name}.to_world"] = type(lights[f"{name}.to_world"])(place)
            lights[f"{name}.emitter.radiance.value"] = mi.Color3f(lamp["emitter"]["radiance"]["value"])
    lights.update()
    coating = material(unit.coating, unit.gel_index)
    if "int_ior" in coating:  # loaded, the two indices are one number
        coating["eta"] = coating["int_ior"] / coating["ext_ior"]
    for name, value in coating.items():
        number = value["value"] if isinstance(value, dict) else value
        for key in (f"gel.bsdf.{name}.value", f"gel.bsdf.{name}"):
            if key in gel:
                gel[key] = type(gel[key])(number)
    gel.update()


def walls(unit: Calibration, mesh: GelMesh) -> dict[str, Any]:
    """Return four black walls around gel and LEDs, from height zero up, as Mitsuba's plugins by name, "to_world" a
    matrix (4, 4); they keep outside light away. What the housing reflects near an LED is part of that LED's fitted
    radius, which is several times a chip's."""
    lowest, highest = mesh.bounds()
    for led in unit.leds:
        place, reach = np.array(to_scene(led.position)), led.radius * MM + WALL_GAP
        lowest, highest = np.minimum(lowest, place - reach), np.maximum(highest, place + reach)
    lowest[2] = 0.0
    middle, half = (lowest + highest) / 2, (highest - lowest) / 2
    found = {}
    for name, axis, side in (("left", 0, -1), ("right", 0, 1), ("lower", 1, -1), ("upper", 1, 1)):
        normal = np.eye(3)[axis] * -side
        across, up = np.cross([0.0, 0.0, 1.0], normal), np.array([0.0, 0.0, 1.0])
        frame = np.eye(4)
        frame[:3, 0], frame[:3, 1], frame[:3, 2] = across * half[1 - axis], up * half[2], normal
        frame[:3, 3] = middle - normal * half[axis]
        found[f"wall_{name}"] = {"type": "rectangle", "to_world": frame, "bsdf": _BLACK}
    return found


def to_scene(place: Sequence[float]) -> list[float]:
    """Convert a place (right, down, toward the camera) m to the scene's (right, up, toward the camera) mm."""
    return [place[0] * MM, -place[1] * MM, place[2] * MM]


@dataclasses.dataclass(frozen=True)
class Lamp:
    """A sphere that shines evenly, or a point with radius 0.
    position : (right, down, toward the camera), m, image frame; radius : m
    brightness : radiance times squared radius in the bands of the red, green and blue LED, levels m^2"""

    position: tuple[float, float, float]
    radius: float
    brightness: tuple[float, float, float]


@dataclasses.dataclass(frozen=True, eq=False)
class Occluder:
    """A black body in the light's way; vertices : (n, 3) m, image frame; faces : (m, 3)."""

    vertices: np.ndarray
    faces: np.ndarray


@dataclasses.dataclass(frozen=True)
class Surroundings:
    """Lamps beside a unit's own, and ``occluders``, bodies in the light's way."""

    lamps: tuple[Lamp, ...] = ()
    occluders: tuple[Occluder, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.lamps or self.occluders)

    def emitters(self) -> dict[str, Any]:
        """Return the lamps as plugins of Mitsuba's, by name."""
        lamps = (sphere_lamp(each.position, each.radius, each.brightness) for each in self.lamps)
        return {f"lamp_{k}": plugin for k, plugin in enumerate(lamps)}

    def shapes(self, mi: Any) -> dict[str, Any]:
        """Return occluders as meshes of Mitsuba's, by name."""
        return {f"body_{k}": _mesh(mi, f"body_{k}", each) for k, each in enumerate(self.occluders)}


NOTHING = Surroundings()


def _mesh(mi: Any, name: str, body: Occluder) -> Any:
    vertices = (np.asarray(body.vertices) * [MM, -MM, MM]).astype(np.float32)
    # Two axes keep their way and one turns: so do the faces, lest their outer side be the inner one.
    mesh = triangle_mesh(mi, name, vertices, np.ascontiguousarray(body.faces[:, ::-1], np.uint32))
    mesh.set_bsdf(mi.load_dict(_BLACK))
    return mesh
