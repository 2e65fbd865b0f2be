"""Mitsuba's presets in a process of their own: a native library that aborts there leaves Blender alive."""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.sensors import calibration_file
from ...tactile_core.sensors.calibration import Calibration
from .jobs import Job, JobFolder

_LOOK = 0.05  # s between two looks at the worker and at Esc


class Stopped(Exception):
    """The user has pressed Esc."""


class Tracer:
    """A worker that draws height maps by one preset of one calibration, until it is closed."""

    def __init__(self, unit: Calibration, preset: str) -> None:
        self._folder, self._count = JobFolder(), 0
        calibration_file.write_calibration(self._folder.path / "unit.toml", unit)
        self._job = Job("render", self._folder.path, listening=True, preset=preset)

    def draw(self, heights: np.ndarray, stopped: Callable[[], bool]) -> np.ndarray:
        """Picture (H, W, 3) uint8 of heights (H, W) m. Raises TactileError, or Stopped when asked to stop."""
        self._count += 1
        np.save(self._folder.path / "heights.npy", heights)
        self._job.tell({"picture": self._count})
        while self._job.done < self._count:
            if self._job.poll(_LOOK):
                raise TactileError("Tactile render", "the worker ended early", "a picture", "Render again")
            if stopped():
                raise Stopped
        return np.load(self._folder.path / "picture.npy", allow_pickle=False)

    def close(self) -> None:
        """End the worker."""
        self._job.cancel()
        self._folder.close()


_kept: dict[str, Tracer] = {}  # one at most: starting Mitsuba takes seconds, the frames of an animation share it


def tracer_for(unit: Calibration, preset: str) -> Tracer:
    """A running worker for this unit and preset."""
    key = hashlib.sha256(f"{preset} {unit!r}".encode()).hexdigest()
    if key not in _kept:
        close_all()
        _kept[key] = Tracer(unit, preset)
    return _kept[key]


def close_all() -> None:
    """End the workers."""
    while _kept:
        _kept.popitem()[1].close()
