"""Translate the imported recording to a DIGIT's at the press of one button."""

import bpy

from ...tactile_core import sensors
from ...tactile_core.translation import contact_patch, gel_place
from ..objects import custom_properties, digit_body, digit_objects, frame_attribute, motion
from ..ui import properties, render_settings, timeline, view
from ..ui.progress import shown
from ..ui.reports import TactileOperator
from . import pictures, recording_data, set_style


class TACTILE_OT_translate(TactileOperator):
    """Translate the BioTac recording: add a DIGIT's gel that moves as it would have, with its contact patch"""

    bl_idname = "tactile.translate"
    bl_label = "Translate to DIGIT"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true where there is a BioTac to translate."""
        skin = properties.of_role(context.scene, "BIOTAC", context.object)
        if skin is None or not skin.tactile.recording:
            cls.poll_message_set("Import a BioTac recording first, or simulate one in a saved file")
            return False
        return True

    def work(self, context: bpy.types.Context) -> None:
        """See ``TactileOperator``."""
        skin = properties.of_role(context.scene, "BIOTAC", context.object)
        properties.check_format(skin)
        properties.check_own(skin)
        about = skin.tactile
        with shown(context) as progress:
            path = bpy.path.abspath(about.recording)
            found = recording_data.load(path, about.tare, about.frames, progress, about.polarity)
        frames = about.first_frame + found.chosen / about.samples
        group = properties.home_of(skin)
        # A gel that is there keeps its LEDs, coating and camera as the user has set them.
        there = (thing for thing in group.objects if thing.tactile.role == "DIGIT")
        gel = next(there, None) or digit_objects.add_gel(group, about.per_metre, skin)
        digit_body.add_body(gel, render_settings.calibration_of(context.scene))
        surface, moved = sensors.digit_surface(), found.translation.displacement_digit
        before = gel.tactile.largest
        summary = motion.animate(gel, surface.rest, moved, frames, about.motion)
        step = frames[1] - frames[0] if len(frames) > 1 else 1.0
        patch = contact_patch.contact_patch(moved, surface)
        frame_attribute.add(gel, frame_attribute.PATCH, patch, frames[0], step)
        set_style.follow(gel, before)
        values = custom_properties.columns(found)
        told_of_gel = {"expected_error_um": 1e6 * found.translation.expected_error_digit}
        told_of_gel |= {name: values[name] for name in ("force", "confidence")}
        seen_by = render_settings.calibration_of(context.scene).camera
        told_of_gel["flags"] = values["flags"] | gel_place.beyond_picture(found.translation.contact_center, seen_by)
        custom_properties.write(gel, told_of_gel, frames)
        low = timeline.mark_low_confidence(context.scene, found.translation.confidence, frames)
        view.show_picture(context, pictures.update(gel, context.evaluated_depsgraph_get()))
        view.show(context, [skin, gel])
        self.report({"INFO"}, f"{summary}; {low} parts of low confidence")


register, unregister = bpy.utils.register_classes_factory((TACTILE_OT_translate,))
