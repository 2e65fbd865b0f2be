"""The render engine "Tactile DIGIT (Mitsuba)": F12, Render Animation and `blender -b` give the DIGIT's picture."""

from __future__ import annotations

import functools
import traceback

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ..objects import digit_unit
from ..process import tracer_process
from ..settings import properties, render_settings, reports
from . import pictures

ID = "TACTILE_DIGIT"
_LOOK = 10.0  # s between two looks for workers that do nothing
# Panels of these kinds suit any engine; Blender shows them for engines that add themselves.
_SHARED = {"properties_output", "properties_render", "properties_view_layer"}
PASSES = {"Height": "V", "Normal": "XYZ", "Contact": "V", "Displacement": "XYZ"}  # name -> channels, beside Combined
_OWN_KIND = ("eevee", "cycles", "freestyle", "hair", "grease", "motion_blur", "simplify", "curves_render")


class TactileRenderEngine(bpy.types.RenderEngine):
    """Engine that renders what the camera of a sensor sees: of the gel with the scene's camera, else of the first"""

    bl_idname = ID
    bl_label = "Tactile DIGIT (Mitsuba)"
    bl_use_preview = False
    bl_use_eevee_viewport = True  # for Material Preview; the 3D view has no Rendered shading by it

    def update_render_passes(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
        """Declare the passes to the compositor; Blender calls it."""
        self.register_pass(scene, view_layer, "Combined", 4, "RGBA", "COLOR")
        for name, channels in PASSES.items():
            kind = "VALUE" if len(channels) == 1 else "VECTOR"
            self.register_pass(scene, view_layer, name, len(channels), channels, kind)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render a view layer of a frame; Blender calls it."""
        try:
            self._render(depsgraph)
        except tracer_process.Stopped:
            tracer_process.close_all()
        except Exception as error:  # whatever it was: Blender shows in the log alone what a render raises
            words = _describe_error(error)
            self.error_set(words)  # stands over the empty picture; the report ends an animation
            self.report({"ERROR"}, words)

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        scene, layer = depsgraph.scene, depsgraph.view_layer_eval.name
        gel = properties.needed_gel(scene)
        size, preset = (self.resolution_x, self.resolution_y), render_settings.preset_of(scene)
        warn = functools.partial(self.report, {"WARNING"})
        for words in (*pictures.mixed(gel, scene), *digit_unit.left_out(scene, gel, preset)):
            warn(words)
        self.update_stats("", f"Frame {scene.frame_current}: {preset}")

        for name, channels in PASSES.items():
            self.add_pass(name, len(channels), channels, layer=layer)
        fields = pictures.fields(gel, depsgraph, size)
        # Raw writes the levels as they are; EXR and HDR hold linear light whatever the window shows.
        linear = scene.render.image_settings.file_format.startswith(digit_unit.LINEAR)
        raw = digit_unit.output_of(scene).view_settings.view_transform == "Raw" and not linear

        def show(picture: np.ndarray) -> None:
            self._show({"Combined": to_linear(picture, raw)} | fields, scene.render, layer)

        show(pictures.draw(gel, depsgraph, preset, size, self.test_break, show, warn)[0])
        self.update_progress(1.0)

    def _show(self, found: dict[str, np.ndarray], render: bpy.types.RenderSettings, layer: str) -> None:
        """Put the region that is rendered of each pass into the render result.

        found : name -> pass (H, W, channels), top row first; layer : the view layer's name
        In stereo both eyes get the same, as the sensor has one camera."""
        left, low = 0, 0
        if render.use_border:  # as Blender rounds it, in float32
            left, low = (int(np.float32(share) * np.float32(whole)) for share, whole in (
                (render.border_min_x, self.resolution_x), (render.border_min_y, self.resolution_y)))  # fmt: skip
        result = self.begin_result(0, 0, self.resolution_x, self.resolution_y, layer=layer)
        region = slice(low, low + result.resolution_y), slice(left, left + result.resolution_x)
        for each in result.layers[0].passes:
            if each.name in found:
                # Flat: a two-dimensional array takes fifty times as long (blender.md).
                each.rect.foreach_set(found[each.name][::-1][region].ravel())
        self.end_result(result)


def _describe_error(error: Exception) -> str:
    if isinstance(error, ModuleNotFoundError):
        return f"{error.name} is missing. {reports.ADVICE}"
    if not isinstance(error, (TactileError, OSError)):
        traceback.print_exc()
        return f"Tactile render: {error!r}; the log says where"
    return reports.in_blender(str(error))


def to_linear(picture: np.ndarray, raw: bool = False) -> np.ndarray:
    """Convert a picture (H, W, 3) uint8 to scene-linear RGBA, float32 (H, W, 4), so that Blender writes files with the
    same 8-bit values.

    raw : true for the view transform Raw, which has no curve; false for Standard, whose sRGB curve is undone, and for
        EXR and HDR, which hold linear light
    """
    curve = np.arange(256) / 255
    if not raw:
        curve = np.where(curve <= 0.04045, curve / 12.92, ((curve + 0.055) / 1.055) ** 2.4)
    pixels = np.ones((*picture.shape[:2], 4), np.float32)
    pixels[..., :3] = curve.astype(np.float32)[picture]
    return pixels


def _panels() -> list[type]:
    """List the panels of the Properties editor that every engine shares: output, resolution, colour management."""
    found = []
    for panel in bpy.types.Panel.__subclasses__():
        engines, module = getattr(panel, "COMPAT_ENGINES", ()), panel.__module__.rsplit(".", 1)[-1]
        own = any(word in panel.__name__.lower() for word in _OWN_KIND)
        if "BLENDER_RENDER" in engines and module in _SHARED and not own:
            found.append(panel)
    return found


def _end_idle_workers() -> float:
    """End workers that have nothing to do; Blender's timer calls this and waits as many seconds as it returns."""
    tracer_process.close_idle()
    return _LOOK


def register() -> None:
    """Start the timer that ends idle workers, and show Blender's own panels for this engine too."""
    bpy.app.timers.register(_end_idle_workers, first_interval=_LOOK, persistent=True)
    for panel in _panels():
        panel.COMPAT_ENGINES.add(ID)


def unregister() -> None:
    """Take the engine off Blender's own panels, and stop the timer that ends idle workers."""
    for panel in _panels():
        panel.COMPAT_ENGINES.discard(ID)
    bpy.app.timers.unregister(_end_idle_workers)


CLASSES = (TactileRenderEngine,)
