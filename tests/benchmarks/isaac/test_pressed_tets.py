"""Linear tetrahedra: consistent derivatives, exact even strains, honest contact, and its answer on the public mesh."""

import itertools

import numpy as np
import pytest
from benchmarks.isaac.corotated_tets import CorotatedTets
from benchmarks.isaac.pressed_tets import SKIN, first_touch, near_body, on_back, press
from benchmarks.isaac.tet_file import checked, read_tet
from slab import slab_mesh

from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid, State
from tactile_core.sensors import Material

BALL = Sphere(3.5e-3)


def block(count=6, size=8e-3, thickness=3e-3):
    """A flat layer, its surface toward -y, cut into six tetrahedra a brick (Kuhn)."""
    across, through = np.linspace(-size / 2, size / 2, count + 1), np.linspace(0, thickness, count // 2 + 1)
    grid = np.stack(np.meshgrid(across, through, across, indexing="ij"), -1)
    ids = np.arange(grid[..., 0].size).reshape(grid.shape[:3])
    cells = []
    for order in itertools.permutations(range(3)):
        corner, path = np.zeros(3, int), [np.zeros(3, int)]
        for axis in order:
            corner = corner + np.eye(3, dtype=int)[axis]
            path.append(corner)
        cells.append(
            np.stack([ids[tuple(slice(c, c - 1 or None) for c in place)] for place in path], -1).reshape(-1, 4)
        )
    mesh = checked(grid.reshape(-1, 3), np.concatenate(cells))
    return mesh, mesh.nodes[:, 1] > thickness - 1e-9


@pytest.fixture(scope="module")
def layer():
    return block()


@pytest.fixture(scope="module")
def solid(layer):
    return CorotatedTets(*layer, SKIN)


def disturbed(solid, size=1e-4):
    random = np.random.default_rng(0)
    shape = solid.mesh.nodes.shape
    return State(size * random.standard_normal(shape), np.zeros(0)), random.standard_normal(shape)


def test_force_is_the_derivative_of_the_energy(solid):
    state, way = disturbed(solid)
    step = 1e-9
    ahead, behind = (solid.energy(State(state.displacement + sign * step * way, state.pressure)) for sign in (1, -1))
    force = solid.linearise(state).internal_force()
    assert (ahead - behind) / (2 * step) == pytest.approx(force @ way.ravel(), rel=1e-6)  # step^2 and round-off


def test_matrix_is_the_derivative_of_the_force_and_symmetric(solid):
    state, way = disturbed(solid)
    step = 1e-9
    ahead, behind = (
        solid.linearise(State(state.displacement + sign * step * way, state.pressure)).internal_force()
        for sign in (1, -1)
    )
    matrix = solid.linearise(state).matrix()
    found = matrix @ way.ravel()
    np.testing.assert_allclose((ahead - behind) / (2 * step), found, atol=1e-6 * np.abs(found).max())
    assert abs(matrix - matrix.T).max() < 1e-12 * abs(matrix).max()


def even(solid, gradient):
    return State(solid.mesh.nodes @ (gradient - np.eye(3)).T, np.zeros(0))


def test_an_even_strain_leaves_inner_nodes_without_force(layer, solid):
    force = solid.linearise(even(solid, np.array([[1.1, 0.1, 0], [0, 0.95, 0], [0, 0.05, 1]]))).internal_force()
    inner = np.setdiff1d(np.arange(len(layer[0].nodes)), layer[0].surface)
    assert len(inner)
    assert np.abs(force.reshape(-1, 3)[inner]).max() < 1e-12 * np.abs(force).max()


def test_the_modulus_is_the_one_given(solid):
    strain, material = 1e-6, SKIN
    stretch = np.diag([1 + strain, 1 - material.poisson * strain, 1 - material.poisson * strain])
    stress, _ = solid.stress_tangent(stretch[None])
    np.testing.assert_allclose(stress[0], np.diag([material.youngs * strain, 0, 0]), atol=1e-3 * strain * 1e6)


def test_turning_the_body_costs_nothing(solid):
    cosine, sine = np.cos(0.9), np.sin(0.9)
    turned = even(solid, np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]]))
    stiff = SKIN.youngs * 1e-3  # N over a displacement of a millimetre
    assert np.abs(solid.linearise(turned).internal_force()).max() < 1e-12 * stiff
    assert abs(solid.energy(turned)) < 1e-12 * stiff * 1e-3


def test_a_cell_turned_inside_out_is_noticed(solid):
    with pytest.raises(FloatingPointError, match="inside out"):
        solid.linearise(even(solid, -np.eye(3)))


def above(point=(0.0, 0.0, 0.0)):
    return pose_on(BALL, np.array(point), np.array([0, -1.0, 0]))


def test_a_press_keeps_the_laws_of_contact(layer):
    mesh, attached = layer
    pose = above()
    found = press(mesh, attached, BALL, pose, 0.6e-3)
    assert found.converged and found.depth == 0.6e-3 and found.report["ended"] == ""
    assert (found.displacement[attached] == 0).all()
    outside = ~found.contact_patch & np.isin(np.arange(len(mesh.nodes)), mesh.surface)
    at = mesh.nodes + found.displacement
    gap, normal = pose.moved(0.6e-3).distance(BALL, at)
    assert gap[outside].min() > -1e-9 and np.abs(gap[found.contact_patch]).max() < 1e-9  # newton.GAP_TOLERANCE
    force = CorotatedTets(mesh, attached, SKIN).linearise(State(found.displacement, np.zeros(0))).internal_force()
    force = force.reshape(-1, 3)
    pressing = np.einsum("nk,nk->n", force, normal)
    assert (pressing[found.contact_patch] > 0).all()
    along = pressing[:, None] * normal
    np.testing.assert_allclose(force[found.contact_patch], along[found.contact_patch], atol=1e-6)  # no friction
    np.testing.assert_allclose(force[found.contact_patch].sum(0), found.force, atol=1e-6)
    loose = ~found.contact_patch & ~attached
    assert np.abs(force[loose]).max() < 1e-6 * np.abs(force).max()
    assert found.force[1] > 0 and abs(found.force[0]) < 0.02 * found.force[1]  # Kuhn's cut is not quite symmetric


def test_a_press_that_finds_no_equilibrium_keeps_what_it_reached():
    mesh, attached = block(count=4, thickness=2.4e-3)
    found = press(mesh, attached, BALL, above(), 2.4e-3)  # all the way through
    assert not found.converged
    assert 0.5e-3 < found.depth < 2.4e-3 and "no equilibrium" in found.report["ended"]
    again = press(mesh, attached, BALL, above(), found.depth)
    np.testing.assert_allclose(again.force, found.force, rtol=1e-5)


@pytest.mark.parametrize("depth", [-1e-4, 3e-3, float("nan")])
def test_an_impossible_depth_is_refused(depth, layer):
    with pytest.raises(TactileError, match=r"0 to 2\.5 mm"):
        press(*layer, BALL, above(), depth)


def test_first_touch_is_found_from_far_and_from_within(layer):
    mesh, _ = layer
    for start in (5e-3, -1e-3):
        pose = first_touch(mesh, BALL, above().moved(-start))
        assert pose.distance(BALL, mesh.nodes)[0].min() == pytest.approx(0, abs=1e-9)
    with pytest.raises(TactileError, match="misses"):
        first_touch(mesh, BALL, above((30e-3, 0, 0)))


def test_linear_tetrahedra_agree_with_mixed_hexahedra_and_lock_where_nearly_incompressible():
    """On the same nodes, 0.67 mm apart; a prototype had up to 1.7 times too much force at nu .48 (docs/sources.md)."""
    mesh, attached = block(12)
    across = np.linspace(-4, 4, 13) * 1e-3
    hexes, _ = slab_mesh(across, across, np.linspace(3, 0, 7) * 1e-3)
    ratio = []
    for material in (Material(1e6, 0.2), Material(1e6, 0.49)):
        mixed = FiniteStrainContact(FiniteStrainSolid(hexes, material), hexes.surface, BALL, above())
        linear = press(mesh, attached, BALL, above(), 0.2e-3, material)
        ratio.append(linear.force[1] / mixed.press(0.2e-3, step=0.2e-3).force[1])
    assert ratio[0] == pytest.approx(1, abs=0.1)  # both are stiff on so few nodes
    assert ratio[1] > 1.25


def test_a_mesh_in_another_frame_is_refused(layer):
    moved = checked(layer[0].nodes - 0.05, layer[0].cells)
    with pytest.raises(TactileError, match="0 of 196 nodes lie on the rigid part"):
        on_back(moved)


def test_a_body_that_cannot_hold_is_refused(layer, tmp_path):
    import trimesh

    trimesh.creation.box((1e-2, 1e-3, 1e-2), trimesh.transformations.translation_matrix([0, 3.4e-3, 0])).export(
        tmp_path / "plate.stl"
    )
    np.testing.assert_array_equal(near_body(layer[0], tmp_path / "plate.stl"), layer[1])
    (tmp_path / "noise.obj").write_text("v 0 0\nf 1 2 3")
    open_box = trimesh.creation.box((1e-2, 1e-3, 1e-2))
    open_box.update_faces(np.arange(12) > 0)
    open_box.export(tmp_path / "open.stl")
    said = {"absent.obj": "cannot be read", "noise.obj": "not closed|cannot be read", "open.stl": "not closed"}
    for name, words in said.items():
        with pytest.raises(TactileError, match=words):
            near_body(layer[0], tmp_path / name)


def test_the_public_skin_is_held_as_its_core_holds_it(outside_data):
    folder = outside_data("biotac_mesh")
    mesh = read_tet(folder / "skin.tet")
    assert near_body(mesh, folder / "core.obj").sum() == 532  # the number of hex_mesh's comment
