"""Reset to Calibration and Save as Calibration: LEDs, coating and camera from a unit's file, and to one."""

import dataclasses

import bpy
from bpy_extras.io_utils import ExportHelper

from ...tactile_core.sensors import calibration_file
from ..objects import digit_body, digit_unit
from ..settings import properties, render_settings
from ..settings.reports import TactileOperator


class OnGel:
    """Operators that need a gel"""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true where there is a gel."""
        return properties.can(cls, lambda: properties.needed_gel(context.scene))


class TACTILE_OT_reset_to_calibration(OnGel, TactileOperator):
    """Put LEDs, coating and camera back to the calibration; their keyframes and drivers are removed"""

    bl_idname = "tactile.reset_to_calibration"
    bl_label = "Reset to Calibration"

    def work(self, context: bpy.types.Context) -> None:
        """Run the operator; ``TactileOperator`` calls this and reports its errors."""
        gel = properties.gel_of(context.scene, context.object)
        properties.check_own(gel)
        gel.tactile.object_reflectance = 0.0
        digit_body.reset(gel, render_settings.calibration_of(context.scene, properties.sensor_name(gel)))


class TACTILE_OT_save_as_calibration(OnGel, TactileOperator, ExportHelper):
    """Write LEDs, coating and camera as they are on this frame as a calibration file, for every `tactile` command"""

    bl_idname = "tactile.save_as_calibration"
    bl_label = "Save as Calibration"
    bl_options = {"REGISTER"}  # noqa: RUF012 (changes no scene)

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def work(self, context: bpy.types.Context) -> None:
        """Run the operator; ``TactileOperator`` calls this and reports its errors."""
        gel = properties.gel_of(context.scene, context.object)
        base = render_settings.calibration_of(context.scene, properties.sensor_name(gel))
        shown = digit_unit.shown_unit(gel, context.evaluated_depsgraph_get(), base)
        path = bpy.path.abspath(self.filepath)
        unit = dataclasses.replace(shown.unit, unit=f"{base.unit}, changed in Blender") if shown.unit != base else base
        calibration_file.write_calibration(path, unit)
        if shown.around:
            self.report({"WARNING"}, "A calibration holds three LEDs of one colour each: lamps, bodies and other"
                        " colours in this scene are not in it")  # fmt: skip
        self.report({"INFO"}, f"{path}: {unit.unit}")


CLASSES = (TACTILE_OT_reset_to_calibration, TACTILE_OT_save_as_calibration)
