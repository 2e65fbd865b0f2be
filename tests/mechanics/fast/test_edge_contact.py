"""Points between nodes: on the smooth surface, moved as their nodes are, a cure where frictionless nodes slide off."""

import numpy as np
import pytest

from tactile_core.geometry.cubic_spline import on_grid
from tactile_core.geometry.indenters import Ring, Sphere
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.contact import ContactProblem
from tactile_core.mechanics.fast.edge_contact import EdgeContactProblem, SpringRows, interpolated_points
from tactile_core.mechanics.fast.press import FORCE_TOLERANCE, CorrectedPress
from tactile_core.mechanics.penetration import PenetrationError, penetration_between
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.mechanics.solve import Step, solve, solve_path

SENSORS = ["biotac", "digit"]
RING = Ring(2.5e-3, 1e-3)
LEANING = Placement(-7.847e-3, 3.476e-3, 0.4526, 1.7439)
DEEP = 1.62e-3  # m, three times the wire's radius


@pytest.mark.parametrize("sensor", SENSORS)
def test_points_lie_on_the_smooth_surface_halfway_between_nodes(sensor):
    compliance = compliance_of(sensor)
    surface = compliance.surface
    points = interpolated_points(surface, compliance.touchable)
    np.testing.assert_allclose(points.weights.sum(axis=1), 1, atol=1e-15)
    heaviest = np.sort(points.weights, axis=1)[:, ::-1]
    along, amid = heaviest[:, 1] > 0.5, heaviest[:, 3] > 0.3  # of two nodes, and of four
    assert (along ^ amid).all() and 0.3 < amid.mean() < 0.37
    nodes = compliance.touchable[points.nodes[amid]]
    first = np.array(np.divmod(nodes[:, 5], surface.shape[1]), float)  # the lower of the middle two, either way
    expected = on_grid(surface.axes, first + 0.5, closed=surface.closed)
    np.testing.assert_allclose(points.interpolate(surface.rest[compliance.touchable])[amid], expected, atol=1e-15)


@pytest.mark.parametrize("sensor", SENSORS)
def test_points_move_with_their_nodes_and_their_springs(sensor):
    compliance, random = compliance_of(sensor), np.random.default_rng(5)
    points = interpolated_points(compliance.surface, compliance.touchable)
    m, some = len(compliance.touchable), np.sort(random.choice(len(points.nodes), 12, replace=False))
    near = np.concatenate([np.unique(points.nodes[some]), m + some])
    rows, inner = SpringRows(compliance, near, points, 2e-5), np.arange(len(compliance.watch_gap))[-3:]
    numbers = near[::3]
    force = random.normal(size=(len(numbers), 3)) * 0.01
    nodes, loads = rows.on_nodes(numbers, force)
    np.testing.assert_allclose(loads.sum(axis=0), force.sum(axis=0), atol=1e-15)
    moved = rows.moved(nodes, loads, inner[:0], np.zeros(0))[::3]
    moved[numbers >= m] += rows.softness * force[numbers >= m]
    block = rows.block(numbers)
    # single precision of sums of some hundred terms
    np.testing.assert_allclose(block, block.T, atol=1e-5 * block.max())
    np.testing.assert_allclose((force.ravel() @ block).reshape(-1, 3), moved, atol=1e-5 * np.abs(moved).max())
    watched = compliance.watch.reshape(m, 3, -1)[nodes][:, :, inner]
    felt = np.einsum("ki,kic->c", loads, watched)
    found = force.ravel() @ rows.sensing_motion(numbers, inner)
    np.testing.assert_allclose(found, felt, atol=1e-5 * np.abs(felt).max(initial=1e-9))


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_ball_that_nodes_hold_needs_no_points(sensor):
    ball, place = Sphere(7e-3), Placement(-8.2e-3, 1.13e-3)
    pose = pose_at(sensor, ball, place)
    plain, guarded = (kind(compliance_of(sensor), ball, pose, 0.4e-3) for kind in (ContactProblem, EdgeContactProblem))
    first, second = plain.at_depth(0.4e-3), guarded.at_depth(0.4e-3)
    assert second.converged
    np.testing.assert_array_equal(second.nodes, first.nodes)
    # m: gaps are closed to 0.2 um in both
    np.testing.assert_allclose(second.displacement, first.displacement, atol=0.5e-6)


def test_a_ring_deeper_than_its_wire_is_held_out_between_nodes():
    pose, compliance = pose_at("digit", RING, LEANING), compliance_of("digit")
    sunk = ContactProblem(compliance, RING, pose, DEEP)
    with pytest.raises(PenetrationError):
        sunk.check_follows(sunk.at_depth(DEEP))
    press = CorrectedPress(compliance, RING, pose, 2.4e-3)
    found = press.at_depth(DEEP).linear
    at = compliance.surface.rest + found.displacement
    assert found.converged and pose.moved(DEEP).distance(RING, at)[0].min() > -1e-6  # m, the target
    assert penetration_between("", compliance.surface.grid(at), RING, pose.moved(DEEP), DEEP, closed=False) < 100e-6
    np.testing.assert_allclose(found.nodal_force.sum(axis=0), found.force, atol=1e-12)
    # Of other steps to it: another order of the same sums, and 0.2 um of each gap.
    again = EdgeContactProblem(compliance, RING, pose, DEEP)
    half = again.at_depth(DEEP / 2)
    assert again.at_depth(DEEP, half).axial_force == pytest.approx(found.axial_force, rel=2e-3)


def test_its_force_is_found_too_and_the_full_tiers_is_within_what_is_stated():
    """3.48 N : the reference tier's without springs, as in ``test_between_nodes``."""
    direction = pose_at("digit", RING, LEANING).direction
    found = solve("digit", RING, LEANING, depth=DEEP, friction=0.0)
    force = float(found.force @ direction)
    assert abs(force / 3.48 - 1) < found.force_error
    back = solve("digit", RING, LEANING, force=force, friction=0.0)
    assert float(back.force @ direction) == pytest.approx(force, rel=FORCE_TOLERANCE)
    assert back.depth == pytest.approx(DEEP, rel=5e-3)  # forces grow a little slower than depths


def test_a_path_goes_on_with_points_from_where_nodes_no_longer_hold():
    steps = [Step(depth=share * DEEP) for share in (0.25, 0.5, 0.75, 1.0)]
    path = [float(np.linalg.norm(found.force)) for found in solve_path("digit", RING, LEANING, steps, friction=0.0)]
    alone = [
        float(np.linalg.norm(solve("digit", RING, LEANING, depth=step.depth, friction=0.0).force)) for step in steps
    ]
    np.testing.assert_allclose(path, alone, rtol=2e-3)  # as above
    assert np.all(np.diff(path) > 0)
