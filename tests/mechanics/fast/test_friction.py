"""Coulomb's law node by node, partial slip against Cattaneo and Mindlin, and full sliding."""

import dataclasses

import numpy as np
import pytest
from slab import slab_compliance

from tactile_core.geometry.indenters import Cylinder, Pose, Sphere, pose_on
from tactile_core.mechanics.fast.contact import ContactProblem
from tactile_core.sensors import Material

SPACING, THICKNESS, RADIUS, FRICTION = 0.12e-3, 4e-3, 3.5e-3, 0.3
DOWN, ALONG = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def layer():
    """A bonded layer, nearly incompressible, so that normal forces hardly move the surface sideways."""
    fine = np.arange(-8, 9) * SPACING
    far = np.geomspace(fine[-1], 12e-3, 9)[1:]
    x = np.r_[-far[::-1], fine, far]
    y = -np.array([0, 0.3, 0.6, 0.75, 0.9, 0.95, 1]) * THICKNESS
    return slab_compliance(x, x, y, Material(1e6, 0.49), reach=1.3e-3)


def above(indenter) -> Pose:
    return pose_on(indenter, np.array([0, -THICKNESS, 0]), DOWN)


def shifted(pose: Pose, by: float) -> Pose:
    return dataclasses.replace(pose, apex=pose.apex + by * ALONG)


def placed(layer, contact):
    """Where the nodes that carry force stand, (k, 3) m."""
    nodes = layer.touchable[contact.nodes]
    return layer.surface.rest[nodes] + contact.displacement[nodes]


def forces(layer, indenter, contact):
    """Normal forces (k,) and tangential ones (k, 3)."""
    _, normal = contact.pose.distance(indenter, placed(layer, contact))
    pressing = np.einsum("ai,ai->a", contact.nodal_force, normal)
    return pressing, contact.nodal_force - pressing[:, None] * normal


def press(layer, indenter, depth, friction):
    problem = ContactProblem(layer, indenter, above(indenter), depth, friction)
    return problem, problem.at_depth(depth)


def slide(problem, contact, step, steps):
    """Contacts along a straight way at the same axial force."""
    force, start = contact.axial_force, contact.pose
    for number in range(1, steps + 1):
        contact = problem.at_pose(shifted(start, number * step), contact, axial_force=force)
        assert contact.converged and contact.axial_force == pytest.approx(force, rel=1e-6)
        yield contact


@pytest.fixture(scope="module")
def partial(layer):
    """Pressed without friction, as the theory has it, then dragged sideways with it."""
    ball = Sphere(RADIUS)
    _, contact = press(layer, ball, 0.15e-3, 0.0)
    problem = ContactProblem(layer, ball, above(ball), 0.15e-3, FRICTION)
    return ball, list(slide(problem, contact, 4e-6, 9))


def test_partial_slip_of_a_ball(partial):
    """Cattaneo 1938, Mindlin 1949: a disc of radius c = a (1 - Q / (mu P))^(1/3) sticks."""
    for contact in partial[1]:
        used = contact.force[0] / (FRICTION * contact.axial_force)
        radius = np.sqrt((~contact.slipping).sum() / len(contact.nodes))
        assert radius == pytest.approx((1 - used) ** (1 / 3), abs=0.08)  # half a spacing over the contact's radius
    assert used > 0.6


def test_force_within_each_nodes_cone(layer, partial):
    ball, contacts = partial
    for contact in contacts:
        pressing, tangential = forces(layer, ball, contact)
        size = np.linalg.norm(tangential, axis=1)
        assert (pressing > 0).all()
        # normals are settled to 1e-4 of the whole force
        assert (size <= FRICTION * pressing + 2e-4 * pressing.sum()).all()
        np.testing.assert_allclose(
            size[contact.slipping], FRICTION * pressing[contact.slipping], atol=2e-4 * pressing.sum()
        )


def test_sticking_nodes_do_not_move_on_the_indenter(layer, partial):
    for before, after in zip(partial[1], partial[1][1:], strict=False):
        both = np.intersect1d(before.nodes, after.nodes[~after.slipping])
        spots = [
            (placed(layer, c)[np.searchsorted(c.nodes, both)] - c.pose.apex) @ c.pose.axes for c in (before, after)
        ]
        assert len(both) > 30
        assert np.linalg.norm(spots[1] - spots[0], axis=1).max() < 0.3e-6  # m: the tolerances of gap and slip together


def test_friction_opposes_the_slip(layer, partial):
    ball, contacts = partial
    for before, after in zip(contacts, contacts[1:], strict=False):
        both = np.intersect1d(before.nodes, after.nodes[after.slipping])
        at = np.searchsorted(after.nodes, both)
        spots = before.pose.to_own(placed(layer, before)[np.searchsorted(before.nodes, both)])
        slip = placed(layer, after)[at] - after.pose.from_own(spots)
        _, tangential = forces(layer, ball, after)
        friction = tangential[at] / np.linalg.norm(tangential[at], axis=1)[:, None]
        along = np.einsum("ai,ai->a", slip, friction)
        assert len(both) > 10 and along.max() < 0.1e-6  # m: the tolerance of slip, and normals settled to 1e-4
        assert np.linalg.norm(slip - along[:, None] * friction, axis=1).max() < 0.3e-6  # m: of gap and slip together


def test_all_friction_is_spent_in_a_long_slide(layer):
    punch = Cylinder(0.6e-3, 0.15e-3)
    problem, contact = press(layer, punch, 0.1e-3, FRICTION)
    *_, contact = slide(problem, contact, 20e-6, 10)
    pressing, tangential = forces(layer, punch, contact)
    assert contact.slipping.all()
    # normals, as above
    np.testing.assert_allclose(np.linalg.norm(tangential, axis=1).sum(), FRICTION * pressing.sum(), rtol=1e-3)
    assert (tangential[:, 0] > 0).mean() > 0.95  # the indenter moves along +x and drags the surface with it
    # under the flat all forces are along the way; nodes at the rounded rim lean
    assert contact.force[0] == pytest.approx(FRICTION * contact.axial_force, rel=0.1)


def test_little_friction_is_no_friction(layer):
    ball = Sphere(RADIUS)
    _, without = press(layer, ball, 0.15e-3, 0.0)
    _, little = press(layer, ball, 0.15e-3, 1e-6)
    assert without.sideways < 1e-4 and without.slipping.all()
    # gaps are closed to 0.2 um
    np.testing.assert_allclose(little.displacement, without.displacement, atol=0.3e-6)
    assert little.axial_force == pytest.approx(without.axial_force, rel=2e-3)  # 0.2 um of 150 um


def test_way_back_recovers_the_force(layer):
    """Unloading a path that only stuck leaves no memory; one that slipped does (hysteresis)."""
    ball = Sphere(RADIUS)
    problem, first = press(layer, ball, 0.15e-3, 5.0)
    there = problem.at_pose(shifted(first.pose, 4e-6), first)
    back = problem.at_pose(first.pose, there)
    np.testing.assert_allclose(back.force, first.force, atol=2e-3 * first.axial_force)
    slipped, contacts = press(layer, ball, 0.15e-3, 0.1)
    for share in (1, 2, 3, 2, 1, 0):
        contacts = slipped.at_pose(shifted(first.pose, share * 10e-6), contacts)
    assert contacts.force[0] < -0.03 * contacts.axial_force
