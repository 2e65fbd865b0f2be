"""Light of L small LEDs on the gel: Lambert's cosine over the squared distance, and cast shadows. The fast picture and
calibrations compute it on gel seen in perspective; Mitsuba without LLVM, and the picture at rest, at points in space.

Light also comes through the coating from the object that touches it. Photographs show it even over the contact, in an
LED's light and shadow alike, since it scatters in the object (docs/calibration.md); it is proportional to each LED's
power."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import TactileError, numbers
from ..files.compiled import Loop, available
from ..sensors.calibration import Calibration
from ..sensors.camera import Camera, Led
from .cast_shadows import ShadowCaster, bounding_box, disc_share
from .perspective import Perspective, slopes

# A shadow begins where the gel's tangent plane cuts the LED, normal . (LED - point) < TANGENT x radius, and up to
# TANGENT_MARGIN px beside, as slopes are differences of neighbours.
TANGENT, TANGENT_MARGIN = 1.1, 2

Box = tuple[slice, slice]  # rows and columns of pixels
FULL_RISE = 0.5  # share of the largest rise that shows all of an object's light; less does in proportion (two pictures)
LEAST_RISE = 5e-6  # m, least rise of gel in contact, as in ``translation.gel_place``


class Surface(NamedTuple):
    """Gel that pixels see, float32: at places (right s, down s, height), image frame, m, where s = 1 - height inverse.

    right : (1, W) or (H, W), down : (H, 1) or (H, W), height : (H, W), m
    slope_right, slope_down : (H, W), of the height over right and down: the normal is along (-slopes, tilt), where tilt
        = s - (right, down) . slopes inverse (from h(q) = height(q s))
    inverse : 1/m, of the camera's apparent height, if right and down are where it sees the places; else 0"""

    right: np.ndarray
    down: np.ndarray
    height: np.ndarray
    slope_right: np.ndarray
    slope_down: np.ndarray
    inverse: np.float32 = np.float32(0)

    @classmethod
    def in_perspective(cls, view: Perspective, height: np.ndarray) -> Surface:
        """Return the surface, with slopes, that pixels see; height : (H, W) m, heights that ``view`` returned"""
        return cls(view.right, view.down, height, *slopes(height, view.camera), view.inverse)


class Lit(NamedTuple):
    """Light of L LEDs on a surface without shadows, float32.
    near : (H, W), s of ``Surface``; tilt, length : (H, W), third component and length of the normal given there
    facing : (L, H, W) m, cosine of incidence times distance from the LED times ``length``; square : (L, H, W) m2, of
        that distance
    light : (L, H, W), relative to that on a coating at the origin that faces the LED"""

    near: np.ndarray
    tilt: np.ndarray
    length: np.ndarray
    facing: np.ndarray
    square: np.ndarray
    light: np.ndarray


def lambert(surface: Surface, positions: np.ndarray) -> Lit:
    """Return the light on a surface of LEDs at positions l (L, 3) m, image frame: Lambert's law and the inverse square.

    light = (n . v) |l|^2 / |v|^3, v = l - p from the gel point p to the LED, n the unit normal at p; it is 1 for a
    coating at the origin that faces the LED. Written out for speed: |v|^2 = |p|^2 - 2 p . l + |l|^2."""
    strengths = np.square(positions).sum(-1).astype(np.float32)
    places = np.asarray(positions, np.float32)
    right, down, height, slope_right, slope_down, inverse = surface
    if available() and len(right) == 1:
        row, column = np.ascontiguousarray(right[0]), np.ascontiguousarray(down[:, 0])
        return Lit(*_lambert_loop(row, column, height, slope_right, slope_down, inverse, places, strengths))
    near = 1 - height * inverse
    outward = right * slope_right
    outward += down * slope_down
    tilt = near - outward * inverse
    # Of the cosine: normal . (LED - place) = tilt LED_up - slopes . LED + own
    own = outward * near
    own -= tilt * height
    length = np.sqrt(slope_right**2 + slope_down**2 + tilt**2)
    from_origin = near**2 * (right**2 + down**2) + height**2
    facing, squares, light = np.empty((3, len(places), *height.shape), np.float32)
    for (aside, ahead, up), strength, faces, square, lit in zip(places, strengths, facing, squares, light, strict=True):
        np.multiply(right * aside + down * ahead, near, out=square)
        square += up * height
        square *= -2
        square += from_origin
        square += strength
        np.multiply(up, tilt, out=faces)
        faces -= aside * slope_right
        faces -= ahead * slope_down
        faces += own
        lit[:] = falling(np.maximum(faces, 0), square, length, strength)
    return Lit(near, tilt, length, facing, squares, light)


def falling(facing: np.ndarray, square: np.ndarray, length: np.ndarray, strength: np.float32) -> np.ndarray:
    """Return one LED's light (H, W), strength facing / (length square^1.5).
    facing, square, length : (H, W), fields of ``Lit``; strength : m2, squared distance of the LED from the origin"""
    return facing / (square * np.sqrt(square) * length) * strength


def open_light(surface: Surface, unit: Calibration) -> np.ndarray:
    """Return the radiance (L, H, W) float32, levels, of a unit's LEDs on its coating, without shadows."""
    light = lambert(surface, np.array([led.position for led in unit.leds])).light
    light *= unit.facing.astype(np.float32)[:, None, None]
    return light


class Lamps:
    """Light of LEDs on a gel, in shadows. Raises TactileError for an LED over the picture or as high as the camera."""

    def __init__(self, camera: Camera, leds: Sequence[Led]) -> None:
        self._casters = [ShadowCaster(camera, led) for led in leds]
        self._positions = np.array([led.position for led in leds])

    def light(self, view: Perspective, height: np.ndarray) -> np.ndarray:
        """Return `Lit.light` (L, H, W) float32 in soft shadows, of the gel that ``view`` sees at height (H, W) m."""
        surface = Surface.in_perspective(view, height)
        lit, mapped = lambert(surface, self._positions), None
        for k, caster in enumerate(self._casters):
            edge = bounding_box(lit.facing[k] < np.float32(TANGENT * caster.led.radius) * lit.length, TANGENT_MARGIN)
            if edge is not None:
                mapped = height / lit.near if mapped is None else mapped
                _cast_shadow(caster, lit, k, height, mapped, edge)
        return lit.light


def _cast_shadow(caster: ShadowCaster, lit: Lit, k: int, height: np.ndarray, mapped: np.ndarray, edge: Box) -> None:
    """Darken the light of LED k, in place, where gel of height (H, W) m stands in its way.

    The part of its disc above the horizon shines. With l the vector to the LED and e the unit vector upward across l,
    that part's centre is l + (radius moment / share) e, and
    normal . e = (tilt |l|^2 - above facing) / (|l| sqrt(|l|^2 - above^2)).
    lit : its light is changed; mapped : (H, W) m, mapped field of ``cast_shadows``; edge : box where shadows may
        begin"""
    sight, box = caster.sight(mapped, edge)
    facing, square = lit.facing[k][box], lit.square[k][box]
    share, moment = disc_share(sight)
    above = caster.led.position[2] - height[box]
    moment *= lit.tilt[box] * square - above * facing
    moment *= np.float32(caster.led.radius) / np.sqrt((square - above**2) * square)
    share *= facing
    share += moment
    strength = np.float32(np.square(caster.led.position).sum())
    lit.light[k][box] = falling(np.maximum(share, 0, out=share), square, lit.length[box], strength)


@Loop
def _lambert_loop(right, down, height, slope_right, slope_down, inverse, position, strength):  # noqa: ANN001, ANN202
    """Compute the fields of ``Lit`` in a compiled loop, by ``lambert``'s formula, from the fields of ``Surface`` with
    right (W,) and down (H,), and the LEDs' position l (L, 3) m and strength |l|^2 (L,) m2."""
    rows, columns = height.shape
    one, zero, two = np.float32(1), np.float32(0), np.float32(-2)
    near, tilt = np.empty((rows, columns), np.float32), np.empty((rows, columns), np.float32)
    length, shape = np.empty((rows, columns), np.float32), (len(position), rows, columns)
    facing, distance, light = np.empty(shape, np.float32), np.empty(shape, np.float32), np.empty(shape, np.float32)
    own, square = np.empty(columns, np.float32), np.empty(columns, np.float32)
    for a in range(rows):  # a row stays in the processor's cache; loops without conditions are vectorised
        for b in range(columns):
            x, y, high = slope_right[a, b], slope_down[a, b], height[a, b]
            nearness = one - high * inverse
            outward = right[b] * x + down[a] * y
            tilted = nearness - outward * inverse
            near[a, b], tilt[a, b] = nearness, tilted
            own[b] = outward * nearness - tilted * high
            length[a, b] = np.sqrt(x * x + y * y + tilted * tilted)
            square[b] = nearness * nearness * (right[b] * right[b] + down[a] * down[a]) + high * high
        for led in range(len(position)):
            aside, ahead, up = position[led, 0], position[led, 1], position[led, 2]
            lower = down[a] * ahead
            for b in range(columns):
                far = (right[b] * aside + lower) * near[a, b]
                far += up * height[a, b]
                far *= two
                far += square[b]
                far += strength[led]
                faces = up * tilt[a, b]
                faces -= aside * slope_right[a, b]
                faces -= ahead * slope_down[a, b]
                faces += own[b]
                facing[led, a, b], distance[led, a, b] = faces, far
                light[led, a, b] = max(faces, zero) / (far * np.sqrt(far) * length[a, b]) * strength[led]
    return near, tilt, length, facing, distance, light


def contact_share(risen: np.ndarray) -> np.ndarray:
    """Return the share (H, W) float32, 0 to 1, of a touching object's light that is seen; risen : (H, W) m, over the
    rest"""
    deepest = float(risen.max())
    if deepest < LEAST_RISE:
        return np.zeros_like(risen)
    share = risen * np.float32(1 / (FULL_RISE * deepest))
    return share.clip(0, 1, out=share)


def object_light(unit: Calibration, risen: np.ndarray, reflectance: np.ndarray | None = None) -> np.ndarray:
    """Return the radiance (3, H, W) float32, levels, that comes through the coating from an object touching it.
    risen : (H, W) m, of the gel; reflectance : (H, W) of the object, 0 black to 1 white; None for the calibration's"""
    amount, share = unit.through, contact_share(risen)
    if reflectance is not None:
        amount, share = unit.coating.transmission, share * reflectance
    return (amount * unit.facing).astype(np.float32)[:, None, None] * share


def checked_reflectance(given: np.ndarray, name: str) -> np.ndarray:
    """Return a map ``given`` (h, w) of reflectance, 0 black to 1 white or grey levels of 8 bits, as float32 0..1.
    Raises TactileError, which calls it ``name``, for another shape or values out of range."""
    values = numbers(given, name)
    if values.ndim != 2 or min(values.shape) < 2:
        advice = "Average the three colours of a picture" if values.ndim == 3 else ""
        raise TactileError(name, f"{values.dtype} of shape {values.shape}", "grey (h, w), 2 x 2 or more", advice)
    white = 255 if values.dtype == np.uint8 else 1
    if not (values.min() >= 0 and values.max() <= white):
        found = f"values from {values.min():g} to {values.max():g}"
        raise TactileError(name, found, "0 black to 1 white, or uint8", "Divide by the level of white")
    return values.astype(np.float32) / np.float32(white)
