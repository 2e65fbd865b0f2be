"""Read the camera of a real DIGIT, or a video: its newest picture, upright as simulated ones are."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np

from ...errors import TactileError

_WIDTH, _HEIGHT, _RATE = 320, 240, 60  # the DIGIT's faster mode (digit-interface, QVGA)
_LEAST_RATE = 1.0  # frames per second of a video file that states less
_LONGEST_READ = 2.0  # s, waited at the end for a camera that hangs


class DigitCamera:
    """A DIGIT's camera, read in a thread of its own, so that a slow or vanished one blocks nothing.
    source : number of a camera (0 is /dev/video0), or a video file, which is played at its own rate
    lost : true once no more pictures come
    Raises TactileError for a source that cannot be opened, ModuleNotFoundError without the extra [camera]."""

    def __init__(self, source: str) -> None:
        is_device = source.isdigit()
        if not is_device and not Path(source).is_file():
            expected = "the number of a camera (0 is /dev/video0), or a regular file that holds a video"
            raise TactileError("--camera", f"{source}, which is neither", expected)
        import cv2

        self._capture = cv2.VideoCapture(int(source) if is_device else source)
        if not self._capture.isOpened():
            raise TactileError("--camera", f"{source}, which OpenCV cannot open", "a camera or video", "Plug it in")
        self._pause = 0.0
        if is_device:
            for what, value in ((cv2.CAP_PROP_FRAME_WIDTH, _WIDTH), (cv2.CAP_PROP_FRAME_HEIGHT, _HEIGHT)):
                self._capture.set(what, value)
            self._capture.set(cv2.CAP_PROP_FPS, _RATE)
        else:
            self._pause = 1 / max(self._capture.get(cv2.CAP_PROP_FPS), _LEAST_RATE)
        self.lost = False
        self._newest: np.ndarray | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        while not self._ended.is_set():
            good, frame = self._capture.read()
            if not good:
                self.lost = True
                return
            self._newest = frame
            self._ended.wait(self._pause)

    def picture(self, shape: tuple[int, ...]) -> np.ndarray:
        """Return the newest picture, uint8 of a shape (H, W, 3), upright; black before the first and once lost."""
        import cv2

        frame = self._newest
        if frame is None or self.lost:
            return np.zeros(shape, np.uint8)
        upright = np.rot90(frame) if frame.shape[1] > frame.shape[0] else frame
        colours = np.ascontiguousarray(upright[..., ::-1])  # OpenCV's are blue, green, red
        return cv2.resize(colours, (shape[1], shape[0]), interpolation=cv2.INTER_AREA)

    def close(self) -> None:
        """Release the camera."""
        self._ended.set()
        self._thread.join(_LONGEST_READ)
        if not self._thread.is_alive():
            self._capture.release()
