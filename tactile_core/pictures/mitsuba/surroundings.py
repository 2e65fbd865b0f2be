"""Lamps and bodies beside a unit's own parts: what somebody has put into the housing."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from .gel_mesh import MM
from .gel_scene import sphere_lamp

_BLACK = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0] * 3}}


@dataclasses.dataclass(frozen=True)
class Lamp:
    """A sphere that shines evenly; 0 of radius is a point.

    position : (right, down, toward the camera), m, image frame; radius : m
    brightness : radiance times squared radius in the bands of the red, green and blue LED, levels m^2
    """

    position: tuple[float, float, float]
    radius: float
    brightness: tuple[float, float, float]


@dataclasses.dataclass(frozen=True, eq=False)
class Occluder:
    """A black body that stands in the light's way; vertices : (n, 3) m, image frame; faces : (m, 3)."""

    vertices: np.ndarray
    faces: np.ndarray


@dataclasses.dataclass(frozen=True)
class Surroundings:
    """Hold all lamps and bodies beside a unit's own."""

    lamps: tuple[Lamp, ...] = ()
    occluders: tuple[Occluder, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.lamps or self.occluders)

    def emitters(self) -> dict[str, Any]:
        """Return the lamps as plugins of Mitsuba's, by name."""
        lamps = (sphere_lamp(each.position, each.radius, each.brightness) for each in self.lamps)
        return {f"lamp_{k}": plugin for k, plugin in enumerate(lamps)}

    def shapes(self, mi: Any) -> dict[str, Any]:
        """Return the bodies as meshes of Mitsuba's, by name."""
        return {f"body_{k}": _mesh(mi, f"body_{k}", each) for k, each in enumerate(self.occluders)}


NOTHING = Surroundings()


def _mesh(mi: Any, name: str, body: Occluder) -> Any:
    mesh = mi.Mesh(name, len(body.vertices), len(body.faces))
    values = mi.traverse(mesh)
    values["vertex_positions"] = (np.asarray(body.vertices) * [MM, -MM, MM]).astype(np.float32).ravel()
    # Two axes keep their way and one turns: so do the faces, lest their outer side be the inner one.
    values["faces"] = np.ascontiguousarray(body.faces[:, ::-1], np.uint32).ravel()
    values.update()
    mesh.set_bsdf(mi.load_dict(_BLACK))
    return mesh
