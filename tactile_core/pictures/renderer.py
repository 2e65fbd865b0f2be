"""Pictures of height maps by a preset: the radiance from each LED, and the camera's picture of it."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from ..errors import TactileError, numbers
from ..files.compiled import Loop, available
from ..files.installed import needing
from ..sensors.calibration import LARGEST_LEVEL, Calibration
from ..sensors.calibration_file import calibration_of
from ..sensors.camera import COLOURS
from .background import by_led, check_way, raised_light, resting_picture
from .camera_curve import bent, ends
from .coating_spread import CoatingSpread
from .height_map import gel_mapper, of_unit, rest_height_map
from .light import Lamps, checked_reflectance, object_light
from .marker_field import MarkerField
from .mitsuba.gel_light import GelLight
from .mitsuba.gel_scene import NOTHING, Surroundings
from .mitsuba.matte_light import MatteLight
from .mitsuba.variant import LLVM, choose_variant
from .perspective import Perspective
from .presets import DEFAULT, FAST, preset_named

# GRAIN : px at 240 wide, over which noise is correlated: by 0.68, 0.42, 0.21, 0.0 over 1 to 4 px in real pictures, both
# ways; by 0.75, 0.5, 0.25, 0 in means of four squares of 2 px, for each of which video keeps one colour. CHANNELS :
# correlations of red, green and blue on photographs of one DIGIT (another: -.22, -.22, .07), assumed for all units.
GRAIN = 4
CHANNELS = (1.0, -0.44, 0.07), (-0.44, 1.0, -0.37), (0.07, -0.37, 1.0)
# m under the undeformed gel: less than a DIGIT's dome, twice the most that a gel dragged by 3 mm yields (assumed)
MOST_BELOW = 1.4e-3


class Renderer:
    """Camera pictures of one unit by one preset; the scene and the picture at rest are made once. Keep one per thread.

    calibration : the unit's camera and lights, of ``load_calibration``, or their file; None for the unit that ships
    preset : ``fast`` (numpy alone, 8 ms per picture), ``standard``, ``quality`` or ``reference`` (Mitsuba)
    variant : Mitsuba's, "llvm_ad_rgb" or "scalar_rgb"; None for the faster one that works here; unused by ``fast``
    background : (H, W, 3) picture of the undeformed gel, levels 0 to 255 of red, green, blue (of OpenCV's blue, green,
        red give ``picture[..., ::-1]``); None for the calibration's
    rest : (H, W) heights of the undeformed gel, m; None for the calibration's, whose dome is then applied to heights
    seed : seed of ``reference``'s random samples; the other presets draw none
    surroundings : lamps and bodies beside the unit's own, which Mitsuba with LLVM alone draws
    Raises TactileError for an unknown preset, arrays of another shape, values that are not finite, and a gel that
    reaches an LED or the camera; ModuleNotFoundError without the extra [render], which all presets but ``fast`` need.

    >>> renderer = tactile.Renderer(preset="fast")
    >>> pictures = renderer.render(touch.displacement_digit)   # (T, 320, 240, 3) uint8
    """

    def __init__(
        self,
        calibration: Calibration | str | os.PathLike[str] | None = None,
        preset: str = DEFAULT,
        variant: str | None = None,
        background: np.ndarray | None = None,
        rest: np.ndarray | None = None,
        seed: int = 0,
        surroundings: Surroundings = NOTHING,
    ) -> None:
        calibration = calibration_of(calibration, "Renderer, calibration")
        if not (isinstance(seed, int | np.integer) and 0 <= seed < 2**32):
            raise TactileError("Renderer, seed", f"{seed!r:.80}", f"a whole number from 0 to {2**32 - 1}")
        self.calibration, self.preset = calibration, preset
        self.camera = calibration.camera
        self._domed = rest is None and calibration.dome_scale != 1
        self._resting = rest_height_map(self.camera) if rest is None else np.array(rest)  # a copy of its own
        resting = self._heights(self._resting, "rest height map")
        self.view = Perspective(self.camera, resting)
        self._spread = CoatingSpread(self.camera, calibration.coating.spread)
        self.variant: str | None = None
        self._light: GelLight | MatteLight | None = None
        if preset == FAST:
            self._lamps = Lamps(self.camera, calibration.leds)
        else:
            chosen = preset_named(preset)
            with needing("render"):
                self.variant = choose_variant(variant).name
            if self.variant == LLVM:
                self._light = GelLight(calibration, chosen, resting, seed, surroundings)
            else:
                self._light = MatteLight(calibration, chosen, resting, seed)
        if surroundings and self.variant != LLVM:
            found = f"{len(surroundings.lamps)} more lamps and {len(surroundings.occluders)} bodies in the light's way"
            raise TactileError(f"preset {preset}", found, "a unit's own LEDs", "Choose standard, with LLVM (doctor)")
        self.rest_radiance = self._spread_radiance(resting)
        self.dots = None if calibration.markers is None else MarkerField(calibration)
        self.background = resting_picture(calibration, self.rest_radiance).astype(np.float32)
        if background is not None:
            self.background = _given_background(background, self.background)
        self._ends = ends(self.background)
        self._response = np.ascontiguousarray(calibration.pixel_response.transpose(2, 3, 0, 1), np.float32)
        self._rest_picture = None if self.dots else self.picture(self.rest_radiance)

    def __repr__(self) -> str:
        return f"<Renderer of a {self.camera.sensor}, preset {self.preset}, pictures {(*self.camera.shape, 3)}>"

    def __call__(
        self, height_map: np.ndarray, marks: np.ndarray | None = None, reflectance: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the picture (H, W, 3) uint8 of a height_map (H, W) m; equal to the background where nothing changed.
        marks : (H, W) share of light that dots leave, from ``marks``; required for a unit with dots
        reflectance : (H, W), 0 black to 1 white, of the object behind each point of height_map, whose light shows
            through the coating where it touches; None for the calibration's ``object_reflectance`` everywhere"""
        plain = marks is None and reflectance is None
        if plain and self._rest_picture is not None and np.array_equal(height_map, self._resting):
            return self._rest_picture.copy()
        return self.picture(self.radiance(height_map, reflectance), marks=marks)

    def refined(self, height_map: np.ndarray) -> Iterator[np.ndarray]:
        """Yield pictures (H, W, 3) uint8 of a height_map (H, W) m, less and less noisy; the last equals what a call
        returns. Only the preset ``reference`` by LLVM yields more than one."""
        heights = self._heights(height_map, "height map")
        if not isinstance(self._light, GelLight):
            yield self.picture(self._spread_radiance(heights))
            return
        seen = self.view(heights)
        for found in self._light.refined(heights):
            yield self.picture(self._completed(np.moveaxis(found, -1, 0), seen))

    def render(self, displacement: np.ndarray) -> np.ndarray:
        """Render the pictures (H, W, 3) uint8 of gel displacement (n_nodes, 3) m; (T, H, W, 3) of (T, n_nodes, 3).
        displacement : of its gel's nodes (DIGIT: 2,867), as ``translate`` and ``solve`` return it
        Raises TactileError for another shape or values that are not finite."""
        displacement = numbers(displacement, "displacement")
        if displacement.ndim != 3:
            return self(gel_mapper(self.camera)(displacement), self.marks(displacement))
        pictures = np.empty((len(displacement), *self.camera.shape, 3), np.uint8)
        for k, frame in enumerate(displacement):
            pictures[k] = self.render(frame)
        return pictures

    def marks(self, displacement: np.ndarray) -> np.ndarray | None:
        """Return the share (H, W) of light that dots leave under displacement (n_nodes, 3) m; None for a gel without
        dots."""
        return None if self.dots is None else self.dots.marks(displacement)

    def radiance(self, height_map: np.ndarray, reflectance: np.ndarray | None = None) -> np.ndarray:
        """Return each LED's radiance (H, W, LED) float32, levels, of what pixels see of a height_map (H, W) m.
        reflectance : (H, W), 0 black to 1 white, of the object behind; None for the calibration's"""
        if reflectance is not None:
            self.calibration.check_shows("reflectance")
            grey = checked_reflectance(reflectance, "reflectance")
            reflectance = camera_array(grey, self.camera.shape, "reflectance")
        return self._spread_radiance(self._heights(height_map, "height map"), reflectance)

    def _spread_radiance(self, heights: np.ndarray, reflectance: np.ndarray | None = None) -> np.ndarray:
        seen = self.view(heights)
        if self._light is not None:
            return self._completed(np.moveaxis(self._light.radiance(heights), -1, 0), seen, reflectance)
        light = self._lamps.light(self.view, seen)
        light *= self.calibration.facing.astype(np.float32)[:, None, None]
        return self._completed(light, seen, reflectance)

    def _completed(self, light: np.ndarray, seen: np.ndarray, reflectance: np.ndarray | None = None) -> np.ndarray:
        """Return the radiance (H, W, LED) of LEDs and ambient light, spread by the coating, and of the touching object.
        light : (3, H, W), of LEDs; seen : (H, W) m, heights; reflectance : (H, W) of the object, None for the
            calibration's"""
        spread = self._spread(light + raised_light(self.calibration, seen))
        if reflectance is not None:
            reflectance = self.view.seen_of(reflectance, seen)
        if reflectance is not None or self.calibration.through:
            spread += object_light(self.calibration, seen - self.view.start, reflectance)
        return np.moveaxis(spread, 0, -1)

    def picture(
        self, radiance: np.ndarray, noise: np.random.Generator | None = None, marks: np.ndarray | None = None
    ) -> np.ndarray:
        """Return the picture (H, W, 3) uint8: background + response (radiance - radiance at rest), times dots' share.
        radiance : (H, W, LED) levels, from method ``radiance``. Its change passes the camera's curve
            (``camera_curve``).
        noise : generator of the camera's noise, as strong as measured on the unit; None adds none
        marks : (H, W), from method ``marks``. Raises TactileError if they are missing for a unit with dots."""
        radiance = numbers(radiance, "radiance")
        if (other := radiance.shape != self.rest_radiance.shape) or not np.isfinite(radiance).all():
            found = f"shape {radiance.shape}" if other else "values that are not finite"
            raise TactileError("radiance", found, f"{self.rest_radiance.shape}", "Renderer.radiance returns it")
        if not isinstance(noise, np.random.Generator | None):
            raise TactileError("noise", f"{noise!r:.80}", "a generator, or None", "Give numpy.random.default_rng(seed)")
        if self.dots is not None and marks is None:
            found = "a picture of heights alone, which do not say where the dots have moved"
            advice = "Call Renderer.render, or leave [markers] out"
            raise TactileError("markers", found, "the gel's displacement", advice)
        if noise is None and marks is None and available() and radiance.dtype == self.rest_radiance.dtype == np.float32:
            now, at_rest = np.moveaxis(radiance, -1, 0), np.moveaxis(self.rest_radiance, -1, 0)
            picture = np.empty(self.background.shape, np.uint8)
            fields = self.background, self._ends, picture
            background, curve, drawn = (field.reshape(*field.shape[:-2], -1) for field in fields)
            _fill_levels(now, at_rest, self._response, background, curve, np.float32(LARGEST_LEVEL), drawn)
            return picture
        levels = self.background + bent(self.in_levels(radiance - self.rest_radiance), self._ends)[0]
        if marks is not None:
            levels *= marks[..., None]
        if noise is not None:
            levels += camera_noise(self.calibration, noise)
        np.rint(levels, out=levels)
        return np.clip(levels, 0, LARGEST_LEVEL, out=levels).astype(np.uint8)

    def correction(self) -> dict[str, float]:
        """Return how far the picture at rest is from the modelled one, ``mean_levels`` and ``largest_levels``."""
        off = np.abs(self.background - by_led(self.calibration, self.rest_radiance).sum(-1))
        return {"mean_levels": round(float(off.mean()), 2), "largest_levels": round(float(off.max()), 1)}

    def _heights(self, given: np.ndarray, name: str) -> np.ndarray:
        """Check a map ``given`` (H, W) m; return it as float32 with the unit's own dome. name : for errors"""
        heights = camera_array(given, self.camera.shape, name)
        if (below := float((self._resting - heights).max())) > MOST_BELOW:
            found = f"{below * 1e3:.2f} mm below the undeformed gel"
            advice = (
                "Give metres, and add the undeformed gel's (pictures.height_map.rest_height_map()) to changes of it"
            )
            raise TactileError(name, found, "heights of the gel, which rise where it is pressed", advice)
        heights = of_unit(heights, self.calibration) if self._domed else heights
        check_reach(heights, self.calibration, name)
        return heights

    def in_levels(self, radiance: np.ndarray) -> np.ndarray:
        """Convert each LED's radiance (H, W, LED) to grey levels (H, W, 3) float32, weighted sums of the LEDs."""
        levels = np.empty_like(radiance)
        for channel, row in enumerate(self._response):
            levels[..., channel] = sum(part * radiance[..., led] for led, part in enumerate(row))
        return levels


def camera_noise(unit: Calibration, random: np.random.Generator) -> np.ndarray:
    """Draw noise (H, W, 3) float32, levels, as strong as the unit's: one colour for each 2 x 2 px (at 240 wide)."""
    height, width = unit.camera.shape
    side = max(GRAIN * width // 240, 2) // 2
    white = random.standard_normal((height // side + 2, width // side + 2, len(COLOURS)), np.float32)
    pairs = white[1:] + white[:-1]
    grain = (pairs[:, 1:] + pairs[:, :-1]) / 2 @ np.linalg.cholesky(CHANNELS).T * unit.noise
    return grain.repeat(side, 0).repeat(side, 1)[:height, :width].astype(np.float32)


def _given_background(picture: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return a user's picture (H, W, 3) as float32. Raises TactileError for values that are not levels 0 to 255, and if
    it is much more like the unit's ``own`` (H, W, 3) with colours exchanged, turned or mirrored."""
    levels = camera_array(picture, own.shape, "background")
    least, most = float(levels.min()), float(levels.max())
    shares = np.asarray(picture).dtype.kind == "f" and 0 < most <= 1
    if shares or least < -0.5 or most > LARGEST_LEVEL + 0.5:  # .5: what resampling adds
        advice = "Multiply shares of 1 by 255" if shares else ""
        raise TactileError("background", f"values from {least:g} to {most:g}", "levels 0 to 255", advice)
    check_way(levels, own)
    return levels.clip(0, LARGEST_LEVEL)


def camera_array(values: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
    """Return values (...) as float32. Raises TactileError, with their ``name``, for another ``shape``, or if not
    finite."""
    values = numbers(values, name)
    if values.shape != shape:
        raise TactileError(name, f"shape {values.shape}", f"{shape}, as the camera's picture")
    if not np.isfinite(values).all():
        raise TactileError(name, "values that are not finite", "finite numbers", "Repair the frame first")
    return values.astype(np.float32)


def check_reach(height: np.ndarray, unit: Calibration, name: str) -> None:
    """Raise TactileError if a map called ``name``, height (H, W) m, reaches the lowest LED's middle or the camera."""
    lowest = min(unit.leds, key=lambda led: led.position[2])
    limits = {f"the {lowest.colour} LED": lowest.position[2], "the camera": unit.camera.apparent_height}
    for what, limit in limits.items():
        if float(height.max()) >= limit:
            found = f"{height.max() * 1e3:.2f} mm high, {what} {limit * 1e3:.2f} mm"
            raise TactileError(name, found, "a gel below LEDs and camera", "Check that heights are in metres")


@Loop
def _fill_levels(radiance, rest, response, background, ends, largest, picture):  # noqa: ANN001, ANN202
    """Fill ``picture`` (H, 3 W) uint8 in place: background (H, 3 W), plus response (3, L, H, W) times (radiance - rest)
    (L, H, W), bent by the camera's curve. ends : (4, H, 3 W), the curve's; largest : grey level"""
    leds, height, width = radiance.shape
    lowest, one, line = np.float32(0), np.float32(1), np.empty(3 * width, np.float32)
    change, level = np.empty((leds, width), np.float32), np.empty(width, np.float32)
    for row in range(height):  # a row stays in the processor's cache
        for led in range(leds):
            for column in range(width):
                change[led, column] = radiance[led, row, column] - rest[led, row, column]
        for channel in range(3):
            level[:] = lowest
            for led in range(leds):
                for column in range(width):
                    level[column] += response[channel, led, row, column] * change[led, column]
            for column in range(width):
                line[3 * column + channel] = level[column]
        bends = False
        for k in range(3 * width):
            bends |= (line[k] < ends[0, row, k]) | (line[k] > ends[2, row, k])
        for k in range(3 * width if bends else 0):  # as ``bent``
            below, above = line[k] - ends[0, row, k], line[k] - ends[2, row, k]
            if below < lowest:
                line[k] = ends[0, row, k] + ends[1, row, k] * (np.exp(below / ends[1, row, k]) - one)
            elif above > lowest:
                line[k] = ends[2, row, k] + ends[3, row, k] * (one - np.exp(-above / ends[3, row, k]))
        for k in range(3 * width):
            value = np.rint(line[k] + background[row, k])
            picture[row, k] = np.uint8(np.int32(min(max(value, lowest), largest)))  # by way of 32 bits: vectorised
