"""The DIGIT's camera and lights as data: one camera model, used for every step between pixels and gel.

Image frame, used by camera and lights: right and down along the picture, toward the camera as third axis,
metres, origin in the picture's centre at height zero (``HEIGHT_ZERO_Y``).
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from .errors import TactileError

# Plane of height zero, shared frame: the lowest point of the public gel mesh at rest (sensors.md). Heights grow
# with y, toward the camera, so that an indentation raises them.
HEIGHT_ZERO_Y = -8.301e-3


@dataclasses.dataclass(frozen=True)
class Camera:
    """An orthographic camera that looks at the coating along -y, from inside the gel.

    width, height : pixels
    px_per_mm_x, px_per_mm_y : pixels a millimetre of gel, along the picture's rows (x) and columns (y)
    centre_x, centre_z : m, the place on the gel, shared frame, in the middle of the picture
    right_z, down_x : +1 or -1, the way z goes to the right and x goes down the picture
    """

    width: int
    height: int
    px_per_mm_x: float
    px_per_mm_y: float
    centre_x: float
    centre_z: float
    right_z: int
    down_x: int

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            size = getattr(self, name)
            if not (isinstance(size, int) and size >= 2):
                raise TactileError(f"camera, {name}", repr(size), "a whole number of pixels, 2 or more")
        for name in ("px_per_mm_x", "px_per_mm_y"):
            scale = getattr(self, name)
            if not (math.isfinite(scale) and scale > 0):
                raise TactileError(f"camera, {name}", repr(scale), "a number of pixels a millimetre above 0")
        for name in ("right_z", "down_x"):
            if getattr(self, name) not in (-1, 1):
                raise TactileError(f"camera, {name}", repr(getattr(self, name)), "+1 or -1")
        if not (math.isfinite(self.centre_x) and math.isfinite(self.centre_z)):
            raise TactileError("camera, centre", f"({self.centre_x}, {self.centre_z})", "finite metres")

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of arrays that hold a picture."""
        return self.height, self.width

    @property
    def pixel_size(self) -> tuple[float, float]:
        """(right, down), m of gel from one pixel to the next."""
        return 1e-3 / self.px_per_mm_x, 1e-3 / self.px_per_mm_y

    @property
    def right(self) -> np.ndarray:
        """Image coordinate (width,) m of the pixel centres of a row, to the right from the picture's middle."""
        return (np.arange(self.width) + 0.5 - self.width / 2) * self.pixel_size[0]

    @property
    def down(self) -> np.ndarray:
        """Image coordinate (height,) m of the pixel centres of a column, down from the picture's middle."""
        return (np.arange(self.height) + 0.5 - self.height / 2) * self.pixel_size[1]

    @property
    def gel_x(self) -> np.ndarray:
        """x (height,) m on the gel of each row of pixels."""
        return self.centre_x + self.down_x * self.down

    @property
    def gel_z(self) -> np.ndarray:
        """z (width,) m on the gel of each column of pixels."""
        return self.centre_z + self.right_z * self.right

    def to_pixel(self, x: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(row, column), fractional, of gel places x, z in m; whole numbers are pixel centres."""
        right, down = self.pixel_size
        row = self.down_x * (np.asarray(x) - self.centre_x) / down + self.height / 2 - 0.5
        column = self.right_z * (np.asarray(z) - self.centre_z) / right + self.width / 2 - 0.5
        return row, column

    def to_gel(self, row: np.ndarray, column: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(x, z) m on the gel of fractional pixels: the inverse of ``to_pixel``."""
        right, down = self.pixel_size
        x = self.centre_x + self.down_x * (np.asarray(row) + 0.5 - self.height / 2) * down
        z = self.centre_z + self.right_z * (np.asarray(column) + 0.5 - self.width / 2) * right
        return x, z


@dataclasses.dataclass(frozen=True)
class Led:
    """One light of one colour, a small sphere.

    colour : "red", "green" or "blue", the only channel it is seen in
    position : (right, down, toward the camera), m, image frame
    radius : m, its apparent size, which makes shadows soft
    """

    colour: str
    position: tuple[float, float, float]
    radius: float

    def __post_init__(self) -> None:
        if self.colour not in COLOURS:
            raise TactileError("led, colour", repr(self.colour), f"one of {', '.join(COLOURS)}")
        if len(self.position) != 3 or not all(math.isfinite(c) for c in self.position) or self.position[2] <= 0:
            raise TactileError(f"led {self.colour}, position", repr(self.position), "three metres, the third above 0")
        if not (math.isfinite(self.radius) and self.radius > 0):
            raise TactileError(f"led {self.colour}, radius", repr(self.radius), "metres above 0")

    @property
    def channel(self) -> int:
        """Index of its colour in a picture's last axis."""
        return COLOURS.index(self.colour)


COLOURS = ("red", "green", "blue")

# Size: the sensor's 320 x 240 mode held in portrait; scale: the most frequent of 17-21 px/mm (sensors.md).
# Centre: the middle of the even window of ``digit_shape``. Which way the picture lies on the gel is not published:
# the fingertip (-x) up is assumed; z then runs to the left, because a camera without a mirror sees it so.
DIGIT_CAMERA = Camera(
    width=240, height=320, px_per_mm_x=18.8, px_per_mm_y=18.8, centre_x=-7.5e-3, centre_z=0.0, right_z=-1, down_x=1
)

# Positions: a fit to real pictures of one unit (sensors.md), start values and not a calibration.
# Radius: assumed; lights and the roughness of the acrylic's edge, which widens them, differ between units.
DIGIT_LEDS = (
    Led("red", (10.8e-3, -10.9e-3, 7.0e-3), 1.0e-3),
    Led("green", (-13.3e-3, -8.5e-3, 7.6e-3), 1.0e-3),
    Led("blue", (1.6e-3, 14.6e-3, 5.8e-3), 1.0e-3),
)
