"""The picture of an untouched DIGIT: a calibration's smooth polynomial, or the user's own photograph."""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np

from ..errors import TactileError
from ..sensors.calibration import BACKGROUND_DEGREE, BACKGROUND_UNIT, LARGEST_LEVEL, Calibration
from ..sensors.camera import Camera

FORMATS = ("PNG", "JPEG", "BMP", "TIFF")  # of photographs; for others the library may start programs (EPS: Ghostscript)
MOST_PIXELS = 50_000_000  # of a photograph: 150 MB; a DIGIT's have 0.08 to 0.3 million


def background_picture(calibration: Calibration) -> np.ndarray:
    """Background (H, W, 3) float32, grey levels; whole numbers of 8 bits.

    Raises TactileError for a photograph that cannot be read or has another size than the camera's pictures.
    """
    if calibration.background.photograph:
        return read_photograph(calibration.background.photograph, calibration.camera).astype(np.float32)
    return polynomial_background(calibration.background.polynomial, calibration.camera)


def polynomial_background(coefficients: tuple[tuple[float, ...], ...], camera: Camera) -> np.ndarray:
    """(H, W, 3) float32 of a polynomial (3, 21) in the order of ``terms``, in whole grey levels of 8 bits."""
    down, right = camera.down / BACKGROUND_UNIT, camera.right / BACKGROUND_UNIT
    picture = np.zeros((*camera.shape, 3))
    for (i, j), levels in zip(terms(), np.asarray(coefficients).T, strict=True):
        picture += (down[:, None] ** j * right**i)[..., None] * levels
    return np.rint(picture).clip(0, LARGEST_LEVEL).astype(np.float32)


def fit_polynomial(picture: np.ndarray, camera: Camera) -> tuple[tuple[float, ...], ...]:
    """Coefficients (3, 21), least squares, of a picture (H, W, 3) in grey levels."""
    down, right = np.meshgrid(camera.down / BACKGROUND_UNIT, camera.right / BACKGROUND_UNIT, indexing="ij")
    basis = np.stack([(right**i * down**j).ravel() for i, j in terms()], -1)
    found = np.linalg.lstsq(basis, picture.reshape(-1, 3).astype(float), rcond=None)[0]
    return tuple(tuple(row) for row in found.T.tolist())


def terms() -> Iterator[tuple[int, int]]:
    """Powers (i, j) of right and down, by i + j, then by j."""
    for degree in range(BACKGROUND_DEGREE + 1):
        for j in range(degree + 1):
            yield degree - j, j


def read_photograph(path: str | os.PathLike, camera: Camera | None = None) -> np.ndarray:
    """Picture (H, W, 3) uint8 of an image file; raises TactileError for what is no picture or of another size."""
    from PIL import Image

    try:
        with Image.open(path, formats=FORMATS) as image:
            if image.width * image.height > MOST_PIXELS:
                raise ValueError(f"{image.width} x {image.height} pixels, over {MOST_PIXELS // 10**6} million")
            picture = np.asarray(image.convert("RGB"))
    except Exception as error:  # the library raises a dozen types on damaged bytes
        expected = f"an image file ({', '.join(FORMATS)})"
        raise TactileError(path, f"cannot be read as a picture ({error})", expected) from error
    if camera is not None and picture.shape[:2] != camera.shape:
        found = f"{picture.shape[1]} x {picture.shape[0]} pixels"
        raise TactileError(path, found, f"{camera.width} x {camera.height}, as the calibration's camera")
    return picture
