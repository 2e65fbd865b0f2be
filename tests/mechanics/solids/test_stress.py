"""Stress of known deformations: exact where the field is even, blind to turning, and in balance with the forces."""

import numpy as np
import pytest
from slab import slab_mesh

from tactile_core.mechanics.solids import stress
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.sensors import Material

RUBBER = Material(1e6, 0.45)
EXACT = 1e-10 * RUBBER.youngs  # round-off of strains of order one


@pytest.fixture(scope="module")
def block():
    x = np.linspace(-1, 1, 5) * 1e-3
    mesh, _ = slab_mesh(x, x, x[::-1].copy())
    random = np.random.default_rng(3)
    middle = np.abs(mesh.nodes).max(1) < 0.9e-3
    mesh.nodes[middle] += random.uniform(-5e-5, 5e-5, (int(middle.sum()), 3))  # a patch test needs bent cells
    return FiniteStrainSolid(mesh, RUBBER)


def even(solid, gradient):
    """The state of one deformation gradient everywhere, with the pressure that belongs to its volume."""
    state = solid.rest()
    state.displacement = solid.mesh.nodes @ (gradient - np.eye(3)).T
    state.pressure[:, 0] = solid.law.bulk * (np.linalg.det(gradient) - 1)
    return state


def turn(angle, axis=(1, 2, 3)):
    import scipy.spatial.transform

    return scipy.spatial.transform.Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)).as_matrix()


def test_uniaxial_tension_is_exact(block):
    """F = diag(a, b, b), so that with J = a b^2 the stress is mu J^-5/3 dev(F F^T) + kappa (J - 1)."""
    a, b = 1.4, 0.87
    volume = a * b**2
    shear = RUBBER.youngs / (2 * (1 + RUBBER.poisson))
    difference = shear * volume ** (-5 / 3) * (a**2 - b**2)  # of the two principal stresses
    found = stress.cauchy(block, even(block, np.diag([a, b, b])))
    np.testing.assert_allclose(found[..., 0, 0] - found[..., 1, 1], difference, atol=EXACT)
    np.testing.assert_allclose(stress.von_mises(found), difference, atol=EXACT)
    mean = np.einsum("eqii->eq", found) / 3
    np.testing.assert_allclose(mean, block.law.bulk * (volume - 1), atol=EXACT)
    nodes = stress.at_nodes(block, found)
    np.testing.assert_allclose(nodes, np.broadcast_to(found[0, 0], nodes.shape), atol=10 * EXACT)


def sheared(solid, rotation=None):
    rotation = np.eye(3) if rotation is None else rotation
    return even(solid, rotation @ np.array([[1.1, 0.3, 0], [0, 0.95, 0.1], [0.05, 0, 1.0]]))


def test_turning_turns_the_stress_and_leaves_von_mises_alone(block):
    rotation = turn(1.1)
    still, turned = (stress.cauchy(block, sheared(block, r)) for r in (None, rotation))
    np.testing.assert_allclose(turned, rotation @ still @ rotation.T, atol=EXACT)
    np.testing.assert_allclose(stress.von_mises(turned), stress.von_mises(still), atol=EXACT)


def test_stress_is_symmetric_and_forces_are_in_balance(block):
    state = sheared(block)
    state.displacement += 1e-5 * np.random.default_rng(0).standard_normal(state.displacement.shape)
    found = stress.cauchy(block, state)
    np.testing.assert_allclose(found, found.swapaxes(2, 3), atol=EXACT)
    force = stress.nodal_force(block, state)
    np.testing.assert_allclose(force, block.linearise(state).internal_force(condensed=False).reshape(-1, 3), atol=1e-12)
    largest, moved = np.abs(force).max(), block.mesh.nodes + state.displacement
    assert np.abs(force.sum(0)).max() < 1e-10 * largest
    assert np.abs(np.cross(moved, force).sum(0)).max() < 1e-10 * largest * 2e-3  # moments, over the block's size


def test_a_linear_field_comes_back_at_the_nodes_and_a_curved_one_converges():
    """Linear: exactly. Quadratic: second order in the spacing."""
    errors = []
    for count in (5, 9):
        x = np.linspace(-1, 1, count) * 1e-3
        mesh, _ = slab_mesh(x, x, x[::-1].copy())
        solid = FiniteStrainSolid(mesh, RUBBER)
        at = quadrature_points(mesh)
        slope = np.array([100.0, -200.0, 300.0])
        np.testing.assert_allclose(stress.at_nodes(solid, at @ slope), mesh.nodes @ slope, atol=1e-12)
        found = stress.at_nodes(solid, (1e3 * at[..., 0]) ** 2)
        errors.append(np.abs(found - (1e3 * mesh.nodes[:, 0]) ** 2).max())
    assert np.log2(errors[0] / errors[1]) > 1.9


def quadrature_points(mesh):
    """(n_cells, 27, 3) m, of straight cells: (1 - xi) / 2 and (1 + xi) / 2 of the corners along each axis."""
    points, _, _ = stress.reference_gradients()
    corners = mesh.nodes[mesh.cells].reshape(-1, 3, 3, 3, 3)[:, ::2, ::2, ::2]
    x, y, z = (np.stack([1 - points[:, k], 1 + points[:, k]]) / 2 for k in range(3))
    return np.einsum("cq,bq,aq,ecbad->eqd", z, y, x, corners)


def test_a_cell_turned_inside_out_is_noticed(block):
    state = block.rest()
    state.displacement = -2 * block.mesh.nodes
    for find in (stress.cauchy, FiniteStrainSolid.linearise):
        with pytest.raises(FloatingPointError, match="inside out"):
            find(block, state)
