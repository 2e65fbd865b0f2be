"""The button "Simulate": contact mechanics over the frame range, in another process."""

import shutil

import bpy
import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.files import atomic
from ...tactile_core.sensors import SAMPLE_RATE
from ..objects import motion
from ..process.jobs import Job, JobFolder
from ..settings import kept_files, properties, render_settings
from ..settings.reports import require
from . import pictures, scene_bridge, simulation_result
from .job_operator import JobOperator


def _outputs(scene: bpy.types.Scene) -> list[str]:
    """List the outputs for the sensors of a scene: one that is not there is not solved."""
    from ...tactile_core.simulation.scene_recording import ELECTRODES_OF

    there = list(map(properties.sensor_name, simulation_result.sensors_in(scene)))
    return ["electrodes"] * (ELECTRODES_OF in there) + [f"displacement_{sensor}" for sensor in there]


class TACTILE_OT_simulate(JobOperator):
    """Press the indenter into the sensors that are there over the frame range, and bake what they feel (Esc stops)"""

    bl_idname = "tactile.simulate"
    bl_label = "Simulate"

    seed: bpy.props.IntProperty(name="Seed", description="Of the electrodes' noise: same seed, same recording", min=0)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true where there are a sensor and what presses it."""
        return properties.can(cls, lambda: (scene_bridge.indenter_of(context), scene_bridge.sensor_of(context)))

    stopped = "Simulation stopped; the scene is as it was"

    def begin(self, context: bpy.types.Context) -> None:
        """Write the authored scene and start its simulation as a job; see ``JobOperator``."""
        require("h5py", "msgspec", "scipy")
        from ...tactile_core.simulation.scene import write_scene

        sensors = simulation_result.sensors_in(context.scene)
        properties.check_own(*sensors)
        motion.check_rest(*sensors)
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
                        placed_on=properties.sensor_name(scene_bridge.sensor_of(context)),
                        first_frame=context.scene.frame_start, rate=scene_bridge.rate_of(context.scene))  # fmt: skip

    def finish(self, context: bpy.types.Context) -> None:
        """Bake the simulation into the scene; see ``JobOperator``."""
        thing = context.scene.objects.get(self._thing)
        if thing is None:
            raise TactileError(self._thing, "no longer in the scene", "the indenter that was simulated")
        result = simulation_result.read(self._folder.path)
        summary = simulation_result.bake(context, thing, result)
        self._keep(context)
        gel = properties.gel_of(context.scene)
        if gel is not None:
            pictures.show_result(self, context, gel)
        self.report({"INFO"}, summary)
        if not result.force.any():
            words = "touched no sensor: press with it lower, or select the indenter that presses"
            self.report({"WARNING"}, f"{self._thing} {words}")

    def _keep(self, context: bpy.types.Context) -> None:
        """Save the simulated recording beside the .blend, so that it can be translated like a real one.

        Of a file that was never saved it is kept by Blender until the file is, see ``kept_files``.
        """
        from ...tactile_core.simulation.scene_recording import ELECTRODES_OF

        there = simulation_result.sensors_in(context.scene)
        skin = next((thing for thing in there if properties.sensor_name(thing) == ELECTRODES_OF), None)
        if skin is None:
            return
        path = kept_files.folder(kept_files.SIMULATIONS) / f"{bpy.path.clean_name(self._thing)}.h5"
        with atomic.new_file(path) as partial:
            shutil.copyfile(self._folder.path / "recording.h5", partial)
        skin.tactile.recording, skin.tactile.tare, skin.tactile.known = kept_files.shown(path), "auto", ""
        skin.tactile.frames, skin.tactile.first_frame = ":", context.scene.frame_start
        skin.tactile.samples = SAMPLE_RATE / scene_bridge.rate_of(context.scene)


CLASSES = (TACTILE_OT_simulate,)
