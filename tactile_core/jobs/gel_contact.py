"""Contacts of a ``Gel``, and the pose and force that are asked for. Poses come as simulators give them: 4 x 4 matrices,
or a position and a quaternion."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import TactileError, finite_number
from ..files.short_text import Summary
from ..geometry.indenters import Pose
from ..mechanics.force_search import MOST_FORCE

PUSH = np.array([0.0, 1.0, 0.0])  # into the gel: along +y of the sensors' frame
# Farther, or turned by more, in one step a contact is another, assumed: at 100 Hz that is 0.3 m/s and 2 turns per s.
_LONGEST_STEP, _LARGEST_TURN = 3e-3, 0.13  # m, rad
FLAGS = {
    "refused": "in follow: what was given is no pose or force; the values are those of the contact before",
    "unsolved": "no equilibrium was found; the values are those of the contact before",
    "too deep": "the pose lies deeper than 60 % of the thickness; the values are those at that depth",
    "force not reached": "no depth bears the force; the values are those of the nearest contact that was solved",
    "began inside": "the first pose lies in the gel; the indenter was taken to come straight in along +y",
    "too large": "so many nodes touch that the step's work was used up; the values are those of the nearest contact "
    "that was found, and the next step goes on from there",
    "too sharp": "a tip, edge or wire is so thin that it sinks in between the surface's nodes: .35 mm apart on the "
    "DIGIT, .5 to .9 on the BioTac",
    "friction forgotten": "no equilibrium was found on the path; the indenter was taken to come straight in along +y",
    "jumped": "the step is too long, or of another indenter or friction, to go on from the contact before; friction "
    "was forgotten, and the indenter taken to come in along +y",
}


@dataclasses.dataclass(frozen=True, repr=False)
class GelContact(Summary):
    """A contact of a ``Gel``, SI units, in the sensor's frame; n surface nodes.

    force : (3,) N, exerted by the indenter; displacement : (n, 3) m of the nodes
    traction : (n, 3) Pa; its sum, weighted with the nodes' areas (n,) m2 (``Gel.areas``), is the force
    patch : (n,) bool, true for nodes that carry force; slipping : share of these at the limit of friction
    depth : m, past first touch along +y; below zero the indenter stands in front of the sensor
    pressure : Pa, rise of the BioTac's fluid pressure; 0 for the DIGIT
    pose : (4, 4) of the indenter; if a force was asked for, where it bears that
    flags : names of what is wrong with the contact, such as "too deep", explained in ``FLAGS``; () for a sound one"""

    force: np.ndarray
    displacement: np.ndarray
    traction: np.ndarray
    patch: np.ndarray
    slipping: float
    depth: float
    pressure: float
    pose: np.ndarray
    flags: tuple[str, ...] = ()

    @classmethod
    def untouched(cls, count: int, pose: Pose) -> GelContact:
        """Return the contact of an indenter at a pose that touches none of `count` surface nodes; its depth is 0."""
        none, patch = np.zeros((count, 3)), np.zeros(count, bool)
        return cls(np.zeros(3), none, none.copy(), patch, 0.0, 0.0, 0.0, matrix_of(pose))


def too_far(before: Pose | None, pose: Pose) -> bool:
    """Return true if a pose is over 3 mm or 0.13 rad from the one before: too far to go on with its contact."""
    if before is None:
        return False
    turn = np.arccos(np.clip((np.trace(pose.axes.T @ before.axes) - 1) / 2, -1, 1))
    return bool(np.linalg.norm(pose.apex - before.apex) > _LONGEST_STEP or turn > _LARGEST_TURN)


def given(pose: Any, force: float | None) -> tuple[Pose, float | None]:
    """Return an indenter's pose and force, N, or None, after checking them. force : N, None if none is asked for
    pose : (4, 4) matrix, or (position (3,) m, quaternion (4,) w, x, y, z). Raises TactileError for invalid ones."""
    if force is not None:
        force = finite_number(force, "Gel, force", "newtons, zero or more, and finite", 0.0)
        if force > MOST_FORCE:
            found = f"at most {MOST_FORCE:g} N, more than a plate bears at the greatest depth"
            raise TactileError("Gel, force", f"{force:g} N", found, "Press less, or to a pose")
    return Pose(*_rigid(pose), PUSH), force


def matrix_of(pose: Pose) -> np.ndarray:
    """Return a pose as a matrix (4, 4): axes in its columns, apex, m, in the last one."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.axes, pose.apex
    return matrix


# Single precision and a quaternion of four decimals stay below this; what is farther off is scaled or sheared.
_RIGID = 1e-3
_LAST_ROW, _ROUNDING = np.array([0.0, 0.0, 0.0, 1.0]), 1e-6  # of single precision
_FARTHEST = 1.0  # m from the sensor's origin; farther off a pose is in millimetres or in another frame (assumed)


def _rigid(pose: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the origin (3,) m and axes (3, 3), as columns, of a pose in the sensor's frame.

    pose : (4, 4) matrix, or (position (3,) m, quaternion (4,) w, x, y, z), as MuJoCo and Isaac order it
    Raises TactileError for another shape, numbers that are not finite, scale, shear, mirroring, and places beyond 1 m.
    """
    if isinstance(pose, Sequence) and len(pose) == 2:
        origin, turn = _array(pose[0], (3,), "position"), _array(pose[1], (4,), "quaternion")
        axes = _from_quaternion(turn)
    else:
        matrix = _array(pose, (4, 4), "matrix")
        if np.abs(matrix[3] - _LAST_ROW).max() > _ROUNDING:
            raise TactileError("pose, last row", f"{matrix[3].tolist()}", "0, 0, 0, 1", "Transpose the matrix")
        origin, axes = matrix[:3, 3].copy(), _orthonormal(matrix[:3, :3])
    if np.abs(origin).max() > _FARTHEST:
        found = f"{origin.tolist()} m"
        raise TactileError("pose, position", found, "metres in the sensor's frame", "Divide millimetres by 1000")
    return origin, axes


def _array(values: Any, shape: tuple[int, ...], name: str) -> np.ndarray:
    try:
        array = np.array(values, float)
    except (TypeError, ValueError) as error:
        raise TactileError(f"pose, {name}", f"{values!r}", f"numbers of shape {shape}") from error
    if array.shape != shape:
        expected = f"{shape}; a pose is a 4 x 4 matrix or (position, quaternion)"
        raise TactileError(f"pose, {name}", f"shape {array.shape}", expected)
    if not np.isfinite(array).all():
        raise TactileError(f"pose, {name}", f"{array.tolist()}", "finite numbers", "Skip the step, or repair the pose")
    return array


def _from_quaternion(quaternion: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(quaternion)
    if abs(length - 1) > _RIGID:
        found = f"length {length:.4g}"
        raise TactileError("pose, quaternion", found, "a unit quaternion (w, x, y, z)", "Divide it by its length")
    w, x, y, z = quaternion / length
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def _orthonormal(axes: np.ndarray) -> np.ndarray:
    """Return the rotation nearest to ``axes`` (3, 3), which may differ from it only by rounding."""
    off = np.abs(axes.T @ axes - np.eye(3)).max()
    if off > _RIGID:
        size = ", ".join(f"{length:.4g}" for length in np.linalg.norm(axes, axis=0))
        found = f"lengths {size}, off a rotation by {off:.2g}"
        raise TactileError("pose, axes", found, "a rotation, without scale or shear", "Scale the mesh instead")
    left, _, right = np.linalg.svd(axes)
    turn = left @ right
    if np.linalg.det(turn) < 0:
        raise TactileError("pose, axes", "a mirror image", "a rotation", "Mirror the mesh instead")
    return turn
