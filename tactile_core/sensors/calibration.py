"""Parameters of a DIGIT unit's pictures: camera, lights, colours, gel and background, in frozen dataclasses.

A picture is ``response(right, down) L + ambient(right, down)`` in raw 8-bit values, where L is the radiance that the
coating reflects of each LED's light. Each LED's light is a spectral band of its own, measured in grey levels of that
colour's channel in the picture's middle. The fast picture and Mitsuba use the same parameters.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from ..errors import TactileError, finite_number
from .camera import COLOURS, Camera, Led
from .toml_fields import number

MOST_DOTS = 10_000  # of a grid (assumed enough: 7 x 9 to 20 x 25 are printed)
MOST_LENGTH = 20e-3  # m of pitch or diameter: the gel itself is 18 x 25 mm


@dataclasses.dataclass(frozen=True)
class Markers:
    """A square grid of round dots on the coating, in the middle of the picture. Raises TactileError for bad numbers.
    rows, columns : numbers of dots down the picture and to its right
    pitch, diameter : m, between neighbours' middles, and of a dot
    albedo : light that a dot scatters back, over the coating's: 0 black to 1 invisible"""

    rows: int = number()
    columns: int = number()
    pitch: float = number("mm")
    diameter: float = number("mm")
    albedo: float = number()

    def __post_init__(self) -> None:
        for name in ("rows", "columns"):
            if getattr(self, name) < 1:
                raise TactileError(f"markers, {name}", str(getattr(self, name)), "1 or more")
        if self.count > MOST_DOTS:
            raise TactileError("markers, rows x columns", f"{self.count} dots", f"at most {MOST_DOTS}")
        for name in ("pitch", "diameter"):
            length = getattr(self, name)
            if not (math.isfinite(length) and 0 < length <= MOST_LENGTH):
                expected = f"above 0, at most {1e3 * MOST_LENGTH:g} mm"
                raise TactileError(f"markers, {name}_mm", f"{1e3 * length:g}", expected)
        if not 0 <= self.albedo <= 1:
            raise TactileError("markers, albedo", f"{self.albedo:g}", "0 (black) to 1 (unseen)")

    @property
    def count(self) -> int:
        """Number of dots."""
        return self.rows * self.columns


DIFFUSE, ROUGH_PLASTIC, PRINCIPLED = MATERIALS = ("diffuse", "roughplastic", "principled")
MOST_SPREAD = 2e-3  # m; the gel is 4 mm thick, its coating far thinner


@dataclasses.dataclass(frozen=True)
class Coating:
    """Material of the coating, one of three of Mitsuba's. Raises TactileError for a number out of its range.

    bsdf : "diffuse" (Lambert), "roughplastic" (Lambert under a rough clear coat) or "principled" (Burley 2012)
    albedo : 0..1 share of each LED's light that it scatters back
    roughness : 0.02..1, width of highlights: GGX's alpha of roughplastic, Burley's roughness; unused by diffuse
    gloss : 0..1, size of highlights; unused by diffuse
    metallic : 0..1, of principled alone; 1 reflects like metal of that albedo
    spread : m, standard deviation of light's sideways spread, at most 2 mm; applied to the picture, in every preset
    transmission : 0..1, light that returns through it from a white object in contact, as a share of what the coating
        itself reflects if it faces the LED at the picture's middle"""

    bsdf: str = DIFFUSE
    albedo: tuple[float, float, float] = number(default=(0.5, 0.5, 0.5))
    roughness: float = number(default=0.3)
    gloss: float = number(default=0.5)
    metallic: float = number(default=0.0)
    spread: float = number("mm", default=0.0, may_miss=True)  # earlier versions' files have none
    transmission: float = number(default=0.0, may_miss=True)

    def __post_init__(self) -> None:
        if self.bsdf not in MATERIALS:
            raise TactileError("coating, bsdf", repr(self.bsdf), f"one of {', '.join(MATERIALS)}")
        if len(self.albedo) != 3:
            raise TactileError("coating, albedo", f"{len(self.albedo)} numbers", "three, one a LED")
        ranges = [("albedo", value, 0.0) for value in self.albedo]
        ranges += [("roughness", self.roughness, 0.02), ("gloss", self.gloss, 0.0), ("metallic", self.metallic, 0.0)]
        ranges += [("transmission", self.transmission, 0.0)]
        for name, value, least in ranges:
            if not least <= value <= 1:  # false for NaN
                raise TactileError(f"coating, {name}", f"{value:g}", f"{least:g} to 1")
        if not 0 <= self.spread <= MOST_SPREAD:
            raise TactileError("coating, spread_mm", f"{1e3 * self.spread:g}", f"0 to {1e3 * MOST_SPREAD:g}")


# Degrees of the ambient light's polynomial over the picture, and their numbers of terms. The second is for units whose
# untouched gel is photographed; on a background estimated from presses it would fit their traces. On the GelSight
# Mini's fitted photographs degree 5 leaves 5.4 levels beside the press, 7 1.8, 9 1.3, the background's own 1.25.
AMBIENT_DEGREE, PHOTOGRAPHED_DEGREE = 5, 7
AMBIENT_TERMS, PHOTOGRAPHED_TERMS = (
    (degree + 1) * (degree + 2) // 2 for degree in (AMBIENT_DEGREE, PHOTOGRAPHED_DEGREE)
)
AMBIENT_UNIT = 10e-3  # m; image coordinates are divided by it in the ambient light's polynomial
# m: ambient light is measured in an LED's light on a coating that faces it at this distance, so that it depends on the
# LED's power, not on its place.
AMBIENT_DISTANCE = 20e-3
MOST_RISE = 2.0  # per mm, of the ambient light's unit
MOST_INDEX = 4.0  # germanium's: no clear solid has more
LARGEST_LEVEL = 255.0  # of 8 bits


@dataclasses.dataclass(frozen=True)
class Response:
    """Matrix from the radiance of each LED's light to the camera's grey levels, varying linearly over the picture.
    centre : (3, 3) levels per level in the picture's middle; rows are channels of the picture, columns LEDs' colours
    along_right, along_down : (3, 3) 1/m, its change per metre on the plane of height zero"""

    centre: tuple[tuple[float, ...], ...] = number(length=3)
    along_right: tuple[tuple[float, ...], ...] = number("per_mm", length=3)
    along_down: tuple[tuple[float, ...], ...] = number("per_mm", length=3)

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            matrix = np.asarray(getattr(self, field.name), float)
            if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
                raise TactileError(f"response, {field.name}", f"shape {matrix.shape}", "3 rows of 3 finite numbers")
        for channel, colour in enumerate(COLOURS):
            if not self.centre[channel][channel] > 0:
                found = f"{self.centre[channel][channel]:g} levels of {colour} by the {colour} LED"
                raise TactileError("response, centre", found, "more than 0: light brightens its own colour")

    def matrices(self, camera: Camera) -> np.ndarray:
        """Return the matrix (H, W, 3, 3) of each pixel of ``camera``, channel by LED."""
        centre, right, down = (np.asarray(matrix) for matrix in (self.centre, self.along_right, self.along_down))
        return centre + camera.right[None, :, None, None] * right + camera.down[:, None, None, None] * down

    def times(self, led: np.ndarray) -> Response:
        """Return the response with each LED's column, in centre and slopes, times its entry of led (3,), no unit."""
        parts = (np.asarray(getattr(self, field.name)) * led for field in dataclasses.fields(self))
        return Response(*(tuple(map(tuple, part.tolist())) for part in parts))


@dataclasses.dataclass(frozen=True)
class Fit:
    """Data and errors of a calibration's fit.

    note : how it was fitted, free text; photographs : names of the files, without the user's folder
    ball_diameter : m, of the ball that they show
    errors : mean on those photographs, by metric: _l1 in grey levels, _psnr in dB, _ssim, lobe_iou, ball_radius_error
    standard_errors : by parameter, in its unit in the file
    not_identified : parameters that the photographs do not determine, held near the start by units' assumed spread"""

    note: str
    photographs: tuple[str, ...]
    not_identified: tuple[str, ...]
    ball_diameter: float = number("mm")
    errors: Mapping[str, float] = number(above=-math.inf, below=math.inf)
    standard_errors: Mapping[str, float] = number(above=-math.inf, below=math.inf)


@dataclasses.dataclass(frozen=True)
class Calibration:
    """Calibration of one unit. Raises TactileError for a number out of its range.

    unit : its name, free text; fit : where the numbers are from
    leds : red, green, blue
    response : the camera's response to each LED's light
    ambient : (3, 21) or (3, 36), a row per LED: its light scattered in gel and acrylic, in units of its radiance on a
        coating that faces it at ``AMBIENT_DISTANCE``: a polynomial of right^i down^j / (10 mm)^(i + j), ordered by i +
        j, then by j
    object_reflectance : 0 black to 1 white, of the object that touches the gel
    ambient_rise : (3,) 1/m, by what share each LED's ambient light grows per metre of the gel's height
    coating : the paint on the gel
    gel_index : refractive index of gel and acrylic, assumed equal
    dome_scale : heights of the resting gel over its lowest point, as a multiple of the public mesh's
    photograph : path of a photograph of the untouched gel, which then is the picture at rest; "" for none
    markers : dots printed on the gel; None for none
    photographed : (LEDs, albedo) when the photograph was taken, if they have changed since; None for the present ones
    noise : standard deviation of the camera's noise, grey levels, per channel; pictures have none unless asked for"""

    unit: str
    camera: Camera
    leds: tuple[Led, Led, Led]
    response: Response
    ambient: tuple[tuple[float, ...], ...]
    coating: Coating
    gel_index: float
    dome_scale: float
    photograph: str
    noise: tuple[float, float, float]
    fit: Fit
    photographed: tuple[tuple[Led, Led, Led], tuple[float, float, float]] | None = None
    markers: Markers | None = None
    ambient_rise: tuple[float, float, float] = (0.0, 0.0, 0.0)
    object_reflectance: float = 0.0

    def __post_init__(self) -> None:
        if tuple(led.colour for led in self.leds) != COLOURS:
            raise TactileError("leds", repr([led.colour for led in self.leds]), f"one each of {', '.join(COLOURS)}")
        for led in self.leds:
            if led.position[2] <= led.radius:
                found = f"{1e3 * led.position[2]:g} mm high, radius {1e3 * led.radius:g} mm"
                raise TactileError(f"leds, {led.colour}", found, "a sphere above the gel, whose height is 0")
        _check_range("gel, dome_scale", self.dome_scale, 0.0, 5.0)
        _check_range("gel, index", self.gel_index, 1.0, MOST_INDEX)
        lengths = [len(row) for row in self.ambient]
        even = lengths in ([AMBIENT_TERMS] * 3, [PHOTOGRAPHED_TERMS] * 3)
        if not even or not np.isfinite(self.ambient).all():
            expected = f"3 rows of {AMBIENT_TERMS} or {PHOTOGRAPHED_TERMS} finite numbers"
            raise TactileError("ambient", f"rows of {lengths} numbers", expected)
        _check_range("object reflectance", self.object_reflectance, 0.0, 1.0)
        for share in self.ambient_rise:
            _check_range("ambient, rise_per_mm", 1e-3 * share, -MOST_RISE, MOST_RISE)
        if self.markers is not None and self.photograph:
            found = f"beside the photograph {self.photograph}, whose own dots would stay"
            raise TactileError("markers", found, "a picture at rest that the lights make", "Leave the photograph out")
        if len(self.noise) != 3:
            raise TactileError("noise, levels", repr(self.noise), "three numbers")
        for level in self.noise:
            _check_range("noise, levels", level, 0.0, LARGEST_LEVEL)
        _check_range("fit, ball_diameter_mm", self.fit.ball_diameter, 0.0, 0.1)

    @property
    def pixel_response(self) -> np.ndarray:
        """Response (H, W, 3, 3) at each pixel of the camera, channel by LED: levels shown per level of LED light."""
        return self.response.matrices(self.camera)

    @property
    def facing(self) -> np.ndarray:
        """Radiance (3,) of each LED's light, levels, on a coating that faces it from as far as the picture's centre is:
        a matte coating of albedo a shows a r^2 / d^2 of the radiance of an even sphere (Lambert's law)."""
        return self._lit([float(np.square(led.position).sum()) for led in self.leds])

    @property
    def through(self) -> float:
        """Light from an object through the coating that it touches, as a share of ``facing``."""
        return self.coating.transmission * self.object_reflectance

    def check_shows(self, what: str) -> None:
        """Raise TactileError, which names ``what``, if the coating shows nothing of an object behind it."""
        if not self.coating.transmission:
            found = f"given for {self.unit}, whose coating lets no light through (transmission 0)"
            raise TactileError(what, found, "a calibration with transmission in [coating]", "Leave it out")

    def with_through(self, through: float) -> Calibration:
        """Return the unit with another ``through``, 0 to 1: by the object's reflectance and, if even a white object
        gives less, by a larger transmission of the coating."""
        most = max(self.coating.transmission, through)
        coating = dataclasses.replace(self.coating, transmission=most)
        return dataclasses.replace(self, coating=coating, object_reflectance=through / most if most else 0.0)

    @property
    def ambient_unit(self) -> np.ndarray:
        """Radiance (3,), levels, that 1 in ``ambient`` means: of a coating that faces its LED at AMBIENT_DISTANCE."""
        return self._lit([AMBIENT_DISTANCE**2] * 3)

    def _lit(self, squares: list[float]) -> np.ndarray:
        parts = zip(self.leds, self.coating.albedo, squares, strict=True)
        return np.array([led.radiance * albedo * led.radius**2 / square for led, albedo, square in parts])

    @property
    def gain(self) -> Response:
        """Response, in levels, to radiance in units of ``facing``: each LED's column times its ``facing``."""
        return self.response.times(self.facing)

    def with_gain(self, gain: Response) -> Calibration:
        """Return the unit with another ``gain``: the LEDs' radiances are set so that each one's own channel responds by
        1 level per level in the picture's middle. Raises TactileError for an albedo of 0."""
        if not min(self.coating.albedo) > 0:
            raise TactileError("coating, albedo", "0", "more than 0, or no LED's light is seen")
        own = np.diag(gain.centre)
        red, green, blue = (
            dataclasses.replace(led, radiance=float(level * np.square(led.position).sum() / (albedo * led.radius**2)))
            for led, level, albedo in zip(self.leds, own, self.coating.albedo, strict=True)
        )
        return dataclasses.replace(self, leds=(red, green, blue), response=gain.times(1 / own))

    def at_size(self, width: int, height: int) -> Calibration:
        """Return the unit with the same view at another width and height in pixels, as ``Camera.at_size`` allows."""
        return dataclasses.replace(self, camera=self.camera.at_size(width, height))


def _check_range(where: str, value: float, least: float, most: float) -> None:
    finite_number(value, where, f"{least:g} to {most:g}", least, most)
