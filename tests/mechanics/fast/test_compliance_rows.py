"""What is followed near an indenter: the same nodes and motions as when the whole surface is looked at."""

import numpy as np
import pytest
from benchmarks.mechanics.random_contacts import INDENTERS

from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.compliance_rows import ComplianceBlock, ComplianceRows, surface_motion
from tactile_core.mechanics.fast.contact import ContactProblem
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.sensors import sensor_surface


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
def test_near_nodes_move_as_on_the_whole_surface(sensor):
    compliance, random = compliance_of(sensor), np.random.default_rng(3)
    near = np.sort(random.choice(len(compliance.touchable), 60, replace=False))  # on both sides of the mirror plane
    inner = np.arange(len(compliance.watch_gap))[-4:]
    rows, inner_force = ComplianceRows(compliance, near), np.full(len(inner), 0.01)
    for some in (slice(0, 20), slice(10, 50)):  # half of the second ones are known by then
        nodes = near[some]
        force = random.normal(size=(len(nodes), 3)) * 0.01
        whole = surface_motion(compliance, nodes, force, inner, inner_force)[compliance.touchable[near]]
        found = rows.moved(nodes, force, inner, inner_force)
        # single precision of sums of some hundred terms
        np.testing.assert_allclose(found, whole, rtol=0, atol=1e-5 * np.abs(whole).max())
        without = rows.moved(nodes, force, inner[:0], inner_force[:0])[some]
        np.testing.assert_allclose(
            (force.ravel() @ rows.block(nodes)).reshape(-1, 3), without, rtol=0, atol=1e-5 * np.abs(without).max()
        )


@pytest.mark.parametrize("sensor", ["biotac", "digit"])
@pytest.mark.parametrize("name", INDENTERS)
def test_no_near_node_is_ruled_out(name, sensor):
    surface, indenter = sensor_surface(sensor), INDENTERS[name]
    pose = pose_at(sensor, indenter, Placement(-8e-3, 1e-3, 0.3, 1.0))
    for other in (pose.moved(0.7e-3), pose.moved(0.3e-3).slid(0.4e-3, -0.2e-3), pose.moved(1.8e-3)):
        every, _ = other.distance(indenter, surface.rest)
        for reach in (0.0, 0.8e-3, np.inf):
            nodes, gap = surface.blocks.near(indenter, other, reach)
            np.testing.assert_array_equal(nodes, np.flatnonzero(every < reach))
            np.testing.assert_allclose(gap, every[nodes], rtol=0, atol=1e-15)  # m, of products of fewer points


def test_nodes_are_followed_as_the_indenter_slides_on():
    compliance, ball = compliance_of("digit"), INDENTERS["sphere 3.5"]
    pose = pose_at("digit", ball, Placement(-8e-3, 0.0))
    problem = ContactProblem(compliance, ball, pose, 0.3e-3, 0.78)
    contact = problem.at_pose(pose.moved(0.3e-3))
    for along in (0.5e-3, 3e-3):
        there = pose.moved(0.3e-3).slid(along, 0.0)
        contact = problem.at_pose(there, contact)
        gap, _ = there.distance(ball, compliance.surface.rest + contact.displacement)
        assert contact.converged and contact.axial_force > 0
        assert gap.min() > -1e-6  # m, the target


def test_turning_some_normals_is_the_same_as_starting_with_them():
    skin = compliance_of("biotac")
    nodes = np.arange(400, 440)
    block = ComplianceBlock(skin, nodes, skin.feet + np.arange(5), ComplianceRows(skin, nodes))
    random = np.random.default_rng(0)
    before, after = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in random.normal(size=(2, block.k, 3)))
    at = np.array([0, 7, 39])
    mixed = before.copy()
    mixed[at] = after[at]
    whole = block.normal(mixed)
    # single precision of sums of nine terms
    np.testing.assert_allclose(block.turned(block.normal(before), mixed, at), whole, atol=1e-6 * np.abs(whole).max())
