"""A contact of a ``Gel``, and the pose and force that it is asked for."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..errors import TactileError
from ..files.short_text import Summary
from ..geometry.indenters import Pose
from ..geometry.indenters.rigid_pose import rigid_pose
from ..mechanics.force_search import MOST_FORCE

PUSH = np.array([0.0, 1.0, 0.0])  # into the gel: along +y of the sensors' frame
# Farther, or turned by more, in one step a contact is another one, assumed: at 100 Hz that is 0.3 m/s and 2 turns a s.
_LONGEST_STEP, _LARGEST_TURN = 3e-3, 0.13  # m, rad
FLAGS = {
    "refused": "in follow: what was given is no pose or force; the values are those of the contact before",
    "unsolved": "no equilibrium was found; the values are those of the contact before",
    "too deep": "the pose lies deeper than 60 % of the thickness; the values are those at that depth",
    "force not reached": "no depth bears the force; the values are those of the nearest contact that was solved",
    "began inside": "the first pose lies in the gel; the indenter was taken to come straight in along +y",
    "too large": "so many nodes touch that the step's work was used up; the values are those of the nearest contact "
    "that was found, and the next step goes on from there",
    "friction forgotten": "no equilibrium was found on the path; the indenter was taken to come straight in along +y",
    "jumped": "the step is too long to follow; friction was forgotten, and the indenter taken to come in along +y",
}


@dataclasses.dataclass(frozen=True, repr=False)
class GelContact(Summary):
    """A contact of a ``Gel``, SI units, in the sensor's frame; n surface nodes.

    force : (3,) N, exerted by the indenter; displacement : (n, 3) m of the surface
    traction : (n, 3) Pa; times the nodes' areas (n,) m2, ``Gel.areas``, and added up it is the force
    patch : (n,) bool, the nodes that carry force; slipping : share of them whose friction is spent
    depth : m, past first touch along +y; below zero the indenter stands in front of the sensor
    pressure : Pa, rise of the BioTac's fluid pressure; 0 for the DIGIT
    pose : (4, 4), where the indenter stands, deeper than the pose given where a force was asked for
    flags : names out of ``FLAGS`` of what is wrong with it, none for a sound contact
    """

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
        """Return the contact of an indenter that touches none of so many nodes."""
        none, patch = np.zeros((count, 3)), np.zeros(count, bool)
        return cls(np.zeros(3), none, none.copy(), patch, 0.0, 0.0, 0.0, matrix_of(pose))


def too_far(before: Pose | None, pose: Pose) -> bool:
    """Return true where a step is so long, or turns so far, that the contact is another one."""
    if before is None:
        return False
    turn = np.arccos(np.clip((np.trace(pose.axes.T @ before.axes) - 1) / 2, -1, 1))
    return bool(np.linalg.norm(pose.apex - before.apex) > _LONGEST_STEP or turn > _LARGEST_TURN)


def given(pose: Any, force: float | None) -> tuple[Pose, float | None]:
    """Return where an indenter is to stand, and with which force, N. Raises TactileError for no pose or force."""
    if force is not None:
        force = not_negative(force, "Gel, force", "newtons, zero or more, and finite")
        if force > MOST_FORCE:
            found = f"at most {MOST_FORCE:g} N, more than a plate bears at the greatest depth"
            raise TactileError("Gel, force", f"{force:g} N", found, "Press less, or to a pose")
    return Pose(*rigid_pose(pose), PUSH), force


def not_negative(value: Any, where: str, expected: str) -> float:
    """Return the value as a float; raises TactileError unless it is a finite number of zero or more."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not (np.isfinite(number) and number >= 0):
        raise TactileError(where, repr(value), expected)
    return number


def matrix_of(pose: Pose) -> np.ndarray:
    """Return a pose as a matrix (4, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.axes, pose.apex
    return matrix
