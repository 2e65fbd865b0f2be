"""Draw by Mitsuba's presets in another process, so that Blender lives on if a native library aborts there."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import shutil
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ...tactile_core.errors import TactileError
from ...tactile_core.pictures.mitsuba.gel_scene import Surroundings
from ...tactile_core.sensors import calibration_file
from ...tactile_core.sensors.calibration import Calibration
from .jobs import Job, JobFolder

_LOOK = 0.05  # s between two looks at the worker and at Esc
_IDLE = 60.0  # s


def write_unit(folder: Path, unit: Calibration) -> None:
    """Write a unit's calibration into a job's folder, and beside it the photograph that it names."""
    calibration_file.write_calibration(folder / "unit.toml", unit)
    if unit.photograph:
        shutil.copyfile(unit.photograph, folder / Path(unit.photograph).name)


class Stopped(Exception):
    """Error that ends a drawing once the user has stopped it, as by Esc."""


class Tracer:
    """A worker that draws pictures of height maps by one preset until it is closed. Each picture may be of another unit
    and of other surroundings, the scene's other lamps and bodies."""

    def __init__(self, preset: str) -> None:
        self._folder, self._count, self._unit = JobFolder(), 0, ""
        self._job = Job("render", self._folder.path, listening=True, preset=preset)

    def prepare(self, unit: Calibration, around: Surroundings) -> None:
        """Let the worker make its scene, compile, and draw the gel at rest, before a picture is asked for."""
        self._tell_unit(unit, around)
        self._job.tell({"unit": self._unit})

    def draw(
        self,
        unit: Calibration,
        around: Surroundings,
        heights: np.ndarray,
        stopped: Callable[[], bool],
        better: Callable[[np.ndarray], None],
    ) -> np.ndarray:
        """Draw the picture (H, W, 3) uint8 of heights (H, W) m.

        stopped : called again and again; once it returns true, Stopped is raised
        better : called with noisier pictures, which come before the one that is returned. Raises TactileError.
        """
        self._count += 1
        drawn = self._job.drawn
        self._tell_unit(unit, around)
        np.save(self._folder.path / "heights.npy", heights)
        self._job.tell({"picture": self._count, "unit": self._unit})
        while self._job.done < self._count:
            if self._job.poll(_LOOK):
                raise TactileError("Tactile render", "the worker ended early", "a picture", "Render again")
            if stopped():
                raise Stopped
            if self._job.drawn > drawn and self._job.done < self._count:
                drawn = self._job.drawn
                better(self._picture())
        return self._picture()

    def _picture(self) -> np.ndarray:
        return np.load(self._folder.path / "picture.npy", allow_pickle=False)

    def _tell_unit(self, unit: Calibration, around: Surroundings) -> None:
        """Write unit and surroundings for the worker, unless it has them already."""
        bodies = [(body.vertices.tobytes(), body.faces.tobytes()) for body in around.occluders]
        key = hashlib.sha256(repr((unit, around.lamps, bodies)).encode()).hexdigest()
        if key == self._unit:
            return
        self._unit = key
        write_unit(self._folder.path, unit)
        lamps = [dataclasses.asdict(lamp) for lamp in around.lamps]
        (self._folder.path / "lamps.json").write_text(json.dumps(lamps), encoding="utf-8")
        arrays = {f"vertices_{k}": body.vertices for k, body in enumerate(around.occluders)}
        arrays |= {f"faces_{k}": body.faces for k, body in enumerate(around.occluders)}
        np.savez(self._folder.path / "bodies.npz", **arrays)

    def close(self) -> None:
        """End the worker process and remove its folder."""
        self._job.cancel()
        self._folder.close()


_kept: dict[str, Tracer] = {}  # one at most: starting Mitsuba takes seconds, the frames of an animation share it
_in_use = threading.Lock()  # Blender renders in a thread of its own
_last_used = 0.0  # s, of the clock that only grows


def draw(
    preset: str,
    unit: Calibration,
    around: Surroundings,
    heights: np.ndarray,
    stopped: Callable[[], bool],
    better: Callable[[np.ndarray], None],
) -> np.ndarray:
    """Draw a picture (H, W, 3) uint8 of heights (H, W) m by a preset's worker, which is kept for the next picture.
    stopped, better : of ``Tracer.draw``, which also says what is raised"""
    global _last_used
    with _in_use:
        if preset not in _kept:
            close_all()
            _kept[preset] = Tracer(preset)
        try:
            return _kept[preset].draw(unit, around, heights, stopped, better)
        except TactileError:
            close_all()  # the worker has ended: the next picture starts another
            raise
        finally:
            _last_used = time.monotonic()


def prepare(preset: str, unit: Calibration, around: Surroundings) -> None:
    """Start a preset's worker, get it ready for its first picture and end other workers; nothing if one is drawing."""
    global _last_used
    if preset in _kept or not _in_use.acquire(blocking=False):
        return
    try:
        close_all()
        _kept[preset] = Tracer(preset)
        _kept[preset].prepare(unit, around)
        _last_used = time.monotonic()
    finally:
        _in_use.release()


def close_idle() -> None:
    """End a worker that has drawn nothing for a minute."""
    if _kept and time.monotonic() - _last_used > _IDLE and _in_use.acquire(blocking=False):
        try:
            close_all()
        finally:
            _in_use.release()


def close_all() -> None:
    """End the workers of all presets."""
    while _kept:
        _kept.popitem()[1].close()
