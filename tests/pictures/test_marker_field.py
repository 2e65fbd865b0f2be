"""Dots on a gel: where the surface carries them, in the picture too, and nothing of them where there are none."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from plain_unit import plain_unit

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.marker_field import MarkerField
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration import Calibration, Markers
from tactile_core.sensors.calibration_file import load_calibration, write_calibration

DOTTED_MINI = Path(__file__).parents[2] / "scenes/calibrations/gelsight_mini_dots.toml"
DOTS = Markers(rows=5, columns=4, pitch=2e-3, diameter=0.6e-3, albedo=0.1)
REST = sensors.digit_surface().rest


@pytest.fixture(scope="module")
def unit():
    return dataclasses.replace(plain_unit(), markers=DOTS)


def dent(depth: float, aside: tuple[float, float], places: np.ndarray = REST) -> np.ndarray:
    """A smooth dent that drags the gel along: displacement (M, 3) m of places (M, 3) m at rest."""
    share = np.exp(-((places[:, 0] + 7e-3) ** 2 + (places[:, 2] - 0.5e-3) ** 2) / 3e-3**2)
    return share[:, None] * np.array([aside[0], depth, aside[1]])


def centre_of_dark(share: np.ndarray, place: np.ndarray) -> np.ndarray:
    """The middle (2,), px right and down, of what is dark within a pitch's half of a place."""
    low = np.maximum(np.rint(place).astype(int) - 16, 0)
    box = 1 - share[low[1] : low[1] + 33, low[0] : low[0] + 33]
    down, right = np.indices(box.shape)
    return low + np.array([(box * right).sum(), (box * down).sum()]) / box.sum()


def test_dots_move_as_the_surface_does(unit):
    """By the nodes nearest to them: a dot 0.2 mm off moves otherwise by the dent's slope, 6 % of 0.3 mm, 0.4 px."""
    field, camera = MarkerField(unit), unit.camera
    moved = dent(0.4e-3, (0.3e-3, -0.2e-3))
    motion = field.motion(np.stack([np.zeros_like(moved), moved]))
    assert motion.shape == (2, 20, 2) and not motion[0].any()
    assert (np.diff(field.rest.reshape(5, 4, 2)[:, :, 0]) > 0).all() and (np.diff(field.rest[::4, 1]) > 0).all()
    x, z = camera.to_gel(*field.rest.T[::-1])
    near = ((x[:, None] - REST[:, 0]) ** 2 + (z[:, None] - REST[:, 2]) ** 2).argmin(1)
    height = REST[near, 1] - sensors.digit_surface().rest[:, 1].min()
    before = camera.to_pixel(REST[near, 0], REST[near, 2], height)
    after = camera.to_pixel(*(REST + moved)[near][:, [0, 2]].T, height + moved[near, 1])
    expected = np.stack([after[1] - before[1], after[0] - before[0]], -1)
    assert np.abs(expected).max() > 4 and np.abs(motion[1] - expected).max() < 0.5


def test_an_even_shift_is_exact_on_domes_of_any_height(unit):
    """A dot h high under a camera H high appears 1 / (1 - h / H) times as far out, and moves as much more."""
    moved = np.zeros_like(REST)
    moved[:, [0, 2]] = 0.1e-3, 0.05e-3
    flat = 18.8e3 * DOTS.pitch * np.tile(np.arange(4) - 1.5, 5)  # px from the middle, of a gel of height zero
    for scale in (1.0, 0.3):
        field = MarkerField(dataclasses.replace(unit, dome_scale=scale))
        nearer = (field.rest[:, 0] - 119.5) / flat
        assert 1 + 0.01 * scale < nearer.max() < 1.1
        expected = nearer[:, None] * [-0.05 * 18.8, 0.1 * 18.8]
        np.testing.assert_allclose(field.motion(moved[None])[0], expected, atol=1e-3)  # px: float32 of 200


def printed(unit: Calibration) -> np.ndarray:
    """Where a unit's dots lie on the resting gel (n, 3) m, by its numbers alone."""
    dots, camera, shape = unit.markers, unit.camera, sensors.shape_of(unit.camera.sensor)
    down, right = (dots.pitch * (np.arange(n) - (n - 1) / 2) for n in (dots.rows, dots.columns))
    x, z = np.meshgrid(camera.centre_x + camera.down_x * down, camera.centre_z + camera.right_z * right, indexing="ij")
    return np.stack([x.ravel(), shape.descriptor.body.back_y - shape.dome_height(x, z).ravel(), z.ravel()], -1)


@pytest.mark.parametrize("which", ["digit", "gelsight_mini"])
def test_motion_is_the_displacement_of_the_printed_place(which, unit):
    """A displacement that is known between nodes, too, seen by a pinhole: interpolation leaves 0.02 px of 5."""
    unit = unit if which == "digit" else load_calibration(DOTTED_MINI, which)
    places, camera = printed(unit), unit.camera
    height = unit.dome_scale * (places[:, 1] - camera.height_zero_y)
    seen = []
    for depth, aside in ((0.0, (0.0, 0.0)), (0.4e-3, (0.3e-3, -0.2e-3))):
        moved = dent(depth, aside, places)
        row, column = camera.to_pixel(*(places + moved)[:, [0, 2]].T, height + moved[:, 1])
        seen.append(np.stack([column, row], -1))
    field = MarkerField(unit)
    motion = field.motion(dent(0.4e-3, (0.3e-3, -0.2e-3), sensors.sensor_surface(which).rest)[None])[0]
    assert np.abs(motion).max() > 4
    np.testing.assert_allclose(field.rest, seen[0], atol=0.02)
    np.testing.assert_allclose(motion, seen[1] - seen[0], atol=0.02)


def test_the_dotted_mini_is_the_one_that_ships_with_dots():
    plain, dotted = load_calibration(None, "gelsight_mini"), load_calibration(DOTTED_MINI)
    assert dataclasses.replace(dotted, markers=None, unit=plain.unit) == plain and dotted.markers.count == 63


@pytest.mark.parametrize(("which", "preset"), [("digit", "fast"), ("digit", "standard"), ("mini", "standard")])
def test_pictures_show_the_dots_where_they_are(which, preset, unit):
    if preset != "fast":
        pytest.importorskip("mitsuba")
    unit = unit if which == "digit" else load_calibration(DOTTED_MINI)
    dotted, plain = Renderer(unit, preset), Renderer(dataclasses.replace(unit, markers=None), preset)
    moved = dent(0.3e-3, (0.2e-3, 0.3e-3), sensors.sensor_surface(unit.camera.sensor).rest)
    shown, bare = (renderer.render(moved).astype(float).sum(-1) for renderer in (dotted, plain))
    places = dotted.dots.rest + dotted.dots.motion(moved[None])[0]
    off = [centre_of_dark(shown / bare, place) - place for place in places]
    # A dent that stretches a dot shifts the middle of its image by a little: 0.1 px; what is seen is whole levels.
    assert np.abs(dotted.dots.motion(moved[None])).max() > 4 and np.abs(off).max() < 0.15
    inside = shown[tuple(np.rint(places[:, ::-1]).astype(int).T)] / bare[tuple(np.rint(places[:, ::-1]).astype(int).T)]
    np.testing.assert_allclose(inside, unit.markers.albedo, atol=0.02)  # of 400 levels, each rounded


def test_heights_alone_do_not_say_where_dots_are(unit):
    with pytest.raises(TactileError, match=r"Renderer\.render"):
        Renderer(unit, "fast")(rest_height_map(unit.camera))


def test_a_grid_beyond_the_gel_and_bad_numbers_are_refused(unit):
    with pytest.raises(TactileError, match="grid on the even part"):
        MarkerField(dataclasses.replace(unit, markers=dataclasses.replace(DOTS, rows=14)))
    with pytest.raises(TactileError, match="rows: 0"):
        Markers(0, 4, 2e-3, 1e-3, 0.1)
    with pytest.raises(TactileError, match="pitch_mm: 2000"):
        Markers(5, 4, 2.0, 1e-3, 0.1)
    with pytest.raises(TactileError, match="whose own dots would stay"):
        dataclasses.replace(unit, photograph="rest.png")


def test_the_table_may_be_left_out_and_reads_back(unit, tmp_path):
    write_calibration(tmp_path / "dots.toml", unit)
    write_calibration(tmp_path / "plain.toml", dataclasses.replace(unit, markers=None))
    assert load_calibration(tmp_path / "dots.toml").markers == DOTS
    assert load_calibration(tmp_path / "plain.toml").markers is None
    assert "markers" not in (tmp_path / "plain.toml").read_text(encoding="utf-8")
    text = (tmp_path / "dots.toml").read_text(encoding="utf-8")
    (tmp_path / "bad.toml").write_text(text.replace("pitch_mm", "pitch"), encoding="utf-8")
    with pytest.raises(TactileError, match=r"markers: pitch; expected pitch_mm"):
        load_calibration(tmp_path / "bad.toml")
