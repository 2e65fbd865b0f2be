"""The button "Simulate": solve contacts over the frame range in another process, and put the result into the scene."""

import dataclasses
import json
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from ...tactile_core.errors import TactileError
from ...tactile_core.sensors import SAMPLE_RATE
from ..objects import axes, curves, indenter_objects, mesh_cache, motion
from ..process.jobs import Job, JobFolder
from ..settings import kept_files, properties, render_settings
from ..settings.reports import require
from . import pictures, scene_bridge, set_style
from .job_operator import JobOperator
from .scene_bridge import motion_of, sensor_of, sensors_for

STANDING = "{} simulated"
MOVED = "moved "  # before a sensor's name, in a worker's result
_BOUNDS = {"sphere": "SPHERE", "cylinder": "CYLINDER"}  # Blender's outlines; the others are boxes


@dataclasses.dataclass(frozen=True)
class Result:
    """Result of a simulation, in the sensor's frame.

    seconds : (T,); force : (T, 3) N, on the sensor
    apex : (T, 3) m, the indenter's tip; turn : (T, 3, 3), its axes as columns; on the gel, else on the skin
    moved : name -> displacement (T, n, 3) m, of each sensor that was solved
    picked : sentences on the tier that was chosen for each sensor; none without a largest error
    """

    seconds: np.ndarray
    force: np.ndarray
    apex: np.ndarray
    turn: np.ndarray
    moved: dict[str, np.ndarray]
    picked: tuple[str, ...]


def read(folder: Path) -> Result:
    """Read the result that the simulation wrote into a job's folder."""
    with np.load(folder / "result.npz") as stored:
        moved = {name.removeprefix(MOVED): stored[name] for name in stored.files if name.startswith(MOVED)}
        picked = tuple(str(text) for text in stored["picked"])
        return Result(stored["seconds"], stored["force"], stored["apex"], stored["axes"], moved, picked)


def bake(context: bpy.types.Context, thing: bpy.types.Object, result: Result, frames: np.ndarray, rate: float) -> str:
    """Animate the sensors by a result at frames (F,) of the scene, and the indenter's twin; return a sentence for the
    user. thing : the indenter; rate : frames per second"""
    scene, seconds = context.scene, result.seconds - result.seconds[0]
    # The mechanics run at the sensor's 100 Hz: each frame shows the nearest of its samples.
    sample = np.abs((frames - frames[0])[:, None] / rate - seconds[None, :]).argmin(axis=1)
    sentences = [*result.picked]
    force = result.force[sample][:, [0, 2, 1]] * np.array([1.0, 1.0, -1.0])
    for sensor in sensors_for(scene, thing):
        moved = result.moved.get(properties.sensor_name(sensor))
        if moved is None:  # it was added while the other process worked
            continue
        told = {"force": force}
        movement = mesh_cache.in_memory(moved[sample], properties.sensor_name(sensor))
        sentences.append(set_style.animate(sensor, movement, frames, sensor.tactile.motion, told))
    if thing.tactile.press_by == "HEIGHT":
        curves.write_curve(thing, "tactile.force", frames, np.linalg.norm(force, axis=1))
    _stand(context, thing, result, sample, frames)
    return "; ".join(sentences)


def _stand(context, thing, result: Result, sample: np.ndarray, frames: np.ndarray) -> None:  # noqa: ANN001
    """Add a solid twin of the indenter ``thing`` where the simulation had it, and show the indenter itself as wires.
    frames : (F,) of the scene; sample : (F,) int, index of the result's moment that each frame shows"""
    sensor = sensor_of(context, thing)
    name = STANDING.format(thing.name)
    there = context.scene.objects
    known = {STANDING.format(each.name) for each in there if each.tactile.role == "INDENTER"}
    left = (each for each in there if each.tactile.role == "TWIN" and each.data == thing.data)  # of a former name
    twin = there.get(name) or next((each for each in left if each.name not in known), None)
    if twin is None:
        twin = bpy.data.objects.new(name, thing.data)
        properties.home_of(thing).objects.link(twin)
    twin.name, twin.tactile.role = name, "TWIN"
    twin.parent, twin.rotation_mode, thing.hide_render = sensor, "QUATERNION", True
    # A few thin lines and a body that is seen through: twin and dent stay in view.
    kind = json.loads(thing.tactile.spec or "{}").get("kind")
    thing.display_type, thing.display_bounds_type = "BOUNDS", _BOUNDS.get(kind, "BOX")
    twin.color, twin.show_transparent = (*thing.color[:3], 0.4), True
    relative = indenter_objects.world_axes(thing, sensor)
    foot = indenter_objects.foot_of(thing, relative, context.evaluated_depsgraph_get())
    size = np.linalg.norm(relative, axis=0)
    twin.scale = size
    places = axes.to_blender(result.apex[sample], sensor.tactile.per_metre)
    # Columns of the pose are the body's axes in the sensor's frame; Blender's axes are that frame turned.
    turns = axes.to_blender(result.turn[sample].swapaxes(1, 2), 1.0).swapaxes(1, 2)
    own = relative / size
    quaternions = []
    for turn in turns:
        found = Matrix((turn @ own).tolist()).to_quaternion()
        if quaternions and found.dot(quaternions[-1]) < 0:
            found.negate()  # the same turn, on the near side: curves between keys then take the short way
        quaternions.append(found)
    places = places - np.einsum("tij,j->ti", turns, foot)
    if thing.tactile.press_by == "HEIGHT":
        # Where it does not touch, nothing but its keys says where it is.
        lifted = np.linalg.norm(result.force[sample], axis=1) == 0
        keyed = motion_of(context, thing, sensor, frames)["apex"]
        places[lifted] = (axes.to_blender(keyed, sensor.tactile.per_metre) - foot)[lifted]
    curves.write_curves(twin, "location", frames, places)
    curves.write_curves(twin, "rotation_quaternion", frames, np.array([q[:] for q in quaternions]))


def _outputs(pressed: list[bpy.types.Object]) -> list[str]:
    """List the outputs to simulate for the sensors that are pressed; sensors without an output are not solved."""
    from ...tactile_core.simulation.scene_recording import ELECTRODES_OF

    there = list(map(properties.sensor_name, pressed))
    return ["electrodes"] * (ELECTRODES_OF in there) + [f"displacement_{sensor}" for sensor in there]


class TACTILE_OT_simulate(JobOperator):
    """Press the indenter into the sensors that are there over the frame range, and bake what they feel (Esc stops)"""

    bl_idname = "tactile.simulate"
    bl_label = "Simulate"

    seed: bpy.props.IntProperty(name="Seed", description="Of the electrodes' noise: same seed, same recording", min=0)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Return true if there are a sensor and an indenter."""
        return properties.can(cls, lambda: sensor_of(context, scene_bridge.indenter_of(context)))

    stopped = "Simulation stopped; the scene is as it was"

    def begin(self, context: bpy.types.Context) -> None:
        """Write the scene as the user has set it up, and start its simulation as a job."""
        require("h5py", "msgspec", "scipy")
        from ...tactile_core.simulation.scene import write_scene

        thing = scene_bridge.indenter_of(context)
        pressed = sensors_for(context.scene, thing)
        properties.check_own(*pressed, *(each.data for each in pressed))
        scene_bridge.check_free(*pressed)
        motion.check_rest(*pressed)
        render = context.scene.render
        if render.frame_map_old != render.frame_map_new:  # else keys would lie on other frames than they are of
            found = f"time is stretched, {render.frame_map_old} to {render.frame_map_new}"
            raise TactileError(context.scene.name, found, "none", "Set Output > Time Stretching to 100 and 100")
        found = scene_bridge.authored(context)
        if found.meshes:
            require("trimesh", "rtree")
        self._thing, self._rate = (thing.session_uid, thing.name), scene_bridge.rate_of(context.scene)
        self._frames = np.arange(context.scene.frame_start, context.scene.frame_end + 1, dtype=float)
        self._folder = JobFolder()
        write_scene(self._folder.path, found.scene, found.meshes)
        self._apexes = found.apexes
        if found.apexes is not None:
            np.savez(self._folder.path / "heights.npz", apex=found.apexes)
        bound = render_settings.budget_of(context.scene).um
        self._job = Job("simulate", self._folder.path, seed=self.seed, keep=_outputs(pressed), um=bound,
                        placed_on=properties.sensor_name(sensor_of(context, thing)),
                        first_frame=context.scene.frame_start, rate=self._rate)  # fmt: skip

    def finish(self, context: bpy.types.Context) -> None:
        """Animate sensors and indenter by the simulation's result, and keep its recording."""
        thing = properties.found_again(context.scene, *self._thing, "the indenter that was simulated")
        result = read(self._folder.path)
        summary = bake(context, thing, result, self._frames, self._rate)
        if self._apexes is None:
            thing.pop(scene_bridge.PRESSED, None)
        else:
            thing[scene_bridge.PRESSED] = [self._frames[0], *self._apexes.ravel().tolist()]
        try:
            self._keep(context, thing)
        except OSError as error:  # what it baked is kept
            self.report({"WARNING"}, f"{error.filename}: the recording to translate is not kept ({error.strerror})")
        sensor = sensor_of(context, thing)
        if sensor.tactile.role == "DIGIT":
            pictures.show_result(self, context, sensor)
        self.report({"INFO"}, summary)
        if not result.force.any():
            words = "touched no sensor: press with it lower, or select the indenter that presses"
            self.report({"WARNING"}, f"{thing.name} {words}")

    def _keep(self, context: bpy.types.Context, thing: bpy.types.Object) -> None:
        """Save the simulated recording beside the .blend, so that it can be translated like a real one.

        If the .blend was never saved, the recording is kept in Blender's own folder until it is (``kept_files``).
        """
        from ...tactile_core.simulation.scene_recording import ELECTRODES_OF

        there = sensors_for(context.scene, thing)
        skin = next((each for each in there if properties.sensor_name(each) == ELECTRODES_OF), None)
        if skin is None:
            return
        skin.tactile.recording = ""  # an earlier one's
        named = self._folder.path / f"{bpy.path.clean_name(thing.name)}.h5"
        (self._folder.path / "recording.h5").rename(named)
        # Beside what is there: another .blend of the folder, or a step to undo to, may be of an earlier one.
        path = kept_files.copied(named, kept_files.folder(kept_files.SIMULATIONS))
        skin.tactile.recording, skin.tactile.tare, skin.tactile.known = kept_files.shown(path), "auto", ""
        skin.tactile.frames, skin.tactile.first_frame = ":", int(self._frames[0])
        skin.tactile.samples = SAMPLE_RATE / self._rate


CLASSES = (TACTILE_OT_simulate,)
