import dataclasses
import logging

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.geometry.lattice import Lattice, grid_faces
from tactile_core.pictures.height_map import HeightMapper, folds_counted, gel_mapper, height_map, rest_height_map
from tactile_core.sensors.calibration_file import load_calibration
from tactile_core.sensors.camera import HEIGHT_ZERO_Y

DIGIT_CAMERA = load_calibration().camera
CENTRE = np.array([-7.0e-3, 1.1e-3])


def even_lattice(rows: int, columns: int) -> Lattice:
    """A parabolic gel, even all over, whose shape at rest a cubic spline holds exactly."""
    x, z = np.meshgrid(np.linspace(-16.2e-3, 1.2e-3, rows), np.linspace(-6.6e-3, 6.6e-3, columns), indexing="ij")
    rest = np.stack([x, parabola(x, z) + HEIGHT_ZERO_Y, z], -1).reshape(-1, 3)
    whole = slice(0, rows), slice(0, columns)
    return Lattice(rest, grid_faces(rows, columns, closed=False), (rows, columns), whole)


def parabola(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    return 12.0 * (x + 7.5e-3) ** 2 + 20.0 * z**2


def dent(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Displacement (..., 3) m of a soft press with sideways spread: 0.5 mm deep, 0.2 mm aside."""
    dx, dz = (x - CENTRE[0]) / 1.4e-3, (z - CENTRE[1]) / 1.4e-3
    bell = np.exp(-(dx**2 + dz**2) / 2)
    return np.stack([0.2e-3 * dx * bell, 0.5e-3 * bell, 0.15e-3 * dz * bell], -1)


def exact_heights(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Height of the dented parabola at fixed places, by a fixed point of 60 turns (contraction below 0.3)."""
    source_x, source_z = x.copy(), z.copy()
    for _ in range(60):
        move = dent(source_x, source_z)
        source_x, source_z = x - move[..., 0], z - move[..., 2]
    return parabola(source_x, source_z) + dent(source_x, source_z)[..., 1]


def pixel_places() -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid(DIGIT_CAMERA.gel_x, DIGIT_CAMERA.gel_z, indexing="ij")


def test_fourth_order_with_sideways_movement() -> None:
    truth = exact_heights(*pixel_places())
    intervals, errors = np.array([(24, 16), (44, 32), (88, 64)]), []
    for rows, columns in intervals + 1:
        lattice = even_lattice(rows, columns)
        heights = HeightMapper(lattice)(dent(lattice.rest[:, 0], lattice.rest[:, 2]))
        errors.append(np.sqrt(np.mean((heights - truth) ** 2)))
    order = -np.polyfit(np.log(intervals[:, 0]), np.log(errors), 1)[0]
    assert order > 3.7  # cubic splines: 4
    assert errors[1] < 10e-9  # m, at the shipped lattice's spacing: measured 4 nm, of a dent of 0.5 mm


def test_dent_that_moves_sideways_is_seen_there() -> None:
    lattice = even_lattice(45, 33)
    shift = np.array([0.3e-3, -0.2e-3])
    still = dent(lattice.rest[:, 0], lattice.rest[:, 2]) * [0, 1, 0]
    moved = HeightMapper(lattice)(still + np.array([shift[0], 0, shift[1]]))
    x, z = pixel_places()
    x, z = x - shift[0], z - shift[1]
    inside = (np.abs(x + 7.5e-3) < 7.5e-3) & (np.abs(z) < 5.4e-3)  # beyond the window nothing is known
    expected = parabola(x, z) + dent(x, z)[..., 1]
    # the interpolation's largest error, 0.06 um
    np.testing.assert_allclose(moved[inside], expected[inside], atol=0.1e-6)


def test_rest_is_the_gel_above_its_lowest_point() -> None:
    rest = rest_height_map()
    assert rest.shape == (320, 240)
    assert 0 <= rest.min() < 20e-6  # our dome is fitted to the mesh that sets zero, 5 um rms
    gel = sensors.digit_surface()
    nodes = gel.window_rest.reshape(-1, 3)
    row, column = DIGIT_CAMERA.to_pixel(nodes[:, 0], nodes[:, 2])
    seen = (row > 0) & (row < 319) & (column > 0) & (column < 239)
    nearest = rest[np.rint(row[seen]).astype(int), np.rint(column[seen]).astype(int)]
    # Half a pixel off, on slopes up to 0.45: 0.027 mm * 0.45 * sqrt(2).
    np.testing.assert_allclose(nearest, nodes[seen, 1] - HEIGHT_ZERO_Y, atol=17e-6)


def test_indentation_raises_the_height_where_it_is() -> None:
    gel = sensors.digit_surface()
    heights = height_map(dent(gel.rest[:, 0], gel.rest[:, 2])) - rest_height_map()
    row, column = DIGIT_CAMERA.to_pixel(*CENTRE)  # of the map: at height zero
    peak = np.unravel_index(np.argmax(heights), heights.shape)
    assert np.hypot(peak[0] - row, peak[1] - column) < 3  # the dome's slope moves the peak by a pixel or two
    assert heights.max() == pytest.approx(0.5e-3, rel=0.02)


def test_many_frames_equal_each_alone() -> None:
    gel = sensors.digit_surface()
    one = dent(gel.rest[:, 0], gel.rest[:, 2])
    frames = np.stack([one, 0 * one, 0.5 * one])
    np.testing.assert_array_equal(height_map(frames), [height_map(frame) for frame in frames])
    assert height_map(frames[:0]).shape == (0, 320, 240)


def test_folded_surface_is_said_and_finite(caplog: pytest.LogCaptureFixture) -> None:
    gel = sensors.digit_surface()
    with caplog.at_level(logging.WARNING):
        heights = height_map(20 * dent(gel.rest[:, 0], gel.rest[:, 2]) * [-1, 0.1, -1])
        said = caplog.text
        with folds_counted() as folds:
            height_map(np.stack([20 * dent(gel.rest[:, 0], gel.rest[:, 2]) * [share, 0.1, share] for share in (0, -1)]))
    assert f"folds over itself at {folds[0]} of" in said
    assert len(folds) == 1 and caplog.text == said  # reported to the one who counts, not logged
    assert np.isfinite(heights).all()


def test_a_gel_dragged_as_far_as_in_firm_grips_is_followed_to_where_it_came_from() -> None:
    """Dragged by 0.65 mm over a bell of 0.7 mm: no fold, but Newton's method with the first Jacobian kept loses it."""
    lattice, width, drag = even_lattice(45, 33), 0.7e-3, 0.65e-3

    def dragged(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        bell = np.exp(-((x - CENTRE[0]) ** 2 + (z - CENTRE[1]) ** 2) / 2 / width**2)
        return np.stack([drag * bell, 0.5e-3 * bell, 0 * bell], -1)

    with folds_counted() as folds:
        heights = HeightMapper(lattice)(dragged(lattice.rest[:, 0], lattice.rest[:, 2]))
    x, z = pixel_places()
    source = x.copy()
    for _ in range(60):  # a fixed point: its slope is .56 at most, .56 ** 60 of .65 mm is nothing
        source = x - dragged(source, z)[..., 0]
    assert folds == []
    # Measured 6 um: nodes 0.4 mm apart are coarse for a bell of 0.7 mm. With the first Jacobian kept: 130 um.
    np.testing.assert_allclose(heights, parabola(source, z) + dragged(source, z)[..., 1], atol=12e-6)


def test_bad_displacement_is_refused() -> None:
    good = np.zeros((len(sensors.digit_surface().rest), 3))
    for bad in (good[:-1], good[:, :2], good[None, None], good[:, 0]):
        with pytest.raises(TactileError, match="shape"):
            height_map(bad)
    for bad in (1e3 * good + 0.3, good + sensors.digit_surface().rest):
        with pytest.raises(TactileError, match="Divide millimetres by 1000; take the resting surface off places"):
            height_map(bad)
    good[7, 1] = np.nan
    with pytest.raises(TactileError, match="not finite"):
        height_map(good)


def test_picture_beyond_the_window_is_refused() -> None:
    wide = dataclasses.replace(DIGIT_CAMERA, px_per_mm_x=10.0)
    with pytest.raises(TactileError, match="camera, z"):
        gel_mapper(wide)
    skin = sensors.biotac_surface()
    with pytest.raises(TactileError, match="window"):
        HeightMapper(skin)
