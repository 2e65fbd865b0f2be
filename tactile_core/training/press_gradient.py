"""Presses of an indenter in torch: poses and forces in, displacements out, with gradients by both.

poses = moved(gel.touching(x=-8e-3, z=0.0, depth=0.4e-3), motions)     # (B, 6) m and rad -> (B, 4, 4)
displacement, force = pressed("digit", Sphere(3e-3), poses)            # (B, n, 3) m, (B, 3) N
BatchPictures(load_translator()).pictures(displacement)                # (B, 320, 240, 3), 0 to 1
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ..errors import TactileError
from ..files.installed import needing
from ..geometry.indenters import Indenter, Pose, as_indenter
from ..geometry.indenters.rigid_pose import rigid_pose
from ..mechanics.placement import FRICTION
from ..mechanics.pose_derivative import MOTIONS, pose_derivative
from ..mechanics.straight_press import straight_press
from ..sensors import sensor_surface

PUSH = np.array([0.0, 1.0, 0.0])  # into the gel, as `Gel` pushes: along +y of the sensor's frame


def moved(pose: Any, motions: Tensor) -> Tensor:
    """Return the poses (B, 4, 4) of an indenter moved from a ``pose`` (4, 4) by motions (B, 6).

    motions : m along the sensor's x, y and z, and a rotation vector, rad, about the indenter's own origin
    """
    start = torch.as_tensor(np.asarray(pose)).to(motions)
    turn = torch.linalg.matrix_exp(_crossed(motions[:, 3:])) @ start[:3, :3]
    upper = torch.cat([turn, (start[:3, 3] + motions[:, :3])[..., None]], -1)
    return torch.cat([upper, start[3:].expand(len(motions), 1, 4)], 1)


@needing("fem")
def pressed(
    sensor: str, indenter: Any, poses: Tensor, forces: Tensor | None = None, *, friction: float = FRICTION
) -> tuple[Tensor, Tensor]:
    """Press an indenter straight in along +y, each pose by itself: displacements (B, n, 3) m and forces (B, 3) N.

    The fast tier's contacts, as ``Gel.press`` finds them from nothing. Gradients lead back to poses and forces, with
    what touches, sticks and slips held: where that is about to change they are one side's.

    sensor : its name; indenter : of ``tactile.indenters``, or a closed ``trimesh.Trimesh``, m
    poses : (B, 4, 4) of the indenter's origin and axes, as ``moved`` makes them; where nothing touches nothing moves
    forces : (B,) N along +y, found to a thousandth by moving on along it; None for the depths of the poses
    Raises TactileError for what is no pose or force, where no contact is found, and with gradients for contacts on
    more than one face; UnreachableError beyond 60 % of the thickness. Each says which pose.

    >>> poses = moved(gel.touching(x=-8e-3, z=0.0), motions)
    >>> displacement, force = pressed("digit", Sphere(3e-3), poses)
    """
    if poses.ndim != 3 or (forces is not None and forces.shape != poses.shape[:1]):
        found = f"{tuple(poses.shape)} and {None if forces is None else tuple(forces.shape)}"
        raise TactileError("pressed, shapes of poses and forces", found, "(B, 4, 4), and (B,) or None")
    return _Pressed.apply(poses, forces, sensor, as_indenter(indenter), friction)


class _Pressed(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, poses: Tensor, forces: Tensor | None, sensor: str, indenter: Indenter, friction: float
    ) -> tuple[Tensor, Tensor]:
        given: Sequence[float | None] = [None] * len(poses) if forces is None else forces.double().tolist()
        rest, inputs = sensor_surface(sensor).rest, MOTIONS + (forces is not None)
        moves, bears = np.zeros((len(poses), *rest.shape)), np.zeros((len(poses), 3))
        differentiates = any(ctx.needs_input_grad[:2])
        by = np.zeros((len(poses), *rest.shape, inputs)), np.zeros((len(poses), 3, inputs))
        for k, (pose, force) in enumerate(zip(poses.double().cpu().numpy(), given, strict=True)):
            try:
                straight = straight_press(sensor, indenter, Pose(*rigid_pose(pose), PUSH), force, friction)
                if straight is None:
                    continue
                moves[k], bears[k] = straight.found.corrected.displacement, straight.found.force
                if differentiates:
                    found = pose_derivative(straight)
                    by[0][k], by[1][k] = found if force is None else found.at_force(PUSH)
            except TactileError as error:
                where = f"pressed, poses[{k}]: {error.where}"
                raise type(error)(where, error.found, error.expected, error.advice) from error
        if differentiates:
            ctx.save_for_backward(poses, *(torch.from_numpy(each).to(poses) for each in by))
        return torch.from_numpy(moves).to(poses), torch.from_numpy(bears).to(poses)

    @staticmethod
    def backward(ctx: Any, of_moves: Tensor, of_bears: Tensor) -> tuple[Tensor | None, ...]:
        poses, moves_by, bears_by = ctx.saved_tensors
        gradient = torch.einsum("bnik,bni->bk", moves_by, of_moves) + torch.einsum("bik,bi->bk", bears_by, of_bears)
        by_poses = torch.zeros_like(poses)
        # A turn w changes the axes R by [w] R; of all matrices whose product with that is g w this one keeps to turns.
        by_poses[:, :3, :3] = 0.5 * _crossed(gradient[:, 3:MOTIONS]) @ poses[:, :3, :3]
        by_poses[:, :3, 3] = gradient[:, :3]
        return by_poses, gradient[:, MOTIONS] if gradient.shape[1] > MOTIONS else None, None, None, None


def _crossed(vectors: Tensor) -> Tensor:
    """Return the matrices (B, 3, 3) whose products with a vector are the cross products of vectors (B, 3) with it."""
    x, y, z = vectors.unbind(-1)
    none = torch.zeros_like(x)
    return torch.stack([none, -z, y, z, none, -x, -y, x, none], -1).unflatten(-1, (3, 3))
