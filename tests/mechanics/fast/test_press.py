"""Presses at corrected forces."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.press import FORCE_TOLERANCE, CorrectedPress
from tactile_core.mechanics.placement import Placement, depth_at, pose_at

BALL, PLACE = Sphere(3.5e-3), Placement(-8e-3, 0.0)


@pytest.mark.parametrize("friction", [0.0, 0.78])
@pytest.mark.parametrize("sensor", ["biotac", "digit"])
def test_a_path_of_growing_force_ends_at_the_depth_limit(sensor, friction):
    pose = pose_at(sensor, BALL, PLACE)
    limit = depth_at(0.6, sensor, BALL, pose)
    press, depths, force = CorrectedPress(compliance_of(sensor), BALL, pose, limit, friction), [], 0.05
    while (contact := press.at_force(force)) is not None:
        assert contact.axial_force == pytest.approx(force, rel=FORCE_TOLERANCE)
        depths.append(contact.linear.depth)
        force *= 1.6
    assert np.all(np.diff(depths) > 0) and len(depths) > 4
    assert depths[-1] <= limit and press.at_depth(limit).axial_force < force


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
def test_a_slide_at_the_same_force_drags_the_skin_along(sensor):
    pose = pose_at(sensor, BALL, PLACE)
    press = CorrectedPress(compliance_of(sensor), BALL, pose, depth_at(0.6, sensor, BALL, pose), 0.78)
    still, slid = press.at_force(0.5), press.at_force(0.5, pose.slid(0.3e-3, 0.0))
    assert slid.axial_force == pytest.approx(0.5, rel=FORCE_TOLERANCE)
    dragged = (slid.force - still.force) @ pose.axes[:, 0]
    assert 0.05 < dragged / 0.5 <= 0.78 * 1.1  # a tenth: forces lean with the surface, by which the cone leans too


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
@pytest.mark.parametrize("across", [-1.5e-3, 1.5e-3])
def test_a_light_touch_is_held_where_the_sensor_falls_away_or_rises(sensor, across):
    pose = pose_at(sensor, BALL, Placement(-8e-3, 5e-3))
    press = CorrectedPress(compliance_of(sensor), BALL, pose, 2.4e-3, 0.78)
    assert press.at_force(0.03) is not None
    for share in (0.5, 1.0):
        slid = press.at_force(0.03, pose.slid(0.0, share * across))
        assert slid.axial_force == pytest.approx(0.03, rel=FORCE_TOLERANCE)
        assert np.isfinite(slid.corrected.displacement).all()
