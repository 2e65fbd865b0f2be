"""Place an indenter at the same unrolled place and angle on both sensors; find its first touch, and poses on a way.

Depth counts from first touch; per cent of depth are of the sensor's thickness there.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from .. import sensors
from ..errors import TactileError, finite_number
from ..geometry.cubic_spline import on_grid
from ..geometry.indenters import Indenter, Pose, pose_on
from ..geometry.lattice import Lattice

_ADVANCES = 60  # steps of a body by its smallest distance: more than any shape needs
_TOUCHES = 1e-9  # m, smallest distance at which the body is taken to touch
_CLOSE = 60e-6  # m: first touch may lie between nodes that are at most this much farther away than the first one
_MOST_PLACES = 12
_FINER = (4, 16, 64, 256)  # parts of a lattice spacing: 1.4 um at last, between which a ball of 1 mm dips below 1 nm
_AROUND = np.stack(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5), indexing="ij")).reshape(2, -1)
_MANY = 2**20  # more than a grid has columns: one number identifies a place (exactly, for they are sums of halves)
_HIDDEN = 6e-6  # m, more than dips between places a quarter spacing apart: (0.045 mm)^2 / (2 x 0.2 mm edge radius)
_CLEAR = (1e-3, 12e-3)  # m, from where the motion starts: from the second no indenter reaches the sensor
_FARTHEST = 30e-3  # m, past all of a sensor from wherever the motion starts
_LEAST_RATE = 0.5  # of approach: of a body that slides past a point the distance says little about the way to it
_NEAREST = 16  # nodes tried first for touch
_NARROW = 2e-3  # m, four spacings of the coarser lattice, the BioTac's: a body this thin may pass between nodes
_BESIDE = 1e-3  # m, largest distance of a node from the line on which a body's foremost point moves
_FRONT = 4e-3  # m: nodes this far behind the first one are on the far side of the sensor
_MISSED = 1e-6  # m, a body that stays this far away has passed the sensor by
# rad: 45 degrees of scenes, and more than sticking friction holds, whose atan(0.78) is 0.66 (assumed)
MOST_TILT = 0.8
_SAME = 1e-12  # m, sideways, of poses that differ in depth alone


def same_place(first: Pose, second: Pose) -> bool:
    """Return true if two poses have the same apex and axes."""
    return np.array_equal(first.apex, second.apex) and np.array_equal(first.axes, second.axes)


def same_line(first: Pose, second: Pose) -> bool:
    """Return true if two poses have the same axes and places that differ along their direction of motion alone."""
    apart = second.apex - first.apex
    sideways = apart - (apart @ first.direction) * first.direction
    return bool(np.abs(sideways).max() < _SAME and np.array_equal(first.axes, second.axes))


def between(first: Pose, second: Pose, share: float) -> Pose:
    """Return the pose at a ``share``, 0 (first) to 1 (second), of the way: apex on a straight line, axes turned about
    one axis (Rodrigues' formula)."""
    apex = first.apex + share * (second.apex - first.apex)
    turn = second.axes @ first.axes.T
    twice = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    size = np.linalg.norm(twice)
    angle = np.arctan2(size, np.trace(turn) - 1)
    if size < 1e-15:
        return Pose(apex, second.axes, second.push)
    x, y, z = twice / size
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    part = np.eye(3) + np.sin(share * angle) * cross + (1 - np.cos(share * angle)) * (cross @ cross)
    return Pose(apex, part @ first.axes, second.push)


def surface_drop(lattice: Lattice, indenter: Indenter, pose: Pose, slid: Pose) -> float:
    """Return how far, m, the indenter at the pose ``slid`` must move along its direction to touch the resting surface
    as it does at ``pose``: negative if the surface rises; 30 mm, more than any sensor is deep, if it has slid off."""
    if same_line(pose, slid):
        return 0.0
    try:
        return float((first_touch(lattice, indenter, slid).apex - pose.apex) @ slid.direction)
    except TactileError:
        return _FARTHEST


def first_touch(lattice: Lattice, indenter: Indenter, pose: Pose) -> Pose:
    """Move a pose along its direction, in or out, until the indenter just touches the resting surface.

    Between nodes the surface is the lattice's cubic (Catmull-Rom) interpolation. Raises TactileError for an indenter
    that passes the sensor by.
    """
    rows, columns = lattice.shape
    met = in_front(lattice.axes, indenter, pose, closed=lattice.closed) if indenter.least_side < _NARROW else None
    pose, nodes = _on_nodes(lattice, np.empty((0, 3)) if met is None else met[1], indenter, pose)
    tip = np.empty((0, 2)) if met is None or (nodes < len(lattice.rest)).all() else met[0]
    nodes = nodes[nodes < rows * columns]
    places = np.concatenate([np.array(np.divmod(nodes, columns), float), tip.T], axis=1)
    for finer in _FINER if places.size else ():
        tried = (places[:, :, None] + _AROUND[:, None] / finer).reshape(2, -1)
        points = on_grid(lattice.axes, tried, closed=lattice.closed)
        gap, _ = pose.distance(indenter, points)
        best = np.argmin(gap.reshape(-1, _AROUND.shape[1]), axis=1) + np.arange(0, len(gap), _AROUND.shape[1])
        best = best[gap[best] < gap[best].min() + _HIDDEN]
        if len(best) > 1:  # neighbours find the same place
            row, column = tried[:, best]
            best = best[np.unique(_MANY * row + column, return_index=True)[1]]
        places = tried[:, best]
        pose = _advance(indenter, pose.moved(2 * min(gap[best].min(), 0.0)), points[best])
    return pose


def first_touch_on_line(lattice: Lattice, indenter: Indenter, pose: Pose) -> Pose:
    """Find first touch of an indenter that comes from outside along the direction of ``pose``, from anywhere on that
    line.
    Raises TactileError if it passes the sensor by."""
    before = float((lattice.rest @ pose.direction).min() - pose.support(indenter, pose.direction) @ pose.direction)
    return first_touch(lattice, indenter, pose.moved(before))  # from just in front the search is short


def in_front(axes: np.ndarray, indenter: Indenter, pose: Pose, *, closed: bool) -> tuple[np.ndarray, np.ndarray] | None:
    """Find where the line on which an indenter's foremost point moves meets a surface, on the side met first.
    axes : (3, rows, columns) m, x, y, z of the surface's nodes; closed : true if its last column joins the first
    Returns the place (1, 2), fractional row and column, and the point (1, 3) m; None if no node is within 1 mm."""
    foremost = pose.support(indenter, pose.direction)
    along, beside = _off_line(axes.reshape(3, -1).T, foremost, pose.direction)
    near = beside < _BESIDE
    if not near.any():
        return None
    near &= along < along[near].min() + _FRONT
    node = int(np.argmin(np.where(near, beside, np.inf)))
    place = np.array([divmod(node, axes.shape[2])], float).T
    for finer in _FINER:
        tried = place + _AROUND / finer
        points = on_grid(axes, tried, closed=closed)
        best = int(np.argmin(_off_line(points, foremost, pose.direction)[1]))
        place, point = tried[:, best : best + 1], points[best : best + 1]
    return place.T, point


def _off_line(points: np.ndarray, start: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates (n,) m of points (n, 3) m along a line, and their distances (n,) m from it.
    start : (3,) m, a point of the line; direction : (3,), its unit vector"""
    arm = points - start
    along = arm @ direction
    return along, np.linalg.norm(arm - along[:, None] * direction, axis=1)


def _on_nodes(lattice: Lattice, more: np.ndarray, indenter: Indenter, pose: Pose) -> tuple[Pose, np.ndarray]:
    """Find the pose at first touch of the lattice's nodes and of ``more`` points (j, 3) m. Also return the numbers of
    at most 12 of them that are close then, nearest first; ``more`` are numbered after the lattice's nodes."""
    rest = np.concatenate([lattice.rest, more]) if len(more) else lattice.rest
    for clear in _CLEAR:
        away, reach = pose.moved(-clear), 2 * clear
        nodes, gap = _near(lattice, more, indenter, away, reach)
        if gap.min(initial=np.inf) > 0:
            break
    if len(nodes) < _NEAREST:
        nodes, gap = _near(lattice, more, indenter, away, np.inf)
    some = nodes[np.argsort(gap, kind="stable")[:_NEAREST]]
    while True:
        pose = _advance(indenter, away, rest[some])
        if pose.distance(indenter, rest[some])[0].min() > _TOUCHES:  # it slides past them
            pose, some = _advance(indenter, away, rest), np.arange(len(rest))
            if pose.distance(indenter, rest)[0].min() > _MISSED:
                expected = "a place and a lean that meet its surface"
                raise TactileError("indenter", "it passes the sensor by", expected, "Move it over the sensor")
        travel = float(np.linalg.norm(pose.apex - away.apex))
        if travel + _CLOSE > reach:
            reach = travel + _CLOSE
            nodes, gap = _near(lattice, more, indenter, away, reach)
        reached = nodes[gap < travel + _CLOSE]  # no distance falls faster than the indenter moves
        now, _ = pose.distance(indenter, rest[reached])
        missed = reached[now < -_TOUCHES]
        if len(missed):
            missed = np.setdiff1d(missed, some)
        if not len(missed):
            order = np.argsort(now, kind="stable")[:_MOST_PLACES]
            return pose, reached[order[now[order] < now[order[0]] + _CLOSE]]
        some = np.r_[some, missed]


def _near(lattice: Lattice, more: np.ndarray, indenter: Indenter, pose: Pose, reach: float) -> tuple:
    """Return nodes (k,) less than ``reach`` m outside an indenter, and their distances (k,) m. All points ``more`` (p,
    3) m follow, near or not, numbered after the lattice's nodes."""
    nodes, gap = lattice.blocks.near(indenter, pose, reach)
    if len(more):
        nodes = np.concatenate([nodes, len(lattice.rest) + np.arange(len(more))])
        gap = np.concatenate([gap, pose.distance(indenter, more)[0]])
    return nodes, gap


def _advance(indenter: Indenter, pose: Pose, points: np.ndarray) -> Pose:
    """Move an indenter until it touches the first of the points (n, 3) m; if it slides past them all, by ``_FARTHEST``.
    Newton's steps never overshoot a convex part; if one overshoots another part, the negative distance leads back.
    """
    own, travel, left = pose.to_own(points), 0.0, _FARTHEST
    ahead = pose.own_direction  # in its frame points come the other way
    for _ in range(_ADVANCES):
        gap, normal = indenter.distance(own)
        step = smallest = float(gap.min())
        if abs(smallest) < _TOUCHES:
            break
        if smallest > 0:
            step = float((gap / np.maximum(normal @ ahead, _LEAST_RATE)).min())
        step = min(step, left)
        left -= step
        travel += step
        own -= step * ahead
    return pose.moved(travel)


FRICTION = 0.78  # Coulomb's coefficient of the BioTac's skin (docs/sources.md, BioTac skin), taken for both sensors
MOST_FRICTION = 5.0  # more is a percentage, or sticks as 5 does (assumed)


def friction_of(value: float, where: str) -> float:
    """Return ``value``, a coefficient of friction, as a float; TactileError, naming ``where``, unless it is 0 to 5."""
    expected = f"Coulomb's coefficient, 0 to {MOST_FRICTION:g}"
    return finite_number(value, where, expected, 0.0, MOST_FRICTION, "Divide per cent by 100; 5 sticks")


@dataclasses.dataclass(frozen=True)
class Placement:
    """Place and angle of an indenter, the same for both sensors.

    x, z : m on the DIGIT's plane, along the finger and across it; on the BioTac, the place that unrolls onto (x, z)
    tilt : rad, between the indenter's axis and the surface normal; at most 0.8 either way
    tilt_heading : rad, direction in which the indenter's upper end leans: 0 toward +x, pi / 2 toward -z
    Raises TactileError for a larger tilt, and for numbers that are not finite.

    >>> tactile.Placement(x=2e-3, z=0.0, tilt=0.1)
    """

    x: float
    z: float
    tilt: float = 0.0
    tilt_heading: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in {"x": "m", "z": "m", "tilt_heading": "rad"}.items():
            finite_number(getattr(self, name), f"Placement, {name}", f"a finite number, {unit}")
        expected = f"-{MOST_TILT} to {MOST_TILT} rad, some 45 degrees"
        finite_number(
            self.tilt, "Placement, tilt", expected, -MOST_TILT, MOST_TILT, "Convert degrees: math.radians(20)"
        )


def pose_at(sensor: str, indenter: Indenter, place: Placement) -> Pose:
    """Find the pose at first touch: on a gel at (x, z), on a skin at the place of its pad that unrolls onto (x, z). The
    indenter's tilt is from the surface normal there."""
    point, outward = sensors.surface_point(sensor, place.x, place.z)
    pose = pose_on(indenter, point, outward, place.tilt, place.tilt_heading)
    return first_touch(sensors.sensor_surface(sensor), indenter, pose)


def on_gel(x: float, z: float, margin: float = 0.0, sensor: str = sensors.TARGET) -> bool:
    """Return true if the place ``x``, ``z``, m, lies on a sensor's gel, more than ``margin`` m inside its outline."""
    return bool(sensors.shape_of(sensor).outline_distance(np.array(x), np.array(z)) > margin)


DEPTH_LIMIT = 0.6  # of the thickness: the deepest that contacts are asked for
_DEEPEST = 2.4e-3  # m, 60 % of the gel: bounds the depth where the BioTac has no core below
_HARDLY_APART = 0.1e-3  # m: at first touch a node is mostly this near


def thickness_under(sensor: str, indenter: Indenter, pose: Pose) -> float:
    """Return the thickness, m, of gel, or of skin and fluid, at the node nearest to an indenter at first touch."""
    surface, reach = sensors.sensor_surface(sensor), _HARDLY_APART
    nodes, gap = surface.blocks.near(indenter, pose, reach)
    while not len(nodes):
        reach *= 4
        nodes, gap = surface.blocks.near(indenter, pose, reach)
    return sensors.thickness_at(sensor, int(nodes[np.argmin(gap)]))


def depth_at(share: float, sensor: str, indenter: Indenter, pose: Pose) -> float:
    """Return the depth, m, at most 2.4 mm, that is ``share`` of the thickness under an indenter at first touch."""
    return min(share * thickness_under(sensor, indenter, pose), _DEEPEST)
