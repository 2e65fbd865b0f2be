"""Fast picture of the gel: three coloured LEDs on a white, matte coating, with soft cast shadows; numpy alone.

Radiance is counted per LED in the unit of ``calibration``: Lambert's cosine times the inverse square of distance, in
which a flat, level coating has sin(elevation), about 0.4. What light the gel throws on itself is left out.
"""

from __future__ import annotations

import numpy as np

from .background import background_picture
from .calibration import LARGEST_LEVEL, Calibration
from .calibration_file import load_calibration
from .camera import COLOURS, Camera, Led
from .cast_shadows import FREE, ShadowCaster, bounding_box, disc_share
from .errors import TactileError
from .height_map import of_unit, rest_height_map
from .view import View, slopes

MIN_RISE = 10e-6  # m; what has risen less throws a shadow of a pixel at most, lights at 20 degrees or higher


class Shader:
    """Pictures of height maps; what only the resting gel decides is computed once.

    calibration : None for the one that ships
    background : (H, W, 3) picture of the undeformed gel, 8-bit values; None for the calibration's
    rest : (H, W) heights of the undeformed gel, m, that height maps rise from; None for the DIGIT's
    Raises TactileError for arrays of another shape, values that are not finite, or LEDs over the picture.
    """

    def __init__(
        self,
        calibration: Calibration | None = None,
        background: np.ndarray | None = None,
        rest: np.ndarray | None = None,
    ) -> None:
        self.calibration = calibration = calibration or load_calibration()
        camera = self.camera = calibration.camera
        self._dome = rest is None  # heights have the public mesh's dome, which the unit's own takes the place of
        rest = of_unit(rest_height_map(camera), calibration) if rest is None else rest
        background = background_picture(calibration) if background is None else background
        rest = _checked(rest, camera.shape, "rest height map")
        self.background = _checked(background, (*camera.shape, 3), "background")
        self._gain = np.ascontiguousarray(calibration.gain.matrices(camera).transpose(2, 3, 0, 1), np.float32)
        self._view = View(camera, rest)
        self.rest = self._view(rest)
        self._lamps = [Lamp(camera, led, self.rest) for led in calibration.leds]
        self._rest_radiance = self._seen_radiance(self.rest)

    def __call__(self, height_map: np.ndarray, noise: np.random.Generator | None = None) -> np.ndarray:
        """Picture (H, W, 3) uint8 of heights (H, W) m; bit-equal to the background's where nothing changed.

        noise : makes the camera's noise, as measured on the unit; None for none
        """
        change = self._radiance(height_map)
        change -= self._rest_radiance
        picture = np.empty((*self.camera.shape, 3), np.uint8)
        for channel in range(len(COLOURS)):
            level = self.background[..., channel].copy()
            for gain, light in zip(self._gain[channel], change, strict=True):
                level += gain * light
            if noise is not None:
                level += np.float32(self.calibration.noise[channel]) * noise.standard_normal(level.shape, np.float32)
            np.rint(level, out=level)
            picture[..., channel] = np.clip(level, 0, LARGEST_LEVEL, out=level)
        return picture

    def radiance(self, height_map: np.ndarray) -> np.ndarray:
        """Radiance (H, W, 3) float32 of the coating that each pixel sees, by LED; height_map : (H, W) m."""
        return np.moveaxis(self._radiance(height_map), 0, -1)

    def _radiance(self, height_map: np.ndarray) -> np.ndarray:
        heights = _checked(height_map, self.camera.shape, "height map")
        return self._seen_radiance(self._view(of_unit(heights, self.calibration) if self._dome else heights))

    def _seen_radiance(self, seen: np.ndarray) -> np.ndarray:
        """Radiance (3, H, W) of heights (H, W) that the pixels see."""
        surface = SeenSurface(self._view, seen)
        raised = bounding_box(seen - self.rest > MIN_RISE)
        return np.stack([lamp.radiance(surface, raised) for lamp in self._lamps])


class SeenSurface:
    """What all LEDs need of the gel that the pixels see, all (H, W) float32.

    With s = 1 - h / H the seen point is (q s, h), and its normal is along (-dh/dq, tilt), where dh/dq are the slopes of
    h over the picture and tilt = s - q . dh/dq / H (from h(q) = height(q s)).
    """

    def __init__(self, view: View, seen: np.ndarray) -> None:
        camera = view.camera
        inverse = np.float32(1 / camera.apparent_height)
        self.height = seen
        self.slope_right, self.slope_down = slopes(seen, camera)
        self.near = 1 - seen * inverse
        outward = view.right * self.slope_right
        outward += view.down * self.slope_down  # q . dh/dq
        self.tilt = self.near - outward * inverse
        # Of the cosine: normal . (LED - point) = tilt LED_up - slopes . LED + own
        self.own = outward * self.near
        self.own -= self.tilt * seen
        self.normal = np.sqrt(self.slope_right**2 + self.slope_down**2 + self.tilt**2)
        self.square = self.near**2 * (view.right**2 + view.down**2) + seen**2  # of the distance from the origin

    @property
    def mapped(self) -> np.ndarray:
        """The field on which shadows are cast, see ``cast_shadows``."""
        return self.height / self.near


class Lamp:
    """One LED and what it gives to the gel that the pixels see.

    seen_rest : (H, W) float32, m, heights of the resting gel that the pixels see
    """

    def __init__(self, camera: Camera, led: Led, seen_rest: np.ndarray) -> None:
        self.led = led
        self._caster = ShadowCaster(camera, led)
        right, down, _ = np.asarray(led.position, np.float32)
        self._over_picture = camera.right.astype(np.float32) * right + (camera.down.astype(np.float32) * down)[:, None]
        self._rest_sight = self._whole_sight(seen_rest / (1 - seen_rest * np.float32(1 / camera.apparent_height)))

    def radiance(self, surface: SeenSurface, raised: tuple[slice, slice] | None) -> np.ndarray:
        """Radiance (H, W) float32; raised : rows and columns of pixels where the gel may throw new shadows."""
        right, down, up = np.asarray(self.led.position, np.float32)
        distance = self._over_picture * surface.near
        distance += up * surface.height
        distance *= -2
        distance += surface.square
        distance += np.float32(np.square(self.led.position).sum())  # squared, so far
        facing = up * surface.tilt
        facing -= right * surface.slope_right
        facing -= down * surface.slope_down
        facing += surface.own
        sight, box = self._sight(surface, raised)
        light = np.maximum(facing, 0)
        if sight is not None:
            light[box] = self._shadowed(sight, facing[box], distance[box], surface, box)
        distance *= np.sqrt(distance)
        distance *= surface.normal
        light /= distance
        light *= np.float32(np.square(self.led.position).sum())
        return light

    def _sight(
        self, surface: SeenSurface, raised: tuple[slice, slice] | None
    ) -> tuple[np.ndarray | None, tuple[slice, slice]]:
        """Sight and the box it is for: where the gel has risen, and where the resting gel shadows itself."""
        rest, whole = self._rest_sight, tuple(slice(0, size) for size in surface.height.shape)
        if raised is None:
            return rest, whole
        if rest is not None:  # the rising gel may bring light to what the resting gel shadowed, wherever that is
            raised = whole
        sight, box = self._caster.sight(surface.mapped, raised)
        if rest is None:
            return sight, box
        both = np.full_like(rest, FREE)
        both[box] = sight
        return both, whole

    def _whole_sight(self, mapped: np.ndarray) -> np.ndarray | None:
        """Sight (H, W); None where the whole LED is seen everywhere, as over the bowl of a dome."""
        sight, box = self._caster.sight(mapped, tuple(slice(0, size) for size in mapped.shape))
        if not sight.size:
            return None
        whole = np.full(mapped.shape, FREE, np.float32)
        whole[box] = sight
        return whole

    def _shadowed(
        self, sight: np.ndarray, facing: np.ndarray, square: np.ndarray, surface: SeenSurface, box: tuple[slice, slice]
    ) -> np.ndarray:
        """Cosine times distance of the part of the LED's disc that stands above the horizon, times its share of it.

        With l the vector to the LED and e the unit vector upward across it, that part's centre is l + radius moment /
        share e; and normal . e = (tilt |l|^2 - above facing) / (|l| plan distance).
        """
        share, moment = disc_share(sight)
        above = self.led.position[2] - surface.height[box]
        moment *= surface.tilt[box] * square - above * facing
        moment *= np.float32(self.led.radius) / np.sqrt((square - above**2) * square)
        share *= facing
        share += moment
        return np.maximum(share, 0, out=share)


def _checked(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    values = np.asarray(values)
    if values.shape != shape:
        raise TactileError(name, f"shape {values.shape}", f"{shape}, as the camera's picture")
    if not np.isfinite(values).all():
        raise TactileError(name, "values that are not finite", "finite numbers", "Repair the frame first")
    return values.astype(np.float32)
