"""One door, three tiers: they agree where they should, and say no in words where none is right."""

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import Step, solve, solve_path

BALL, PLACE = Sphere(7e-3), Placement(-8e-3, 1e-3)


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
@pytest.mark.parametrize("friction", [0.0, 0.78])
def test_fast_depth_and_force_belong_together(sensor, friction):
    by_depth = solve(sensor, BALL, PLACE, depth=0.3e-3, friction=friction)
    along = float(np.linalg.norm(by_depth.force))
    by_force = solve(sensor, BALL, PLACE, force=along, friction=friction)
    assert by_depth.converged and by_force.converged and by_depth.tier == "fast"
    assert by_force.depth == pytest.approx(0.3e-3, rel=0.02)  # the axial force is a little below the whole one
    assert by_depth.contact_patch.any() and (by_depth.pressure > 0) == (sensor == "biotac")
    assert np.linalg.norm(by_depth.displacement, axis=1).max() == pytest.approx(0.3e-3, rel=0.05)
    assert by_depth.penetration < 1e-6 and 0 < by_depth.shape_error < 0.1e-3 and 0 < by_depth.force_error < 1


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({}, "one of the two"),
        ({"depth": 1e-4, "force": 0.1}, "one of the two"),
        ({"depth": float("nan")}, "finite"),
        ({"depth": -1e-4}, "zero or more"),
        ({"depth": 1e-4, "friction": -0.1}, "friction"),
        ({"depth": 1e-4, "tier": "exact"}, "fast, full or reference"),
    ],
)
def test_impossible_requests_are_refused_in_words(request_, said):
    with pytest.raises(TactileError, match=said):
        solve("digit", BALL, PLACE, **request_)


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
def test_the_full_tier_agrees_with_the_fast_one_at_a_tenth_of_the_thickness(sensor):
    fast = solve(sensor, BALL, PLACE, depth=0.4e-3, friction=0.0)
    full = solve(sensor, BALL, PLACE, depth=0.4e-3, friction=0.0, tier="full")
    assert full.tier == "full" and full.converged and full.penetration < 1e-6
    assert full.volume is not None and (full.pressure > 0) == (sensor == "biotac")
    # 5 %: the target allows the fast tier's force after correction
    assert np.linalg.norm(full.force) == pytest.approx(np.linalg.norm(fast.force), rel=0.05)
    error = np.linalg.norm(full.displacement - fast.displacement, axis=1)
    moves = np.linalg.norm(full.displacement, axis=1) > 10e-6
    assert np.sqrt((error[moves] ** 2).mean()) < 5e-6  # the target up to 20 % depth


def test_a_path_keeps_what_is_solved_when_a_later_step_is_refused():
    path = solve_path("digit", BALL, PLACE, [Step(depth=0.1e-3), Step(force=0.05), Step(force=1e4)], friction=0.0)
    found = [next(path), next(path)]
    assert all(s.converged for s in found) and np.linalg.norm(found[1].force) == pytest.approx(0.05, rel=0.02)
    with pytest.raises(TactileError, match="force 10000"):
        next(path)


def test_a_slide_under_friction_pulls_along_and_ends_at_mu():
    """The indenter's force on the sensor points the way it slides, and grows to the coefficient of friction."""
    steps = [Step(depth=0.3e-3), *(Step(depth=0.3e-3, slide=(x, 0.0)) for x in (0.05e-3, 0.5e-3, 1.0e-3))]
    found = list(solve_path("digit", BALL, PLACE, steps, friction=0.5))
    ratio = [s.force[0] / s.force[1] for s in found]  # the dome's own slope here is below 0.05
    assert abs(ratio[0]) < 0.08 < ratio[1] < ratio[2]
    assert ratio[-1] == pytest.approx(0.5, abs=0.06)
    assert found[1].slipping < 1 and found[-1].slipping > 0.7
