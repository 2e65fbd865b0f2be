"""Blocks on a fixed pattern say the same as a matrix that is assembled again, and a factor of them solves it."""

import numpy as np
import pytest
import scipy.sparse
from slab import assemble, slab_mesh

from tactile_core.mechanics.solids import sparse_cholesky as factors
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.sparse_cholesky import NotPositiveDefiniteError, PatternFactor
from tactile_core.sensors import Material

RUBBER = Material(1e6, 0.48)


@pytest.fixture(scope="module")
def solid():
    x = np.linspace(-1, 1, 5) * 1e-3
    return FiniteStrainSolid(slab_mesh(x, x, x[::-1].copy())[0], RUBBER)


@pytest.fixture(scope="module")
def blocks(solid):
    return solid.linearise(solid.rest()).blocks()


def test_the_sparse_matrix_is_the_assembled_one(solid, blocks):
    difference = solid.pattern.sparse(blocks) - assemble(solid.mesh, RUBBER)
    assert abs(difference).max() < 1e-12 * abs(blocks).max()  # round-off


def test_find_names_the_block_of_a_pair(solid, blocks):
    pattern = solid.pattern
    some = np.arange(0, len(pattern.rows), 97)
    np.testing.assert_array_equal(pattern.find(pattern.rows[some], pattern.columns[some]), some)


def test_turning_nodes_is_a_congruence(solid, blocks):
    nodes = np.array([30, 77])
    turn, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    turned = blocks.copy()
    solid.pattern.turn(turned, nodes, np.stack([turn, turn]))
    whole = scipy.sparse.lil_matrix(scipy.sparse.identity(3 * len(solid.mesh.nodes)))
    for node in nodes:
        whole[3 * node : 3 * node + 3, 3 * node : 3 * node + 3] = turn
    expected = whole.T @ solid.pattern.sparse(blocks) @ whole
    assert abs(solid.pattern.sparse(turned) - expected).max() < 1e-12 * abs(blocks).max()


@pytest.fixture(params=["pardiso", "fallback"])
def pattern_factor(request, monkeypatch):
    if request.param == "fallback":
        monkeypatch.setattr(factors, "_pardiso", lambda: None)
    elif factors._pardiso() is None:
        pytest.skip("pypardiso is not installed")
    return PatternFactor()


def test_held_degrees_of_freedom_keep_what_the_right_side_says(solid, blocks, pattern_factor):
    pattern = solid.pattern
    held = np.zeros(len(pattern.free), bool)
    held[::7] = True
    load = np.where(held, 0.0, np.random.default_rng(1).standard_normal(len(held)))[:, None]
    answer = pattern_factor(pattern.upper(blocks, held))(load)[:, 0]
    assert not answer[held].any()
    whole = np.zeros(3 * pattern.n_nodes)
    whole[pattern.free] = answer
    left = (pattern.sparse(blocks) @ whole)[pattern.free] - load[:, 0]
    assert np.abs(left[~held]).max() < 1e-9  # of a load of one newton: the condition of the matrix times round-off
    again = pattern_factor(pattern.upper(2 * blocks, held))(load)[:, 0]  # the analysis is kept, the numbers are new
    np.testing.assert_allclose(2 * again, answer, atol=1e-9 * np.abs(answer).max())


def test_an_unstable_matrix_is_refused(solid, blocks, pattern_factor):
    with pytest.raises(NotPositiveDefiniteError):
        pattern_factor(solid.pattern.upper(-blocks, np.zeros(len(solid.pattern.free), bool)))


def test_the_analysis_of_a_pattern_is_made_once(solid, blocks, monkeypatch):
    """It costs about as much as a factor; SciPy wraps a pattern's arrays again for every matrix."""
    if factors._pardiso() is None:
        pytest.skip("pypardiso is not installed")
    phases, run = [], PatternFactor._run
    monkeypatch.setattr(
        PatternFactor, "_run", lambda self, a, b, phase: (phases.append(phase), run(self, a, b, phase))[1]
    )
    factor, held = PatternFactor(), np.zeros(len(solid.pattern.free), bool)
    for scale in (1.0, 2.0, 3.0):
        factor(solid.pattern.upper(scale * blocks, held))
    assert phases.count(factors._ANALYSE) == 1 and phases.count(factors._FACTORISE) == 3


def test_a_refused_matrix_leaves_the_factor_usable(solid, blocks, pattern_factor):
    held = np.zeros(len(solid.pattern.free), bool)
    load = np.ones((len(held), 1))
    before = pattern_factor(solid.pattern.upper(blocks, held))(load)
    with pytest.raises(NotPositiveDefiniteError):
        pattern_factor(solid.pattern.upper(-blocks, held))
    np.testing.assert_array_equal(pattern_factor(solid.pattern.upper(blocks, held))(load), before)
