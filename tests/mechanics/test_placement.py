"""Where a press starts, and how thick the sensor is there."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Box, Cylinder, Pose, Ring, Sphere, pose_on
from tactile_core.mechanics.placement import Placement, first_touch, pose_at
from tactile_core.sensors import shape_of

DIGIT = shape_of("digit")
PLACES = [Placement(-8e-3, 0.0), Placement(-14e-3, 4e-3, 0.3, 1.0), Placement(-3e-3, -6e-3, 0.5, 4.0)]
INDENTERS = [Sphere(3.5e-3), Cylinder(3.5e-3, 0.5e-3), Box((14e-3,) * 3, 0.5e-3), Ring(2.5e-3, 1e-3)]


def dome(pose: Pose, reach: float) -> np.ndarray:
    """The analytic gel within ``reach`` m of the place under the indenter, (n, 3) m, every 5 um."""
    x = pose[0] + np.arange(-reach, reach, 5e-6)
    z = pose[2] + np.arange(-reach, reach, 5e-6)
    x, z = np.meshgrid(x, z)
    return np.stack([x, DIGIT.back_y - DIGIT.dome_height(x, z), z], -1).reshape(-1, 3)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("indenter", INDENTERS, ids=lambda i: type(i).__name__)
def test_first_touch_is_on_the_true_dome(indenter, place):
    """The lattice's interpolation stands for the dome: found from above, the touch is exact to a micrometre."""
    pose = pose_at("digit", indenter, place)
    rest = sensors.digit_surface().rest
    near = rest[np.argmin(pose.distance(indenter, rest)[0])]
    gap = pose.distance(indenter, dome(near, 0.4e-3))[0].min()
    assert abs(gap) < 0.5e-6  # m: 5 um of the sampling leave 0.01 um on edges of 0.5 mm; the rest is interpolation


@pytest.mark.parametrize("lattice", [sensors.digit_surface(), sensors.biotac_surface()], ids=["digit", "biotac"])
def test_first_touch_does_not_depend_on_where_the_motion_starts(lattice):
    ball = Sphere(2e-3)
    centre = lattice.rest[np.argmin(lattice.rest[:, 1])]
    there = pose_on(ball, centre, np.array([0.0, -1.0, 0.0]), 0.2, 1.0)
    places = [first_touch(lattice, ball, there.moved(by)).apex for by in (-0.5e-3, 0.0, 0.7e-3)]
    np.testing.assert_allclose(places, places[:1] * 3, atol=20e-9)


@pytest.mark.parametrize("radius", [0.3e-3, 0.05e-3])
@pytest.mark.parametrize("place", PLACES)
def test_a_ball_that_fits_between_nodes_touches_the_surface_between_them(radius, place):
    """Looked for among nodes alone, its first touch once lay 147 mm behind the gel."""
    pose = pose_at("digit", Sphere(radius), place)
    at = dome(pose.apex, 0.4e-3)
    assert abs(pose.distance(Sphere(radius), at)[0].min()) < 0.5e-6  # m, as above


def test_an_indenter_that_meets_nothing_is_refused():
    aside = pose_on(Sphere(1e-3), np.array([0.0, -8e-3, 50e-3]), np.array([0.0, -1.0, 0.0]))
    with pytest.raises(TactileError, match="passes the sensor by"):
        first_touch(sensors.digit_surface(), Sphere(1e-3), aside)


def test_an_edge_that_slides_past_the_nearest_nodes_touches_others():
    """The sixteen nodes nearest to this leaning cube lie beside it; it once ran past them for ever."""
    cube, place = Box((14e-3,) * 3, 0.5e-3), Placement(-4.5836989537761e-3, 7.306593692882052e-3, 0.421, 4.7387)
    pose = pose_at("digit", cube, place)
    rest = sensors.digit_surface().rest
    near = rest[np.argmin(pose.distance(cube, rest)[0])]
    assert abs(pose.distance(cube, dome(near, 0.4e-3))[0].min()) < 0.5e-6  # m, as above


@pytest.mark.parametrize("tilt", [20, -1, float("nan"), None])
def test_degrees_are_no_tilt(tilt):
    with pytest.raises(TactileError, match=r"Placement, tilt: .*; .*45 degrees. Convert degrees: math.radians"):
        Placement(-6e-3, 0.0, tilt)
    for name, value in {"x": "0", "z": None, "tilt_heading": float("nan")}.items():
        with pytest.raises(TactileError, match=f"Placement, {name}: {value!r}; expected a finite number"):
            Placement(**{"x": -6e-3, "z": 0.0, name: value})
    assert Placement(-6e-3, 0.0, float(np.float32(np.pi / 4))).tilt > np.pi / 4  # 45 degrees, as Blender rounds them


def test_ball_set_on_a_smooth_place_stays_there():
    ball = Sphere(3.5e-3)
    point, outward = DIGIT.dome_point(-8e-3, 1e-3)
    there = pose_on(ball, point, outward)
    moved = (first_touch(sensors.digit_surface(), ball, there).apex - there.apex) @ there.direction
    assert abs(moved) < 0.2e-6


def test_thickness_of_the_gel_and_of_skin_and_fluid():
    def at(sensor):
        """Node nearest to the middle of the pad, and the thickness there."""
        rest, (point, _) = sensors.sensor_surface(sensor).rest, sensors.surface_point(sensor, -8e-3, 0.0)
        node = int(np.argmin(np.linalg.norm(rest - point, axis=1)))
        return rest[node], sensors.thickness_at(sensor, node)

    on_dome, thick = at("digit")
    # at the top of the dome the normal is nearly upright
    assert thick == pytest.approx(DIGIT.back_y - on_dome[1], rel=1e-3)
    # docs/sources.md, BioTac skin and fluid: skin 1.58 mm and a fluid film of up to 2.45 mm
    assert 1.58e-3 + 0.5e-3 < at("biotac")[1] < 1.63e-3 + 2.45e-3
    with pytest.raises(TactileError, match="biotac, biotac_sp, digit"):
        at("absent")  # no name of another test's own sensor, which may be cached
