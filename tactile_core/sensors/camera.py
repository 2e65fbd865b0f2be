"""Data of a camera and lights: one camera model, used for every step between pixels and gel.

Image frame, for camera and lights: right and down along the picture, third axis toward the camera, metres, origin in
the picture's centre at height zero (``Camera.height_zero_y``). A unit's own camera and lights are in its calibration,
which ``calibration_file`` documents.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from ..errors import TactileError, finite_number
from ..geometry.lattice import Lattice
from .descriptor import of_kind
from .gel_sensor import GelSensor
from .gel_shape import shape_of
from .toml_fields import IN_PYTHON, number

HEIGHT_ZERO_Y = of_kind("digit", GelSensor).camera.height_zero_y  # of a DIGIT's cameras
MOST_PIXELS = 10_000_000  # 2.5 GB for a fast picture; the camera has 76,800 (assumed enough)
FINEST = 1000.0  # pixels per millimetre; the shipped unit's camera has 20 (assumed enough)
LOWEST_CAMERA = 5e-3  # m; the gel alone is 4 mm thick, and no press reaches a camera that is higher


@dataclasses.dataclass(frozen=True)
class Camera:
    """A pinhole camera in the middle over the picture that looks at the coating along -y, from inside the gel.

    Its position is the apparent one, after refraction by gel and acrylic. A gel point appears at its central projection
    onto the plane of height zero: (right, down, h) at (right, down) / (1 - h / apparent_height).
    width, height : pixels
    px_per_mm_x, px_per_mm_y : pixels per millimetre of gel at height zero, along the picture's rows (x) and columns (y)
    centre_x, centre_z : m, the place on the gel, shared frame, in the middle of the picture
    apparent_height : m, height of the pinhole above the plane of height zero
    right_z, down_x : +1 or -1, the direction of z to the right and of x down the picture
    sensor : name of the sensor whose gel it looks at"""

    width: int = number("px")
    height: int = number("px")
    px_per_mm_x: float = number()
    px_per_mm_y: float = number()
    centre_x: float = number("mm")
    centre_z: float = number("mm")
    apparent_height: float = number("mm")
    right_z: int = number()
    down_x: int = number()
    sensor: str = dataclasses.field(default="digit", metadata=IN_PYTHON)

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            size = getattr(self, name)
            if not (isinstance(size, int) and size >= 2):
                raise TactileError(f"camera, {name}", repr(size), "a whole number of pixels, 2 or more")
        if self.width * self.height > MOST_PIXELS:
            found = f"{self.width} x {self.height} pixels"
            raise TactileError("camera, size", found, f"at most {MOST_PIXELS // 10**6} million pixels")
        for name in ("px_per_mm_x", "px_per_mm_y"):
            scale = getattr(self, name)
            if not 0 < scale <= FINEST:  # false for nan
                raise TactileError(f"camera, {name}", repr(scale), f"pixels a millimetre, above 0, at most {FINEST:g}")
        for name in ("right_z", "down_x"):
            if getattr(self, name) not in (-1, 1):
                raise TactileError(f"camera, {name}", repr(getattr(self, name)), "+1 or -1")
        if not (math.isfinite(self.centre_x) and math.isfinite(self.centre_z)):
            raise TactileError("camera, centre", f"({self.centre_x}, {self.centre_z})", "finite metres")
        expected = f"{LOWEST_CAMERA} m or more, above the gel"
        finite_number(self.apparent_height, "camera, apparent_height", expected, LOWEST_CAMERA)
        of_kind(self.sensor, GelSensor)  # refused where it is none

    @property
    def height_zero_y(self) -> float:
        """Coordinate y, m, of the plane of height zero. Heights grow with y, toward the camera: a dent raises them."""
        return of_kind(self.sensor, GelSensor).camera.height_zero_y

    @property
    def surface(self) -> Lattice:
        """Resting surface of the gel that the camera looks at."""
        return shape_of(self.sensor).surface()

    @property
    def shape(self) -> tuple[int, int]:
        """Shape (height, width) of arrays that hold a picture."""
        return self.height, self.width

    def at_size(self, width: int, height: int) -> Camera:
        """Return the same view at another width and height in pixels. They may differ from an exact share of this one's
        by part of a pixel, which cuts the view. Raises TactileError for another aspect ratio or fewer than 3 pixels."""
        if not -self.height < width * self.height - height * self.width < self.width:
            expected = f"the aspect ratio of {self.width} x {self.height}"
            raise TactileError("camera, size", f"{width} x {height} pixels", expected)
        if min(width, height) < 3:
            raise TactileError("camera, size", f"{width} x {height} pixels", "3 x 3 and more, between which slopes lie")
        factor = height / self.height
        scale_x, scale_y = self.px_per_mm_x * factor, self.px_per_mm_y * factor
        return dataclasses.replace(self, width=width, height=height, px_per_mm_x=scale_x, px_per_mm_y=scale_y)

    @property
    def pixel_size(self) -> tuple[float, float]:
        """Size (right, down) of a pixel, m on the gel at height zero."""
        return 1e-3 / self.px_per_mm_x, 1e-3 / self.px_per_mm_y

    @property
    def right(self) -> np.ndarray:
        """Places (width,) m, to the right of the picture's middle, of the pixel centres in a row, at height zero."""
        return (np.arange(self.width) + 0.5 - self.width / 2) * self.pixel_size[0]

    @property
    def down(self) -> np.ndarray:
        """Places (height,) m, down from the picture's middle, of the pixel centres in a column, at height zero."""
        return (np.arange(self.height) + 0.5 - self.height / 2) * self.pixel_size[1]

    @property
    def gel_x(self) -> np.ndarray:
        """Coordinate x (height,) m at height zero of each row of pixels: the rows of a height map."""
        return self.centre_x + self.down_x * self.down

    @property
    def gel_z(self) -> np.ndarray:
        """Coordinate z (width,) m at height zero of each column of pixels: the columns of a height map."""
        return self.centre_z + self.right_z * self.right

    def to_pixel(self, x: np.ndarray, z: np.ndarray, height: np.ndarray | float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Project points x, z, height (...) m, toward the camera, to row and column (...) px, whole at pixel
        centres."""
        right, down = self.pixel_size
        nearer = 1 / (1 - np.asarray(height) / self.apparent_height)
        row = self.down_x * (np.asarray(x) - self.centre_x) * nearer / down + self.height / 2 - 0.5
        column = self.right_z * (np.asarray(z) - self.centre_z) * nearer / right + self.width / 2 - 0.5
        return row, column

    def sees(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return which places x, z (n,) m of the gel at height zero lie in the picture, (n,) bool; false for NaN."""
        row, column = self.to_pixel(x, z)
        return (row > -0.5) & (row < self.height - 0.5) & (column > -0.5) & (column < self.width - 0.5)

    def to_gel(
        self, row: np.ndarray, column: np.ndarray, height: np.ndarray | float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return x, z (...) m of points at height (...) m that row, column (...) px show: inverts ``to_pixel``."""
        right, down = self.pixel_size
        nearer = 1 / (1 - np.asarray(height) / self.apparent_height)
        x = self.centre_x + self.down_x * (np.asarray(row) + 0.5 - self.height / 2) * down / nearer
        z = self.centre_z + self.right_z * (np.asarray(column) + 0.5 - self.width / 2) * right / nearer
        return x, z


@dataclasses.dataclass(frozen=True)
class Led:
    """Light of one colour: a sphere, equally bright from all sides.

    colour : "red", "green" or "blue"; its light is a band of radiance of its own
    position : (right, down, toward the camera), m, image frame
    radius : m, its apparent size, which makes shadows soft
    radiance : of the sphere's surface, some 1e5 levels of its channel in the picture's middle; 0 is off
    """

    colour: str = dataclasses.field(metadata=IN_PYTHON)
    position: tuple[float, float, float] = number("mm")
    radius: float = number("mm")
    radiance: float = number()

    def __post_init__(self) -> None:
        if self.colour not in COLOURS:
            raise TactileError("led, colour", repr(self.colour), f"one of {', '.join(COLOURS)}")
        if len(self.position) != 3 or not all(math.isfinite(c) for c in self.position) or self.position[2] <= 0:
            raise TactileError(f"led {self.colour}, position", repr(self.position), "three metres, the third above 0")
        if not (math.isfinite(self.radius) and self.radius > 0):
            raise TactileError(f"led {self.colour}, radius", repr(self.radius), "metres above 0")
        finite_number(self.radiance, f"led {self.colour}, radiance", "grey levels, 0 or more", 0.0)

    @property
    def channel(self) -> int:
        """Index of the LED's colour in a picture's last axis."""
        return COLOURS.index(self.colour)


COLOURS = ("red", "green", "blue")
