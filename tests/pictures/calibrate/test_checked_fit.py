"""Photographs that are turned, mirrored or hold blue first: all ways are tried together, and the right one is named."""

import dataclasses
import itertools

import numpy as np
import pytest
from PIL import Image
from plain_unit import plain_unit
from pressed_unit import BALL, PLACES, write_photographs

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.pictures.calibrate import checked_fit
from tactile_core.pictures.calibrate.ball_pictures import FastPictures
from tactile_core.pictures.calibrate.checked_fit import TURNS, Way, check_orientation
from tactile_core.pictures.calibrate.photographs import Photographs, press_of, read_photographs
from tactile_core.pictures.calibrate.press_fit import fit_ball
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration_file import load_calibration, write_calibration

ALL = [Way(*turn, colours) for turn, colours in itertools.product(TURNS, (False, True))]


FITTED = {}


@pytest.fixture(autouse=True)
def _fast(monkeypatch):
    """A press of 30 x 40 pixels tells the ways apart too; a way of a changed press is another way of the press."""

    def once(bench, sight, radius):
        name = bench.calibration.unit, bench.rest.shape, sight.change.round(2).tobytes()
        if name not in FITTED:
            FITTED[name] = fit_ball(bench, sight, radius)
        return FITTED[name]

    monkeypatch.setattr(checked_fit, "fit_ball", once)
    monkeypatch.setattr(checked_fit, "COARSE_SIDE", 30)
    monkeypatch.setattr(checked_fit, "LOOKED_AT", 1)


@pytest.fixture(scope="module")
def presses(tmp_path_factory):
    folder = write_photographs(tmp_path_factory.mktemp("unit") / "presses", plain_unit().at_size(120, 160), PLACES[1:2])
    return read_photographs(folder, folder.parent / "untouched.png")


def changed(photographs, way):
    found = tuple(checked_fit._changed(press, way) for press in photographs.presses)
    return dataclasses.replace(photographs, presses=found, background=way.applied_to(photographs.background))


def undone(way):
    """The way that leads back; a quarter turn's is the other quarter turn, all others are their own."""
    rows, columns = (way.columns, way.rows) if way.transposed else (way.rows, way.columns)
    return Way(way.transposed, rows, columns, way.colours)


@pytest.mark.parametrize("way", ALL, ids=str)
def test_each_way_is_named_at_once(presses, way):
    np.testing.assert_array_equal(undone(way).applied_to(way.applied_to(presses.background)), presses.background)
    if way == checked_fit.GIVEN:
        check_orientation(presses, 2 * BALL, plain_unit())
        return
    with pytest.raises(TactileError) as refused:
        check_orientation(changed(presses, way), 2 * BALL, plain_unit())
    assert refused.value.advice.startswith(f"Give them {undone(way)}. Each way leaves: ")
    assert refused.value.advice.count("%") == 8  # those that give pictures of the camera's shape


@pytest.mark.parametrize("way", [way for way in ALL if not way.transposed], ids=str)
def test_lights_that_stand_opposite_are_told_apart_by_the_untouched_gel(tmp_path, request, way):
    """Exchange red and blue of a start of round numbers and mirror it top to bottom: the same prints."""
    start = load_calibration(request.config.rootpath / "scenes/calibrations/start_gelsight_mini.toml")
    unit = load_calibration(None, "gelsight_mini").at_size(80, 60)
    rest = Renderer(unit, "fast").background
    picture = np.rint(rest + FastPictures(unit).change((1e-3, 0.5e-3, 0.8e-3, BALL))).clip(0, 255).astype(np.uint8)
    press = press_of("press.png", picture, rest)
    given = changed(Photographs(tmp_path, (press,), rest, False, (), (0.0,) * 3), way)
    if way == checked_fit.GIVEN:
        check_orientation(given, 2 * BALL, start)
        return
    with pytest.raises(TactileError, match=f"Give them {undone(way)}. Each"):
        check_orientation(given, 2 * BALL, start)


@pytest.mark.parametrize(
    ("files", "untouched", "sensor"),
    [
        ("digit_real/presses/00[01]*.png", "digit_real/background_other_day.png", "digit"),
        ("digit_other_unit/sphere_frame_2[01].jpg", "digit_other_unit/untouched.jpg", "digit"),
        ("gelsight_mini/ball.png", "gelsight_mini/background.png", "gelsight_mini"),
    ],
    ids=lambda value: value.split("/")[0],
)
def test_real_photographs_lie_right_and_a_turn_is_told(files, untouched, sensor, outside_data, tmp_path):
    root = outside_data(files.split("/")[0]).parent
    for file in sorted(root.glob(files))[:2]:
        (tmp_path / file.name).symlink_to(file)
    photographs, unit = read_photographs(tmp_path, root / untouched), load_calibration(None, sensor)
    check_orientation(photographs, 2 * BALL, unit)
    for way in (Way(True, False, True, True), Way(False, True, True, False), Way(False, False, False, True)):
        with pytest.raises(TactileError, match=f"Give them {undone(way)}. Each"):
            check_orientation(changed(photographs, way), 2 * BALL, unit)


def test_other_shapes_are_refused(presses):
    with pytest.raises(TactileError, match="fingertip up"):
        check_orientation(dataclasses.replace(presses, background=presses.background[:100]), 2 * BALL, plain_unit())


def test_the_verb_says_it_and_writes_nothing(tmp_path, capsys):
    folder = write_photographs(tmp_path / "presses", plain_unit().at_size(120, 160), PLACES[:3])
    for file in [*folder.iterdir(), tmp_path / "untouched.png"]:
        Image.fromarray(np.rot90(np.asarray(Image.open(file)))[..., ::-1]).save(file)
    write_calibration(tmp_path / "start.toml", plain_unit())
    words = ["--background", str(tmp_path / "untouched.png"), "--start", str(tmp_path / "start.toml")]
    words += ["--ball-diameter", "6", "--quick", "--out", str(tmp_path / "unit.toml")]
    assert main(["calibrate", str(folder), *words]) == 2
    assert "Give them turned by 90 degrees clockwise with red and blue exchanged." in capsys.readouterr().err
    assert not (tmp_path / "unit.toml").exists()
