"""Springs between nodes: consistent with their energy, absent where nodes are enough, a cure where they slide off."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import Pose, Ring, Sphere
from tactile_core.mechanics import penetration
from tactile_core.mechanics.finite_strain import penalty_points
from tactile_core.mechanics.finite_strain.body import ONE_STEP, graded_body
from tactile_core.mechanics.finite_strain.contact_set import PlacedIndenter
from tactile_core.mechanics.finite_strain.penalty_points import PenaltyPoints
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.mechanics.solids.block_pattern import BlockPattern
from tactile_core.mechanics.solve import solve

FACE = np.arange(9)[None]  # one face of nine nodes, 0.5 mm apart
STIFFNESS = 3e3  # N/m
SMOOTH = Sphere(3.5e-3)


def face() -> np.ndarray:
    """Nodes (9, 3) m of a face that is curved and leans."""
    x, y = (0.5e-3 * (values.ravel() - 1) for values in np.meshgrid(np.arange(3), np.arange(3)))
    return np.stack([x, y, 0.03e-3 + 0.1 * x + 200 * x**2 - 90 * y**2], -1)


def ball() -> PlacedIndenter:
    """Over the face, its foremost point at the origin, moving along -z."""
    return PlacedIndenter(Sphere(3e-3), Pose(np.zeros(3), np.eye(3)))


def energy(at: np.ndarray) -> float:
    """Of the springs, J, with the nodes at (9, 3) m."""
    points = np.array([weights @ at for weights in penalty_points._WEIGHTS])
    deep = np.maximum(-ball().distance(points)[0] - penetration.SLACK, 0)
    return float(STIFFNESS * (deep**2).sum() / 2)


def test_points_lie_halfway_between_nodes_on_the_quadratic_face():
    weights = penalty_points._WEIGHTS
    xi, eta = (values.ravel() for values in np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]))  # of the nodes, xi first
    found = {(float(x), float(y)) for x, y in zip(weights @ xi, weights @ eta, strict=True)}
    line = -1.0, -0.5, 0.0, 0.5, 1.0
    assert found == {(x, y) for x in line for y in line if x % 1 or y % 1}
    for i, j in np.ndindex(3, 3):
        np.testing.assert_allclose(weights @ (xi**i * eta**j), (weights @ xi) ** i * (weights @ eta) ** j, atol=1e-14)


def test_force_and_stiffness_are_derivatives_of_the_energy():
    at, springs = face(), PenaltyPoints(FACE)
    pattern = BlockPattern(FACE, np.zeros(9, bool))
    residual, blocks = np.zeros((9, 3)), np.zeros((81, 3, 3))
    push = springs.push(ball(), at, STIFFNESS)
    push.add_to(residual, blocks, pattern)
    assert len(push.force) > 4 and push.total[2] < 0

    def forces(shifted: np.ndarray) -> np.ndarray:
        out = np.zeros((9, 3))
        springs.push(ball(), shifted, STIFFNESS).add_to(out, np.zeros((81, 3, 3)), pattern)
        return out.ravel()

    # m: no point comes in or goes; what differences of this size leave is 1e-4 of the stiffness, by rounding
    tiny, rows = 1e-9, []
    for k in range(27):
        step = np.zeros(27)
        step[k] = tiny
        ahead, behind = at + step.reshape(9, 3), at - step.reshape(9, 3)
        assert (energy(ahead) - energy(behind)) / (2 * tiny) == pytest.approx(residual.ravel()[k], rel=1e-4, abs=1e-8)
        rows.append((forces(ahead) - forces(behind)) / (2 * tiny))
    np.testing.assert_allclose(pattern.sparse(blocks).toarray(), np.array(rows), atol=1e-4 * STIFFNESS)


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_a_smooth_indenter_is_left_to_the_nodes(sensor):
    pose = pose_at(sensor, SMOOTH, Placement(0.0, 0.0))
    body = graded_body(sensor, SMOOTH, pose, 0.6e-3)
    touch = body.contact(SMOOTH, pose, 0.6e-3, 0.0).press(0.6e-3, step=ONE_STEP)
    assert not touch.guarded and not len(touch.push.force)


def test_a_ring_deeper_than_its_wire_is_held():
    """Within what it states of 3.48 N, the reference tier's without springs. Nodes alone let it through."""
    ring, place = Ring(2.5e-3, 1e-3), Placement(-7.847e-3, 3.476e-3, 0.4526, 1.7439)
    found = solve("digit", ring, place, depth=1.62e-3, tier="full", friction=0.0)
    along = float(found.force @ pose_at("digit", ring, place).direction)
    assert along == pytest.approx(3.48, rel=found.force_error) and found.penetration < 1e-6
    assert found.force_error < 0.05
