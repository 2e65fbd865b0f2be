"""Derivatives of straight presses by the motions of the indenter against central differences of presses."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Box, BumpyCube, Cylinder, Edge, LyingCylinder, Pose, Ring, Sphere
from tactile_core.mechanics.fast import frictionless
from tactile_core.mechanics.first_touch import first_touch, touching_point
from tactile_core.mechanics.force_search import UnreachableError
from tactile_core.mechanics.pose_derivative import MOTIONS, pose_derivative
from tactile_core.mechanics.straight_press import straight_press

PUSH = np.array([0.0, 1.0, 0.0])
STEP = 0.5e-6  # m, or at 3 mm from the origin: few nodes begin or cease to touch in it
LEVERS = np.array([1, 1, 1, 3e-3, 3e-3, 3e-3])  # m a unit of each motion
CASES = [
    ("digit", Sphere(3e-3), 0.4e-3, 0.0),
    ("digit", Sphere(3e-3), 0.4e-3, 0.78),
    ("digit", Box((4e-3, 3e-3, 4e-3), 0.5e-3), 0.4e-3, 0.78),
    ("digit", LyingCylinder(2e-3, 0.3e-3, 8e-3), 0.4e-3, 0.0),
    ("digit", Ring(2.5e-3, 0.8e-3), 0.2e-3, 0.3),
    ("biotac", Sphere(3e-3), 1.6e-3, 0.0),  # the skin's inner side bears on the core
    ("biotac", Cylinder(2e-3, 0.3e-3), 0.4e-3, 0.78),
]


def placed(sensor: str, indenter, depth: float, tilt: float = 0.1) -> Pose:
    """A pose with a tilted indenter, ``depth`` m past first touch."""
    turn = Rotation.from_euler("yxz", [0.3, tilt, 0.6 * tilt]).as_matrix()
    axes = turn @ np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    return touch_of(sensor, indenter, Pose(np.array([-8e-3, -20e-3, 1e-3]), axes, PUSH)).moved(depth)


def touch_of(sensor: str, indenter, pose: Pose) -> Pose:
    return first_touch(sensors.sensor_surface(sensor), indenter, pose)


def after(pose: Pose, k: int, step: float) -> Pose:
    """The pose after a step of the k-th motion, m at the lever."""
    motion = np.zeros(MOTIONS)
    motion[k] = step / LEVERS[k]
    return Pose(pose.apex + motion[:3], Rotation.from_rotvec(motion[3:]).as_matrix() @ pose.axes, pose.push)


def differences(press, k: int, step: float = STEP):
    """(n, 3) and (3,) for a unit of the k-th motion, of the press at a pose after a step of it."""
    ahead, back = (press(k, way * step).found for way in (1, -1))
    unit = 2 * step / LEVERS[k]
    return (ahead.corrected.displacement - back.corrected.displacement) / unit, (ahead.force - back.force) / unit


def off(found: np.ndarray, expected: np.ndarray) -> float:
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


@pytest.fixture
def solved_further(monkeypatch):
    """What frictionless solves leave, to 0.2 um and 1e-4 of the force, is as large as 2 % of their differences."""
    monkeypatch.setattr(frictionless, "SIDEWAYS_TOLERANCE", 1e-6)
    monkeypatch.setattr(frictionless, "GAP_TOLERANCE", 1e-8)


@pytest.mark.parametrize(("sensor", "indenter", "depth", "friction"), CASES)
@pytest.mark.usefixtures("solved_further")
def test_they_are_those_of_differences(sensor, indenter, depth, friction):
    pose = placed(sensor, indenter, depth)
    straight = straight_press(sensor, indenter, pose, None, friction)
    found = pose_derivative(straight)
    if depth > 1e-3:
        assert len(straight.found.linear.core_nodes)
    if friction:
        assert 0 < straight.found.linear.slipping.sum() < len(straight.found.linear.nodes)
    for k in range(MOTIONS):
        moved, force = differences(
            lambda k, step: straight_press(sensor, indenter, after(pose, k, step), None, friction), k
        )
        # What touches may change within the step: measured below 2.1 %.
        assert off(found.displacement[..., k], moved) < 0.03
        assert off(found.force[:, k], force) < 0.03


@pytest.mark.parametrize("friction", [0.0, 0.78])
@pytest.mark.usefixtures("solved_further")
def test_at_a_force_they_are_those_of_differences_too(friction):
    indenter, force = Sphere(3e-3), 0.6
    pose = placed("digit", indenter, 0.0)
    straight = straight_press("digit", indenter, pose, force, friction)
    assert straight.found.force[1] == pytest.approx(force, rel=1e-3)
    found = pose_derivative(straight).at_force(PUSH)
    assert np.abs(found.displacement[..., 1]).max() < 1e-9  # it starts farther out, and goes on to the same place
    np.testing.assert_allclose(found.force[1], [0] * MOTIONS + [1], atol=1e-9 * np.abs(found.force).max())
    ahead, back = (straight_press("digit", indenter, pose, share * force, friction).found for share in (1.01, 0.99))
    per_newton = (ahead.corrected.displacement - back.corrected.displacement) / (ahead.force[1] - back.force[1])
    assert off(found.displacement[..., MOTIONS], per_newton) < 0.03
    for k in (0, 3):
        moved, bears = differences(
            lambda k, step: straight_press("digit", indenter, after(pose, k, step), force, friction), k, 1e-6
        )
        moved -= found.displacement[..., MOTIONS] * bears[1]  # the search finds a force to a thousandth
        assert off(found.displacement[..., k], moved) < 0.03


@pytest.mark.parametrize("indenter", [Sphere(3e-3), Cylinder(2e-3, 0.3e-3), Ring(2.5e-3, 0.3e-3)])
def test_the_touching_point_touches(indenter):
    for sensor in ("digit", "biotac"):
        touch = placed(sensor, indenter, 0.0)
        point = touching_point(sensors.sensor_surface(sensor), indenter, touch)
        assert abs(touch.distance(indenter, point[None])[0][0]) < 1e-8


def test_in_front_of_the_sensor_there_is_no_contact():
    ball = Sphere(3e-3)
    assert straight_press("digit", ball, placed("digit", ball, -1e-4), None, 0.78) is None
    assert straight_press("digit", ball, placed("digit", ball, 1e-4), 0.0, 0.78) is None
    beside = Pose(np.array([0.1, 0, 0]), np.eye(3), PUSH)
    assert straight_press("digit", ball, beside, None, 0.78) is None
    with pytest.raises(TactileError, match="passes the sensor by"):
        straight_press("digit", ball, beside, 1.0, 0.78)


@pytest.mark.parametrize(
    ("depth", "force", "error", "words"),
    [
        (3e-3, None, UnreachableError, "3 mm; expected at most 2"),
        (0.0, 50.0, UnreachableError, "50 N"),
        (0.0, -1.0, TactileError, "-1 N; expected 0 to 500 N"),
        (0.0, np.nan, TactileError, "nan N"),
    ],
)
def test_what_is_impossible_is_refused(depth, force, error, words):
    ball = Sphere(3e-3)
    with pytest.raises(error, match=words):
        straight_press("digit", ball, placed("digit", ball, depth), force, 0.78)


def test_contacts_whose_equations_are_others_are_refused():
    cube = BumpyCube(6e-3, 0.4e-3, 0.6e-3, 0.3e-3, 1.5e-3)
    with pytest.raises(TactileError, match="creases"):
        pose_derivative(straight_press("digit", cube, placed("digit", cube, 0.4e-3), None, 0.0))
    wedge = Edge(np.radians(90), 0.4e-3, 8e-3)
    lying = placed("digit", wedge, 0.3e-3, tilt=0.0)
    askew = Rotation.from_rotvec([0.03, -0.28, 0.2]).as_matrix() @ lying.axes
    with pytest.raises(TactileError, match="between nodes"):
        pose_derivative(straight_press("digit", wedge, Pose(lying.apex, askew, PUSH), None, 0.0))
