"""Fast picture of the gel: three coloured LEDs on a white, matte coating, with soft cast shadows; numpy alone.

Radiance is Lambert's cosine times the inverse square of distance. What light the gel throws on itself, the coating's
gloss and the window are left out.
"""

from __future__ import annotations

import numpy as np

from ..errors import TactileError
from ..files.compiled import available
from ..sensors.calibration import LARGEST_LEVEL, Calibration
from ..sensors.calibration_file import load_calibration
from ..sensors.camera import COLOURS, Camera, Led
from .background import raised_light, resting_picture
from .cast_shadows import ShadowCaster, bounding_box, disc_share
from .coating_spread import CoatingSpread
from .height_map import of_unit, rest_height_map
from .lamp_loops import lamp_light
from .level_loops import in_picture
from .perspective import Perspective, slopes
from .perspective_loops import seen_surface

# A shadow begins where the gel's tangent plane cuts the LED: at normal . (LED - point) < radius. With a margin for the
# differences that slopes are made of.
TANGENT, TANGENT_MARGIN = 1.1, 2  # of the radius, px


class Shader:
    """Pictures of height maps; what only the resting gel decides is computed once.

    calibration : None for the one that ships
    background : (H, W, 3) picture of the undeformed gel, 8-bit values; None for what the calibration makes
    rest : (H, W) heights of the undeformed gel, m, that height maps rise from; None for the DIGIT's
    Raises TactileError for arrays of another shape, values that are not finite, LEDs over the picture, or a gel that
    reaches an LED or the camera.
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
        self._resting = rest_height_map(camera) if rest is None else camera_array(rest, camera.shape, "rest height map")
        rest = of_unit(self._resting, calibration) if self._dome else self._resting
        self._view = Perspective(camera, rest)
        check_reach(rest, calibration, "rest height map")
        self.rest = self._view(rest)
        self._spread = CoatingSpread(camera, calibration.coating.spread)
        self._lamps = [Lamp(camera, led) for led in calibration.leds]
        self._rest_radiance = self._seen_radiance(self.rest)
        if background is None:
            background = resting_picture(calibration, np.moveaxis(self._rest_radiance, 0, -1))
        self.background = camera_array(background, (*camera.shape, 3), "background")
        self._levels = np.ascontiguousarray(np.moveaxis(self.background, -1, 0))
        self._response = np.ascontiguousarray(calibration.pixel_response.transpose(2, 3, 0, 1), np.float32)
        self._rest_picture = self._drawn(self._rest_radiance)

    def __call__(self, height_map: np.ndarray) -> np.ndarray:
        """Picture (H, W, 3) uint8 of heights (H, W) m; bit-equal to the background's where nothing changed."""
        if np.array_equal(height_map, self._resting):
            return self._rest_picture.copy()
        return self._drawn(self._radiance(height_map))

    def _drawn(self, radiance: np.ndarray) -> np.ndarray:
        """Picture (H, W, 3) uint8 of the radiance (3, H, W) of the LEDs."""
        if available():
            return in_picture(radiance, self._rest_radiance, self._response, self.background, np.float32(LARGEST_LEVEL))
        change = radiance - self._rest_radiance
        picture = np.empty((*self.camera.shape, 3), np.uint8)
        for channel in range(len(COLOURS)):
            level = self._levels[channel].copy()
            for response, light in zip(self._response[channel], change, strict=True):
                level += response * light
            np.rint(level, out=level)
            picture[..., channel] = np.clip(level, 0, LARGEST_LEVEL, out=level)
        return picture

    def radiance(self, height_map: np.ndarray) -> np.ndarray:
        """Return the radiance (H, W, 3) float32, levels, of each pixel's coating, by LED; height_map : (H, W) m."""
        return np.moveaxis(self._radiance(height_map), 0, -1)

    def _radiance(self, height_map: np.ndarray) -> np.ndarray:
        heights = camera_array(height_map, self.camera.shape, "height map")
        heights = of_unit(heights, self.calibration) if self._dome else heights
        check_reach(heights, self.calibration, "height map")
        return self._seen_radiance(self._view(heights))

    def _seen_radiance(self, seen: np.ndarray) -> np.ndarray:
        """Radiance (3, H, W) of heights (H, W) that the pixels see."""
        surface = SeenSurface(self._view, seen)
        scale = self.calibration.facing.astype(np.float32)
        direct = np.stack([lamp.radiance(surface) * level for lamp, level in zip(self._lamps, scale, strict=True)])
        return self._spread(direct + raised_light(self.calibration, seen))


class SeenSurface:
    """Data of the gel that the pixels see, shared by all LEDs, all (H, W) float32.

    With s = 1 - h / H the seen point is (q s, h), and its normal is along (-dh/dq, tilt), where dh/dq are the slopes of
    h over the picture and tilt = s - q . dh/dq / H (from h(q) = height(q s)).
    """

    def __init__(self, view: Perspective, seen: np.ndarray) -> None:
        camera = view.camera
        inverse = np.float32(1 / camera.apparent_height)
        self.height = seen
        self.slope_right, self.slope_down = slopes(seen, camera)
        if available():
            self.near, self.tilt, self.own, self.normal, self.square, self.mapped = seen_surface(
                seen, self.slope_right, self.slope_down, view.right[0], view.down[:, 0], inverse
            )
            return
        self.near = 1 - seen * inverse
        outward = view.right * self.slope_right
        outward += view.down * self.slope_down  # q . dh/dq
        self.tilt = self.near - outward * inverse
        # Of the cosine: normal . (LED - point) = tilt LED_up - slopes . LED + own
        self.own = outward * self.near
        self.own -= self.tilt * seen
        self.normal = np.sqrt(self.slope_right**2 + self.slope_down**2 + self.tilt**2)
        self.square = self.near**2 * (view.right**2 + view.down**2) + seen**2  # of the distance from the origin

        self.mapped = seen / self.near  # the field on which shadows are cast, see ``cast_shadows``


class Lamp:
    """Light of one LED on the gel that the pixels see."""

    def __init__(self, camera: Camera, led: Led) -> None:
        self.led = led
        self._caster = ShadowCaster(camera, led)
        right, down, _ = np.asarray(led.position, np.float32)
        self._over_picture = camera.right.astype(np.float32) * right + (camera.down.astype(np.float32) * down)[:, None]

    def radiance(self, surface: SeenSurface) -> np.ndarray:
        """Return the radiance (H, W) float32, relative to a coating that faces the LED in the picture's middle."""
        if available():
            return self._compiled_radiance(surface)
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
        light = np.maximum(facing, 0)
        edge = bounding_box(facing < np.float32(TANGENT * self.led.radius) * surface.normal, TANGENT_MARGIN)
        if edge is not None:
            sight, box = self._caster.sight(surface.mapped, edge)
            light[box] = self._shadowed(sight, facing[box], distance[box], surface, box)
        distance *= np.sqrt(distance)
        distance *= surface.normal
        light /= distance
        light *= np.float32(np.square(self.led.position).sum())
        return light

    def _compiled_radiance(self, surface: SeenSurface) -> np.ndarray:
        """Compute the same radiance by a compiled loop; shadows are numpy's."""
        strength = np.float32(np.square(self.led.position).sum())
        facing, distance, light = np.empty((3, *surface.near.shape), np.float32)
        first_row, last_row, first_column, last_column = lamp_light(
            np.asarray(self.led.position, np.float32), strength, np.float32(TANGENT * self.led.radius),
            self._over_picture, surface.near, surface.height, surface.square, surface.tilt, surface.slope_right,
            surface.slope_down, surface.own, surface.normal, facing, distance, light,
        )  # fmt: skip
        if last_row < 0:
            return light
        margin, (rows, columns) = TANGENT_MARGIN, light.shape
        edge = (
            slice(max(first_row - margin, 0), min(last_row + 1 + margin, rows)),
            slice(max(first_column - margin, 0), min(last_column + 1 + margin, columns)),
        )
        sight, box = self._caster.sight(surface.mapped, edge)
        square = distance[box]
        shadowed = self._shadowed(sight, facing[box], square, surface, box)
        light[box] = shadowed / (square * np.sqrt(square) * surface.normal[box]) * strength
        return light

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


def camera_array(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Convert values to float32; raises TactileError, by their name, for another shape or what is not finite."""
    values = np.asarray(values)
    if values.shape != shape:
        raise TactileError(name, f"shape {values.shape}", f"{shape}, as the camera's picture")
    if not np.isfinite(values).all():
        raise TactileError(name, "values that are not finite", "finite numbers", "Repair the frame first")
    return values.astype(np.float32)


def check_reach(height: np.ndarray, unit: Calibration, name: str) -> None:
    """Raise TactileError for heights (H, W) m that reach an LED's middle or the camera."""
    lowest = min(unit.leds, key=lambda led: led.position[2])
    limits = {f"the {lowest.colour} LED": lowest.position[2], "the camera": unit.camera.apparent_height}
    for what, limit in limits.items():
        if float(height.max()) >= limit:
            found = f"{height.max() * 1e3:.2f} mm high, {what} {limit * 1e3:.2f} mm"
            raise TactileError(name, found, "a gel below LEDs and camera", "Check that heights are in metres")
