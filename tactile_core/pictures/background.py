"""The picture of an untouched DIGIT: its LEDs' light on the coating and ambient light, or the user's own photograph.

About half of what a real unit shows at rest is light scattered in gel and acrylic, which lights the coating from all
sides. Each LED has its own share of it, a smooth polynomial, proportional to the LED's power and the coating's
albedo."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterator

import numpy as np

from ..errors import TactileError
from ..files import outside
from ..sensors.calibration import AMBIENT_DEGREE, AMBIENT_TERMS, AMBIENT_UNIT, PHOTOGRAPHED_DEGREE, Calibration
from ..sensors.camera import Camera
from .height_map import of_unit, rest_height_map
from .light import Surface, open_light
from .perspective import slopes

FORMATS = ("PNG", "JPEG", "BMP", "TIFF")  # of photographs; for others the library may start programs (EPS: Ghostscript)
DARK = 1.0  # grey levels, least modelled picture that the photograph is divided by
MOST_PIXELS = 50_000_000  # of a photograph: 150 MB; a DIGIT's have 0.08 to 0.3 million
# Of correlations with a unit's own picture, which other DIGITs' have by .79 to .98, and by .49 to .67 with red and blue
# exchanged (assumed)
MORE_ALIKE = 0.15
ALIKE = 0.5  # least correlation that tells a way at all (assumed: two units .2, the right way of one .98)


def resting_picture(unit: Calibration, radiance: np.ndarray) -> np.ndarray:
    """Return the picture (H, W, 3) float32, levels, of the untouched gel: the calibration's photograph, scaled by the
    modelled effect of LEDs or albedo changed since; without one the model's. radiance : (H, W, LED) levels, at rest

    Raises TactileError for a photograph that cannot be read, has another size than the camera's pictures, or is turned,
    mirrored or blue first."""
    own = by_led(unit, radiance).sum(-1)
    if not unit.photograph:
        return own
    photograph = read_photograph(unit.photograph, unit.camera).astype(np.float32)
    if unit.photographed in (None, (unit.leds, unit.coating.albedo)):
        check_way(photograph, own, unit.photograph)
        return photograph
    leds, albedo = unit.photographed
    coating = dataclasses.replace(unit.coating, albedo=albedo)
    now, then = _open_light(unit), _open_light(dataclasses.replace(unit, leds=leds, coating=coating))
    check_way(photograph, then, unit.photograph)
    return photograph * np.maximum(now, 0) / np.maximum(then, DARK)


def _open_light(unit: Calibration) -> np.ndarray:
    return by_led(unit, open_radiance(unit)).sum(-1)


def open_radiance(unit: Calibration) -> np.ndarray:
    """Return the radiance (H, W, LED), levels, of the untouched gel without shadows: a smooth dome casts none."""
    height = of_unit(rest_height_map(unit.camera), unit).astype(np.float32)
    right, down = unit.camera.right.astype(np.float32)[None, :], unit.camera.down.astype(np.float32)[:, None]
    surface = Surface(right, down, height, *slopes(height, unit.camera))
    return np.moveaxis(open_light(surface, unit) + raised_light(unit, height), 0, -1)


def raised_light(unit: Calibration, seen: np.ndarray) -> np.ndarray:
    """Return the ambient light (LED, H, W) float32, levels, proportional to the gel's ``seen`` heights (H, W) m."""
    share = unit.ambient_unit * unit.ambient_rise
    return share.astype(np.float32)[:, None, None] * seen


def by_led(unit: Calibration, radiance: np.ndarray) -> np.ndarray:
    """Return each LED's part of the picture at rest, grey levels (H, W, channel, LED); the picture is their sum.
    radiance : (H, W, LED) levels, of the coating; each LED's ambient light is added to it"""
    right, down = unit.camera.right / AMBIENT_UNIT, unit.camera.down / AMBIENT_UNIT
    ambient = np.zeros((*unit.camera.shape, 3))
    table = np.asarray(unit.ambient)
    degree = AMBIENT_DEGREE if table.shape[1] == AMBIENT_TERMS else PHOTOGRAPHED_DEGREE
    for (i, j), share in zip(terms(degree), table.T, strict=True):
        ambient += (down[:, None] ** j * right**i)[..., None] * share
    levels = unit.pixel_response * radiance[..., None, :]
    levels += np.asarray(unit.response.centre) * (ambient * unit.ambient_unit)[..., None, :]
    return levels.astype(np.float32)


def fit_ambient(
    picture: np.ndarray, unit: Calibration, radiance: np.ndarray, degree: int = AMBIENT_DEGREE
) -> tuple[tuple[float, ...], ...]:
    """Fit each LED's ambient light to a picture at rest by least squares; return coefficients (LED, n) of ``terms``.
    picture : (H, W, 3) levels; radiance : (H, W, LED) levels of the coating at rest; degree : of the polynomials, 5 or,
        for a photograph, 7"""
    right, down = np.meshgrid(unit.camera.right / AMBIENT_UNIT, unit.camera.down / AMBIENT_UNIT)
    basis = np.stack([(right**i * down**j).ravel() for i, j in terms(degree)], -1)
    left = picture - np.einsum("hwcl,hwl->hwc", unit.pixel_response, radiance)
    found = np.linalg.lstsq(basis, left.reshape(-1, 3), rcond=None)[0]
    bands = np.linalg.solve(np.asarray(unit.response.centre), found.T) / unit.ambient_unit[:, None]
    return tuple(tuple(row) for row in bands.tolist())


def terms(most: int) -> Iterator[tuple[int, int]]:
    """Yield the exponents (i, j) of right and down in a polynomial of degree ``most``, sorted by i + j, then by j."""
    for degree in range(most + 1):
        for j in range(degree + 1):
            yield degree - j, j


def check_way(picture: np.ndarray, own: np.ndarray, where: str = "background") -> None:
    """Raise TactileError, which names ``where``, for a background that is much more like the unit's own after its
    colours are exchanged or it is turned or mirrored. picture, own : (H, W, 3) levels, it and the unit's own"""
    ways = {
        "as it is": picture, "with red and blue exchanged": picture[..., ::-1], "turned by 180°": picture[::-1, ::-1],
        "mirrored up and down": picture[::-1], "mirrored left and right": picture[:, ::-1],
    }  # fmt: skip
    alike = {way: _correlation(each, own) for way, each in ways.items()}
    best = max(alike, key=alike.__getitem__)
    if alike[best] > max(ALIKE, alike["as it is"] + MORE_ALIKE):
        found = f"like the calibration's ({alike['as it is']:.2f} as it is, {alike[best]:.2f} {best})"
        raise TactileError(where, found, "red, green, blue, fingertip up", f"Give it {best}, or calibrate the unit")


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    """Return the correlation of pictures one, other (H, W, 3), each less its channels' means; 0 if one is uniform."""
    one, other = (each - each.mean(axis=(0, 1)) for each in (one, other))
    return float(np.vdot(one, other) / max(np.linalg.norm(one) * np.linalg.norm(other), 1e-9))


def read_photograph(path: str | os.PathLike, camera: Camera | None = None) -> np.ndarray:
    """Read an image file as a picture (H, W, 3) uint8, red, green, blue. Raises TactileError for a file that is no
    image of 8 bits a colour, and for a size other than that of ``camera``'s pictures (None accepts any)."""
    from PIL import Image, ImageOps

    expected = f"an image file of 8 bits a colour ({', '.join(FORMATS)})"
    try:
        with outside.open_file(path, expected) as file, Image.open(file, formats=FORMATS) as image:
            if image.width * image.height > MOST_PIXELS:
                raise ValueError(f"{image.width} x {image.height} pixels, over {MOST_PIXELS // 10**6} million")
            if image.mode[0] in "IF":  # which would be cut off at 255
                raise ValueError("more than 8 bits a pixel")
            if image.mode in ("1", "L", "LA"):
                raise ValueError("it has no colours")
            if image.format in ("PNG", "TIFF") and getattr(image, "n_frames", 1) > 1:  # the others would be lost
                raise ValueError("several pictures in one file")
            picture = np.asarray(ImageOps.exif_transpose(image).convert("RGB"))  # as viewers show it
    except TactileError:
        raise
    except Exception as error:  # the library raises a dozen types on damaged bytes
        raise TactileError(path, f"cannot be read as a picture ({error})", expected) from error
    if camera is not None and picture.shape[:2] != camera.shape:
        found = f"{picture.shape[1]} x {picture.shape[0]} pixels"
        raise TactileError(path, found, f"{camera.width} x {camera.height}, as the calibration's camera")
    return picture
