"""Photographs of balls pressed into a gel: pictures, background, and where each press is visible."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import TactileError
from ..background import read_photograph
from . import video_frames
from .photo_metrics import windowed

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
CHANGE = 18  # grey levels in some channel, of a pixel that the press has changed (assumed)
DILATION = 9  # px, by which the region reaches beyond such pixels
SMALLEST_PRESS = 300  # px at 240 x 320 changed by more than CHANGE; less is dust or drift, a light press has 2,000
LARGEST_SHARE = 0.6  # of the picture changed: another lighting, not a press
OVER_EXPOSED = 0.05  # share of the region with a channel at 255 from which on a press is flagged
EXPOSURE = 0.1  # change of brightness of the gel beside a press that is flagged, a share; real sets differ by 0.06
FEWEST_FOR_MEDIAN = 3  # photographs; of two, the median is their mean, which shows both presses
NOISE_WINDOW = 41  # px at 240 wide, of the means that are no noise
NOISE_LIMIT = 15  # grey levels; more is dust or the rim of a press


@dataclasses.dataclass(frozen=True)
class Press:
    """Photograph of a press.

    picture : (H, W, 3) uint8; drift : (H, W, 3) float32, grey levels, change of the lighting since the background
    change : (H, W, 3) float32, grey levels, picture less background and drift; touched : (H, W) bool, near large
        changes
    region : (H, W) bool, in which pictures are compared: near changes of picture from background, drift included
    flags : what is wrong with it, in words; empty for nothing
    radius : m, its ball's; None for the whole set's"""

    name: str
    picture: np.ndarray
    drift: np.ndarray
    change: np.ndarray
    touched: np.ndarray
    region: np.ndarray
    flags: tuple[str, ...]
    radius: float | None = None

    @property
    def middle(self) -> tuple[float, float]:
        """Centre of mass (row, column) of the change."""
        weight = np.abs(self.change).max(-1) * self.touched
        rows, columns = np.indices(weight.shape)
        return float((weight * rows).sum() / weight.sum()), float((weight * columns).sum() / weight.sum())


@dataclasses.dataclass(frozen=True)
class Photographs:
    """Photographs of one unit, prepared. folder : that holds all, or the video; presses : those of a press
    background : (H, W, 3) float32, grey levels; estimated : true if it was estimated from the set
    untouched : names of photographs that show no press; noise : (3,) grey levels, standard deviation of a pixel"""

    folder: Path
    presses: tuple[Press, ...]
    background: np.ndarray
    estimated: bool
    untouched: tuple[str, ...]
    noise: tuple[float, float, float]

    @property
    def shape(self) -> tuple[int, int]:
        """Shape (H, W) of each photograph, pixels."""
        return self.background.shape[:2]


def read_photographs(
    folders: str | os.PathLike | Sequence[str | os.PathLike],
    background: str | os.PathLike | None = None,
    radii: Sequence[float] | None = None,
    only: list[str] | None = None,
) -> Photographs:
    """Read all pictures of folders or videos; without a photograph of the background, estimate it from them.

    radii : m, of each folder's ball; None if one ball, given elsewhere, made all presses
    only : names of the presses to keep, in that order; None for all
    Raises TactileError for a folder without pictures or without a press, pictures of different sizes, a press that is
    there twice or grey, or too few to estimate the background; ModuleNotFoundError for a video without OpenCV."""
    paths = [Path(each) for each in ([folders] if isinstance(folders, str | os.PathLike) else folders)]
    folder = paths[0] if len(paths) == 1 else Path(os.path.commonpath([path.absolute() for path in paths]))
    pictures, ball = {}, {}
    for number, path in enumerate(paths):
        for name, picture in _pictures(path).items():
            name = name if len(paths) == 1 else f"{path.name}/{name}" if path.is_dir() else name
            if name in pictures:
                raise TactileError(path, f"a second {name}", "folders and videos of different names")
            pictures[name], ball[name] = picture, radii[number] if radii else None
    sizes = {name: picture.shape[:2] for name, picture in pictures.items()}
    first = next(iter(sizes))
    for name, size in sizes.items():
        if size != sizes[first]:
            found = f"{size[1]} x {size[0]} pixels"
            raise TactileError(folder / name, found, f"{sizes[first][1]} x {sizes[first][0]}, as {first}")
    if background is not None:
        rest = read_photograph(background).astype(np.float32)
        if rest.shape[:2] != sizes[first]:
            found = f"{rest.shape[1]} x {rest.shape[0]} pixels"
            raise TactileError(background, found, f"{sizes[first][1]} x {sizes[first][0]}, as the photographs")
    elif len(pictures) < FEWEST_FOR_MEDIAN:
        found = f"{len(pictures)} photographs, too few to estimate the untouched gel from"
        advice = "Give a photograph of the untouched gel: --background FILE"
        raise TactileError(folder, found, f"{FEWEST_FOR_MEDIAN} or more", advice)
    else:
        rest = estimated_background(np.stack(list(pictures.values())))
    tried = {name: press_of(name, picture, rest, ball[name]) for name, picture in pictures.items()}
    presses = tuple(press for press in tried.values() if press is not None)
    if not presses:
        advice = "Give the background with --background, or press harder"
        raise TactileError(folder, f"no press in {len(pictures)} photographs", "photographs of a pressed ball", advice)
    untouched = tuple(name for name, press in tried.items() if press is None)
    every = Photographs(folder, presses, rest, background is None, untouched, measured_noise(presses, rest))
    kept = every if only is None else chosen(every, only)
    _check_pictures(kept)
    return kept


def _check_pictures(photographs: Photographs) -> None:
    """Raise TactileError for a press without colours, and for one that is there twice: held out, it would be known."""
    first: dict[bytes, str] = {}
    for press in photographs.presses:
        where, same = photographs.folder / press.name, first.setdefault(press.picture.tobytes(), press.name)
        if same != press.name:
            raise TactileError(where, f"the same picture as {same}", "a photograph of another press", "Take one away")
        if (press.picture == press.picture[..., :1]).all():
            found = "no colours: red, green and blue are the same everywhere"
            raise TactileError(where, found, "a photograph in colours", "Save them as the camera gives them")


def chosen(photographs: Photographs, names: list[str]) -> Photographs:
    """Return the set with the presses ``names`` alone, in their order; raises TactileError for an unknown name."""
    by_name = {press.name: press for press in photographs.presses}
    for name in names:
        if name not in by_name:
            expected = f"some of {', '.join(by_name)}"
            raise TactileError(photographs.folder / name, "shows no press or is absent", expected)
    return dataclasses.replace(photographs, presses=tuple(by_name[name] for name in names))


def estimated_background(pictures: np.ndarray) -> np.ndarray:
    """Estimate the untouched gel (H, W, 3) float32 from pictures (n, H, W, 3) in which each pixel is mostly untouched.
    At each pixel it is the median of the values within 18 levels of the median of all: presses in a third of the
    pictures pull that first median by up to 18 levels."""
    first = np.median(pictures, axis=0).astype(np.float32)
    touched = np.abs(pictures - first).max(-1, keepdims=True) > CHANGE
    rest = np.where(touched, np.nan, pictures.astype(np.float32))
    always = touched.all(axis=0)[..., 0]
    rest[:, always] = first[always]  # where no picture is untouched there is nothing else to take a median of
    return np.nanmedian(rest, axis=0)


def measured_noise(presses: tuple[Press, ...], background: np.ndarray) -> tuple[float, float, float]:
    """Return the standard deviation (3,) of the camera's noise, grey levels, beside the presses. Means over 41 px (at
    240 wide), which hold the drift of light, are subtracted first; a photographed background (H, W, 3) adds its own
    noise."""
    window = NOISE_WINDOW * background.shape[1] // 240 | 1
    found = []
    for press in presses:
        quiet = ~dilated(press.touched, window // 4)
        if quiet.any():
            rest = press.change - windowed(press.change.astype(float), window)
            found.append([channel[np.abs(channel) < NOISE_LIMIT].std() for channel in rest[quiet].T])
    levels = np.median(found, axis=0) if found else np.zeros(3)
    red, green, blue = (float(level) for level in levels)
    return red, green, blue


def dilated(mask: np.ndarray, radius: int) -> np.ndarray:
    """Return ``mask`` (H, W), its true part grown by a disc of a ``radius``, px."""
    height, width = mask.shape
    padded = np.zeros((height + 2 * radius, width + 2 * radius + 1), np.int32)
    padded[radius : radius + height, radius + 1 : radius + 1 + width] = mask
    counted = padded.cumsum(1)
    grown = np.zeros(mask.shape, bool)
    for row in range(-radius, radius + 1):
        half = int(np.sqrt(radius**2 - row**2))
        rows = counted[radius + row : radius + row + height]
        right = rows[:, radius + half + 1 : radius + half + 1 + width]
        left = rows[:, radius - half : radius - half + width]
        grown |= right > left
    return grown


def _pictures(path: Path) -> dict[str, np.ndarray]:
    """Return pictures (H, W, 3) uint8 by name: a folder's photographs and videos, or a video's frames."""
    if not path.is_dir() and path.suffix.lower() in video_frames.SUFFIXES:
        return video_frames.frames_of(path)
    if not path.is_dir():
        raise TactileError(path, "is no folder", "a folder of photographs of a pressed ball, or a video of presses")
    pictures = {}
    for file in sorted(path.iterdir()):
        if file.suffix.lower() in SUFFIXES:
            pictures[file.name] = read_photograph(file)
        elif file.suffix.lower() in video_frames.SUFFIXES:
            pictures |= video_frames.frames_of(file)
    if not pictures:
        raise TactileError(path, "no photographs", f"files that end in {', '.join(SUFFIXES + video_frames.SUFFIXES)}")
    return pictures


def press_of(name: str, picture: np.ndarray, background: np.ndarray, radius: float | None = None) -> Press | None:
    """Return the press, called ``name``, in a photograph ``picture`` (H, W, 3) uint8; None if it shows none.
    background : (H, W, 3) levels, the untouched gel; radius : m, the ball's, None for that of the whole set"""
    difference = picture.astype(np.float32) - background
    drift = lighting_drift(difference)
    change = difference - drift
    changed = np.abs(change).max(-1) > CHANGE
    scale = changed.size / (240 * 320)
    # Dust and drift change single pixels here and there: only what is changed all around counts.
    if (~dilated(~changed, 2)).sum() < SMALLEST_PRESS * scale:
        return None
    differs = np.abs(difference).max(-1) > CHANGE
    touched, region = dilated(changed, DILATION), dilated(differs, DILATION)
    flags = []
    if (picture[touched].max(-1) == 255).mean() > OVER_EXPOSED:
        flags.append("over-exposed")
    if differs.mean() > LARGEST_SHARE:
        flags.append("changed nearly all over: another lighting than the background's")
    beside = ~touched & (background.max(-1) > CHANGE)
    brighter = float(np.median(picture[beside].sum(-1) / background[beside].sum(-1))) - 1 if beside.any() else 0.0
    if abs(brighter) > EXPOSURE:
        flags.append(f"exposed otherwise: {100 * brighter:+.0f} % beside the press, of the background's light")
    return Press(name, picture, drift, change, touched, region, tuple(flags), radius)


COARSE = 8  # px at 240 wide, over which means are taken first: drift has no finer structure
ROUNDS = 20  # of reweighting; it settles in about ten
SOFTNESS = 3.0  # grey levels: changes that are twice as far from the drift, as a press's are, hardly count (assumed)


def lighting_drift(change: np.ndarray) -> np.ndarray:
    """Return the drift (H, W, 3) float32 grey levels: the quadratic nearest most of a photograph's change (H, W, 3).
    Iteratively reweighted least squares with Geman and McClure's weights, from the median: a press that covers less
    than half of the picture has almost no weight."""
    height, width = change.shape[:2]
    step = max(COARSE * width // 240, 1)
    rows, columns = height // step, width // step
    coarse = change[: rows * step, : columns * step].reshape(rows, step, columns, step, 3).mean((1, 3), dtype=float)
    terms = _terms(_middles(rows, step, height), _middles(columns, step, width)).reshape(-1, 6)
    values = coarse.reshape(-1, 3)
    found = np.zeros((6, 3))
    found[0] = np.median(values, axis=0)
    for _ in range(ROUNDS):
        far = np.square(values - terms @ found).max(axis=1)  # a press shows in some channel
        weight = np.square(SOFTNESS**2 / (SOFTNESS**2 + far))[:, None]
        found = np.linalg.lstsq(np.sqrt(weight) * terms, np.sqrt(weight) * values, rcond=None)[0]
    whole = _terms(_middles(height, 1, height), _middles(width, 1, width))
    return (whole @ found).astype(np.float32)


def _middles(count: int, step: int, size: int) -> np.ndarray:
    """Return the middles (count,) of ``count`` intervals of ``step`` px, on a scale of -1 to 1 over ``size`` px."""
    return 2 * (np.arange(count) + 0.5) * step / size - 1


def _terms(down: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the terms (H, W, 6) of a quadratic in down (H,), right (W,): 1, right, down and their products."""
    down, right = np.meshgrid(down, right, indexing="ij")
    return np.stack([np.ones_like(down), right, down, right * right, right * down, down * down], axis=-1)
