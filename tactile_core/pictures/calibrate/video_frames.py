"""Frames of a video of presses: the deepest of each press, and some of the untouched gel."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...errors import TactileError
from ...files import installed

SUFFIXES = (".avi", ".mp4", ".mov", ".mkv")
SMALL = (40, 40)  # px, of the pictures from which frames are chosen
MOST_FRAMES = 20_000  # at 60 per second five minutes; 100 MB of small pictures
MOST_PIXELS = 4_000_000  # of a frame
MOST_PRESSES, UNTOUCHED = 24, 8  # frames that are taken
CHANGE = 12.0  # grey levels in some channel, of a small pixel that a press has changed (assumed)
LEAST = 4  # small pixels that have changed: fewer are noise, or a ball that hardly touches (assumed)
SHALLOW = 0.3  # of the deepest press's change; a weaker peak is part of another press (assumed)


def frames_of(path: Path) -> dict[str, np.ndarray]:
    """Return frames (H, W, 3) uint8 by "FILE#NUMBER": the deepest of each press, and some of the untouched gel. Raises
    TactileError for a file that OpenCV cannot read or that is too long or large; ModuleNotFoundError without OpenCV."""
    installed.require("camera", "cv2")
    small = np.stack([_small(frame) for frame in _read(path)])
    change = np.abs(small - np.median(small, axis=0).astype(np.float32)).max(-1) > CHANGE
    wanted = _wanted(change.sum((1, 2)))
    return {
        f"{path.name}#{number}": np.ascontiguousarray(frame[..., ::-1])  # OpenCV's are blue, green, red
        for number, frame in enumerate(_read(path))
        if number in wanted
    }


def _wanted(changed: np.ndarray) -> set[int]:
    """Return the indices of the frames to take; changed : (n,), how many pixels of each, made small, have changed"""
    touched = np.r_[False, changed >= LEAST, False]
    edges = np.flatnonzero(touched[1:] != touched[:-1]).reshape(-1, 2)
    deepest = np.array([first + changed[first:end].argmax() for first, end in edges], int)
    deepest = deepest[changed[deepest] >= SHALLOW * changed.max()]
    return {*_spread(deepest, MOST_PRESSES), *_spread(np.flatnonzero(changed < LEAST), UNTOUCHED)}


def _spread(numbers: np.ndarray, most: int) -> list[int]:
    """Return at most ``most`` of the frames' indices ``numbers`` (n,), evenly spread."""
    places = np.linspace(0, len(numbers) - 1, min(most, len(numbers))).round().astype(int)
    return numbers[places].tolist()


def _small(frame: np.ndarray) -> np.ndarray:
    import cv2

    return cv2.resize(frame, SMALL, interpolation=cv2.INTER_AREA)


def _read(path: Path) -> Iterator[np.ndarray]:
    """Yield the frames (H, W, 3) uint8 of a video, blue, green, red."""
    import cv2

    expected = f"a video ({', '.join(SUFFIXES)}) of presses, of {MOST_FRAMES} frames at most"
    if not path.is_file():
        raise TactileError(path, "is no file", expected)
    capture, number = cv2.VideoCapture(str(path)), 0
    try:
        while True:
            good, frame = capture.read()
            if not good:
                break
            number += 1
            if number > MOST_FRAMES:
                raise TactileError(path, f"more than {MOST_FRAMES} frames", expected, "Cut it")
            if frame.shape[0] * frame.shape[1] > MOST_PIXELS:
                raise TactileError(path, f"{frame.shape[1]} x {frame.shape[0]} pixels", f"{MOST_PIXELS} at most")
            yield frame
    finally:
        capture.release()
    if not number:
        raise TactileError(path, "no frame that OpenCV can read", expected)
