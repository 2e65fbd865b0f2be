"""The button "Simulate": contact mechanics over the frame range, in another process."""

import shutil
from pathlib import Path

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.sensors import SAMPLE_RATE
from ..process.jobs import Job, JobFolder
from ..ui import properties, render_settings
from ..ui.reports import Refused, TactileOperator, reported, require
from . import scene_bridge, simulation_result

_STEP = 0.1  # s between two looks at the worker


def _outputs(scene: bpy.types.Scene) -> list[str]:
    """List the outputs for the sensors of a scene: one that is not there is not solved."""
    of = {"BIOTAC": ["electrodes", "displacement_biotac"], "DIGIT": ["displacement_digit"]}
    return [word for role, words in of.items() if properties.of_role(scene, role) for word in words]


def _rate(scene: bpy.types.Scene) -> float:
    return scene.render.fps / scene.render.fps_base


class TACTILE_OT_simulate(TactileOperator):
    """Press the indenter into both sensors over the frame range, and bake what they feel (Esc stops)"""

    bl_idname = "tactile.simulate"
    bl_label = "Simulate"

    seed: bpy.props.IntProperty(name="Seed", description="Of the electrodes' noise: same seed, same recording", min=0)

    def _begin(self, context: bpy.types.Context) -> None:
        """Raise TactileError."""
        require("h5py", "msgspec", "scipy")
        from ...tactile_core.simulation.scene_text import write_scene

        roles = ("BIOTAC", "DIGIT")
        properties.check_own(*(properties.of_role(context.scene, role) for role in roles))
        found = scene_bridge.authored(context)
        if found.meshes:
            require("trimesh", "rtree")
        self._thing = scene_bridge.indenter_of(context).name
        self._folder = JobFolder()
        write_scene(self._folder.path, found.scene, found.meshes)
        if found.apexes is not None:
            np.savez(self._folder.path / "heights.npz", apex=found.apexes)
        bound = render_settings.budget_of(context.scene).um
        self._job = Job("simulate", self._folder.path, seed=self.seed, keep=_outputs(context.scene), um=bound,
                        first_frame=context.scene.frame_start, rate=_rate(context.scene))  # fmt: skip

    def _bake(self, context: bpy.types.Context) -> None:
        thing = context.scene.objects.get(self._thing)
        if thing is None:
            raise TactileError(self._thing, "no longer in the scene", "the indenter that was simulated")
        result = simulation_result.read(self._folder.path)
        summary = simulation_result.bake(context, thing, result)
        self._keep(context)
        self.report({"INFO"}, summary)

    def _keep(self, context: bpy.types.Context) -> None:
        """Save the simulated recording beside the .blend, so that it can be translated like a real one."""
        skin = properties.of_role(context.scene, "BIOTAC")
        if not bpy.data.is_saved or skin is None:
            return
        name = f"{bpy.path.clean_name(self._thing)}.h5"
        path = Path(bpy.path.abspath("//tactile_simulations")) / name
        path.parent.mkdir(exist_ok=True)
        shutil.copyfile(self._folder.path / "recording.h5", path)
        skin.tactile.recording, skin.tactile.tare = f"//tactile_simulations/{name}", "auto"
        skin.tactile.frames, skin.tactile.first_frame = ":", context.scene.frame_start
        skin.tactile.samples = SAMPLE_RATE / _rate(context.scene)

    def work(self, context: bpy.types.Context) -> None:
        """Simulate without a window, or from a script: waits for the end."""
        try:
            self._begin(context)
            while not self._job.poll(_STEP):
                pass
            self._bake(context)
        finally:
            self._close(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Simulate from the window: goes on while Blender stays usable."""
        try:
            with reported(self):
                self._begin(context)
        except Refused:
            self._close(context)
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(_STEP, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.window_manager.progress_begin(0, 100)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Called by Blender for each event."""
        if event.type == "ESC":
            self._close(context)
            self.report({"WARNING"}, "Simulation stopped; the scene is as it was")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            with reported(self):
                over = self._job.poll()
                share = round(100 * self._job.share)
                context.window_manager.progress_update(share)
                context.workspace.status_text_set(f"{self._job.stage}: {share} %   (Esc stops)")
                if over:
                    self._bake(context)
        except Refused:
            self._close(context)
            return {"CANCELLED"}
        if over:
            self._close(context)
            return {"FINISHED"}
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop the job when Blender closes or another file is opened."""
        self._close(context)

    def _close(self, context: bpy.types.Context) -> None:
        if getattr(self, "_job", None) is not None:
            self._job.cancel()
            self._job = None
        if getattr(self, "_folder", None) is not None:
            self._folder.close()
            self._folder = None
        if getattr(self, "_timer", None) is not None:
            context.window_manager.event_timer_remove(self._timer)
            context.window_manager.progress_end()
            context.workspace.status_text_set(None)
            self._timer = None


register, unregister = bpy.utils.register_classes_factory((TACTILE_OT_simulate,))
