"""Trace by Mitsuba where pixels' rays meet the gel, and which points of the lights are visible from there.

A tracer keeps one scene, in which only the gel's vertices change. Both variants trace one mesh with the same rays, so
they agree but for rounding. Never dr.freeze here: with moving vertices it gives wrong pixels (blender.md)."""

from __future__ import annotations

import abc
import math
from typing import Any

import numpy as np

from .gel_mesh import MM, GelMesh, check_mesh, mend
from .variant import LLVM, activate

NEAREST_MM = 1.0  # nothing is nearer to the camera
BEHIND_MM = 1e3  # nothing of the gel lies farther behind the plane of height zero


class Tracer(abc.ABC):
    """Traces one scene by a ``variant`` of Mitsuba. height : (H, W) m, of the gel, until ``load`` gives others"""

    def __init__(self, mesh: GelMesh, height: np.ndarray, variant: str) -> None:
        self.mesh, self.variant = mesh, variant
        self.camera = mesh.camera
        self.mi = activate(variant)
        self.scene = self.mi.load_dict({"type": "scene", "gel": mesh.shape(self.mi, height), **self.around()})
        self.values = self.mi.traverse(self.scene)

    def around(self) -> dict[str, Any]:
        """Return the objects of the scene besides the gel, by name, as Mitsuba's ``load_dict`` takes them."""
        return {}

    def load(self, height: np.ndarray) -> None:
        """Replace the gel's heights by ``height`` (H, W) m."""
        vertices = self.mesh.vertices(height)
        check_mesh(vertices, self.mesh.faces, self.mesh.count)
        activate(self.variant)
        self.values["gel.vertex_positions"] = vertices.ravel()
        self.values.update()

    @abc.abstractmethod
    def trace(self, points: np.ndarray, shift: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Trace the pixels' rays to the gel, and from there to points (n, 3) m, image frame, 1 <= n <= 32.
        shift : pixels to the right and down from each pixel's middle
        Returns places (H, W, 3) float32 m, and seen (H, W) uint32, bit k: point k lights the gel's front there."""


def make_tracer(mesh: GelMesh, height: np.ndarray, variant: str) -> Tracer:
    """Make a tracer of a gel's ``mesh`` at ``height`` (H, W) m in the variant ``"llvm_ad_rgb"`` or ``"scalar_rgb"``."""
    return (_LlvmTracer if variant == LLVM else _ScalarTracer)(mesh, height, variant)


class _LlvmTracer(Tracer):
    def trace(self, points: np.ndarray, shift: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
        """Trace all pixels and points in one compiled kernel; arguments and result: see ``Tracer.trace``."""
        mi = activate(self.variant)
        import drjit as dr

        camera, lights = self.camera, self.mesh.to_mesh(points).astype(np.float32)
        directions = self._directions(shift)
        ray = mi.Ray3f(mi.Point3f(0, 0, camera.apparent_height * MM), mi.Vector3f(directions))
        hit = self.scene.ray_intersect(ray, mi.RayFlags.Minimal, True)
        seen = mi.UInt32(0)
        for k, light in enumerate(lights):
            # Opaque: as literals, other points would be other kernels.
            light = mi.Point3f(*[dr.opaque(mi.Float, float(value)) for value in light])
            front = hit.is_valid() & (dr.dot(hit.n, light - hit.p) > 0)
            blocked = self.scene.ray_test(hit.spawn_ray_to(light), front)
            seen |= dr.select(front & ~blocked, mi.UInt32(1 << k), mi.UInt32(0))
        dr.eval(hit.p, seen)
        place = np.array(hit.p).T.reshape(*camera.shape, 3)
        return _mended(place, np.array(seen).reshape(camera.shape), self.mesh)

    def _directions(self, shift: tuple[float, float]) -> np.ndarray:
        camera = self.camera
        direction = np.empty((3, *camera.shape))
        direction[0] = (camera.right + shift[0] * camera.pixel_size[0]) * MM
        direction[1] = ((camera.down + shift[1] * camera.pixel_size[1]) * (-MM * self.mesh.up_scale))[:, None]
        direction[2] = -camera.apparent_height * MM
        direction /= np.sqrt((direction**2).sum(0))
        return direction.reshape(3, -1).astype(np.float32)


class _ScalarTracer(Tracer):
    """Traces by one render for the places and one for each point, so that loops over pixels stay inside Mitsuba."""

    def __init__(self, mesh: GelMesh, height: np.ndarray, variant: str) -> None:
        super().__init__(mesh, height, variant)
        self._places = self.mi.load_dict({"type": "aov", "aovs": "p:position"})
        self._lit = self.mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0})

    def around(self) -> dict[str, Any]:
        """Return a camera, and a point light that ``trace`` moves to each point in turn."""
        camera = self.camera
        half_width = camera.width / 2 * camera.pixel_size[0]
        transform = self.mi.ScalarTransform4f()
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
        """Trace points (n, 3) m, see ``Tracer.trace``, at a shift; a point is seen if its light arrives."""
        mi = activate(self.variant)
        for axis, size, move in (("x", self.camera.width, shift[0]), ("y", self.camera.height, shift[1])):
            self.values[f"eye.principal_point_offset_{axis}"] = float(move / size)
        self.values.update()
        place = np.array(mi.render(self.scene, integrator=self._places, spp=1))[..., -3:]
        seen = np.zeros(self.camera.shape, np.uint32)
        for k, light in enumerate(self.mesh.to_mesh(points)):
            self.values["light.position"] = light
            self.values.update()
            lit = np.array(mi.render(self.scene, integrator=self._lit, spp=1))[..., 0]
            seen |= (lit > 0).astype(np.uint32) << np.uint32(k)
        return _mended(place, seen, self.mesh)


def _mended(place: np.ndarray, seen: np.ndarray, mesh: GelMesh) -> tuple[np.ndarray, np.ndarray]:
    """Return places m, image frame, from ``place`` (H, W, 3), mesh coordinates, and bits ``seen`` (H, W), holes filled:
    a ray that misses the gel has its place at the origin, where no ray leads. Raises TactileError if over 0.1 % do."""
    mend(np.logical_not(place.any(-1)), place, seen)
    return place * np.array([1 / MM, -1 / (MM * mesh.up_scale), 1 / MM], np.float32), seen
