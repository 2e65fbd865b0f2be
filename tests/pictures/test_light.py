"""The fast picture against Lambert's law and brute force; what holds for every preset is in test_renderer."""

import dataclasses

import numpy as np
import pytest
from plain_unit import LEDS, LEVELS, plain_unit

from tactile_core.errors import TactileError
from tactile_core.pictures import renderer
from tactile_core.pictures.height_map import rest_height_map
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.camera import Led

UNIT = plain_unit()
DIGIT_CAMERA, DIGIT_LEDS = UNIT.camera, UNIT.leds
RIGHT, DOWN = np.meshgrid(DIGIT_CAMERA.right, DIGIT_CAMERA.down)
FLAT = np.zeros(DIGIT_CAMERA.shape)
GREY = np.full((*DIGIT_CAMERA.shape, 3), 128)


class Press:
    """A bowl with the smoothed print of a 6 mm ball in it, as formulas: heights and slopes at any place, m."""

    def __init__(self, depth: float, right: float, down: float) -> None:
        self.depth, self.right, self.down = depth, right, down
        self.ball, self.bowl, self.soft = 3e-3, 21e-3, 40e-6

    def _excess(self, right: np.ndarray, down: np.ndarray) -> np.ndarray:
        square = (right - self.right) ** 2 + (down - self.down) ** 2
        return (self.depth - square / (2 * self.ball)) / self.soft

    def rest(self, right: np.ndarray) -> np.ndarray:
        return right**2 / (2 * self.bowl)

    def height(self, right: np.ndarray, down: np.ndarray) -> np.ndarray:
        return self.rest(right) + self.soft * np.logaddexp(0, self._excess(right, down))

    def slopes(self, right: np.ndarray, down: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        share = 1 / (1 + np.exp(-self._excess(right, down))) / self.ball
        return right / self.bowl - share * (right - self.right), -share * (down - self.down)


def seen_by_pixels(press: Press, right: np.ndarray, down: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Image places (n,) m of the gel points that the camera sees at places (n,) of height zero, by bisection."""
    low, high = np.zeros_like(right), np.full_like(right, 4e-3)
    for _ in range(40):
        middle = (low + high) / 2
        near = 1 - middle / DIGIT_CAMERA.apparent_height
        hidden = press.height(right * near, down * near) > middle
        low, high = np.where(hidden, middle, low), np.where(hidden, high, middle)
    near = 1 - low / DIGIT_CAMERA.apparent_height
    return right * near, down * near


def brute_force(press: Press, right: np.ndarray, down: np.ndarray, led: Led, points: int = 97) -> np.ndarray:
    """Radiance (n,) seen at places (n,) m of height zero: hard shadows of many points of the LED, exact heights."""
    right, down = seen_by_pixels(press, right, down)
    place = np.stack([right, down, press.height(right, down)], -1)
    slopes = press.slopes(right, down)
    normal = np.stack([-slopes[0], -slopes[1], np.ones_like(right)], -1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    to_led = np.array(led.position) - place
    distance = np.linalg.norm(to_led, axis=1, keepdims=True)
    ray = to_led / distance
    apparent = led.radius * distance / np.sqrt(distance**2 - led.radius**2)  # of the tangent cone, in the LED's plane
    side = np.cross(ray, [0, 0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    upward = np.cross(side, ray)
    march = np.linspace(0, 4.5e-3, 121)[1:]  # no shadow of a dent below 1.5 mm is longer
    total = np.zeros(len(place))
    for k in range(points):  # sunflower: even over the disc that a sphere of even brightness looks like
        radius, angle = apparent * np.sqrt((k + 0.5) / points), k * np.pi * (3 - np.sqrt(5))
        to_light = to_led + radius * (np.cos(angle) * side + np.sin(angle) * upward)
        part = march / np.hypot(to_light[:, 0], to_light[:, 1])[:, None]
        at_right, at_down, line = (place[:, i, None] + part * to_light[:, i, None] for i in range(3))
        seen = (press.height(at_right, at_down) <= line + 1e-9).all(1)  # 1 nm: rounding
        # Even radiance: solid angle of a part of the plane, distance / |to_light|^3, times the cosine.
        total += seen * np.maximum((normal * to_light).sum(1), 0) / np.linalg.norm(to_light, axis=1) ** 4
    return total / points * ((apparent / led.radius) ** 2 * distance)[:, 0] * np.square(led.position).sum()


@pytest.mark.parametrize(
    ("depth", "right", "down", "allowed"),
    # Measured: up to 0.2, 0.45 and 0.51 grey levels rms near a press, of which brute force's own points make 0.2.
    [(0.5e-3, 0.0, 0.0, 0.3), (1.0e-3, 2e-3, -3e-3, 0.5), (1.5e-3, -2e-3, 2e-3, 0.55)],
)
def test_shadows_against_brute_force(depth: float, right: float, down: float, allowed: float) -> None:
    press = Press(depth, right, down)
    shader = Renderer(UNIT, "fast", rest=press.rest(RIGHT), background=GREY)
    fast = shader.radiance(press.height(RIGHT, DOWN))
    near = np.hypot(RIGHT - right, DOWN - down) < np.sqrt(2 * press.ball * depth) + 3e-3
    near[np.indices(near.shape).sum(0) % 31 != 0] = False  # a thousand pixels are enough
    for led in DIGIT_LEDS:
        error = fast[near][:, led.channel] - LEVELS * brute_force(press, RIGHT[near], DOWN[near], led)
        assert np.sqrt(np.mean(error**2)) < allowed


def test_undeformed_gel_that_shadows_itself_is_bit_equal_too() -> None:
    ridge = 1.0e-3 * np.exp(-((RIGHT / 0.8e-3) ** 2))
    low = tuple(dataclasses.replace(led, position=(*led.position[:2], 2.5e-3)) for led in DIGIT_LEDS)
    shader = Renderer(plain_unit(leds=low), "fast", rest=ridge, background=GREY)
    np.testing.assert_array_equal(shader(ridge), GREY)
    # The ridge is there: without it the far side of the picture is brighter.
    free = Renderer(plain_unit(leds=low), "fast", rest=FLAT, background=GREY).radiance(FLAT)
    assert (free - shader.radiance(ridge))[..., 0].max() > 0.05 * LEVELS


def test_tilted_plane_is_lambert(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer, "MOST_BELOW", 1.0)  # a half of the plane lies deeper than a gel's surface may
    led = Led("red", (9e-3, -3e-3, 9e-3), 1e-7, 1.0)
    plane = 0.2 * RIGHT - 0.1 * DOWN
    unit = plain_unit(leds=(led, *LEDS[1:]))
    radiance = Renderer(unit, "fast", rest=FLAT, background=GREY).radiance(plane)
    # The plane h = a . q s, s = 1 - h / H, is seen at s = 1 / (1 + a . q / H).
    near = 1 / (1 + plane / DIGIT_CAMERA.apparent_height)
    to_light = np.stack([9e-3 - RIGHT * near, -3e-3 - DOWN * near, 9e-3 - plane * near], -1)
    cosine = to_light @ np.array([-0.2, 0.1, 1]) / np.sqrt(1.05)
    expected = 171e-6 * cosine / np.linalg.norm(to_light, axis=-1) ** 3
    inside = (np.abs(RIGHT * near) < 0.98 * RIGHT.max()) & (np.abs(DOWN * near) < 0.98 * DOWN.max())  # of the map
    # Slopes of float32 heights over 0.1 mm.
    np.testing.assert_allclose(radiance[..., 0][inside], LEVELS * expected[inside], rtol=5e-4)


def test_deeper_changes_more_and_pictures_stay_in_range() -> None:
    shader = Renderer(preset="fast")
    changes = []
    for depth in (0.1e-3, 0.4e-3, 1.6e-3):
        press = Press(depth, 0.0, 0.0)
        picture = shader(rest_height_map(DIGIT_CAMERA) + press.height(RIGHT, DOWN) - press.rest(RIGHT))
        assert picture.dtype == np.uint8
        changes.append(np.abs(picture.astype(int) - shader.background).mean())
    assert changes == sorted(changes)


NAN = np.where(np.indices(DIGIT_CAMERA.shape).sum(0) == 9, np.nan, 0)


@pytest.mark.parametrize(
    ("options", "where"),
    [({"calibration": plain_unit(leds=(Led("red", (1e-3, 2e-3, 7e-3), 1e-3, 1.0), *LEDS[1:]))}, "led red, position"),
     ({"background": GREY[..., 0]}, "background"), ({"rest": NAN}, "rest height map")],
)  # fmt: skip
def test_bad_shader_is_refused(options: dict, where: str) -> None:
    with pytest.raises(TactileError, match=where):
        Renderer(preset="fast", **options)


@pytest.mark.parametrize("corner", [(0, 0), (0, -1), (-1, 0), (-1, -1)])
def test_press_at_a_corner_changes_the_picture_there_alone(corner: tuple[int, int]) -> None:
    height = FLAT.copy()
    height[corner] = 0.3e-3
    change = np.abs(Renderer(UNIT, "fast", rest=FLAT, background=GREY)(height).astype(int) - 128).max(-1)
    assert change[corner] > 20
    away = np.hypot(RIGHT - RIGHT[corner], DOWN - DOWN[corner]) > 1.5e-3  # a needle of 0.3 mm, lights at 20 degrees
    assert not change[away].any()
