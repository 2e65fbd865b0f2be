"""Set Up Render: everything that makes a rendered file hold the DIGIT's own 8-bit values; and the engine's panel."""

import math

import bpy

from ...tactile_core.errors import TactileError
from ...tactile_core.sensors.camera import HEIGHT_ZERO_Y, Camera
from ..objects import axes
from ..ui import properties, render_settings, reports
from ..ui.reports import TactileOperator
from .render_engine import ID

CAMERA = "DIGIT camera"


class TACTILE_OT_set_up_render(TactileOperator):
    """Render the DIGIT's picture: engine, 240 x 320 pixels, colours as the camera gives them, a camera in the gel"""

    bl_idname = "tactile.set_up_render"
    bl_label = "Set Up Render"

    def work(self, context: bpy.types.Context) -> None:
        """See ``TactileOperator``."""
        scene = context.scene
        gel = properties.of_role(scene, "DIGIT", context.object)
        if gel is None:
            raise TactileError(scene.name, "no DIGIT", "a gel to look at", "Translate a recording, or add a DIGIT")
        settings = scene.tactile_render
        path = bpy.path.abspath(settings.calibration) if settings.calibration else None
        camera = render_settings.calibration_file.load_calibration(path).camera
        render = scene.render
        render.engine = ID
        render.resolution_x, render.resolution_y, render.resolution_percentage = camera.width, camera.height, 100
        right, down = camera.pixel_size
        render.pixel_aspect_x, render.pixel_aspect_y = max(1.0, right / down), max(1.0, down / right)
        render.dither_intensity = 0.0  # noise of a grey level that the camera does not have
        scene.view_settings.view_transform, scene.view_settings.look = "Standard", "None"
        scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0
        render.image_settings.file_format, render.image_settings.color_mode = "PNG", "RGB"
        scene.camera = _camera_object(gel, camera)


def _camera_object(gel: bpy.types.Object, camera: Camera) -> bpy.types.Object:
    """A camera where the DIGIT's own seems to be: Blender renders no scene without one, and users see it."""
    found = next((thing for thing in gel.children if thing.type == "CAMERA"), None)
    if found is None:
        found = bpy.data.objects.new(CAMERA, bpy.data.cameras.new(CAMERA))
        gel.users_collection[0].objects.link(found)
        found.parent = gel
    per_metre, high = gel.tactile.per_metre, camera.apparent_height
    place = [[camera.centre_x, HEIGHT_ZERO_Y + high, camera.centre_z]]
    found.location = axes.to_blender(place, per_metre)[0]
    # It looks up into the gel, its own -Z along the scene's Z; the fingertip, -X, is up in the picture.
    found.rotation_euler = (math.pi, 0.0, -math.pi / 2 * camera.down_x)
    lens = found.data
    size = camera.height * camera.pixel_size[1]
    lens.sensor_fit, lens.lens_unit, lens.angle = "VERTICAL", "FOV", 2 * math.atan(size / 2 / high)
    lens.clip_start, lens.display_size = 1e-4 * per_metre, 2e-3 * per_metre
    return found


class TACTILE_PT_render(bpy.types.Panel):
    """Preset, unit, lights and coating"""

    bl_idname = "TACTILE_PT_render"
    bl_label = "DIGIT"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true for this engine only."""
        return context.engine == ID

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender."""
        draw_settings(self.layout, context)


def draw_settings(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The settings, for this panel and the sidebar's."""
    settings = context.scene.tactile_render
    layout.use_property_split = True
    layout.operator(TACTILE_OT_set_up_render.bl_idname, icon="RESTRICT_RENDER_OFF")
    layout.prop(settings, "preset")
    layout.prop(settings, "error")
    if settings.preset != "fast" and reports.missing("mitsuba"):
        layout.label(text="mitsuba is missing: see Preferences", icon="ERROR")
    layout.prop(settings, "calibration")
    layout.prop(settings, "lights")
    layout.prop(settings, "albedo")


CLASSES = (TACTILE_OT_set_up_render, TACTILE_PT_render)
register, unregister = bpy.utils.register_classes_factory(CLASSES)
