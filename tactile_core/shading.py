"""Fast picture of the gel: three coloured LEDs on a white, matte coating, with soft cast shadows; numpy alone.

Radiance is counted per colour in units of what the same LED gives on a coating that faces it at the distance from
the LED to the picture's centre: Lambert's cosine times the inverse square of distance, in which a flat, level coating
has sin(elevation), about 0.4. A picture is ``background + gain * (radiance - radiance at rest)`` in 8-bit values,
without gamma (blender.md: raw 8-bit values beat every gamma tried).
"""

from __future__ import annotations

import numpy as np

from .background import background_picture
from .calibration import Calibration
from .calibration_file import load_calibration
from .camera import Camera, Led
from .cast_shadows import FREE, MIN_RISE, ShadowCaster, bounding_box, disc_share
from .errors import TactileError
from .height_map import rest_height_map


class Shader:
    """Pictures of height maps; what only the resting gel decides is computed once.

    calibration : None for the one that ships
    background : (H, W, 3) picture of the undeformed gel, 8-bit values; None for the calibration's
    rest : (H, W) heights of the undeformed gel, m; None for the DIGIT's
    Raises TactileError for arrays of another shape, or values that are not finite.
    """

    def __init__(
        self,
        calibration: Calibration | None = None,
        background: np.ndarray | None = None,
        rest: np.ndarray | None = None,
    ) -> None:
        self.calibration = calibration = calibration or load_calibration()
        camera = self.camera = calibration.camera
        self.leds = calibration.leds
        self.gain = calibration.gain.matrices(camera).astype(np.float32)
        rest = rest_height_map(camera) if rest is None else rest
        background = background_picture(calibration) if background is None else background
        self.rest = _checked(rest, camera.shape, "rest height map")
        self.background = _checked(background, (*camera.shape, 3), "background")
        self._casters = [ShadowCaster(camera, led) for led in self.leds]
        self._offsets = [_offsets(camera, led) for led in self.leds]
        self._rest_sight = [_whole_sight(caster, self.rest) for caster in self._casters]
        self._rest_radiance = self.radiance(self.rest)

    def __call__(self, height_map: np.ndarray) -> np.ndarray:
        """Picture (H, W, 3) uint8 of heights (H, W) m; bit-equal to the background's where nothing changed."""
        change = self.radiance(height_map)
        change -= self._rest_radiance
        change = np.einsum("hwcl,hwl->hwc", self.gain, change)
        change += self.background
        np.rint(change, out=change)
        return np.clip(change, 0, 255, out=change).astype(np.uint8)

    def radiance(self, height_map: np.ndarray) -> np.ndarray:
        """Radiance (H, W, 3) float32 of the coating at heights (H, W) m, in the module's unit."""
        height = _checked(height_map, self.camera.shape, "height map")
        slope_right, slope_down = _slopes(height, self.camera)
        level = 1 / np.sqrt(1 + slope_right**2 + slope_down**2)  # the normal's third component
        raised = _raised_box(height, self.rest)
        radiance = np.zeros((*self.camera.shape, 3), np.float32)
        for k, led in enumerate(self.leds):
            right, down, square = self._offsets[k]
            above = led.position[2] - height
            # Half the radius squared: the mean inverse cube of the distance over a disc, to second order.
            cubed = square + above**2 + np.float32(led.radius**2 / 2)
            cubed *= np.sqrt(cubed)  # inverse square, and the length of (right, down, above) in the cosine
            strength = level / cubed
            strength *= np.float32(np.square(led.position).sum())
            facing = above - slope_right * right - slope_down * down
            light = np.maximum(facing, 0)
            sight, box = self._sight(k, height, raised)
            if sight is not None:
                light[box] = _shadowed(sight, facing[box], square[box], above[box], led)
            light *= strength
            radiance[..., led.channel] += light
        return radiance

    def _sight(
        self, k: int, height: np.ndarray, raised: tuple[slice, slice] | None
    ) -> tuple[np.ndarray | None, tuple[slice, slice]]:
        """Sight of LED k and the box it is for: where the gel has risen, and where the resting gel shadows itself."""
        rest, whole = self._rest_sight[k], (slice(0, self.camera.height), slice(0, self.camera.width))
        if raised is None:
            return rest, whole
        if rest is not None:  # the rising gel may bring light to what the resting gel shadowed, wherever that is
            raised = whole
        sight, box = self._casters[k].sight(height, raised)
        if rest is None:
            return sight, box
        both = np.full_like(rest, FREE)
        both[box] = sight
        return both, whole


def _whole_sight(caster: ShadowCaster, height: np.ndarray) -> np.ndarray | None:
    """Sight (H, W) of one LED; None where all of it is seen everywhere, as over the bowl of a dome."""
    box = tuple(slice(0, size) for size in height.shape)
    sight, box = caster.sight(height, box)
    if not sight.size:
        return None
    whole = np.full(height.shape, FREE, np.float32)
    whole[box] = sight
    return whole


def _shadowed(sight: np.ndarray, facing: np.ndarray, square: np.ndarray, above: np.ndarray, led: Led) -> np.ndarray:
    """Cosine times distance of the part of the LED's disc that stands above the horizon, times its share of the disc.

    With l the vector to the LED and e the unit vector upward across it, that part's centre is l + radius moment /
    share e; n' = (-slopes, 1) has n' . l = facing, so that n' . e = (|l|^2 - above facing) / (|l| plan distance).
    """
    share, moment = disc_share(sight)
    length = square + above**2
    moment *= length - above * facing
    moment *= led.radius / np.sqrt(square * length)
    return np.maximum(facing * share + moment, 0)


def _offsets(camera: Camera, led: Led) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From each pixel to the LED: right (1, W), down (H, 1), and the sum of their squares (H, W), m."""
    right = (led.position[0] - camera.right).astype(np.float32)[None, :]
    down = (led.position[1] - camera.down).astype(np.float32)[:, None]
    return right, down, right**2 + down**2


def _slopes(height: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of heights (H, W) m along the picture's right and down, second order, at its edges too."""
    right, down = camera.pixel_size
    return _differences(height.T, right).T, _differences(height, down)


def _differences(values: np.ndarray, step: float) -> np.ndarray:
    slopes = np.empty_like(values)
    np.subtract(values[2:], values[:-2], out=slopes[1:-1])
    slopes[0] = 4 * values[1] - 3 * values[0] - values[2]
    slopes[-1] = 3 * values[-1] - 4 * values[-2] + values[-3]
    slopes *= np.float32(0.5 / step)
    return slopes


def _raised_box(height: np.ndarray, rest: np.ndarray) -> tuple[slice, slice] | None:
    """Rows and columns of pixels that have risen enough to throw a shadow; None where none has."""
    return bounding_box(height - rest > MIN_RISE)


def _checked(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    values = np.asarray(values)
    if values.shape != shape:
        raise TactileError(name, f"shape {values.shape}", f"{shape}, as the camera's picture")
    if not np.isfinite(values).all():
        raise TactileError(name, "values that are not finite", "finite numbers", "Repair the frame first")
    return values.astype(np.float32)
