"""Radiance of the gel by Mitsuba with LLVM, in a compiled scene: by our own integrator, or by Mitsuba's path tracer."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...errors import TactileError
from ...sensors.calibration import Calibration
from ..coating_spread import evened
from ..perspective import lookup, slopes
from ..presets import Preset
from .gel_mesh import MM, GelMesh, mend
from .gel_scene import NOTHING, Surroundings, change_numbers, gel_shape, lamps, plugin_names, walls
from .led_integrator import DIRECTIONS, bounced, direct, mirrored, narrow_lobe
from .variant import LLVM, activate
from .window import camera_rays

# px, offset of rays from pixels' middles, where they would meet vertices exactly and slip between triangles.
ASIDE = (0.013, 0.0071)
DEPTH = 6  # of paths: light, four bounces on the way, the camera
PATHS_A_PASS = 64  # per pixel; a square number, as the stratified sampler needs


class GelLight:
    """Radiance of a gel by one preset; scenes are made once, only the gel's vertices change. The coating's spread is
    not included: ``Renderer`` adds it (``coating_spread``). rest : (H, W) m, heights that the scene starts with
    surroundings : lamps and bodies beside the unit's own; seed : of the reference's random numbers"""

    def __init__(
        self, unit: Calibration, preset: Preset, rest: np.ndarray, seed: int, surroundings: Surroundings = NOTHING
    ) -> None:
        self.unit, self.preset, self._seed = unit, preset, seed
        self._mesh = GelMesh(unit.camera, preset.spacing)
        mi = activate(LLVM)
        lights = lamps(unit) | surroundings.emitters()
        # Black: the unit's own light need not meet them.
        around = {
            name: wall | {"to_world": mi.ScalarTransform4f(wall["to_world"])}
            for name, wall in (walls(unit, self._mesh) if surroundings else {}).items()
        }
        gel = gel_shape(mi, self._mesh, rest, unit, smooth=bool(preset.paths))
        # What stands in the way, without the LEDs: spheres would make each ray a third dearer, and none is ever met.
        shadowing = {"type": "scene", "gel": gel, **around, **surroundings.shapes(mi)}
        self._scene = mi.load_dict(shadowing | lights if preset.paths else shadowing)
        self._lights = mi.load_dict({"type": "scene", **lights})  # kept, as its emitters do not keep it
        self._emitters = self._lights.emitters()
        self._values = mi.traverse(self._scene)
        self._look(mi)

    def change_unit(self, unit: Calibration) -> None:
        """Change to another unit of as many pixels, in 10 ms, without compiling the scene again.

        Its LEDs, camera, coating and index may differ in numbers, not in kind (the material's name; a sphere so small
        that it is a point). Raises TactileError for another kind, and for a preset of paths."""
        mi = activate(LLVM)
        mesh = GelMesh(unit.camera, self.preset.spacing)
        same = plugin_names(unit) == plugin_names(self.unit) and unit.camera.shape == self.unit.camera.shape
        if self.preset.paths or not same or mesh.faces.shape != self._mesh.faces.shape:
            raise TactileError("scene", "another kind of unit", "other numbers alone", "Make a new scene")
        self.unit, self._mesh = unit, mesh
        change_numbers(mi, mi.traverse(self._lights), self._values, unit)
        self._look_from(mi)

    def _look(self, mi: Any) -> None:
        """Set up the integrator and the camera's rays."""
        camera, step = self.unit.camera, self.preset.bounce_step
        if self.preset.paths:
            self._paths = mi.load_dict({"type": "path", "max_depth": DEPTH, "hide_emitters": True})
            return
        import drjit

        self._slopes = mi.Texture2f(camera.shape, 2, use_accel=False, wrap_mode=drjit.WrapMode.Clamp)
        row, column = np.indices(camera.shape)
        # Four neighbours' points lie a quarter of their distance apart.
        self._phase = mi.Float(((column % 2 + 2 * (row % 2)) / 4).ravel().astype(np.float32))
        self._look_from(mi)
        if step:
            row, column = np.indices((camera.height // step, camera.width // step))
            turned = (column % 2 + 2 * (row % 2) + 0.5) / 4
            self._turned = mi.Float(np.repeat(turned.ravel(), DIRECTIONS).astype(np.float32))

    def _look_from(self, mi: Any) -> None:
        """Make the rays of the camera's position."""
        import drjit

        camera, step = self.unit.camera, self.preset.bounce_step
        self._rays = self._towards(mi, 1)
        self._coarse = self._towards(mi, step, DIRECTIONS) if step else None
        lobe = narrow_lobe(self.unit.coating) if step else None
        self._lobe = None if lobe is None else (drjit.opaque(mi.Float, lobe[0]), drjit.opaque(mi.Float, lobe[1]))
        # Opaque: as literals, another camera would be other kernels.
        sides = camera.pixel_size[0] * camera.width, -camera.pixel_size[1] * camera.height
        self._per_mm = [drjit.opaque(mi.Float, 1 / (MM * side)) for side in sides]
        self._height = drjit.opaque(mi.Float, MM * camera.apparent_height)

    def _towards(self, mi: Any, step: int, times: int = 1) -> Any:
        """Return rays at every ``step``-th pixel, ``times`` of each."""
        camera = self.unit.camera
        first = (step - 1) / 2
        right = camera.right[0] + (first + step * np.arange(camera.width // step) + ASIDE[0]) * camera.pixel_size[0]
        down = camera.down[0] + (first + step * np.arange(camera.height // step) + ASIDE[1]) * camera.pixel_size[1]
        places = (np.repeat(each.ravel(), times) for each in np.meshgrid(right, down))
        start, toward = camera_rays(self.unit, *places)
        return mi.Ray3f(mi.Point3f(start), mi.Vector3f(toward))

    def radiance(self, height_map: np.ndarray) -> np.ndarray:
        """Return the radiance (H, W, LED) float32, levels, of a height_map (H, W) m."""
        *_, found = self.refined(height_map)
        return found

    def refined(self, height_map: np.ndarray) -> Iterator[np.ndarray]:
        """Yield ``radiance`` (H, W, LED) of a height_map (H, W) m, once; by traced paths the mean so far after each
        pass."""
        height = np.asarray(height_map, np.float32)
        mi = activate(LLVM)
        self._values["gel.vertex_positions"] = self._mesh.vertices(height).ravel()
        self._values.update()
        if self.preset.paths:
            # Mitsuba's own normals are sums in an order that varies; a second update leaves ours.
            self._values["gel.vertex_normals"] = self._mesh.normals(height).ravel()
            self._values.update()
            yield from self._by_paths(mi)
            return
        self._slopes.set_tensor(mi.TensorXf(np.stack(slopes(height, self.unit.camera), -1)))
        found = self._direct(mi)
        yield found if self._coarse is None else found + self._bounced(mi)

    def _hit(self, ray: Any) -> Any:
        """Return the rays' intersections with the scene, with shading normals by the slopes of the height map."""
        mi = activate(LLVM)
        import drjit as dr

        # In a new scope the generated code, and so whether it is compiled again, depends less on variables still alive.
        dr.detail.new_scope(dr.JitBackend.LLVM)
        hit = self._scene.ray_intersect(ray)
        place = mi.Point2f(hit.p.x * self._per_mm[0] + 0.5, hit.p.y * self._per_mm[1] + 0.5)
        right, down = self._slopes.eval(place)
        hit.sh_frame.n = dr.normalize(mi.Normal3f(-right, down, 1))
        hit.initialize_sh_frame()
        hit.wi = hit.to_local(-ray.d)
        return hit

    def _direct(self, mi: Any) -> np.ndarray:
        import drjit as dr

        shape = self.unit.camera.shape
        hit = self._hit(self._rays)
        lights = direct(mi, self._scene, self._emitters, hit, self.preset.points, self._phase)
        seen = hit.is_valid()
        dr.eval(seen, *[part for light in lights for part in light])
        radiance = np.zeros((*shape, 3), np.float32)
        for light in lights:
            share = np.array(light.share).reshape(shape)
            radiance += np.array(light.open).T.reshape(*shape, 3) * evened(share)[..., None]
        mend(~np.array(seen).reshape(shape), radiance)
        return radiance

    def _bounced(self, mi: Any) -> np.ndarray:
        """Return the light (H, W, 3) of one bounce, gathered on a coarse grid."""
        camera, step = self.unit.camera, self.preset.bounce_step
        shape = camera.height // step, camera.width // step
        hit = self._hit(self._coarse)
        end = None if self._lobe is None else self._lobe[1]
        found = bounced(mi, self._hit, self._scene, self._emitters, hit, self._turned, end).reshape(*shape, 3)
        light = self._finer(evened(evened(found)), step)
        return light if self._lobe is None else light + self._mirrored(mi, hit, self._lobe)

    def _mirrored(self, mi: Any, hit: Any, lobe: tuple[Any, Any]) -> np.ndarray:
        """Return the light (H, W, 3) that narrow highlights throw onto other gel, on cells half as wide as the
        bounce's. hit : the coarse rays' intersections; lobe : GGX's alpha, and the cosine at the lobe's end"""
        camera, step = self.unit.camera, self.preset.bounce_step
        cell = max(step // 2, 1)
        right, down = self._per_mm

        def to_cell(place: Any) -> Any:
            """Convert places of the scene, mm, to the cells (column, row) in which the camera sees them."""
            nearer = self._height / (self._height - place.z)
            column = (place.x * nearer * right + 0.5) * (camera.width / cell) - 0.5
            return mi.Point2f(column, (place.y * nearer * down + 0.5) * (camera.height / cell) - 0.5)

        shape = camera.height // cell, camera.width // cell
        found = mirrored(
            mi, self._hit, self._scene, self._emitters, hit, self._turned, lobe, self._height, to_cell, shape
        )
        found *= (step / cell) ** 2  # a ray stands for a square of ``step`` px, not for a cell
        return self._finer(evened(found.astype(np.float32)), cell)

    def _finer(self, coarse: np.ndarray, step: int) -> np.ndarray:
        """Interpolate the ``coarse`` light (h, w, 3), of squares of ``step`` px, to every pixel (H, W, 3)."""
        row, column = (np.indices(self.unit.camera.shape) - (step - 1) / 2) / step
        at = lookup(row.astype(np.float32), column.astype(np.float32), coarse.shape[:2])
        return np.stack([at(np.ascontiguousarray(coarse[..., k])) for k in range(3)], -1)

    def _by_paths(self, mi: Any) -> Iterator[np.ndarray]:
        """Yield the mean radiance (H, W, 3) of all passes so far, after each."""
        import drjit as dr

        camera = self.unit.camera
        pixels, total = camera.width * camera.height, np.zeros((3, camera.width * camera.height))
        for number in range(self.preset.paths):
            sampler = mi.load_dict({"type": "multijitter", "sample_count": PATHS_A_PASS})
            sampler.set_samples_per_wavefront(PATHS_A_PASS)
            sampler.seed(self._seed * self.preset.paths + number, pixels * PATHS_A_PASS)
            aside = np.array(sampler.next_2d()) - 0.5
            row, column = np.divmod(np.repeat(np.arange(pixels), PATHS_A_PASS), camera.width)
            right = camera.right[column] + aside[0] * camera.pixel_size[0]
            start, toward = camera_rays(self.unit, right, camera.down[row] + aside[1] * camera.pixel_size[1])
            ray = mi.RayDifferential3f(mi.Ray3f(mi.Point3f(start), mi.Vector3f(toward)))
            light, _, _ = self._paths.sample(self._scene, sampler, ray)
            dr.eval(light)  # else each sum would trace the paths again
            total += np.stack([np.array(dr.block_sum(light[k], PATHS_A_PASS)) for k in range(3)])
            mean = total / ((number + 1) * PATHS_A_PASS)
            yield mean.T.reshape(*camera.shape, 3).astype(np.float32)
