"""Translate the imported recording to a gel's movement at the press of one button."""

import bpy
import numpy as np
from mathutils import Vector

from ...tactile_core.errors import TactileError
from ...tactile_core.jobs.results import BALL, ball_radius
from ...tactile_core.translation import gel_place
from ..objects import curves, digit_body, digit_objects, mesh_cache, motion
from ..process.jobs import Job, JobFolder
from ..settings import properties, render_settings
from ..settings.reports import require, shown
from . import pictures, recording_data, set_style, view
from .import_recording import play, plays
from .job_operator import JobOperator

_READ = ("displacement_digit", "contact_center", "force", "flags", "expected_error_digit")  # to solve its contacts


class TACTILE_OT_translate(JobOperator):
    """Translate the recording: add a gel that moves as it would have, with its contact patch"""

    bl_idname = "tactile.translate"
    bl_label = "Translate"

    to: bpy.props.EnumProperty(
        name="To", description="Which gel; the networks' own, the DIGIT for those that ship, unless another is chosen."
        " On another the contact that they find is solved", items=lambda _self, _context: properties.sensor_items(True),
    )  # fmt: skip
    stopped = "Translation stopped; the scene is as it was"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true if there is a skin with a recording."""
        skin = properties.of_role(context.scene, "BIOTAC", context.object)
        if skin is None or not skin.tactile.recording:
            cls.poll_message_set("Import a BioTac recording first, or simulate one")
            return False
        return True

    def begin(self, context: bpy.types.Context) -> None:
        """Translate the recording; start a job only to solve the contacts, under a known ball or on another gel."""
        skin = properties.of_role(context.scene, "BIOTAC", context.object)
        properties.check_format(skin)
        properties.check_own(skin, skin.data)  # an override's mesh is linked
        about = skin.tactile
        with shown(context) as progress:
            own = recording_data.translator_of(about, bpy.path.abspath(about.recording)).target
            self._target = self.to.lower() if self.properties.is_property_set("to") else own
            gel = _gel_beside(context.scene, skin, self._target)
            motion.check_rest(*filter(None, (skin, gel)))
            ball = ball_radius(f"{BALL}{about.ball:g}") if about.ball else None
            solved = self._target != own or ball is not None
            if about.two and solved:
                raise TactileError("Two Contacts", "a gel that is solved", "one that is translated to", "Leave it out")
            # Contacts are solved from what is in memory.
            how = (about.motion if not solved else "") or "SHAPE_KEYS"
            found = recording_data.load(bpy.path.abspath(about.recording), about, progress, how, about.per_metre)
        self._skin = skin.session_uid, skin.name
        self._found = found
        unit = render_settings.calibration_of(context.scene, self._target)
        beside = gel_place.beyond_picture(found.translation.contact_center, unit.camera)
        self._moved, self._flags = found.gel, found.translation.flags | beside
        self._error = found.translation.expected_error_digit
        if solved:
            require("scipy")
            self._folder = JobFolder()
            arrays = {name: getattr(found.translation, name) for name in _READ}
            np.savez(self._folder.path / "frames.npz", **arrays)
            self._job = Job("solve_gel", self._folder.path, gel=self._target, found_on=own, ball=ball)

    def finish(self, context: bpy.types.Context) -> None:
        """Animate the gel by the translation; add a gel if there is none."""
        if self._job is not None:
            with np.load(self._folder.path / "gel.npz") as stored:
                self._moved = mesh_cache.in_memory(stored["displacement"], self._target)
                self._flags |= stored["flags"]
                self._error = np.nan_to_num(stored["error"], nan=curves.UNKNOWN)
            from ...tactile_core.jobs.frame_pass import describe_gel

            for words in describe_gel(self._target, self._found.translator.target):
                self.report({"WARNING"}, words)
        skin = properties.found_again(context.scene, *self._skin, "the skin that was translated")
        frames = skin.tactile.first_frame + self._found.chosen / skin.tactile.samples
        old = _gel_beside(context.scene, skin, self._target)
        gel = old or digit_objects.add_gel(properties.home_of(skin), skin.tactile.per_metre, skin, self._target)
        if skin.tactile.known and not plays(skin, self._found, frames):  # imported, with another unit than is chosen
            play(skin, self._found, frames)
        digit_body.add_body(gel, render_settings.calibration_of(context.scene, self._target))
        values = self._found.columns()
        told = {name: values[name] for name in ("force", "confidence", "explained")}
        told |= {"expected_error_um": 1e6 * self._error, "flags": self._flags}
        summary = set_style.animate(gel, self._moved, frames, skin.tactile.motion, told)
        if old is None:
            set_style.take_over(gel, skin)
        low = view.mark_low_confidence(context.scene, skin.name, self._found.translation.confidence, frames)
        view.show(context, [gel, skin])
        pictures.show_result(self, context, gel)
        self.report({"INFO"}, f"{summary}; {low} parts of low confidence")


def _gel_beside(scene: bpy.types.Scene, skin: bpy.types.Object, sensor: str) -> bpy.types.Object | None:
    """Return the gel of the kind ``sensor`` beside a skin, None if there is none.

    It keeps its LEDs, coating and camera as the user set them; of several, as of a copied pair, it is the one nearest
    to where this skin's would be added. One that was moved to a collection without a skin is known by its forces.
    """
    gels = [thing for thing in scene.objects if thing.tactile.role == "DIGIT"]
    gels = [thing for thing in gels if properties.sensor_name(thing) == sensor]
    place = skin.location + Vector((0.0, digit_objects.BESIDE * skin.tactile.per_metre, 0.0))
    beside = properties.home_of(skin).objects.values()
    alone = [gel for gel in gels if all(thing.tactile.role != "BIOTAC" for thing in properties.home_of(gel).objects)]
    found = [gel for gel in gels if gel in beside] or [
        gel for gel in alone if "force" in gel and _forces(gel) == _forces(skin)]  # fmt: skip
    return min(found, key=lambda thing: (thing.location - place).length, default=None)


def _forces(sensor: bpy.types.Object) -> list[list[float]]:
    return [curves.values_of(sensor, '["force"]', axis).tolist() for axis in range(3)]


CLASSES = (TACTILE_OT_translate,)
