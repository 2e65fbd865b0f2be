import dataclasses

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.sensors.calibration_file import load_calibration
from tactile_core.sensors.camera import Led

DIGIT_CAMERA, DIGIT_LEDS = load_calibration().camera, load_calibration().leds


def test_pixels_and_gel_places_are_inverse_at_any_height() -> None:
    rng = np.random.default_rng(0)
    row, column, height = rng.uniform(0, 320, 50), rng.uniform(0, 240, 50), rng.uniform(-1e-3, 3e-3, 50)
    x, z = DIGIT_CAMERA.to_gel(row, column, height)
    np.testing.assert_allclose(DIGIT_CAMERA.to_pixel(x, z, height), (row, column), atol=1e-9)


def test_what_is_seen_lies_on_the_ray_from_the_pinhole() -> None:
    camera = DIGIT_CAMERA
    x, z = camera.to_gel(10.0, 20.0, np.array([0.0, 1e-3, 2e-3]))
    pinhole = np.array([camera.centre_x, camera.apparent_height, camera.centre_z])
    rays = np.stack([x, np.array([0.0, 1e-3, 2e-3]), z], -1) - pinhole
    np.testing.assert_allclose(np.cross(rays[0], rays[1:]), 0, atol=1e-18)  # m^2, of rays of 20 mm


def test_nearer_gel_is_seen_larger() -> None:
    camera = dataclasses.replace(DIGIT_CAMERA, apparent_height=20e-3)
    row, column = camera.to_pixel(camera.centre_x, camera.centre_z + 1e-3 * np.array([-1, 1]), 2e-3)
    assert row == pytest.approx((camera.height - 1) / 2)
    assert abs(column[1] - column[0]) == pytest.approx(2 * camera.px_per_mm_x / 0.9)


def test_the_same_view_in_other_pixels() -> None:
    large = DIGIT_CAMERA.at_size(480, 640)
    assert large.px_per_mm_x == pytest.approx(2 * DIGIT_CAMERA.px_per_mm_x)
    np.testing.assert_allclose(large.gel_z.reshape(-1, 2).mean(1), DIGIT_CAMERA.gel_z, atol=1e-12)
    with pytest.raises(TactileError, match="aspect ratio"):
        DIGIT_CAMERA.at_size(640, 480)
    with pytest.raises(TactileError, match="2 x 3 pixels"):
        DIGIT_CAMERA.at_size(2, 3)


def test_pixel_centres_agree_with_the_conversion() -> None:
    rows, columns = np.arange(320), np.arange(240)
    np.testing.assert_allclose(DIGIT_CAMERA.gel_x, DIGIT_CAMERA.to_gel(rows, 0)[0], atol=1e-12)
    np.testing.assert_allclose(DIGIT_CAMERA.gel_z, DIGIT_CAMERA.to_gel(0, columns)[1], atol=1e-12)
    assert DIGIT_CAMERA.shape == (320, 240)


def test_scales_are_told_apart() -> None:
    camera = dataclasses.replace(DIGIT_CAMERA, px_per_mm_x=10.0, px_per_mm_y=20.0)
    x, z = camera.to_gel(np.array([0, 20]), np.array([0, 10]))
    assert abs(x[1] - x[0]) == pytest.approx(1e-3)
    assert abs(z[1] - z[0]) == pytest.approx(1e-3)


def test_picture_is_not_mirrored() -> None:
    # A camera looks along -y: right x down points away from it, as x x y does for any picture seen from above.
    right, down = np.array([0, 0, DIGIT_CAMERA.right_z]), np.array([DIGIT_CAMERA.down_x, 0, 0])
    np.testing.assert_array_equal(np.cross(right, down), [0, -1, 0])


def test_scale_is_one_of_those_measured_on_units() -> None:
    assert 17 <= DIGIT_CAMERA.px_per_mm_x <= 21  # docs/sources.md, DIGIT camera, at 240 x 320
    assert DIGIT_CAMERA.px_per_mm_y == pytest.approx(DIGIT_CAMERA.px_per_mm_x, rel=0.03)  # square pixels, as fitted


def test_lights_stand_where_another_fit_to_real_pictures_puts_them() -> None:
    position = np.array([led.position for led in DIGIT_LEDS])
    azimuth = np.degrees(np.arctan2(-position[:, 1], position[:, 0])) % 360
    elevation = np.degrees(np.arctan2(position[:, 2], np.hypot(*position[:, :2].T)))
    np.testing.assert_allclose(azimuth, [45, 147, 276], atol=10)  # docs/sources.md, DIGIT camera: another camera model
    # The other fit has 21 to 26. A coating that spreads light and LEDs that stand lower soften a print's rim alike:
    # photographs of one unit leave some seven degrees between the two.
    assert ((elevation > 14) & (elevation < 27)).all()
    assert [led.channel for led in DIGIT_LEDS] == [0, 1, 2]


@pytest.mark.parametrize(
    ("field", "value"),
    [("width", 0), ("height", 3.5), ("px_per_mm_x", -18.8), ("px_per_mm_y", float("nan")), ("right_z", 2),
     ("down_x", 0), ("centre_x", float("inf")), ("apparent_height", 1e-3), ("apparent_height", float("nan"))],
)  # fmt: skip
def test_camera_refuses(field: str, value: float) -> None:
    with pytest.raises(TactileError, match=field[:6]):
        dataclasses.replace(DIGIT_CAMERA, **{field: value})


@pytest.mark.parametrize(
    ("field", "value"),
    [("colour", "white"), ("position", (0, 0, -1e-3)), ("position", (0, 1e-3)), ("radius", 0.0), ("radiance", -1.0),
     ("radiance", float("nan"))],
)  # fmt: skip
def test_led_refuses(field: str, value: object) -> None:
    good = {"colour": "red", "position": (1e-3, 0, 1e-3), "radius": 1e-3, "radiance": 1.0}
    with pytest.raises(TactileError, match=field):
        Led(**good | {field: value})
