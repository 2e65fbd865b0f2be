"""The window that moves with a dent: found, cut out and put back, by whole cells."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.translation.contact_frame import ContactFrame, frame_of

FRAME = ContactFrame(9, 7, 2, np.zeros(64, np.float32))  # one node behind the lattice, as a pole


def field(*cells):
    """(T, 64, 3) with one node moved a frame."""
    values = np.zeros((len(cells), 64, 3), np.float32)
    for frame, (row, column) in enumerate(cells):
        values[frame, row * 7 + column] = [1e-4, 5e-4, -2e-4]
    return values


def test_a_dent_is_where_it_is():
    moved = field((4, 3), (0, 6), (8, 0))
    cells, left = FRAME.cells(FRAME.place(moved))
    np.testing.assert_array_equal(cells, [(4, 3), (0, 6), (8, 0)])
    np.testing.assert_allclose(left, 0, atol=1e-5)  # float32 of at most 9 cells


def test_between_two_cells_the_rest_is_told():
    moved = field((4, 3))
    moved[0, 4 * 7 + 4] = moved[0, 4 * 7 + 3] / 3  # a weight of one third, above the core's share
    cells, left = FRAME.cells(FRAME.place(moved))
    np.testing.assert_array_equal(cells, [(4, 3)])
    np.testing.assert_allclose(left, [(0, 0.25)], atol=1e-5)


def test_nothing_moved_is_in_the_middle():
    np.testing.assert_array_equal(FRAME.place(np.zeros((2, 64, 3))), 0)


@pytest.mark.parametrize("cell", [(4, 3), (0, 0), (8, 6), (1, 5)])
def test_windows_put_back_give_what_they_cover(cell):
    values = np.random.default_rng(0).standard_normal((1, 64, 3)).astype(np.float32)
    windows = FRAME.windows(values, np.array([cell]))
    assert windows.shape == (1, 5, 5, 3)
    np.testing.assert_array_equal(windows[0, 2, 2], values[0, cell[0] * 7 + cell[1]])
    back = FRAME.add(np.zeros_like(values), windows, np.array([cell]))
    row, column = np.divmod(np.arange(63), 7)
    near = (np.abs(row - cell[0]) <= 2) & (np.abs(column - cell[1]) <= 2)
    np.testing.assert_array_equal(back[0, :63], np.where(near[:, None], values[0, :63], 0))
    assert not back[0, 63].any()
    np.testing.assert_array_equal(FRAME.windows(back, np.array([cell])), windows)


def test_places_off_the_lattice_and_without_number_stay_on_it():
    cells, left = FRAME.cells(np.array([[99.0, -99.0], [np.nan, 0.0]]))
    np.testing.assert_array_equal(cells, [(8, 0), (4, 3)])
    assert (np.abs(left) <= 1).all()


def test_the_biotac_is_turned_so_that_inward_is_one_axis():
    """On the pad the inward normal is the second axis of every node's own frame."""
    surface, frame = sensors.biotac_surface(), frame_of("biotac", 3)
    rows, columns = surface.shape
    radial = surface.rest[: rows * columns] - [0, -1.237e-3, 0]  # the axis of the pad (docs/sources.md, BioTac skin)
    radial[:, 0] = 0
    inward = np.zeros((1, len(surface.rest), 3))
    inward[0, : rows * columns] = -radial / np.linalg.norm(radial, axis=1, keepdims=True)
    local = frame.to_local(inward)
    np.testing.assert_allclose(local[0, : rows * columns], [[0, 1, 0]] * (rows * columns), atol=1e-5)
    np.testing.assert_allclose(frame.to_shared(local.copy()), inward, atol=1e-6)


def test_what_is_drawn_in_the_window_fades_toward_its_edge():
    fade = ContactFrame(30, 30, 12, np.zeros(900, np.float32)).fade()
    middle = fade[12]
    assert fade.shape == (25, 25)
    np.testing.assert_array_equal(middle[5:20], 1)
    assert (np.diff(middle[19:]) < 0).all()
    assert 0 < middle[-1] < 0.1  # one cell on it would be zero
    np.testing.assert_array_equal(fade, fade.T[::-1])
