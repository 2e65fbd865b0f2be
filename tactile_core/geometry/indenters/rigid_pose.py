"""Read the poses that simulators give: 4 x 4 matrices, or a position and a quaternion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import TactileError

# Single precision and a quaternion of four decimals stay below this; what is farther off is scaled or sheared.
_RIGID = 1e-3
_LAST_ROW, _ROUNDING = np.array([0.0, 0.0, 0.0, 1.0]), 1e-6  # of single precision
_FARTHEST = 1.0  # m from the sensor's origin; farther off a pose is in millimetres or in another frame (assumed)


def rigid_pose(pose: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the origin (3,) m and axes (3, 3), as columns, of a pose in the sensor's frame.

    pose : (4, 4) matrix, or (position (3,) m, quaternion (4,) w, x, y, z), as MuJoCo and Isaac order it
    Raises TactileError for another shape, numbers that are not finite, scale, shear, mirroring, and places beyond 1 m.
    """
    if _is_pair(pose):
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


def _is_pair(pose: Any) -> bool:
    return isinstance(pose, Sequence) and len(pose) == 2


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
    """The rotation nearest to ``axes`` (3, 3), which may differ from it by rounding alone."""
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
