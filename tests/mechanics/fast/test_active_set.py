"""The complementarity problem: its laws on random matrices, with a free depth, and when all exchanges are refused."""

import numpy as np
import pytest

from tactile_core.mechanics.fast import active_set
from tactile_core.mechanics.fast.active_set import UnsolvedError, complement


def problem(seed: int, n: int = 40) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    root = random.normal(size=(n, n))
    return (root @ root.T / n + 0.1 * np.eye(n)) * 1e-2, random.normal(size=n) * 1e-4


def check(matrix, gap, solved, along=0.0):
    opened = matrix @ solved.pressing + gap - solved.step * along
    assert (solved.pressing >= -1e-9).all() and (opened > -1e-10).all()  # N, m: the solver's own noise
    assert np.abs(solved.pressing * opened).max() < 1e-9 * 1e-2  # N m, of forces of 1e-2 N


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("touching_at_first", [False, True])
def test_one_of_force_and_gap_is_zero(seed, touching_at_first):
    matrix, gap = problem(seed)
    check(matrix, gap, complement(matrix, gap, np.full(len(gap), touching_at_first)))


def test_one_by_one_finds_the_same(monkeypatch):
    """Murty's rule alone, as where block exchanges cycle."""
    matrix, gap = problem(7)
    blocks = complement(matrix, gap, np.zeros(len(gap), bool))
    monkeypatch.setattr(active_set, "_PATIENCE", -1)
    single = complement(matrix, gap, np.zeros(len(gap), bool))
    np.testing.assert_allclose(single.pressing, blocks.pressing, atol=1e-12)


def test_depth_found_for_a_force():
    matrix, gap = problem(3)
    gap = np.abs(gap)
    along = np.linspace(0.7, 1.0, len(gap))
    solved = complement(matrix, gap, gap < np.median(gap), along, 0.02)
    assert along @ solved.pressing == pytest.approx(0.02, rel=1e-12)
    check(matrix, gap, solved, along)


def test_no_solution_is_said():
    with pytest.raises(UnsolvedError, match="positive definite"):
        complement(-np.eye(3), -np.ones(3), np.ones(3, bool))
    with pytest.raises(UnsolvedError, match="no node"):
        complement(np.eye(3), np.ones(3), np.zeros(3, bool), np.ones(3), 1.0)
