import numpy as np
import pytest

from tactile_core.geometry.cubic_spline import EvenSpline, on_grid


def test_nodes_are_reproduced_exactly() -> None:
    spline = EvenSpline(-1.0, 0.1, 21)
    values = np.random.default_rng(0).normal(size=(21, 3))
    np.testing.assert_array_equal(spline.matrix(spline.nodes) @ values, values)


def test_agrees_with_scipy_not_a_knot() -> None:
    interpolate = pytest.importorskip("scipy.interpolate", reason="scipy is no requirement of the package")
    spline, at = EvenSpline(0.0, 0.5, 12), np.linspace(0, 5.5, 77)
    values = np.random.default_rng(1).normal(size=12)
    oracle = interpolate.CubicSpline(spline.nodes, values, bc_type="not-a-knot")
    np.testing.assert_allclose(spline.matrix(at) @ values, oracle(at), atol=1e-12)
    np.testing.assert_allclose(spline.matrix(at, 1) @ values, oracle(at, 1), atol=1e-11)


def test_refined_grid_holds_the_same_spline() -> None:
    coarse, at = EvenSpline(0.0, 0.5, 12), np.linspace(0, 5.5, 77)
    fine = coarse.refined(3)
    values = np.random.default_rng(2).normal(size=12)
    through_fine = fine.matrix(at) @ (coarse.matrix(fine.nodes) @ values)
    np.testing.assert_allclose(through_fine, coarse.matrix(at) @ values, atol=1e-12)


def test_ends_are_held() -> None:
    spline = EvenSpline(0.0, 1.0, 6)
    values = np.arange(6.0) ** 2
    np.testing.assert_allclose(spline.matrix(np.array([-3.0, 99.0])) @ values, [0, 25], atol=1e-12)


def test_too_few_nodes() -> None:
    with pytest.raises(ValueError, match="5 nodes"):
        EvenSpline(0.0, 1.0, 4)


ROW, COLUMN = np.meshgrid(np.arange(7.0), np.arange(9.0), indexing="ij")
PLACES = np.random.default_rng(0).uniform((1, 1), (5, 7), size=(40, 2)).T  # away from the ends, where nodes are lacking


def bowl(row, column):
    return np.stack([row, column, 0.3 * row**2 - row * column + 0.1 * column**2])


def test_quadratics_are_reproduced():
    np.testing.assert_allclose(on_grid(bowl(ROW, COLUMN), PLACES, closed=False), bowl(*PLACES).T, atol=1e-12)


def test_places_beyond_the_ends_lie_on_them():
    grid = bowl(ROW, COLUMN)
    beyond = np.array([[-1.0, 9.0], [3.0, 12.0]])
    np.testing.assert_allclose(on_grid(grid, beyond, closed=False), [grid[:, 0, 3], grid[:, 6, 8]], atol=1e-12)


def test_a_closed_grid_goes_on_round():
    grid = bowl(ROW, np.cos(2 * np.pi * COLUMN / 9))
    once, again = (on_grid(grid, np.add(PLACES, [[0], [turn]]), closed=True) for turn in (-9.0, 9.0))
    np.testing.assert_allclose(once, again, atol=1e-12)
