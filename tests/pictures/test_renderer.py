"""Pictures of every preset: exact zeros, Lambert's law, symmetry, repeats, variants, bad input."""

import dataclasses

import numpy as np
import pytest
from gel_pictures import Press, levels, with_leds, works
from plain_unit import plain_unit

from tactile_core.errors import TactileError
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.mitsuba.matte_light import MatteLight
from tactile_core.pictures.mitsuba.variant import LLVM, SCALAR
from tactile_core.pictures.perspective import Perspective
from tactile_core.pictures.presets import PRESETS, REFERENCE
from tactile_core.pictures.renderer import CHANNELS, Renderer, camera_noise
from tactile_core.sensors.calibration import Coating

SHORT = dataclasses.replace(REFERENCE, name="short", passes=2)


@pytest.fixture
def short(monkeypatch):
    """The reference preset with two passes, so that tests of what holds for any number are quick."""
    monkeypatch.setitem(PRESETS, "reference", SHORT)


@pytest.mark.parametrize("preset", ["fast", "standard"])
def test_each_led_dims_in_its_own_shadow_alone(preset, any_variant, small, press):
    renderer = Renderer(small, preset, any_variant)
    change = (renderer.radiance(press.on(small.camera)) - renderer.rest_radiance) / small.facing
    right, down = np.meshgrid(small.camera.right, small.camera.down)
    for led in small.leds:
        away = -np.array(led.position[:2]) / np.hypot(*led.position[:2])
        behind = np.array([press.right, press.down]) + away * (np.sqrt(2 * press.ball * press.depth) + 0.3e-3)
        at = np.hypot(right - behind[0], down - behind[1]) < 0.3e-3
        assert change[at][:, led.channel].mean() < -0.15  # of about 0.4 that a level gel has
        assert np.abs(np.delete(change[at].mean(0), led.channel)).max() < 0.1


@pytest.mark.parametrize("preset", ["fast", "standard"])
def test_ambient_light_grows_with_the_gel_s_height(preset, any_variant, small, press):
    """By what a pixel sees of the gel, in each LED's band; an LED that is off has none."""
    red, *others = small.leds
    off = dataclasses.replace(small, leds=(dataclasses.replace(red, radiance=0.0), *others))
    raised = dataclasses.replace(off, ambient_rise=(50.0, 50.0, -100.0))  # a metre
    height, rest = press.on(small.camera), rest_height_map(small.camera)
    changes = []
    for unit in (off, raised):
        renderer = Renderer(unit, preset, any_variant)
        changes.append(renderer.radiance(height) - renderer.rest_radiance)
    view = Perspective(small.camera, rest)
    more = (view(height) - view(rest))[..., None] * raised.ambient_rise * off.ambient_unit
    np.testing.assert_allclose(changes[1] - changes[0], more, atol=0.01)
    assert not changes[1][..., 0].any() and more[..., 1].max() > 4 and more[..., 2].min() < -7


@pytest.mark.parametrize("preset", ["fast", "standard"])
def test_object_shows_through_the_coating_where_it_touches(preset, any_variant, small, press):
    """As bright in every preset, in light and in shadow, in each LED's band; nowhere else, and not at rest."""
    thin = dataclasses.replace(small, coating=dataclasses.replace(small.coating, transmission=0.2))
    black, white = (
        Renderer(dataclasses.replace(thin, object_reflectance=share), preset, any_variant) for share in (0.0, 1.0)
    )
    np.testing.assert_array_equal(black.rest_radiance, white.rest_radiance)
    height = press.on(small.camera)
    more = white.radiance(height) - black.radiance(height)
    right, down = np.meshgrid(small.camera.right, small.camera.down)
    distance = np.hypot(right - press.right, down - press.down)
    inside, reach = distance < 0.5e-3, np.sqrt(2 * press.ball * press.depth)
    np.testing.assert_allclose(more[inside], np.broadcast_to(0.2 * small.facing, more[inside].shape), rtol=1e-4)
    assert np.abs(more[distance > 1.3 * reach]).max() < 1e-3 * more.max()


def test_a_mirrored_scene_makes_the_mirrored_picture(any_variant, small):
    flat = np.zeros(small.camera.shape, np.float32)
    mirrored = dataclasses.replace(
        small,
        leds=tuple(dataclasses.replace(led, position=(-led.position[0], *led.position[1:])) for led in small.leds),
    ).with_gain(small.gain)
    one, other = Press(right=1.2e-3), Press(right=-1.2e-3)
    for preset in ("fast", "standard", "quality"):
        left = Renderer(small, preset, any_variant, rest=flat).radiance(one.over(flat, small.camera))
        right = Renderer(mirrored, preset, any_variant, rest=flat).radiance(other.over(flat, small.camera))
        difference = levels(small, left - right[:, ::-1])
        # Cells of the mesh are cut along one diagonal, which is not mirrored, and pixels here are four times as wide
        # as the real ones: at a shadow's edge one light point of four flips, a fifth of a level rms.
        assert np.sqrt(np.mean(difference**2)) < 0.5
        assert np.abs(difference.mean()) < 0.05  # of 60: pixels' points are turned in fours, which is not mirrored


@pytest.mark.parametrize("preset", ["fast", "standard"])
def test_a_dent_that_moves_takes_its_picture_along(preset, any_variant, small):
    far = dataclasses.replace(
        small, camera=dataclasses.replace(small.camera, apparent_height=1.0),
        leds=tuple(dataclasses.replace(led, position=tuple(20 * c for c in led.position)) for led in small.leds),
    ).with_gain(small.gain)  # fmt: skip
    flat, camera = np.zeros(small.camera.shape, np.float32), far.camera
    renderer = Renderer(far, preset, any_variant, rest=flat)
    step = camera.pixel_size[0]
    one = renderer.radiance(Press(0.4e-3, 0, 0, soft=0.1e-3).over(flat, camera)) - renderer.rest_radiance
    moved = renderer.radiance(Press(0.4e-3, -6 * step, 8 * step, soft=0.1e-3).over(flat, camera))
    moved = np.roll(moved - renderer.rest_radiance, (-8, 6), (0, 1))
    # Lights 0.3 m away see a shift of 2 mm as 1.5 % of distance at most: inverse square and angle, a few per cent.
    inside = np.s_[12:-12, 10:-10]
    assert np.sqrt(np.mean((moved - one)[inside] ** 2)) < 0.06 * np.sqrt(np.mean(one[inside] ** 2))


@pytest.mark.parametrize(("preset", "count"), [("standard", 1), ("reference", REFERENCE.paths)])
def test_pictures_get_better_up_to_the_one_of_a_call(preset, count, small, press):
    unit = small.at_size(30, 40)
    renderer, height = Renderer(unit, preset, works(LLVM)), press.on(unit.camera)
    pictures = [picture.astype(float) for picture in renderer.refined(height)]
    assert len(pictures) == count
    np.testing.assert_array_equal(pictures[-1], renderer(height))
    noise = [np.sqrt(np.mean((picture - pictures[-1]) ** 2)) for picture in pictures]
    assert noise == sorted(noise, reverse=True)


def test_repeats_are_bit_equal(variant, small, press, short):
    unit = small.at_size(30, 40)
    height = press.on(unit.camera)
    for preset in ("standard", "quality", "reference"):
        one, other = (Renderer(unit, preset, variant) for _ in range(2))
        other(rest_height_map(unit.camera))  # what was drawn before leaves no trace
        np.testing.assert_array_equal(one.radiance(height), other.radiance(height))


@pytest.mark.parametrize("coating", [Coating(), Coating("principled", roughness=0.4)], ids=lambda each: each.bsdf)
def test_the_number_of_threads_changes_nothing(small, press, coating):
    variant = works(LLVM)
    import drjit

    unit = dataclasses.replace(small, coating=coating)
    renderer, height = Renderer(unit, "standard", variant), press.on(small.camera)
    before, found = drjit.thread_count(), []
    try:
        for count in (1, 2, 3):
            drjit.set_thread_count(count)
            found.append(renderer.radiance(height))
    finally:
        drjit.set_thread_count(before)
    np.testing.assert_array_equal(found[1:], [found[0]] * 2)


@pytest.mark.parametrize("preset", ["standard", "quality"])
def test_the_variants_draw_nearly_the_same_picture(preset, small, press):
    """Two implementations of one model: emitters of a scene, and points whose light is added up in numpy."""
    height = press.on(small.camera)
    one, other = (Renderer(small, preset, works(variant)) for variant in (LLVM, SCALAR))
    difference = levels(small, one.radiance(height) - other.radiance(height))
    # Pixels of 0.2 mm: at a shadow's edge points of an LED flip; the window shifts quality's and standard's by a third
    # of a pixel by LLVM alone. Measured 0.4 and 0.7; without the bounce it is 1.3.
    assert np.sqrt(np.mean(difference**2)) < 1.0


def test_pixels_need_not_be_square(variant, small, press):
    camera = dataclasses.replace(small.camera, px_per_mm_y=small.camera.px_per_mm_y * 1.05)
    unit = dataclasses.replace(small, camera=camera)
    fast, traced = (Renderer(unit, preset, variant).radiance(press.on(camera)) for preset in ("fast", "standard"))
    near = levels(unit, fast - traced)
    assert np.sqrt(np.mean(near**2)) < 2.0  # as with square pixels of 0.2 mm; a wrong scale makes it 5


@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda h: np.where(np.indices(h.shape).sum(0) == 9, np.nan, h), "not finite"),
        (lambda h: np.where(np.indices(h.shape).sum(0) == 9, np.inf, h), "not finite"),
        (lambda h: h[:-1], "shape"),
        (lambda h: h[None], "shape"),
        (lambda h: h * 1e3, "LED"),
        (lambda h: h + 5.8e-3, "LED"),
    ],
)
def test_bad_heights_are_refused(harm, words, any_variant, small, press):
    renderer = Renderer(small, "standard", any_variant)
    with pytest.raises(TactileError, match=words):
        renderer(harm(press.on(small.camera)))
    assert renderer(rest_height_map(small.camera)).shape == (80, 60, 3)  # and it goes on


def test_a_gel_that_reaches_the_camera_is_refused(any_variant, small):
    low = dataclasses.replace(small, camera=dataclasses.replace(small.camera, apparent_height=5e-3))
    high = with_leds(low, position=(9e-3, 9e-3, 30e-3))
    with pytest.raises(TactileError, match="camera"):
        Renderer(high, "standard", any_variant).radiance(np.full(small.camera.shape, 5.2e-3))


@pytest.mark.parametrize("levels", [0.5, 1.0, -5.0, 30000.0])
def test_a_background_in_other_units_is_refused(levels, small):
    with pytest.raises(TactileError, match=rf"background: values from {levels:g} to .*; expected levels 0 to 255"):
        Renderer(small, "fast", background=np.full((*small.camera.shape, 3), levels))
    for kept in (0.0, -0.1, 255.2):  # a dark room, and what resampling leaves
        assert Renderer(small, "fast", background=np.full((*small.camera.shape, 3), kept)).background.max() <= 255


def test_a_rest_that_its_caller_then_dents_stays_the_rest(small):
    heights = rest_height_map(small.camera)
    renderer, dented = Renderer(small, "fast", rest=heights), heights.copy()
    dented[30:40, 30:40] += 0.2e-3
    expected = renderer(dented)
    heights[30:40, 30:40] += 0.2e-3
    np.testing.assert_array_equal(renderer(heights), expected)


def test_heights_in_millimetres_of_the_other_sign_and_changes_alone_are_refused(small):
    """A dent of half a millimetre, as half a metre: away from the camera nothing else stops it."""
    rest = rest_height_map(small.camera)
    add = r"mm below the undeformed gel; .* add the undeformed gel's"
    deep = r"50\d\.\d\d mm below the undeformed gel; .* Give metres"
    for wrong, words in ((np.full(rest.shape, -0.5), deep), (-rest, add), (rest - rest, add)):
        with pytest.raises(TactileError, match=words):
            Renderer(small, "fast")(wrong)


def test_an_unknown_preset_or_variant_is_refused(any_variant, small):
    with pytest.raises(TactileError, match="--preset"):
        Renderer(small, "best")
    with pytest.raises(TactileError, match="variant"):
        Renderer(small, "standard", "cuda_ad_rgb")


def test_memory_stays_flat(any_variant, small, press):
    resource = pytest.importorskip("resource", reason="the system counts no memory for a process")
    del resource
    unit = small.at_size(30, 40)
    light = MatteLight(unit, PRESETS["standard"], rest_height_map(unit.camera), 0)
    height = press.on(unit.camera)
    for _ in range(50):
        light.radiance(height)
    before = resident()
    for k in range(200):
        light.radiance(height + np.float32(k * 1e-7))
    # 1,000 frames of 240 x 320 grow by less than 20 MB; a leak of one frame's vertices alone would be 5 MB here.
    assert resident() - before < 4e6


def resident() -> int:
    """Bytes of memory that this process holds."""
    try:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096
    except OSError:
        pytest.skip("the system has no /proc/self/statm")


NOISE = (1.0, 2.0, 4.0)
MEASURED = 0.74, 0.49, 0.25  # correlation over 1, 2 and 3 px on real pictures (docs/sources.md, DIGIT camera)


def correlation(noise, step):
    return float((noise[:, step:] * noise[:, :-step]).mean() / noise.var())


def test_noise_has_the_unit_s_size_and_grain():
    unit = plain_unit(noise=NOISE)
    noise = camera_noise(unit, np.random.default_rng(3))
    assert noise.shape == (*unit.camera.shape, 3)
    np.testing.assert_allclose(noise.std((0, 1)), NOISE, rtol=0.05)  # 4,800 independent squares: 1 %
    for step, said in enumerate(MEASURED, 1):
        for values in (noise[..., 2], noise[..., 2].T):
            assert correlation(values, step) == pytest.approx(said, abs=0.05)
    channels = np.corrcoef(noise.reshape(-1, 3).T)
    np.testing.assert_allclose(channels, CHANNELS, atol=0.06)
    np.testing.assert_array_equal(noise[0::2], noise[1::2])  # video keeps one colour for two rows of 240 px


@pytest.mark.parametrize("preset", ["fast", "standard"])
def test_every_preset_has_the_same_noise_and_none_unasked(preset):
    if preset != "fast":
        pytest.importorskip("mitsuba")
    unit = plain_unit(noise=NOISE)
    flat, grey = np.zeros(unit.camera.shape), np.full((*unit.camera.shape, 3), 128)
    renderer = Renderer(unit, preset, background=grey, rest=flat)
    one, again = (renderer.picture(renderer.rest_radiance, np.random.default_rng(7)).astype(float) for _ in range(2))
    np.testing.assert_array_equal(one, again)
    # Whole levels add a variance of 1/12.
    np.testing.assert_allclose((one - 128).std((0, 1)), np.sqrt(np.square(NOISE) + 1 / 12), rtol=0.05)
    assert correlation(one[..., 2] - one[..., 2].mean(), 1) == pytest.approx(MEASURED[0], abs=0.05)
    np.testing.assert_array_equal(renderer(flat), grey)
