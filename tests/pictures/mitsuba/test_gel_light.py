"""Pictures by Mitsuba's emitters and materials: against its path integrator, and whether each parameter acts."""

import dataclasses

import numpy as np
import pytest
from gel_pictures import Press, levels, works

from tactile_core.errors import TactileError
from tactile_core.files.exr_file import read_exr
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.mitsuba.gel_light import GelLight
from tactile_core.pictures.mitsuba.gel_scene import NOTHING, Lamp, Occluder, Surroundings
from tactile_core.pictures.mitsuba.scene_file import square_pixels, write_scene
from tactile_core.pictures.mitsuba.variant import LLVM, activate
from tactile_core.pictures.presets import QUALITY, REFERENCE, STANDARD
from tactile_core.sensors.calibration import Coating

PRESS = Press(depth=1.2e-3)
COATINGS = (Coating(), Coating("roughplastic"), Coating("principled", roughness=0.4))


@pytest.fixture(autouse=True)
def _llvm() -> None:
    works(LLVM)


DIRECT = dataclasses.replace(STANDARD, bounce_step=0)  # linear in each light and in albedo


def drawn(unit, preset=DIRECT, surroundings=NOTHING) -> np.ndarray:
    """Radiance (2, H, W, 3), levels, at rest and pressed."""
    rest = rest_height_map(unit.camera)
    light = GelLight(unit, preset, rest, 0, surroundings)
    return np.stack([light.radiance(height) for height in (rest, PRESS.on(unit.camera))])


@pytest.mark.parametrize("coating", COATINGS, ids=lambda coating: coating.bsdf)
def test_our_integrator_is_near_mitsubas_paths(small, coating):
    """Means of 10 x 10 pixels, at rest and under a press of 1.2 mm: the paths' noise is 0.15 to 0.3 levels there."""
    unit = dataclasses.replace(small, coating=coating)
    truth, errors = drawn(unit, dataclasses.replace(REFERENCE, paths=8)), []
    for preset in (DIRECT, STANDARD, QUALITY):
        off = np.stack([levels(unit, each) for each in drawn(unit, preset) - truth])
        errors.append(np.sqrt(np.mean(off.reshape(2, 8, 10, 6, 10, 3).mean((2, 4)) ** 2, axis=(1, 2, 3))))
    # A bounce brings both nearer, where highlights are narrow too: 0.3 to 0.9 and 0.3 to 0.5, 0.5 to 2.5 without.
    assert (errors[1] < 0.7 * errors[0]).all()
    assert (errors[2] < 0.8).all() and (errors[2] < 0.7 * errors[0]).all()


@pytest.mark.parametrize("coating", COATINGS, ids=lambda coating: coating.bsdf)
def test_other_numbers_in_one_scene_make_what_a_new_scene_makes(small, coating):
    leds = tuple(
        dataclasses.replace(led, position=tuple(np.add(led.position, 1e-3).tolist()), radius=0.7 * led.radius,
                            radiance=2 * led.radiance) for led in small.leds
    )  # fmt: skip
    camera = dataclasses.replace(small.camera, px_per_mm_x=1.02 * small.camera.px_per_mm_x, apparent_height=30e-3)
    paint = dataclasses.replace(coating, albedo=(0.3, 0.4, 0.2), roughness=0.5, gloss=0.9)
    other = dataclasses.replace(small, leds=leds, camera=camera, coating=paint, gel_index=1.5)
    light = GelLight(dataclasses.replace(small, coating=coating), QUALITY, rest_height_map(small.camera), 0)
    height = PRESS.on(other.camera)
    before = light.radiance(height)
    light.change_unit(other)
    new = GelLight(other, QUALITY, rest_height_map(other.camera), 0).radiance(height)
    np.testing.assert_array_equal(light.radiance(height), new)
    assert np.abs(new - before).mean() > 1  # levels: the numbers matter
    with pytest.raises(TactileError, match="other numbers alone"):
        light.change_unit(other.at_size(30, 40))


def test_an_led_that_is_off_or_doubled_or_moved_acts(small):
    def with_red(**change) -> np.ndarray:
        red = dataclasses.replace(small.leds[0], **change)
        return drawn(dataclasses.replace(small, leds=(red, *small.leds[1:])))

    whole, radiance, place = drawn(small), small.leds[0].radiance, small.leds[0].position
    off, doubled = with_red(radiance=0.0), with_red(radiance=2 * radiance)
    np.testing.assert_array_equal(off[..., 0], 0)
    np.testing.assert_allclose(doubled[..., 0], 2 * whole[..., 0], rtol=1e-5)
    for found in (off, doubled):
        np.testing.assert_allclose(found[..., 1:], whole[..., 1:], rtol=1e-6)  # the others stay as they are
    near = with_red(position=(place[0] - 2e-3, place[1] + 2e-3, place[2]))
    assert (near[..., 0].mean((1, 2)) > 1.2 * whole[..., 0].mean((1, 2))).all()
    # Toward the LED light grows with the inverse square: from 15.6 to 12.8 mm off the middle.
    assert np.abs(near - whole)[..., 1:].max() < 1e-3


def test_the_coating_acts(small):
    def coated(**change) -> np.ndarray:
        return drawn(dataclasses.replace(small, coating=Coating(**change)))

    grey = coated()
    np.testing.assert_array_equal(coated(albedo=(0.0, 0.0, 0.0)), 0)
    np.testing.assert_allclose(coated(albedo=(1.0, 1.0, 1.0)), 2 * grey, rtol=1e-5)  # Lambert's law, direct: linear
    rough = {"albedo": (0.0, 0.0, 0.0), "bsdf": "roughplastic"}
    matte, glossy = coated(gloss=0.0, **rough), coated(gloss=1.0, **rough)
    np.testing.assert_allclose(matte, 0, atol=1e-4)
    assert (glossy.mean((1, 2, 3)) > 0.02).all()  # highlights alone
    narrow = coated(gloss=1.0, roughness=0.1, **rough)
    # A narrow highlight lies where the gel mirrors an LED into the camera: not on the level gel, but on a flank.
    assert narrow[0].mean() < 0.2 * glossy[0].mean()
    assert narrow[1].max() > 10 * narrow[0].max()
    paint, metal = coated(bsdf="principled"), coated(bsdf="principled", metallic=1.0)
    assert metal[0].mean() < 0.6 * paint[0].mean()  # a metal throws little sideways


def test_the_gels_index_bends_the_cameras_rays(small):
    """At rest the gel lies near the plane that rays are aimed at: what is off it, shifts."""
    one, other = (drawn(dataclasses.replace(small, gel_index=index)) for index in (1.0, 1.6))
    moved = np.sqrt(np.mean((one - other) ** 2, axis=(1, 2, 3)))
    assert 0.02 < moved[1] < 2.0
    assert moved[1] > moved[0]


def test_another_lamp_adds_its_light_unless_the_housing_hides_it(small):
    def lamp(place: list[float]) -> Surroundings:
        return Surroundings((Lamp(place, 0.0, [9e-3 / np.pi] * 3),))

    whole = drawn(small)
    over, beside = (drawn(small, DIRECT, lamp(place)) for place in ([0, 0, 12e-3], [60e-3, 0, 3e-3]))
    assert ((over - whole).min(-1).mean((1, 2)) > 5).all()
    np.testing.assert_allclose(beside, whole, atol=1e-3)


def test_a_body_between_an_led_and_the_gel_casts_a_shadow(small):
    """A square of 8 mm upright between the red LED and the picture, half way."""
    along = np.array(small.leds[0].position) / 2
    across = 4e-3 * np.array([-along[1], along[0], 0]) / np.hypot(*along[:2])
    up = np.array([0, 0, 4e-3])
    corners = np.array([along + a * across + b * up for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    body = Surroundings(occluders=(Occluder(corners, np.array([[0, 1, 2], [0, 2, 3]])),))
    darker = (drawn(small) - drawn(small, DIRECT, body))[0]
    assert darker[..., 0].max() > 20
    assert np.abs(darker[..., 1]).mean() < 0.2 * darker[..., 0].mean()


def test_a_picture_at_rest_has_no_pattern(small):
    """Neighbours' points are turned against each other: on a level gel that must not be seen."""
    unit = dataclasses.replace(small, coating=Coating("roughplastic"))
    for each in (small, unit):
        resting = drawn(each)[0][4:-4, 4:-4]
        second = np.abs(resting[:, :-2] - 2 * resting[:, 1:-1] + resting[:, 2:])
        smooth = np.abs(resting[:, :-4] - 2 * resting[:, 2:-2] + resting[:, 4:]) / 4  # of steps of two, which have none
        assert (second[:, 1:-1] - smooth).max() < 0.1


def test_stock_mitsuba_renders_the_written_scene_alike(small, tmp_path):
    """Means of 10 x 10 pixels; square pixels here. Raised gel shifts by up to a third of a pixel without the window."""
    unit = dataclasses.replace(small, coating=Coating("roughplastic"))
    height = PRESS.on(unit.camera)
    write_scene(tmp_path / "gel.xml", unit, height)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gel.camera.exr", "gel.ply", "gel.xml"]
    mi = activate(LLVM)
    found = np.array(mi.render(mi.load_file(str(tmp_path / "gel.xml")), spp=1024))
    expected = GelLight(unit, QUALITY, rest_height_map(unit.camera), 0).radiance(height)
    off = (found - expected).reshape(8, 10, 6, 10, 3).mean((1, 3))
    assert np.abs(off.mean()) < 0.5 and np.sqrt(np.mean(off**2)) < 1.5


def test_pixels_of_a_scene_file_are_square(small):
    camera = dataclasses.replace(small.camera, px_per_mm_y=small.camera.px_per_mm_y * 0.9)
    square = square_pixels(camera)
    assert square.pixel_size[0] == square.pixel_size[1] and square.height == 89
    with pytest.raises(TactileError, match="ends in"):
        write_scene("gel.json", small, rest_height_map(small.camera))


def test_a_scene_file_says_the_spread_that_it_leaves_out(small, tmp_path):
    write_scene(tmp_path / "gel.xml", small, rest_height_map(small.camera))
    pixels = f"{small.coating.spread / small.camera.pixel_size[0]:.6g}"
    assert f"a Gaussian of {pixels} px" in (tmp_path / "gel.xml").read_text(encoding="utf-8")
    assert read_exr(tmp_path / "gel.camera.exr")[1]["coating_spread_px"] == pixels
