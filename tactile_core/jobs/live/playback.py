"""Feed a view the rows of a recording that grows, or of a finished one at its own pace, and show what it draws."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ...errors import TactileError
from ...recordings import Recording
from ...recordings.chunks import read_parts
from ...recordings.tables.column_map import ColumnMap
from ...sensors import SOURCE
from .digit_camera import DigitCamera
from .growing_file import Growing
from .live_view import Shown, View

POLL = 0.002  # s between two looks at the file
LONGEST_WAIT = 10.0  # s without a frame that are played; a longer gap is skipped
REPORT_EVERY = 1.0  # s between two lines of numbers

Rows = Iterator[tuple[Recording | None, float]]  # new rows and when they came; None now and then without any
Output = Callable[[Shown, dict[str, np.ndarray]], bool]  # takes a frame and its pictures; false: it has ended
Say = Callable[[str], None]


def watch(source: Rows, view: View, camera: DigitCamera | None, outputs: Sequence[Output], say: Say, tell: Say) -> None:
    """Show until the rows end or an output does; say : takes a line of progress; tell : the summary at the end."""
    reported, failed, lost, silent = time.perf_counter(), False, False, False
    try:
        for rows, came in source:
            shown = None if rows is None else view.show(rows, came)
            if view.silent != silent:
                silent = view.silent
                say("the finger does not answer: no contact" if silent else "the finger answers")
            if shown is not None:
                seen = {"picture": shown.picture}
                if camera is not None:
                    seen["camera"] = camera.picture(shown.picture.shape)
                if not all(output(shown, seen) for output in outputs):
                    break
            if camera is not None and camera.lost and not lost:
                lost = True
                say("the camera gives no more pictures; watching goes on without it")
            if time.perf_counter() - reported >= REPORT_EVERY:
                reported = time.perf_counter()
                say(view.describe_latency() + (f"; force {shown.newtons:.2f} N" if shown else ""))
    except TactileError:
        failed = not view.frames
        raise
    finally:
        if not failed:
            say(f"rest from {view.rest_source}" if view.rest_source else "rest was not found")
            say(f"counts that {view.polarity.name[:-1]}: {view.polarity.evidence}")
            tell(f"{view.frames} frames: {view.describe_latency()}")


def followed(path: str, idle: float | None, say: Say, columns: ColumnMap | None = None, sensor: str = SOURCE) -> Rows:
    """Yield new rows of a growing file and their arrival time, s; None now and then while no row comes.

    idle : s without a row after which it ends; None: never. Raises what `Growing.poll` raises.
    """
    growing, last, bad = Growing(path, columns, sensor), time.perf_counter(), 0
    while idle is None or time.perf_counter() - last < idle:
        came = time.perf_counter()
        rows = growing.poll()
        if growing.bad > bad:
            bad = growing.bad
            say(f"{bad} of {growing.rows} rows were bad and are passed over")
        if rows is None:
            time.sleep(POLL)
        else:
            last = came
        yield rows, came


def played(path: str, speed: float, say: Say, columns: ColumnMap | None = None, sensor: str = SOURCE) -> Rows:
    """Yield the rows of a finished recording at their times, one part in memory at a time; speed 0: without waiting."""
    began = time.perf_counter()
    for part in read_parts(path, columns, sensor):
        recording, done = part.recording, part.repeated
        for warning in recording.warnings if not done else ():
            say(f"warning: {warning}")
        for warning in recording.warnings if not done else ():
            say(f"warning: {warning}")
        while done < len(recording):
            ahead = recording.time[done] / speed - (time.perf_counter() - began) if speed else 0.0
            if ahead > LONGEST_WAIT:
                say(f"nothing for {ahead:.0f} s before frame {done}: skipped")
                began -= ahead
            due = done + 1 if speed == 0 else _due(recording, speed * (time.perf_counter() - began))
            if due <= done:
                time.sleep(POLL)
                continue
            pdc = None if recording.pdc is None else recording.pdc[done:due]
            rows = dataclasses.replace(recording, electrodes=recording.electrodes[done:due], pdc=pdc)
            yield rows, time.perf_counter()
            done = due


def _due(recording: Recording, passed: float) -> int:
    """Return the number of frames whose time is within `passed` s of the first."""
    return int(recording.time.searchsorted(passed, side="right"))
