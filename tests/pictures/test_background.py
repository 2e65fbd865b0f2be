"""The picture at rest: a photograph of the untouched gel follows the lights that are changed after it was taken."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tactile_core.errors import TactileError
from tactile_core.pictures.background import check_way, read_photograph, resting_picture
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration_file import load_calibration, write_calibration


@pytest.fixture
def unit(tmp_path):
    """A unit from a file, with a photograph: the lights' own picture with some dirt on it, which no light explains."""
    small = load_calibration().at_size(60, 80)
    shown = Renderer(small, "fast").background.copy()
    shown[30:40, 20:30] *= 0.8
    Image.fromarray(np.rint(shown).clip(0, 255).astype(np.uint8)).save(tmp_path / "untouched.png")
    write_calibration(tmp_path / "unit.toml", dataclasses.replace(small, photograph=str(tmp_path / "untouched.png")))
    return load_calibration(tmp_path / "unit.toml")


def at_rest(unit, **led) -> np.ndarray:
    """Picture (H, W, 3) at rest with some numbers of each LED changed."""
    leds = tuple(dataclasses.replace(each, **{name: f(each) for name, f in led.items()}) for each in unit.leds)
    return Renderer(dataclasses.replace(unit, leds=leds), "fast").background


def test_lights_that_are_off_or_doubled_act_on_a_photograph(unit):
    photograph = at_rest(unit)
    np.testing.assert_array_equal(at_rest(unit, radiance=lambda led: 0.0), 0)
    np.testing.assert_allclose(at_rest(unit, radiance=lambda led: 2 * led.radiance), 2 * photograph, rtol=1e-4)
    red = at_rest(unit, radiance=lambda led: 0.0 if led.colour == "red" else led.radiance)
    assert red[..., 0].mean() < 0.4 * photograph[..., 0].mean()
    assert red[..., 2].mean() > 0.8 * photograph[..., 2].mean()


@pytest.mark.parametrize("way", [np.s_[::-1], np.s_[:, ::-1], np.s_[..., ::-1]])
def test_a_photograph_that_is_turned_mirrored_or_blue_first_is_refused(unit, way):
    Image.fromarray(read_photograph(unit.photograph)[way].copy()).save(unit.photograph)
    for changed in ({}, {"radiance": lambda led: 1.02 * led.radiance}):
        with pytest.raises(TactileError, match=rf"{re.escape(unit.photograph)}.*as it is, \d\.\d\d (mirrored|with)"):
            at_rest(unit, **changed)


def test_another_unit_s_photograph_is_not_taken_for_a_turned_one(unit):
    own = at_rest(unit)
    noise = np.random.default_rng(0).normal(scale=6 * own.std(), size=own.shape)
    check_way((own[:, ::-1] + noise).astype(np.float32), own)  # a fifth alike, mirrored; less as it is


def test_a_moved_light_and_another_albedo_act_on_a_photograph(unit):
    photograph = at_rest(unit)
    moved = at_rest(unit, position=lambda led: (*led.position[:2], 1.2 * led.position[2]))
    assert np.abs(moved - photograph).mean() > 2
    coating = dataclasses.replace(unit.coating, albedo=tuple(share / 2 for share in unit.coating.albedo))
    darker = dataclasses.replace(unit, coating=coating)
    np.testing.assert_allclose(Renderer(darker, "fast").background, photograph / 2, rtol=1e-4)


def test_a_calibration_in_memory_keeps_its_photograph(unit):
    radiance = np.zeros((*unit.camera.shape, 3), np.float32)
    unknown = dataclasses.replace(unit, photographed=None)
    np.testing.assert_array_equal(resting_picture(unknown, radiance), at_rest(unit))


PICTURES = sorted((Path(__file__).parents[2] / "scenes").glob("*/picture.png"))


@pytest.mark.parametrize("path", PICTURES, ids=lambda path: path.parent.name)
def test_a_scenes_picture_has_the_shipped_background(path):
    background = Renderer(preset="fast").background
    off = np.abs(read_photograph(path).astype(float) - background).mean(axis=2)
    # Nothing touches the corners: light that the walls return makes them up to 0.4 levels off, the gel
    # that a nut of 5 N moves 4.4, another unit 30 to 60.
    ends, most = (slice(20), slice(-20, None)), 5 if path.parent.name == "hex_nut" else 2
    assert max(off[rows, columns].mean() for rows in ends for columns in ends) < most


def test_all_are_here():
    assert len(PICTURES) == 7


@pytest.mark.parametrize("name", ["turned.jpg", "turned.png", "turned.tiff"])
def test_a_photograph_is_read_as_viewers_show_it(tmp_path, name):
    shown = np.zeros((80, 60, 3), np.uint8)
    shown[:40, :30] = 200, 100, 50
    tag = Image.Exif()
    tag[0x112] = 8  # a viewer turns it by a quarter to the left
    Image.fromarray(np.rot90(shown, -1)).save(tmp_path / name, exif=tag)
    assert np.abs(read_photograph(tmp_path / name).astype(int) - shown)[4:28, 4:12].max() < 5
    assert read_photograph(tmp_path / name).shape == shown.shape


BACK = {  # the way back, and what a picture was turned by
    "mirrored up and down": np.s_[::-1], "mirrored left and right": np.s_[:, ::-1],
    "with red and blue exchanged": np.s_[..., ::-1],
}  # fmt: skip


@pytest.mark.parametrize("way", BACK)
def test_a_background_that_is_mirrored_or_of_other_colours_is_told_the_way_back(unit, way):
    picture = at_rest(unit)
    with pytest.raises(TactileError, match=re.escape(f"1.00 {way})")):
        Renderer(unit, "fast", background=picture[BACK[way]])
    np.testing.assert_array_equal(Renderer(unit, "fast", background=picture).background, picture)
