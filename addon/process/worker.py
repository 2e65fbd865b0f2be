"""Run long jobs in a process of their own, so that Blender lives on if they stall, are stopped or abort.

Started by ``jobs.Job`` as `python worker.py FOLDER` with ``tactile_core`` on its path. FOLDER/job.json says what to do;
each line on stdout is a JSON object: {"stage": "..."}, {"done": 3, "total": 10}, {"drawn": true} for a picture that
can be shown, {"error": "..."} or {"finished": true}. No bpy here.
A job is a function of FOLDER, job.json's content, and ``progress``, a function that it calls with (done, total).
"""

from __future__ import annotations

import dataclasses
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

Progress = Callable[[int, int], None]


def main(folder: Path) -> int:
    """Run the job in a folder; return the exit status: 0, or 2 if it has reported an error."""
    from tactile_core.errors import TactileError

    job = json.loads((folder / "job.json").read_text(encoding="utf-8"))
    try:
        JOBS[job["kind"]](folder, job, lambda done, total: say(done=done, total=total))
    except TactileError as error:
        say(error=str(error))
        return 2
    except ModuleNotFoundError as error:
        say(error=f"{error.name} is missing in Blender's Python. Install the extension's zip for this platform")
        return 2
    except OSError as error:
        say(error=f"{error.filename or folder}: cannot be written or read ({error.strerror or error})")
        return 2
    say(finished=True)
    return 0


def say(**message: Any) -> None:
    """Print a message as one line of JSON, for the Blender that started this process."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def simulate(folder: Path, job: dict, progress: Progress) -> None:
    """Simulate FOLDER/scene.toml; write recording.h5 and result.npz: true forces and displacements, indenter's places.

    job["keep"] : outputs to write; only sensors that they need are solved; job["seed"] : of the noise
    job["um"] : largest error of a surface, um, or None; job["placed_on"] : sensor whose frame places are in
    job["first_frame"], job["rate"] : of Blender's scene, and its frames per second, to name the frame in errors
    If the folder has heights.npz, the scene's forces are first found from how deep the indenter stands.
    """
    from tactile_core.errors import TactileError
    from tactile_core.mechanics.fast.compliance import compliance_of
    from tactile_core.simulation.scene_recording import sensors_of, simulate_recording
    from tactile_core.simulation.tier_choice import choose_for_scene

    by_height, used = (folder / "heights.npz").exists(), sensors_of(job["keep"])
    stages = _stages(used, by_height, job["um"])
    for sensor in used if job["um"] is None else ():
        next(stages)
        compliance_of(sensor)
    if by_height:
        next(stages)
    depths = _forces_from_heights(folder, job, progress) if by_height else None
    if job["um"] is not None:
        next(stages)
    choices = {} if job["um"] is None else choose_for_scene(folder, used, job["um"])
    tiers = {sensor: choice.tier for sensor, choice in choices.items()}
    scene, out = folder / "scene.toml", folder / "recording.h5"
    next(stages)
    try:
        simulate_recording(scene, out, job["seed"], progress, keep=job["keep"], tiers=tiers)
    except TactileError as error:
        raise _in_scene(error, folder, job, depths) from error
    _result(folder, job["placed_on"], [choice.describe(sensor) for sensor, choice in choices.items()])


def _stages(used: tuple[str, ...], by_height: bool, um: float | None) -> Iterator[None]:
    """Report the next stage of a simulation at each step, such as "Solving the contacts, 3 of 3".
    used : sensors; by_height : true if heights are given in place of forces; um : largest error asked for, or None"""
    names = [_preparing(sensor) for sensor in used if um is None]
    names += ["Finding the forces of the heights"] * by_height + ["Choosing the tiers"] * (um is not None)
    names.append("Solving the contacts")
    for k, name in enumerate(names):
        say(stage=f"{name}, {k + 1} of {len(names)}", done=0, total=1)
        yield


def _preparing(sensor: str) -> str:
    from tactile_core.sensors import title

    return f"Preparing the {title(sensor)}'s compliance (computed once, then kept)"


def _forces_from_heights(folder: Path, job: dict, progress: Progress) -> list[float]:
    """Write into scene.toml the forces with which the sensor job["placed_on"] resists the indenter at each point of its
    path, by how deep it stands there (heights.npz); return these depths, m."""
    import msgspec

    from tactile_core.errors import TactileError
    from tactile_core.mechanics.placement import Placement, pose_at
    from tactile_core.mechanics.solve import solve
    from tactile_core.simulation.scene import load_scene, to_toml

    scene = load_scene(folder)[0]
    spec = scene.recording
    indenter = next(i for i in scene.indenters if i.name == spec.indenter).build()
    with np.load(folder / "heights.npz") as stored:
        apexes = stored["apex"]
    points, depths, sensor = [], [], job["placed_on"]
    for k, (point, apex) in enumerate(zip(spec.points, apexes, strict=True)):
        place = Placement(point.x_mm * 1e-3, point.z_mm * 1e-3, np.radians(spec.tilt_deg))
        try:
            pose = pose_at(sensor, indenter, place)
        except TactileError as error:
            raise _at_frame(spec.indenter, job, k, error.found, error.expected, error.advice) from error
        depth = float((apex - pose.apex) @ pose.direction)
        force = 0.0
        if depth > 0:
            try:
                solution = solve(sensor, indenter, place, depth=depth, friction=spec.friction)
            except TactileError as error:
                raise _at_frame(spec.indenter, job, k, _too_deep(depth, error), error.expected, LIFT) from error
            force = max(solution.axial_force, 0.0)
        points.append(msgspec.structs.replace(point, force_n=force))
        depths.append(depth)
        progress(k + 1, len(apexes))
    # The rest of the scene as it was written: load_scene has made its file names absolute.
    text = msgspec.toml.decode((folder / "scene.toml").read_bytes(), type=type(scene))
    recording = msgspec.structs.replace(text.recording, points=points)
    (folder / "scene.toml").write_text(to_toml(msgspec.structs.replace(text, recording=recording)), encoding="utf-8")
    return depths


def _too_deep(depth: float, error: Any) -> str:
    """Return words on how deep, m, an indenter stands, and why that is not solved if not for the depth itself."""
    from tactile_core.mechanics.force_search import UnreachableError

    why = "" if isinstance(error, UnreachableError) else f" ({error.found})"
    return f"{1e3 * depth:.2f} mm below the gel's surface{why}"


def _at_frame(indenter: str, job: dict, k: int, found: str, expected: str, advice: str) -> Exception:
    """Return a TactileError that names the object ``indenter`` and the scene's frame, job["first_frame"] + k."""
    from tactile_core.errors import TactileError

    return TactileError(f"{indenter}, frame {job['first_frame'] + k:g}", found, expected, advice)


def _in_scene(error: Any, folder: Path, job: dict, depths: list[float] | None) -> Exception:
    """Return an error of one moment with the indenter and frame of the scene in a folder; other errors as they are.
    depths : m, at the scene's points, if heights were given in place of forces; else None"""
    from tactile_core.simulation.scene import load_scene

    if error.second is None:
        return error
    spec = load_scene(folder)[0].recording
    k = round((error.second - spec.points[0].time_s) * job["rate"])
    if depths is None or k >= len(depths):
        return _at_frame(spec.indenter, job, k, error.found, error.expected, "Let it press with less force there")
    found = f"{error.found}, {1e3 * depths[k]:.2f} mm below the gel's surface"
    return _at_frame(spec.indenter, job, k, found, error.expected, LIFT)


def _result(folder: Path, sensor: str, picked: list[str]) -> None:
    """Write result.npz: seconds (T,); force (T, 3) N; "moved SENSOR" (T, n, 3) m; ``picked``, sentences on tiers; apex
    (T, 3) m and axes (T, 3, 3) of the indenter, lowered until it touches the dented surface of the ``sensor``."""
    from tactile_core import sensors
    from tactile_core.mechanics.placement import Placement, pose_at
    from tactile_core.recordings.simulated import read_truth
    from tactile_core.simulation.scene import load_scene

    scene = load_scene(folder)[0]
    spec = scene.recording
    indenter = next(i for i in scene.indenters if i.name == spec.indenter).build()
    seconds, truth = read_truth(folder / "recording.h5")
    moved = truth.displacements
    columns = [(p.time_s, p.x_mm, p.z_mm) for p in spec.points]
    times, x, z = np.array(columns).T
    rest = sensors.sensor_surface(sensor).rest
    poses = []
    for k, second in enumerate(seconds):
        along, across = (1e-3 * np.interp(second, times, each) for each in (x, z))
        at = Placement(along, across, np.radians(spec.tilt_deg))
        pose = pose_at(sensor, indenter, at)
        nodes = rest + moved[sensor][k]
        for _ in range(STEPS if truth.force[k].any() else 0):
            pose = pose.moved(float(pose.distance(indenter, nodes)[0].min()))
        poses.append(pose)
    arrays = {"apex": np.array([pose.apex for pose in poses]), "axes": np.array([pose.axes for pose in poses])}
    arrays |= {"seconds": seconds, "force": truth.force}
    arrays["picked"] = np.array(picked, np.str_)
    np.savez(folder / "result.npz", **arrays, **{f"moved {name}": values for name, values in moved.items()})


def render(folder: Path, job: dict, progress: Progress) -> None:
    """Draw FOLDER/heights.npy (H, W) m to picture.npy (H, W, 3) uint8, for each line on stdin.

    A line is {"unit": name, "picture": number}; without a number the renderer only gets ready. Unit and surroundings
    are read from the folder when "unit" changes. Some presets write noisier pictures first.
    """
    renderer, known = None, None
    for line in sys.stdin:
        asked = json.loads(line)
        if renderer is None or asked["unit"] != known:
            renderer, known = _renderer(folder, job["preset"]), asked["unit"]
        if "picture" not in asked:  # it gets ready
            continue
        for picture in renderer.refined(np.load(folder / "heights.npy", allow_pickle=False)):
            np.save(folder / "partial.npy", picture)
            (folder / "partial.npy").replace(folder / "picture.npy")
            say(drawn=True)
        progress(asked["picture"], asked["picture"])


def _renderer(folder: Path, preset: str) -> Any:
    from tactile_core.pictures.mitsuba.gel_scene import Lamp, Occluder, Surroundings
    from tactile_core.pictures.renderer import Renderer
    from tactile_core.sensors.calibration_file import load_calibration

    lamps = [Lamp(**each) for each in json.loads((folder / "lamps.json").read_text(encoding="utf-8"))]
    with np.load(folder / "bodies.npz", allow_pickle=False) as stored:
        bodies = [Occluder(stored[f"vertices_{k}"], stored[f"faces_{k}"]) for k in range(len(stored.files) // 2)]
    around = Surroundings(tuple(lamps), tuple(bodies))
    if preset == "fast":
        around = Surroundings()
    return Renderer(load_calibration(folder / "unit.toml"), preset, surroundings=around)


def picture_scene(folder: Path, job: dict, progress: Progress) -> None:
    """Write a scene for Mitsuba of FOLDER/unit.toml and heights.npy, (H, W) m, to job["path"] (.xml). It is done here
    because it crashes inside a Blender that brings its own OpenEXR. progress : not used"""
    from tactile_core.pictures.mitsuba.scene_file import write_scene
    from tactile_core.sensors.calibration_file import load_calibration

    heights = np.load(folder / "heights.npy", allow_pickle=False)
    write_scene(job["path"], load_calibration(folder / "unit.toml"), heights)


def solve_gel(folder: Path, job: dict, progress: Progress) -> None:
    """Solve on the gel job["gel"] the contacts that networks found on the gel job["found_on"].

    job["ball"] : radius, m, of the ball that touched; None for one as curved as the dent
    Reads FOLDER/frames.npz: a translation's displacement_digit, contact_center, force, flags, expected_error_digit
    Writes FOLDER/gel.npz: displacement (T, n, 3) m, flags (T,), error (T,) m, expected, NaN where it is not known
    """
    from tactile_core.jobs import solved_gel

    say(stage=f"{_preparing(job['gel'])}, 1 of 2", done=0, total=1)
    solved_gel.prepare(job["gel"])
    say(stage="Solving the contacts, 2 of 2", done=0, total=1)
    with np.load(folder / "frames.npz") as stored:
        arrays = dict(stored)
    count, parts = len(arrays["flags"]), []
    for start in range(0, count, BLOCK):
        part = {name: values[start : start + BLOCK] for name, values in arrays.items()}
        found = solved_gel.solved(part, job["gel"], job["found_on"], job["ball"])
        parts.append((found["displacement_digit"], found["flags"], found[solved_gel.EXPECTED]))
        progress(min(start + BLOCK, count), count)
    moved, flags, error = map(np.concatenate, zip(*parts, strict=True))
    np.savez(folder / "gel.npz", displacement=moved, flags=flags, error=error)


def variant(folder: Path, job: dict, progress: Progress) -> None:
    """Write to FOLDER/variant.txt a sentence on which variant of Mitsuba this machine runs, and why."""
    from tactile_core.pictures.mitsuba.variant import LLVM, OLDEST_LLVM, choose_variant

    choice = choose_variant()
    works = choice.name == LLVM
    text = f"Mitsuba runs by LLVM: {choice.why}" if works else (
        f"Mitsuba traces one ray at a time, because {choice.why}; several times faster with LLVM {OLDEST_LLVM} or newer"
    )  # fmt: skip
    (folder / "variant.txt").write_text(text, encoding="utf-8")


def read(folder: Path, job: dict, progress: Progress) -> None:
    """Read a recording and write it as FOLDER/arrays.npz and about.json, for ``recording_reader``.

    job["path"] : its file; job["sensor"] : its sensor; job["columns"] : file that says what its columns are, or ""
    """
    from tactile_core import recordings
    from tactile_core.recordings.tables import column_map

    columns = column_map.read(job["columns"]) if job["columns"] else None
    found = recordings.read(job["path"], columns, job["sensor"])
    whole = {field.name: getattr(found, field.name) for field in dataclasses.fields(found)}
    whole["labels"] = {}  # texts of frames, which no part of Blender shows
    truth = whole.pop("truth")
    if truth is not None:
        held = {f"truth.{field.name}": getattr(truth, field.name) for field in dataclasses.fields(truth)}
        whole |= {name: values for name, values in held.items() if isinstance(values, np.ndarray)}
    arrays = {name: value for name, value in whole.items() if isinstance(value, np.ndarray)}
    np.savez(folder / "arrays.npz", **arrays)
    about = {name: value for name, value in whole.items() if name not in arrays}
    (folder / "about.json").write_text(json.dumps(about), encoding="utf-8")


LIFT = "Lift it there"
STEPS = 8  # of sinking by the free distance; each leaves a small part of it, far below a pixel after eight
BLOCK = 16  # frames whose contacts are solved between two reports
JOBS = {
    "simulate": simulate,
    "solve_gel": solve_gel,
    "render": render,
    "picture_scene": picture_scene,
    "read": read,
    "variant": variant,
}

if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
