"""The solid: patch test, rigid motions, incompressibility, orientation."""

import numpy as np
import pytest
from slab import assemble, slab_mesh

from tactile_core.mechanics.solids.elasticity import cell_stiffness, reference_gradients
from tactile_core.mechanics.solids.hex_mesh import gel_mesh, skin_mesh
from tactile_core.sensors import Material

RUBBER = Material(youngs=1e6, poisson=0.48)


@pytest.fixture(scope="module")
def bent_block():
    """A block of 2 x 2 x 2 cells whose inner nodes are moved, so that no cell is a brick."""
    x = np.linspace(-1, 1, 5) * 1e-3
    mesh, _ = slab_mesh(x, x, x[::-1])
    nodes = mesh.nodes.copy()
    inside = (np.abs(nodes) < 0.9e-3).all(axis=1)
    nodes[inside] += np.random.default_rng(0).uniform(-4e-5, 4e-5, (inside.sum(), 3))
    return nodes, mesh, inside


def test_patch_test_linear_displacement_is_exact(bent_block):
    nodes, mesh, inside = bent_block
    moved = type(mesh)(nodes, mesh.cells, mesh.clamped, mesh.surface, mesh.inner)
    stiffness = assemble(moved, RUBBER).toarray()
    strain = np.random.default_rng(1).standard_normal((3, 3)) * 1e-3
    exact = nodes @ strain.T
    free = np.repeat(inside, 3)
    given = exact.ravel() * ~free
    found = np.linalg.solve(stiffness[free][:, free], -(stiffness @ given)[free])
    # round-off of a well conditioned system of 81 unknowns
    np.testing.assert_allclose(found, exact.ravel()[free], atol=1e-11 * np.abs(exact).max() / 1e-2)


def test_rigid_motion_costs_no_force(bent_block):
    nodes, mesh, _ = bent_block
    stiffness = cell_stiffness(nodes[mesh.cells], RUBBER)
    corners = nodes[mesh.cells]
    turned = np.cross([1.0, 2.0, 3.0], corners)
    for motion in (np.broadcast_to([1.0, 0, 0], corners.shape), turned):
        force = np.einsum("eij,ej->ei", stiffness, motion.reshape(len(corners), 81))
        scale = np.abs(stiffness).max() * np.abs(motion).max()
        assert np.abs(force).max() < 1e-12 * scale  # round-off of 81 products


def test_cells_that_are_turned_inside_out_are_refused(bent_block):
    nodes, mesh, _ = bent_block
    with pytest.raises(ValueError, match="inside out"):
        cell_stiffness(nodes[mesh.cells] * [1, 1, -1], RUBBER)


@pytest.mark.parametrize("make", [gel_mesh, skin_mesh])
def test_sensor_meshes_have_positive_volume_and_clamped_nodes(make):
    mesh = make()
    jacobians = np.einsum("qak,ead->eqkd", reference_gradients()[2], mesh.nodes[mesh.cells], optimize=True)
    assert (np.linalg.det(jacobians) > 0).all()  # at every Gauss point
    assert 0 < mesh.clamped.sum() < len(mesh.nodes) / 5
    assert not mesh.clamped[mesh.surface].all()
