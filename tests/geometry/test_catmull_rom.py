"""The smooth surface through a grid's nodes: quadratics exactly, ends held, closed grids joined."""

import numpy as np

from tactile_core.geometry.catmull_rom import on_grid

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
