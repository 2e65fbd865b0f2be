"""Calibration files: what is written is read back, what is wrong is named."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.pictures.background import fit_ambient
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration_file import SHIPPED, load_calibration, write_calibration

SHIPPED_TEXT = SHIPPED.read_text(encoding="utf-8")


def test_shipped_calibration_is_the_one_in_scenes() -> None:
    scenes = Path(__file__).parents[2] / "scenes" / "calibrations" / "default.toml"
    assert scenes.read_bytes() == SHIPPED.read_bytes()


def test_a_unit_s_name_of_any_text_is_kept(tmp_path: Path) -> None:
    write_calibration(tmp_path / "unit.toml", dataclasses.replace(load_calibration(), unit='a "unit" of ours'))
    assert load_calibration(tmp_path / "unit.toml").unit == 'a "unit" of ours'


def test_shipped_file_is_written_as_this_version_writes_it(tmp_path: Path) -> None:
    write_calibration(tmp_path / "again.toml", load_calibration())
    assert (tmp_path / "again.toml").read_bytes() == SHIPPED.read_bytes()


def test_a_file_of_before_coatings_spread_light_is_read_as_one_that_does_not(tmp_path: Path) -> None:
    text = re.sub(r"spread_mm = .*\n", "", SHIPPED.read_text()).replace("calibration-3", "calibration-2")
    (tmp_path / "older.toml").write_text(text)
    found, shipped = load_calibration(tmp_path / "older.toml"), load_calibration()
    assert found == dataclasses.replace(shipped, coating=dataclasses.replace(shipped.coating, spread=0.0))


def test_ambient_light_of_higher_gel_is_kept_and_may_be_left_out(tmp_path: Path) -> None:
    unit = dataclasses.replace(load_calibration(), ambient_rise=(40.0, -20.0, 0.0))
    write_calibration(tmp_path / "unit.toml", unit)
    assert load_calibration(tmp_path / "unit.toml").ambient_rise == pytest.approx(unit.ambient_rise)
    (tmp_path / "older.toml").write_text(re.sub(r"rise_per_mm = .*\n", "", SHIPPED_TEXT))
    assert load_calibration(tmp_path / "older.toml").ambient_rise == (0, 0, 0)


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("rise_per_mm = [", "rise_per_mm = [5", "ambient, rise_per_mm"),
        ("px_per_mm_x =", "px_per_cm_x =", "unknown px_per_cm_x"),
        ("albedo =", "# albedo =", "coating: albedo missing"),
        ("radius_mm =", "radius =", "leds, red: radius; expected radius_mm"),
        ("[noise]", "[other]", "unknown other"),
        ("reflectance = 0", "reflectance = 1.2", "object reflectance: 1.2; expected 0 to 1"),
        ("transmission = 0.2", "transmission = 2", "coating, transmission"),
        ('format = "tactile-calibration-3"', 'format = "tactile-calibration-9"', "format"),
        (
            'format = "tactile-calibration-3"',
            'format = "tactile-calibration-1"',
            "format.*-1'; expected tactile-calibration-3 or",
        ),
        ("radiance = ", "radiance = -", "leds?,? red, radiance"),
        ("radius_mm = ", "radius_mm = 9", "above the gel"),
        ("index = 1", "index = 0", "gel, index"),
        ("albedo = [0", "albedo = [2", "coating, albedo"),
        ('bsdf = "diffuse"', 'bsdf = "bitmap"', "coating, bsdf"),
        ("spread_mm = ", "spread_mm = -", "coating, spread_mm"),
        ("spread_mm = ", "spread_mm = 7", "coating, spread_mm"),
        ("width_px = 240", "width_px = 240.5", "width_px"),
        ("height_px = 320", "height_px = true", "height_px"),
        ("down_x = 1", "down_x = 0", "down_x"),
        ("position_mm = [", "position_mm = [nan, ", "position_mm"),
        ("position_mm = [", f"position_mm = [{10**400}, ", "position_mm"),
        ("centre = [[", "centre = [[1], [", "response, centre"),
        ("centre = [[", "centre = [[-", "response, centre"),
        ("dome_scale = ", "dome_scale = 100", "dome_scale"),
        ("position_mm = [", "position_mm = [1e300, ", r"leds, red, position_mm: .*a list of 3"),
        ("px_per_mm_x = ", "px_per_mm_x = 1000", "px_per_mm_x"),
        ("position_mm = [", "position_mm = [99999999999, ", r"leds, red, position_mm: .*a list of 3"),
        ("[camera]", "[camera", "table declaration"),
        ('photograph = ""', 'photograph = "../rest.png"', "background, photograph"),
        ('photograph = ""', 'photograph = "/etc/rest.png"', "background, photograph"),
        ('photograph = ""', 'photograph = "sub/rest.png"', "background, photograph"),
    ],
)
def test_bad_file_is_refused(tmp_path: Path, old: str, new: str, where: str) -> None:
    assert old in SHIPPED_TEXT
    file = tmp_path / "unit.toml"
    file.write_text(SHIPPED_TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(TactileError, match=where) as raised:
        load_calibration(file)
    assert str(file) in str(raised.value)


def test_absent_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TactileError, match="cannot be read"):
        load_calibration(tmp_path / "none.toml")


def test_a_channel_blind_to_its_own_led_is_refused() -> None:
    calibration = load_calibration()
    centre = np.array(calibration.response.centre)
    centre[1, 1] = 0
    with pytest.raises(TactileError, match="0 levels of green"):
        dataclasses.replace(calibration.response, centre=tuple(map(tuple, centre)))


def test_photograph_takes_the_background_s_place(tmp_path: Path) -> None:
    from PIL import Image

    photograph = np.random.default_rng(0).integers(0, 256, (320, 240, 3), dtype=np.uint8)
    Image.fromarray(photograph).save(tmp_path / "rest.png")
    file = tmp_path / "unit.toml"
    file.write_text(SHIPPED_TEXT.replace('photograph = ""', 'photograph = "rest.png"'), encoding="utf-8")
    np.testing.assert_array_equal(Renderer(load_calibration(file), "fast").background, photograph)
    Image.fromarray(photograph[:-2]).save(tmp_path / "rest.png")
    with pytest.raises(TactileError, match="240 x 318"):
        Renderer(load_calibration(file), "fast")
    (tmp_path / "rest.png").unlink()
    with pytest.raises(TactileError, match=r"rest\.png"):
        Renderer(load_calibration(file), "fast")


def test_picture_at_rest_is_smooth_and_its_ambient_light_is_found_again() -> None:
    unit = load_calibration()
    shader = Renderer(unit, "fast")
    picture = shader.background
    assert picture.shape == (320, 240, 3)
    for axis in (0, 1):
        assert np.abs(np.diff(picture, axis=axis)).max() <= 3  # levels a pixel: no edge
    found = fit_ambient(picture, unit, shader.radiance(rest_height_map(unit.camera)))
    np.testing.assert_allclose(found, unit.ambient, atol=1e-3)


def test_ambient_light_of_either_degree_is_kept(tmp_path: Path) -> None:
    unit = load_calibration()
    shader = Renderer(unit, "fast")
    radiance, down = shader.radiance(rest_height_map(unit.camera)), unit.camera.down[:, None, None]
    picture = shader.background + 20 * (down / 8e-3) ** 7  # which a quintic does not follow
    left = []
    for degree, terms in ((5, 21), (7, 36)):
        fine = dataclasses.replace(unit, ambient=fit_ambient(picture, unit, radiance, degree))
        write_calibration(tmp_path / "unit.toml", fine)
        read = load_calibration(tmp_path / "unit.toml")
        assert np.shape(read.ambient) == (3, terms)
        left.append(np.abs(Renderer(read, "fast").background - picture).mean())
        (tmp_path / "unit.toml").unlink()
    assert left[1] < 0.05 < 0.1 < left[0]
    with pytest.raises(TactileError, match=r"ambient: rows of \[28, 28, 28\] numbers; expected 3 rows of 21 or 36"):
        dataclasses.replace(unit, ambient=((0.0,) * 28,) * 3)


def test_each_led_takes_its_share_of_the_picture_at_rest_along() -> None:
    """Off is black, doubled is twice as bright, ambient light with it; the LEDs' parts add up to the whole."""
    unit = load_calibration()

    def at_rest(*powers: float) -> np.ndarray:
        pairs = zip(unit.leds, powers, strict=True)
        leds = tuple(dataclasses.replace(led, radiance=led.radiance * power) for led, power in pairs)
        return Renderer(dataclasses.replace(unit, leds=leds), "fast").background

    whole = at_rest(1, 1, 1)
    np.testing.assert_array_equal(at_rest(0, 0, 0), 0)
    np.testing.assert_allclose(at_rest(2, 2, 2), 2 * whole, rtol=1e-5, atol=1e-3)
    alone = [at_rest(*row) for row in np.eye(3)]
    np.testing.assert_allclose(sum(alone), whole, atol=1e-3)
    for led, part in enumerate(alone):
        assert part.mean((0, 1)).argmax() == led
    black = dataclasses.replace(unit, coating=dataclasses.replace(unit.coating, albedo=(0.0, 0.0, 0.0)))
    np.testing.assert_array_equal(Renderer(black, "fast").background, 0)


def test_start_of_unlike_units_reads() -> None:
    start = load_calibration(Path(__file__).parents[2] / "scenes" / "calibrations" / "start.toml")
    assert not start.fit.photographs
    assert start.camera.shape == (320, 240)


def test_a_reflectance_that_no_picture_shows_is_refused():
    with pytest.raises(TactileError, match="lets no light through"):
        load_calibration(None, "gelsight_mini", 0.5)
    assert load_calibration(None, "gelsight_mini", 0.0).through == 0
