"""Contact as Isaac Gym computed it: linear tetrahedra, co-rotated linear law, no fluid, on a mesh the user gives.

For those who hold data made that way. Linear tetrahedra lock (docs/sources.md, Mechanics): forces come out about twice
too high on the public BioTac mesh, which the published modulus does not undo. Differences to Isaac Gym that remain:
equilibrium is found exactly instead of stepped in time, and there is no friction.
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
from tactile_core.mechanics.finite_strain.solved_contact import ContactState
from tactile_core.mechanics.pose_path import between
from tactile_core.sensors import Material, biotac, digit

from .corotated_tets import CorotatedTets
from .tet_file import TetMesh

SKIN = Material(youngs=1.552e6, poisson=0.316)  # fitted on such a mesh by Narang et al. (docs/sources.md, BioTac skin)
MAX_DEPTH = 2.5e-3  # m: the fluid's greatest depth under the pad (docs/sources.md), for the core's contact is left out
LOAD_STEP = 0.3e-3  # m, as for the BioTac's own mesh
_ON_CORE = 0.02e-3  # m, nodes this close to the core are glued to it, as in hex_mesh: 532 nodes of the public mesh
_BASE_CAP_X = 4.9e-3  # m, the inner base cap rests on the core (public mesh)
_ON_BACK = 0.01e-3  # m, of the DIGIT's flat back (assumed; the public mesh's back is flat to 1 nm)
_FAR = 50e-3  # m, an indenter that meets nothing within this way misses the sensor
_FORCE_TOLERANCE, _SEARCH_STEPS = 1e-3, 12  # relative, of the search for a force


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


def attached_to(sensor: str, mesh: TetMesh) -> np.ndarray:
    """Mark nodes (n,) bool of a mesh in the sensors' frame that are glued to the BioTac's core or to the DIGIT's back.

    The core is our own table of it: on the public mesh 354 nodes, of which 294 are among the 532 that ``near_body``
    finds with the core's own mesh; the others lie on the far side and at the base.
    Raises TactileError where that leaves too few to hold the mesh or none to move: it stands in another frame.
    """
    x, y, z = mesh.nodes.T
    if sensor == "digit":
        return _held(sensor, y > digit.BACK_Y - _ON_BACK)
    radius = np.hypot(y - biotac.AXIS_Y, z)
    core = biotac.core_radius(x, np.arctan2(z, biotac.AXIS_Y - y))
    on_core = (np.nan_to_num(core, nan=-1.0) >= radius - _ON_CORE) | (x > _BASE_CAP_X)
    boundary = np.isin(np.arange(len(x)), mesh.surface)
    return _held(sensor, on_core & boundary & _on_inner_side(mesh.nodes))


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


def _on_inner_side(nodes: np.ndarray) -> np.ndarray:
    """Nodes nearer to the inner than to the outer skin."""
    import scipy.spatial

    inner, outer = (
        scipy.spatial.cKDTree(biotac.skin_surface(layer).rest).query(nodes)[0] for layer in ("inner", "outer")
    )
    return inner < outer


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


class Press:
    """An indenter that presses a mesh here and there; each contact goes on from the last one that was solved."""

    def __init__(
        self, mesh: TetMesh, attached: np.ndarray, indenter: Indenter, pose: Pose, material: Material = SKIN
    ) -> None:
        """Take attached : (n,) bool, nodes that do not move; pose : clear of the mesh, or at first touch."""
        self.solid = CorotatedTets(mesh, attached, material)
        skin = np.setdiff1d(mesh.surface, np.flatnonzero(attached))
        self.indenter = indenter
        self.contact = FiniteStrainContact(self.solid, skin, indenter, pose)
        self.last: ContactState = self.contact.start()

    def lift(self, pose: Pose) -> None:
        """Take the indenter off and put it at another pose, clear of the mesh."""
        self.last = dataclasses.replace(self.contact.start(), pose=pose)

    def at_depth(self, pose: Pose, depth: float) -> Solution:
        """The contact ``depth`` m beyond the first touch at ``pose``.

        Not converged, and as deep as it went, where equilibrium ends before. Raises TactileError for a depth that is no
        number from 0 to MAX_DEPTH.
        """
        if not 0 <= depth <= MAX_DEPTH:
            found, expected = f"{depth * 1e3:g} mm", f"0 to {MAX_DEPTH * 1e3:g} mm"
            raise TactileError("isaac-like press, depth", found, expected, "Contact with the core is not modelled")
        begin, goal, ended = self.last.pose, pose.moved(depth), ""
        count = max(int(np.ceil(np.linalg.norm(goal.apex - begin.apex) / LOAD_STEP - 1e-6)), 1)
        for part in np.arange(1, count + 1) / count:
            try:
                self.last = self.contact.move(between(begin, goal, part), self.last, LOAD_STEP)
            except TactileError as error:
                ended = str(error)
                break
        reached = float((self.last.pose.apex - pose.apex) @ pose.direction) if ended else depth
        return self.solution(reached, ended)

    def at_force(self, pose: Pose, force: float, guess: float = 0.2e-3) -> Solution:
        """The contact of an axial force, N, with the first touch at ``pose``; ``guess`` m of its depth.

        Not converged where no depth up to MAX_DEPTH gives it.
        """
        goal, depth = force ** (2 / 3), guess
        low, high = (0.0, 0.0), None
        for _ in range(_SEARCH_STEPS):  # regula falsi on F^(2/3), nearly straight in the depth
            solution = self.at_depth(pose, depth)
            found = max(float(solution.force @ pose.direction), 0.0)
            if not solution.converged or abs(found - force) <= _FORCE_TOLERANCE * force:
                return solution
            root = found ** (2 / 3)
            if root < goal:
                low = (depth, root)
            else:
                high = (depth, root)
            if high is not None:
                depth = low[0] + (goal - low[1]) * (high[0] - low[0]) / (high[1] - low[1])
            else:
                grown = depth * goal / max(root, 1e-12)
                depth = min(max(grown, 1.05 * depth), depth + LOAD_STEP, MAX_DEPTH)
        return dataclasses.replace(solution, converged=False)

    def solution(self, depth: float, ended: str = "") -> Solution:
        """The last contact, ``depth`` m from first touch; ``ended`` : why it went no deeper."""
        touch, mesh = self.last, self.solid.mesh
        report = {
            "method": "isaac-like: linear tetrahedra, co-rotated linear law, no fluid, no friction",
            "nodes": len(mesh.nodes), "cells": len(mesh.cells), "attached": int(mesh.clamped.sum()),
            "touching": len(touch.nodes), "iterations": touch.iterations, "ended": ended,
        }  # fmt: skip
        patch = np.zeros(len(mesh.nodes), bool)
        patch[touch.nodes] = True
        return Solution(touch.state.displacement, touch.force, patch, depth, not ended, report)


def press(
    mesh: TetMesh, attached: np.ndarray, indenter: Indenter, pose: Pose, depth: float, material: Material = SKIN
) -> Solution:
    """Press an indenter into a mesh, ``depth`` m beyond first touch, which may lie off ``pose`` along its motion.

    attached : (n,) bool, nodes that do not move. Raises TactileError for an indenter that misses the mesh and for a
    depth that is no number from 0 to MAX_DEPTH.
    """
    touching = first_touch(mesh, indenter, pose)
    return Press(mesh, attached, indenter, touching, material).at_depth(touching, depth)
