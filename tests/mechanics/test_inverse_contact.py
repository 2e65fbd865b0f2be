"""Traction read off a deformed surface: that of the contact that deformed it, and nothing that pulls."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.contact import ContactProblem
from tactile_core.mechanics.inverse_contact import pressing_traction
from tactile_core.mechanics.node_areas import node_areas, traction
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.sensors.unrolling import node_normals
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.training.step_errors import true_displacement
from tactile_core.translation.gel_place import contact_patch

CONTACTS = Path(__file__).resolve().parents[2] / "scenes" / "training" / "test_contacts.h5"


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_a_linear_contact_is_read_back(sensor):
    """The layer gives 0.1 % of the thickness over E; a ball's rim, where the traction falls to zero, blurs by that."""
    compliance, ball = compliance_of(sensor), Sphere(3e-3)
    pose = pose_at(sensor, ball, Placement(-8e-3, 1e-3))
    contact = ContactProblem(compliance, ball, pose, 0.4e-3, 0.78).at_pose(pose.moved(0.3e-3))
    nodes, areas = compliance.touchable[contact.nodes], node_areas(sensor)
    patch = np.zeros(len(areas), bool)
    patch[nodes] = True
    expected = traction(sensor, nodes, contact.nodal_force)
    found = pressing_traction(sensor, contact.displacement, patch)
    assert not len(contact.core_nodes) and not found[~patch].any()
    np.testing.assert_allclose(areas @ found, contact.force, atol=0.01 * np.linalg.norm(contact.force))
    assert areas @ np.abs(found - expected).sum(1) < 0.05 * (areas @ np.abs(expected).sum(1))


def test_gels_solved_at_finite_strain_press_with_their_force():
    pairs, surface = read_pairs(CONTACTS), sensors.digit_surface()
    still = np.flatnonzero(~pairs.slide.any(-1))[::40]
    with h5py.File(CONTACTS) as file:
        true = file["force_digit"][()][still]
    moved = true_displacement(pairs, "digit", still).astype(float)
    outward = node_normals(surface.rest, surface.faces)
    missed = []
    for one, patch, force in zip(moved, contact_patch(moved, surface), true, strict=True):
        found = pressing_traction("digit", one, patch)
        assert (np.einsum("nk,nk->n", found, outward) <= 0).all() and not found[~patch].any()
        missed.append(np.linalg.norm(node_areas("digit") @ found - force) / np.linalg.norm(force))
    assert np.median(missed) < 0.1  # 6 % measured on 30 of them; the functional fitted to such contacts 13 %
