"""The answer turns with sensor and indenter, and mirrors with them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.geometry.indenters import Pose, Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.finite_strain.solved_contact import ContactState
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.sensors import Material

from .block import block

TARGET = 1e-8  # of the depth: Newton's method stops at a balance of 1e-8 and is quadratic, so that this is generous
FRICTION_TARGET = 1e-5  # with friction it stops at a balance of 1e-6 and converges linearly
_DEPTH, _THICKNESS = 0.3e-3, 1.5e-3  # m
_ACROSS = 9  # nodes
_PLACE = np.array([0.31e-3, -_THICKNESS, 0.17e-3])
_MATERIAL = Material(1e6, 0.48)


def turned(rotation: np.ndarray, place: np.ndarray = _PLACE, friction: float = 0.0) -> ContactState:
    """A ball on a block, all of it turned by ``rotation`` (3, 3)."""
    across = np.linspace(-2e-3, 2e-3, _ACROSS)
    mesh = block(across, -np.linspace(0, _THICKNESS, 5), across)
    ball = Sphere(1.5e-3)
    pose = pose_on(ball, place, np.array([0, -1.0, 0]))
    mesh = dataclasses.replace(mesh, nodes=mesh.nodes @ rotation.T)
    contact = FiniteStrainContact(
        FiniteStrainSolid(mesh, _MATERIAL), mesh.surface, ball, Pose(rotation @ pose.apex, rotation @ pose.axes),
        friction=friction,
    )  # fmt: skip
    return contact.press(_DEPTH, step=_DEPTH / 2)


def turning_error(friction: float = 0.0) -> tuple[float, float]:
    """Largest difference of a turned problem's result to the turned result: displacement over depth, force relative."""
    cosine, sine = np.cos(0.7), np.sin(0.7)
    about_x = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    rotation = about_x @ np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    there, here = turned(rotation, friction=friction), turned(np.eye(3), friction=friction)
    moved = there.state.displacement @ rotation - here.state.displacement
    pull = there.force @ rotation - here.force
    return float(np.abs(moved).max() / _DEPTH), float(np.abs(pull).max() / np.linalg.norm(here.force))


def mirror_error() -> tuple[float, float]:
    """Largest difference between the result at the mirrored place and the mirrored result."""
    flip = np.array([-1.0, 1.0, 1.0])
    there, here = turned(np.eye(3), _PLACE * flip), turned(np.eye(3))
    grid = here.state.displacement.reshape(_ACROSS, _ACROSS, 5, 3)
    image = there.state.displacement.reshape(grid.shape)[::-1] * flip
    pull = there.force * flip - here.force
    return float(np.abs(image - grid).max() / _DEPTH), float(np.abs(pull).max() / np.linalg.norm(here.force))


def spin_stress() -> float:
    """Largest force of a body that only turns, over youngs times the square of its size."""
    solid = FiniteStrainSolid(block(*[np.linspace(-1e-3, 1e-3, 5) * sign for sign in (1, -1, 1)]), _MATERIAL)
    cosine, sine = np.cos(2.0), np.sin(2.0)
    rotation = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    state = solid.rest()
    state.displacement = solid.mesh.nodes @ rotation.T - solid.mesh.nodes
    return float(np.abs(solid.linearise(state).internal_force()).max() / (_MATERIAL.youngs * 4e-6))


def rows(quick: bool) -> Iterator[Row]:
    """Turned, mirrored, and turned without load."""
    of = "1.5 mm ball 0.3 mm into a block of 1.5 mm"
    for name, (moved, pull), target in (
        ("turned", turning_error(), TARGET),
        ("turned_friction", turning_error(0.5), FRICTION_TARGET),
        ("mirrored", mirror_error(), TARGET),
    ):
        yield row(f"{name}_displacement_error", moved, "1", target, baseline=1.0, of=of)
        yield row(f"{name}_force_error", pull, "1", target, baseline=1.0, of=of)
    yield row("rigid_rotation_force", spin_stress(), "1", 1e-12, of="block turned by 2 rad; rounding")
