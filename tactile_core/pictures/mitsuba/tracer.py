"""Trace by Mitsuba without LLVM where pixels' rays meet the gel, and which points of the lights are visible from there.

A tracer keeps one scene, in which only the gel's vertices change."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .gel_mesh import MM, GelMesh, mend
from .variant import SCALAR, activate

NEAREST_MM = 1.0  # nothing is nearer to the camera
BEHIND_MM = 1e3  # nothing of the gel lies farther behind the plane of height zero


class Tracer:
    """Traces one scene. height : (H, W) m, of the gel, until ``load`` gives others

    One render finds the places and one each point's light, so that loops over pixels stay inside Mitsuba."""

    def __init__(self, mesh: GelMesh, height: np.ndarray) -> None:
        self.mesh, self.camera = mesh, mesh.camera
        mi = activate(SCALAR)
        self.scene = mi.load_dict({"type": "scene", "gel": mesh.shape(mi, height), **self._around(mi)})
        self.values = mi.traverse(self.scene)
        self._places = mi.load_dict({"type": "aov", "aovs": "p:position"})
        self._lit = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0})

    def load(self, height: np.ndarray) -> None:
        """Replace the gel's heights by ``height`` (H, W) m."""
        activate(SCALAR)
        self.values["gel.vertex_positions"] = self.mesh.vertices(height).ravel()
        self.values.update()

    def _around(self, mi: Any) -> dict[str, Any]:
        """Return a camera, and a point light that ``trace`` moves to each point in turn, as plugins by name."""
        camera = self.camera
        half_width = camera.width / 2 * camera.pixel_size[0]
        transform = mi.ScalarTransform4f()
        film = {"type": "hdrfilm", "width": camera.width, "height": camera.height, "rfilter": {"type": "box"},
                "pixel_format": "rgb", "component_format": "float32"}  # fmt: skip
        eye = {
            "type": "perspective", "fov_axis": "x",
            "fov": 2 * math.degrees(math.atan(half_width / camera.apparent_height)),
            "near_clip": NEAREST_MM, "far_clip": camera.apparent_height * MM + BEHIND_MM,
            "to_world": transform.look_at(origin=[0, 0, camera.apparent_height * MM], target=[0, 0, 0], up=[0, 1, 0]),
            # One sample in the middle of each pixel: nothing here is random.
            "film": film, "sampler": {"type": "stratified", "sample_count": 1, "jitter": False},
        }  # fmt: skip
        return {"light": {"type": "point", "position": [0, 0, 10]}, "eye": eye}

    def trace(self, points: np.ndarray, shift: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Trace the pixels' rays to the gel, and from there to points (n, 3) m, image frame, 1 <= n <= 32.
        shift : pixels to the right and down from each pixel's middle
        Returns places (H, W, 3) float32 m, and seen (H, W) uint32, bit k: point k lights the gel's front there."""
        mi, to_mesh = activate(SCALAR), np.array([MM, -MM * self.mesh.up_scale, MM])
        for axis, size, move in (("x", self.camera.width, shift[0]), ("y", self.camera.height, shift[1])):
            self.values[f"eye.principal_point_offset_{axis}"] = float(move / size)
        self.values.update()
        place = np.array(mi.render(self.scene, integrator=self._places, spp=1))[..., -3:]
        seen = np.zeros(self.camera.shape, np.uint32)
        for k, light in enumerate(points * to_mesh):
            self.values["light.position"] = light
            self.values.update()
            lit = np.array(mi.render(self.scene, integrator=self._lit, spp=1))[..., 0]
            seen |= (lit > 0).astype(np.uint32) << np.uint32(k)
        # A ray that misses the gel has its place at the origin, where no ray leads.
        mend(np.logical_not(place.any(-1)), place, seen)
        return place * np.array([1 / MM, -1 / (MM * self.mesh.up_scale), 1 / MM], np.float32), seen
