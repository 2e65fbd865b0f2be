"""Light of small LEDs on the gel that a camera sees: Lambert's cosine over the square of distance, and cast shadows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..files.compiled import Loop, available
from ..sensors.camera import Camera, Led
from .cast_shadows import ShadowCaster, bounding_box, disc_share
from .perspective import Perspective, slopes

# A shadow begins where the gel's tangent plane cuts the LED: at normal . (LED - point) < radius. With a margin for the
# differences that slopes are made of.
TANGENT, TANGENT_MARGIN = 1.1, 2  # of the radius, px

Box = tuple[slice, slice]  # rows and columns of pixels


class SeenSurface(NamedTuple):
    """The gel that the pixels see, all (H, W) float32.

    With s = 1 - h / H the seen point is (q s, h), and its normal is along (-dh/dq, tilt), where dh/dq are the slopes of
    h over the picture and tilt = s - q . dh/dq / H (from h(q) = height(q s)).
    height : h, m; normal : its length; mapped : m, the field on which shadows are cast, see ``cast_shadows``
    """

    height: np.ndarray
    tilt: np.ndarray
    normal: np.ndarray
    mapped: np.ndarray


class Lamps:
    """The LEDs of one camera's gel. Raises TactileError for those that ``ShadowCaster`` refuses."""

    def __init__(self, camera: Camera, leds: Sequence[Led]) -> None:
        self._camera = camera
        self.lamps = [Lamp(camera, led) for led in leds]
        self._positions = np.stack([lamp.position for lamp in self.lamps])
        self._strengths = np.array([lamp.strength for lamp in self.lamps])
        self._tangents = np.array([lamp.tangent for lamp in self.lamps])

    def light(self, view: Perspective, seen: np.ndarray) -> np.ndarray:
        """Return the radiance (3, H, W) float32 of heights (H, W) m that pixels see, by LED.

        Each is relative to a coating that faces the LED in the picture's middle.
        """
        slope_right, slope_down = slopes(seen, self._camera)
        inverse = np.float32(1 / self._camera.apparent_height)
        if available():
            return self._compiled(view, seen, slope_right, slope_down, inverse)
        near = 1 - seen * inverse
        outward = view.right * slope_right
        outward += view.down * slope_down  # q . dh/dq
        tilt = near - outward * inverse
        # Of the cosine: normal . (LED - point) = tilt LED_up - slopes . LED + own
        own = outward * near
        own -= tilt * seen
        normal = np.sqrt(slope_right**2 + slope_down**2 + tilt**2)
        square = near**2 * (view.right**2 + view.down**2) + seen**2  # of the distance from the origin
        surface, light = (
            SeenSurface(seen, tilt, normal, seen / near),
            np.empty((len(self.lamps), *seen.shape), np.float32),
        )
        for lamp, lit in zip(self.lamps, light, strict=True):
            right, down, up = lamp.position
            distance = (view.right * right + view.down * down) * near
            distance += up * seen
            distance *= -2
            distance += square
            distance += lamp.strength  # squared, so far
            facing = up * tilt
            facing -= right * slope_right
            facing -= down * slope_down
            facing += own
            np.divide(np.maximum(facing, 0), distance * np.sqrt(distance) * normal, out=lit)
            lit *= lamp.strength
            edge = bounding_box(facing < lamp.tangent * normal, TANGENT_MARGIN)
            if edge is not None:
                lamp.cast_shadow(lit, surface, edge, facing, distance)
        return light

    def _compiled(self, view: Perspective, seen: np.ndarray, slope_right, slope_down, inverse) -> np.ndarray:  # noqa: ANN001
        """Compute the same light by one compiled loop; shadows are numpy's."""
        near, tilt, normal, mapped = np.empty((4, *seen.shape), np.float32)
        facing, distance, light = np.empty((3, len(self.lamps), *seen.shape), np.float32)
        edges = light_of_lamps(
            seen, slope_right, slope_down, view.right[0], view.down[:, 0], inverse, self._positions, self._strengths,
            self._tangents, near, tilt, normal, mapped, facing, distance, light,
        )  # fmt: skip
        surface = SeenSurface(seen, tilt, normal, mapped)
        for k, (first_row, last_row, first_column, last_column) in enumerate(edges.tolist()):
            if last_row >= 0:
                edge = _wider(first_row, last_row, seen.shape[0]), _wider(first_column, last_column, seen.shape[1])
                self.lamps[k].cast_shadow(light[k], surface, edge, facing[k], distance[k])
        return light


def _wider(first: int, last: int, size: int) -> slice:
    return slice(max(first - TANGENT_MARGIN, 0), min(last + 1 + TANGENT_MARGIN, size))


class Lamp:
    """One LED. position : (3,) float32 m; strength : its squared distance, m2; tangent : m, see ``TANGENT``."""

    def __init__(self, camera: Camera, led: Led) -> None:
        self.led, self.caster = led, ShadowCaster(camera, led)
        self.position = np.asarray(led.position, np.float32)
        self.strength = np.float32(np.square(led.position).sum())
        self.tangent = np.float32(TANGENT * led.radius)

    def cast_shadow(
        self, light: np.ndarray, surface: SeenSurface, edge: Box, facing: np.ndarray, distance: np.ndarray
    ) -> None:
        """Darken light (H, W) where the gel stands in the LED's way; edge : where that may begin.

        facing : (H, W) m, cosine times distance times the normal's length; distance : (H, W), squared, m2
        """
        sight, box = self.caster.sight(surface.mapped, edge)
        square = distance[box]
        shadowed = self._shadowed(sight, facing[box], square, surface, box)
        light[box] = shadowed / (square * np.sqrt(square) * surface.normal[box]) * self.strength

    def _shadowed(
        self, sight: np.ndarray, facing: np.ndarray, square: np.ndarray, surface: SeenSurface, box: Box
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


@Loop
def light_of_lamps(  # noqa: ANN201
    seen, slope_right, slope_down, right, down, inverse, position, strength, tangent,  # noqa: ANN001
    near, tilt, normal, mapped, facing, distance, light,  # noqa: ANN001
):  # fmt: skip
    """Fill in the light (3, H, W) of all LEDs without shadows, and what it is of; return where shadows may begin.

    seen, slope_right, slope_down, near, tilt, normal, mapped : (H, W), see ``SeenSurface``; right (W,), down (H,) m
    inverse : 1/m, of the camera's apparent height; position : (3, 3) m of the LEDs; strength : (3,), squared distances
    from the middle, m2; tangent : (3,) m, see ``TANGENT``
    facing : (3, H, W) m, cosine times distance times the normal's length; distance : (3, H, W), squared, m2
    edges : (3, 4), first and last row and column of each LED; the first row beyond the last where there is none
    """
    rows, columns = seen.shape
    one, zero, two = np.float32(1), np.float32(0), np.float32(-2)
    own, square, edges = np.empty(columns, np.float32), np.empty(columns, np.float32), np.empty((3, 4), np.int64)
    edges[:, 0], edges[:, 1], edges[:, 2], edges[:, 3] = rows, -1, columns, -1
    for a in range(rows):  # a row stays in the processor's cache; loops without conditions are vectorised
        for b in range(columns):
            x, y, height = slope_right[a, b], slope_down[a, b], seen[a, b]
            nearness = one - height * inverse
            outward = right[b] * x + down[a] * y
            tilted = nearness - outward * inverse
            near[a, b], tilt[a, b] = nearness, tilted
            own[b] = outward * nearness - tilted * height
            normal[a, b] = np.sqrt(x * x + y * y + tilted * tilted)
            square[b] = nearness * nearness * (right[b] * right[b] + down[a] * down[a]) + height * height
            mapped[a, b] = height / nearness
        for led in range(3):
            aside, ahead, up = position[led, 0], position[led, 1], position[led, 2]
            begins, lower = False, down[a] * ahead
            for b in range(columns):
                far = (right[b] * aside + lower) * near[a, b]
                far += up * seen[a, b]
                far *= two
                far += square[b]
                far += strength[led]
                faces = up * tilt[a, b]
                faces -= aside * slope_right[a, b]
                faces -= ahead * slope_down[a, b]
                faces += own[b]
                facing[led, a, b], distance[led, a, b] = faces, far
                light[led, a, b] = max(faces, zero) / (far * np.sqrt(far) * normal[a, b]) * strength[led]
            for b in range(columns):
                begins |= facing[led, a, b] < tangent[led] * normal[a, b]
            if begins:
                edges[led, 0], edges[led, 1] = min(edges[led, 0], a), a
                for b in range(columns):
                    if facing[led, a, b] < tangent[led] * normal[a, b]:
                        edges[led, 2], edges[led, 3] = min(edges[led, 2], b), max(edges[led, 3], b)
    return edges
