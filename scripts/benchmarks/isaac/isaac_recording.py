"""The motion of a scene on a user's mesh, as Isaac Gym would have it: one HDF5 file of deformed meshes and forces.

Root attributes: ``format`` = "tactile-isaac-like-1", ``simulated`` = True, ``method``, ``youngs`` Pa, ``poisson``,
``scene`` (TOML text), ``made_by``. Datasets: ``nodes`` (n, 3) float64 m, ``cells`` (m, 4) int32, ``attached`` (n,)
bool; then T first: ``time`` (T,) s, ``displacement`` (T, n, 3) float32 m, ``force`` (T, 3) N of the indenter on the
sensor, ``depth`` (T,) m from first touch, ``contact`` (T, n) bool, ``converged`` (T,) bool. No electrodes: there is no
fluid.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator

import numpy as np

from tactile_core import __version__
from tactile_core.errors import TactileError
from tactile_core.files import atomic
from tactile_core.geometry.indenters import Pose
from tactile_core.mechanics.placement import Placement, biotac_pose, on_gel
from tactile_core.simulation.scene import RecordingSpec, load_scene

from .pressed_tets import SKIN, Press, Solution, attached_to, first_touch, near_body
from .tet_file import TetMesh, read_tet

FORMAT = "tactile-isaac-like-1"
RATE = 10.0  # Hz: a tenth of the sensor's, for each frame takes seconds
_FIRST_DEPTH = 0.2e-3  # m, where the search for a force begins on a mesh that is not yet touched


def simulate_isaac_like(
    scene_path: str | os.PathLike,
    tet_path: str | os.PathLike,
    out: str | os.PathLike,
    core_path: str | os.PathLike | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> int:
    """Press a BioTac skin of linear tetrahedra as the [recording] of a scene says, ten frames a second, into ``out``.

    tet_path : the skin in Isaac Gym's layout, in the frame of the public mesh; core_path : its rigid core, a closed
    triangle mesh; without it the nodes on our own table of the core are held, see ``pressed_tets.attached_to``
    progress : called with (frames done, frames). Returns how many frames did not reach their force; they are marked.
    Raises TactileError for what cannot be read or computed with, and for a place off the pad.
    """
    scene, text = load_scene(scene_path)
    spec = scene.recording
    if spec is None:
        raise TactileError(f"{scene_path}, recording", "missing", "a [recording] table")
    atomic.claim(out)
    mesh = read_tet(tet_path)
    attached = near_body(mesh, core_path) if core_path else attached_to("biotac", mesh)
    indenter = next(spec_.build() for spec_ in scene.indenters if spec_.name == spec.indenter)
    time, places, forces = _motion(scene_path, spec)
    poses = [biotac_pose(indenter, place) for place in places]
    frames = []
    for frame in _frames(Press(mesh, attached, indenter, poses[0]), mesh, poses, forces):
        frames.append(frame)
        if progress:
            progress(len(frames), len(time))
    attributes = {
        "format": FORMAT, "simulated": True, "method": frames[0].report["method"], "scene": text,
        "youngs": SKIN.youngs, "poisson": SKIN.poisson, "made_by": f"tactile {__version__}",
    }  # fmt: skip
    arrays = {
        "nodes": mesh.nodes, "cells": mesh.cells.astype(np.int32), "attached": attached, "time": time,
        "displacement": np.stack([frame.displacement for frame in frames]).astype(np.float32),
        "force": np.stack([frame.force for frame in frames]).astype(np.float32),
        "depth": np.array([frame.depth for frame in frames]),
        "contact": np.stack([frame.contact_patch for frame in frames]),
        "converged": np.array([frame.converged for frame in frames]),
    }  # fmt: skip
    _write(out, attributes, arrays)
    return int((~arrays["converged"]).sum())


def _motion(where: str | os.PathLike, spec: RecordingSpec) -> tuple[np.ndarray, list[Placement], np.ndarray]:
    """Interpolate time (T,) s, places, force (T,) N linearly between the scene's points."""
    points = np.array([[p.time_s, p.x_mm * 1e-3, p.z_mm * 1e-3, p.force_n] for p in spec.points])
    time = np.arange(np.ceil(points[0, 0] * RATE - 1e-9), np.floor(points[-1, 0] * RATE + 1e-9) + 1) / RATE
    if not len(time):
        found = f"no multiple of {1 / RATE:g} s from {points[0, 0]:g} to {points[-1, 0]:g} s"
        raise TactileError(f"{where}, recording.points", found, "a longer motion")
    x, z, force = (np.interp(time, points[:, 0], points[:, k]) for k in (1, 2, 3))
    for k in np.flatnonzero(force > 0):
        if not on_gel(x[k], z[k]):
            found = f"({x[k] * 1e3:g}, {z[k] * 1e3:g}) mm at {time[k]:g} s"
            raise TactileError(f"{where}, recording.points", found, "places on the DIGIT's gel")
    return time, [Placement(a, b, np.radians(spec.tilt_deg)) for a, b in zip(x, z, strict=True)], force


def _frames(press: Press, mesh: TetMesh, poses: list[Pose], forces: np.ndarray) -> Iterator[Solution]:
    """Yield one solution a frame, each started from the one before."""
    depth: float | None = None  # of the frame before, where it touched
    for pose, force in zip(poses, forces, strict=True):
        if force == 0:
            press.lift(pose)
            depth = None
            yield press.solution(0.0)
            continue
        pose = first_touch(mesh, press.indenter, pose)
        if depth is None:
            press.lift(pose)
        solution = press.at_force(pose, force, depth or _FIRST_DEPTH)
        # What went wrong in a frame must not spoil the next one.
        depth = solution.depth if solution.converged else None
        yield solution


def _write(out: str | os.PathLike, attributes: dict, arrays: dict[str, np.ndarray]) -> None:
    import h5py

    memory = io.BytesIO()  # HDF5 crashes at the process's end where a full disk stops its own writing
    with h5py.File(memory, "w") as file:
        file.attrs.update(attributes)
        for name, values in arrays.items():
            file.create_dataset(name, data=values, compression="gzip", shuffle=True, track_times=False)
    with atomic.writing(out, "room in a folder that can be written to", ""):
        atomic.write_bytes(out, memory.getvalue())
