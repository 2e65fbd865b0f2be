"""Contact as Isaac Gym computed it: linear tetrahedra, co-rotated linear law, no fluid, on the public meshes.

A benchmark of what data made that way are off by. Linear tetrahedra lock (docs/sources.md, Mechanics): forces come out
about twice too high on the public BioTac mesh, which the published modulus does not undo. Differences to Isaac Gym that
remain: equilibrium is found exactly instead of stepped in time, and there is no friction.
"""

from __future__ import annotations

import dataclasses
import io
import os
import pathlib
from typing import Any

import numpy as np

from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Indenter, Pose, mesh_file
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.pose_path import between
from tactile_core.sensors import Material, digit

from .corotated_tets import CorotatedTets
from .tet_file import TetMesh

SKIN = Material(youngs=1.552e6, poisson=0.316)  # fitted on such a mesh by Narang et al. (docs/sources.md, BioTac skin)
MAX_DEPTH = 2.5e-3  # m: the fluid's greatest depth under the pad (docs/sources.md), for the core's contact is left out
LOAD_STEP = 0.3e-3  # m, as for the BioTac's own mesh
_ON_CORE = 0.02e-3  # m, nodes this close to the core are glued to it, as in hex_mesh: 532 nodes of the public mesh
_ON_BACK = 0.01e-3  # m, of the DIGIT's flat back (assumed; the public mesh's back is flat to 1 nm)
_FAR = 50e-3  # m, an indenter that meets nothing within this way misses the sensor


@dataclasses.dataclass(frozen=True)
class Solution:
    """A solved contact, SI units.

    displacement : (n, 3) m of all nodes of the mesh; force : (3,) N of the indenter on the sensor
    contact_patch : (n,) bool, nodes that carry force; depth : m from first touch that was reached
    converged : whether that is the depth asked for
    report : plain values for a file: law, numbers of nodes and steps, why it ended early
    """

    displacement: np.ndarray
    force: np.ndarray
    contact_patch: np.ndarray
    depth: float
    converged: bool
    report: dict[str, Any]


def on_back(mesh: TetMesh) -> np.ndarray:
    """Mark nodes (n,) bool of a DIGIT's mesh in the sensors' frame that are glued to the gel's back.

    Raises TactileError where that leaves too few to hold the mesh or none to move: it stands in another frame.
    """
    return _held("digit", mesh.nodes[:, 1] > digit.BACK_Y - _ON_BACK)


def near_body(mesh: TetMesh, path: str | os.PathLike) -> np.ndarray:
    """Mark nodes (n,) bool in or within 0.02 mm of a rigid body, a closed triangle mesh in metres (OBJ, STL, PLY).

    Raises TactileError for a file that is no such mesh, or that touches too few nodes or all.
    """
    import trimesh

    kind = pathlib.Path(path).suffix[1:].lower()
    try:
        content, options = mesh_file.read_bytes(path), {"skip_materials": True} if kind == "obj" else {}
        body = trimesh.load(io.BytesIO(content), file_type=kind, force="mesh", process=True, **options)
        closed = len(body.faces) > 3 and body.is_watertight
    except TactileError:
        raise
    except Exception as error:  # trimesh raises what its many readers raise
        raise TactileError(path, f"cannot be read ({error})", "a triangle mesh, such as core.obj") from error
    if not closed:
        raise TactileError(path, "the mesh is not closed", "a closed triangle mesh", "Close its holes")
    body.apply_scale(1e3)  # in metres trimesh takes nearby places for one (docs/sources.md, Mechanics)
    return _held("core", trimesh.proximity.signed_distance(body, mesh.nodes * 1e3) >= -_ON_CORE * 1e3)


def _held(what: str, held: np.ndarray) -> np.ndarray:
    if not 3 <= held.sum() < len(held):
        found = f"{int(held.sum())} of {len(held)} nodes lie on the rigid part of the {what}"
        expected = "a mesh in the frame of the public ones: x along the finger, -y out of the pad"
        raise TactileError("isaac-like mesh", found, expected)
    return held


def first_touch(mesh: TetMesh, indenter: Indenter, pose: Pose) -> Pose:
    """The pose moved along its direction to where the indenter first touches a node of the mesh.

    Raises TactileError for an indenter that misses it.
    """
    nodes = mesh.nodes[np.unique(mesh.surface)]
    way = -_FAR / 2
    while way < _FAR / 2:
        gap = float(pose.moved(way).distance(indenter, nodes)[0].min())
        if gap < 1e-9:
            return pose.moved(way)
        way += gap  # no node can be nearer than that: the body never goes through one
    raise TactileError("isaac-like press", "the indenter misses the mesh", "a pose in front of it")


def press(
    mesh: TetMesh, attached: np.ndarray, indenter: Indenter, pose: Pose, depth: float, material: Material = SKIN
) -> Solution:
    """Press an indenter into a mesh, ``depth`` m beyond first touch, which may lie off ``pose`` along its motion.

    attached : (n,) bool, nodes that do not move. Not converged, and as deep as it went, where equilibrium ends before.
    Raises TactileError for an indenter that misses the mesh and for a depth that is no number from 0 to MAX_DEPTH.
    """
    if not 0 <= depth <= MAX_DEPTH:
        found, expected = f"{depth * 1e3:g} mm", f"0 to {MAX_DEPTH * 1e3:g} mm"
        raise TactileError("isaac-like press, depth", found, expected, "Contact with the core is not modelled")
    touching = first_touch(mesh, indenter, pose)
    skin = np.setdiff1d(mesh.surface, np.flatnonzero(attached))
    contact = FiniteStrainContact(CorotatedTets(mesh, attached, material), skin, indenter, touching)
    last, ended, goal = contact.start(), "", touching.moved(depth)
    count = max(int(np.ceil(depth / LOAD_STEP - 1e-6)), 1)
    for part in np.arange(1, count + 1) / count:
        try:
            last = contact.move(between(touching, goal, part), last, LOAD_STEP)
        except TactileError as error:
            ended = str(error)
            break
    reached = float((last.pose.apex - touching.apex) @ touching.direction) if ended else depth
    report = {
        "method": "isaac-like: linear tetrahedra, co-rotated linear law, no fluid, no friction",
        "nodes": len(mesh.nodes), "cells": len(mesh.cells), "attached": int(attached.sum()),
        "touching": len(last.nodes), "iterations": last.iterations, "ended": ended,
    }  # fmt: skip
    patch = np.zeros(len(mesh.nodes), bool)
    patch[last.nodes] = True
    return Solution(last.state.displacement, last.force, patch, reached, not ended, report)
