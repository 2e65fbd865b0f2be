"""Base class of indenters, checks that all share, and the form in which a shape's file describes it to scenes and
menus.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from ...errors import TactileError, finite_number
from ...files.installed import modules_of

# Components of a unit vector below this count as zero, so that rounding does not choose an end of a flat or a line.
SQUARE = 1e-9
# m; nearer to a centre of curvature (deep inside a body) normals and curvatures are those at this distance.
NEAREST = 1e-9

Surface = tuple[np.ndarray, np.ndarray]  # nodes (n, 3) m in the body's frame, triangles (m, 3)
Hull = Callable[[Callable[[np.ndarray], np.ndarray]], Surface]  # surface of a convex body, by its ``support``


class Indenter(Protocol):
    """A rigid body given by its signed distance, in its own frame. Shapes inherit from it."""

    def distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the signed distance (n,) m, positive outside, and its gradient (n, 3), at points (n, 3) m."""

    def curvature(self, points: np.ndarray) -> np.ndarray:
        """Return the symmetric second derivatives (n, 3, 3) 1/m of the distance at points (n, 3) m in the own frame.

        They belong to the same branch as ``distance``'s gradient; on creases they are those of one of the sides.
        """

    def support(self, direction: np.ndarray) -> np.ndarray:
        """Return the point (3,) m of the body's convex hull farthest along a unit vector ``direction`` (3,), own frame;
        if a whole flat, circle or line lies farthest, its middle."""

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and upper corner (3,) m of the smallest box along the own axes that holds the body."""
        lower = [self.support(-axis)[k] for k, axis in enumerate(np.eye(3))]
        upper = [self.support(axis)[k] for k, axis in enumerate(np.eye(3))]
        return np.array(lower), np.array(upper)

    def preview(self, hull: Hull) -> Surface:
        """Return nodes (n, 3) m, own frame, and triangles (m, 3) that show the body.
        hull : function that makes these for a convex body, given its ``support``"""
        return hull(self.support)

    @functools.cached_property
    def least_side(self) -> float:
        """The least side, m, of the box of ``bounds``."""
        lower, upper = self.bounds()
        return float((upper - lower).min())


def contiguous(points: np.ndarray) -> np.ndarray:
    """Return points (n, 3) m as a contiguous float array, as compiled loops need."""
    return np.ascontiguousarray(points, float)


def lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the lengths (n,) of vectors (n, 3), for few of them in half the time of ``np.linalg.norm``."""
    return np.sqrt(np.einsum("ai,ai->a", vectors, vectors))


def check_length(kind: str, name: str, value: float) -> None:
    """Raise TactileError unless a length ``value``, m, is a number between 0.001 mm and 1 m.
    kind, name : words for the shape and for the length, for the message"""
    expected, advice = "a length in m, between 0.001 mm and 1 m", "Check the unit: scenes give millimetres"
    finite_number(value, f"{kind}, {name}", expected, 1e-6, 1.0, advice)


def sign_of(component: np.ndarray | float) -> np.ndarray:
    """Return the sign -1, 0 or 1 (...) of a direction's component (...), 0 if that is zero up to rounding."""
    return np.where(np.abs(component) > SQUARE, np.sign(component), 0.0)


_OWN_DOWN = np.array([0.0, 0.0, -1.0])


@dataclasses.dataclass(frozen=True)
class Pose:
    """Position and orientation of an indenter: own origin at ``apex`` (3,) m, own axes as columns of ``axes`` (3, 3).
    push : unit vector (3,), in the sensor's frame, along which the indenter moves; None for its own -z
    Raises TactileError for other shapes, and for a number that is nan or infinite.
    """

    apex: np.ndarray
    axes: np.ndarray
    push: np.ndarray | None = None

    def __post_init__(self) -> None:
        try:
            right = self.apex.shape == (3,) and self.axes.shape == (3, 3)
            right &= math.isfinite(np.vdot(self.apex, self.apex) + np.vdot(self.axes, self.axes))  # quicker than each
        except (AttributeError, TypeError):  # no arrays
            right = False
        if not right:
            found = f"apex {self.apex!r:.80} m, axes {self.axes!r:.80}"
            raise TactileError("pose", found, "arrays (3,) and (3, 3) of finite numbers")

    def check(self, where: str) -> None:
        """Raise TactileError, which names ``where``, unless the axes are right-handed and they and ``push`` are unit
        vectors."""
        push, square = np.asarray(self.direction), np.abs(self.axes.T @ self.axes - np.eye(3)).max() < SQUARE
        if not (square and np.linalg.det(self.axes) > 0):
            raise TactileError(where, f"axes {self.axes.tolist()}", "right-handed unit axes")
        if push.shape != (3,) or push.dtype.kind not in "if" or not abs(push @ push - 1) < SQUARE:
            raise TactileError(where, f"push {self.push!r:.80}", "a unit vector (3,), or None")

    @property
    def direction(self) -> np.ndarray:
        """Unit vector (3,) into the sensor, along which the indenter moves."""
        return -self.axes[:, 2] if self.push is None else self.push

    @property
    def own_direction(self) -> np.ndarray:
        """Unit vector (3,) of the motion in the indenter's own frame."""
        return _OWN_DOWN if self.push is None else self.push @ self.axes

    def moved(self, depth: float) -> Pose:
        """Return the pose after moving ``depth`` m along ``direction``, into the sensor; negative: out of it."""
        return Pose(self.apex + depth * self.direction, self.axes, self.push)

    def slid(self, along: float, across: float) -> Pose:
        """Return the pose after sliding by ``along`` and ``across``, m, along the indenter's own x and y."""
        return Pose(self.apex + self.axes[:, 0] * along + self.axes[:, 1] * across, self.axes, self.push)

    def to_own(self, points: np.ndarray) -> np.ndarray:
        """Transform points (n, 3) m from the sensor's frame to the indenter's, in which points that stick to the
        indenter stay put as it moves."""
        return (points - self.apex) @ self.axes

    def from_own(self, points: np.ndarray) -> np.ndarray:
        """Transform points (n, 3) m from the indenter's frame to the sensor's: the inverse of ``to_own``."""
        return points @ self.axes.T + self.apex

    def distance(self, indenter: Indenter, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the placed indenter's signed distance (n,) m and gradient (n, 3) at points (n, 3) m of the sensor."""
        distance, gradient = indenter.distance(self.to_own(points))
        return distance, gradient @ self.axes.T

    def curvature(self, indenter: Indenter, points: np.ndarray) -> np.ndarray:
        """Return the second derivatives (n, 3, 3) 1/m of the placed indenter's distance at points (n, 3) m of the
        sensor."""
        return self.axes @ indenter.curvature(self.to_own(points)) @ self.axes.T

    def support(self, indenter: Indenter, direction: np.ndarray) -> np.ndarray:
        """Return the placed indenter's farthest point (3,) m along a unit vector ``direction`` (3,), sensor frame."""
        return self.apex + self.axes @ indenter.support(direction @ self.axes)


def tangents(outward: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit tangents (..., 3) of a surface with unit normals ``outward`` (..., 3): ``along``, the tangent
    nearest to +x, and the cross product of along and outward (on the pad toward -z)."""
    along = np.array([1.0, 0.0, 0.0]) - outward[..., :1] * outward
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    return along, np.cross(along, outward)


def pose_on(
    indenter: Indenter, point: np.ndarray, outward: np.ndarray, tilt: float = 0.0, tilt_heading: float = 0.0
) -> Pose:
    """Return the pose in which the indenter just touches ``point`` (3,) m of a surface, unit normal ``outward`` (3,).

    tilt : rad, between the indenter's axis, along which it moves, and that normal
    tilt_heading : rad, where its upper end leans: 0 toward +x of the finger, pi / 2 (on the pad) toward -z
    """
    along, side = tangents(outward)
    axis = np.cos(tilt) * outward + np.sin(tilt) * (np.cos(tilt_heading) * along + np.sin(tilt_heading) * side)
    first = along - axis * (along @ axis)
    first /= np.linalg.norm(first)
    axes = np.column_stack([first, np.cross(axis, first), axis])
    return Pose(point - axes @ indenter.support(-outward @ axes), axes)


@dataclasses.dataclass(frozen=True)
class Size:
    """A size of a shape, as scene files give it.

    field : its name in scenes, which ends in its unit, ``_mm`` or ``_deg``; count : how many numbers it takes
    default : its value, in that unit, if a scene leaves it out; None: it must be given
    slider : name of the size in Blender's Add menu that sets it; empty: a new object has the default"""

    field: str
    default: float | None = None
    slider: str = ""
    count: int = 1

    def in_si(self, value: Any) -> Any:
        """Convert a scene's ``value``, a number or a tuple of them in the field's unit, to metres or radians."""
        if isinstance(value, tuple):
            return tuple(self.in_si(one) for one in value)
        return float(np.deg2rad(value)) if self.field.endswith("_deg") else value * 1e-3


@dataclasses.dataclass(frozen=True)
class SceneForm:
    """Entry of a shape in scenes and in Blender's Add menu, made of the ``SCENE`` of this type in each module here.
    kind : its name in scenes; shape : class or function that makes it; says : what it is, in one line
    sizes : the ``Size`` of each argument of ``shape``, those without a default first
    label, icon : in the menu, "" for none"""

    kind: str
    shape: Callable[..., Indenter]
    says: str
    sizes: dict[str, Size]
    label: str = ""
    icon: str = ""

    def build(self, values: Mapping[str, Any]) -> Indenter:
        """Build the shape from values in mm or degrees, by ``Size.field``. Raises TactileError if none has these."""
        return self.shape(**{argument: size.in_si(values[size.field]) for argument, size in self.sizes.items()})


@functools.cache
def forms() -> dict[str, SceneForm]:
    """Return the ``SceneForm`` of each shape in this folder, by its kind."""
    found = [getattr(module, "SCENE", None) for module in modules_of(__name__.rpartition(".")[0]).values()]
    return {form.kind: form for form in found if form is not None}
