"""One door, two tiers: they agree where the linear one is right, and say no in words where neither is."""

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.indenters import Sphere
from tactile_core.mechanics.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.hex_mesh import skin_mesh
from tactile_core.mechanics.press import Placement
from tactile_core.mechanics.solve import _core_gap, solve, solve_path

BALL, PLACE = Sphere(7e-3), Placement(-8e-3, 1e-3)


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
def test_fast_depth_and_force_belong_together(sensor):
    by_depth = solve(sensor, BALL, PLACE, depth=0.3e-3)
    along = float(np.linalg.norm(by_depth.force))
    by_force = solve(sensor, BALL, PLACE, force=along)
    assert by_depth.converged and by_force.converged and by_depth.tier == "fast"
    assert by_force.depth == pytest.approx(0.3e-3, rel=0.02)  # the axial force is a little below the whole one
    assert by_depth.contact_patch.any() and (by_depth.pressure > 0) == (sensor == "biotac")
    assert np.linalg.norm(by_depth.displacement, axis=1).max() == pytest.approx(0.3e-3, rel=0.05)


def test_nothing_happens_without_depth_or_force():
    for request in ({"depth": 0.0}, {"force": 0.0}):
        still = solve("digit", BALL, PLACE, **request)
        assert not still.displacement.any() and not still.contact_patch.any() and not still.force.any()


@pytest.mark.parametrize(
    ("request_", "said"),
    [
        ({}, "one of the two"),
        ({"depth": 1e-4, "force": 0.1}, "one of the two"),
        ({"depth": float("nan")}, "finite"),
        ({"depth": -1e-4}, "zero or more"),
        ({"depth": 5e-3}, "at most 1.2 mm"),
        ({"force": 1e4}, "at most 1.2 mm deep"),
    ],
)
def test_impossible_requests_are_refused_in_words(request_, said):
    with pytest.raises(TactileError, match=said):
        solve("digit", BALL, PLACE, **request_)


def test_reference_tier_agrees_at_small_depth(monkeypatch):
    """One load step on the whole gel takes a minute, so the test counts it: at 0.1 mm five or six iterations."""
    calls = []
    linearise = FiniteStrainSolid.linearise
    monkeypatch.setattr(FiniteStrainSolid, "linearise", lambda self, state: calls.append(1) or linearise(self, state))
    fast = solve("digit", BALL, PLACE, depth=0.1e-3)
    exact = solve("digit", BALL, PLACE, depth=0.1e-3, tier="reference")
    assert exact.tier == "reference" and len(calls) <= 8
    # 1 %: the linear model's own error at 2.5 % of the gel's thickness (0.5 % was measured at 0.2 mm)
    np.testing.assert_allclose(exact.force, fast.force, atol=0.01 * np.abs(fast.force).max())
    error = np.linalg.norm(exact.displacement - fast.displacement, axis=1)
    assert np.sqrt((error**2).mean()) < 2e-6


def test_places_off_the_gel_and_presses_into_the_core_are_refused():
    with pytest.raises(TactileError, match="place on the DIGIT's gel"):
        solve("biotac", BALL, Placement(-8e-3, 9.4e-3), depth=1e-4)
    with pytest.raises(TactileError, match="clear of its core"):
        solve("biotac", Sphere(3.5e-3), Placement(-8e-3, 8e-3), depth=1.2e-3)


def test_a_path_gives_the_same_as_single_solves_and_keeps_what_it_had():
    depths = [0.1e-3, 0.2e-3, 5e-3]
    found = []
    with pytest.raises(TactileError, match="at most"):
        found.extend(solve_path("digit", BALL, PLACE, depths))
    assert len(found) == 2
    path = solve_path("digit", BALL, PLACE, depths)
    for depth in depths[:2]:
        np.testing.assert_array_equal(next(path).force, solve("digit", BALL, PLACE, depth=depth).force)


def test_the_core_is_watched():
    mesh = skin_mesh()
    still = np.zeros_like(mesh.nodes)
    assert _core_gap(mesh, still) > 0
    still[:, 1] = 2.6e-3  # deeper than the fluid under the pad, 2.45 mm at most
    assert _core_gap(mesh, still) < 0
