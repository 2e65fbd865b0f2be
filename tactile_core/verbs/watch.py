"""``tactile watch``: a live view of a recording that is being made, or is played again."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from ..errors import TactileError
from ..terminal import say, tell
from .common import NOTHING

if TYPE_CHECKING:
    import numpy as np

    from ..recordings import Recording

BRIEF = "live view of a recording that is being written"
TEXT = """\
Follow a CSV recording while another program writes it, and show the newest frame's DIGIT picture: in a window, or in
a PNG file that is replaced with each picture. With --play a finished recording of any layout, bags too, is played at
its own pace. Rest is taken from the first quiet part: begin without contact. The time from frame to picture is told
each second and at the end."""
EPILOG = """\
examples:
  tactile watch touch.csv
  tactile watch touch.csv --out now.png --idle 10
  tactile watch touch.bag --play"""
LEAVES = NOTHING
POLL = 0.002  # s between two looks at the file
TOLD = 1.0  # s between two lines of figures


def arguments(verb: argparse.ArgumentParser) -> None:
    """Of this verb."""
    verb.add_argument("recording", metavar="PATH", help="a CSV file that grows; with --play any recording")
    verb.add_argument("--play", action="store_true", help="play a finished recording at its own pace")
    verb.add_argument("--out", metavar="FILE", help="write each picture to this PNG file instead of a window")
    verb.add_argument("--idle", type=float, metavar="S", help="end when no frame came for S seconds (default: never)")
    verb.add_argument("--rate", type=float, default=100.0, metavar="HZ", help="of the recording (default: 100)")
    verb.add_argument("--weights", metavar="DIR", help="networks of your own training instead of the shipped ones")


def run(options: argparse.Namespace) -> int:
    """Show until the recording ends, the window is closed, or Ctrl-C."""
    from .. import live
    from ..convert import load_tools

    if not 1 <= options.rate <= 1e4:
        raise TactileError("--rate", f"{options.rate:g}", "1 to 10,000 Hz")
    source = _played(options) if options.play else _followed(options)
    view = live.View(load_tools(options.weights), options.rate)
    draw = _window(options.recording) if options.out is None else _file(options.out)
    told = time.perf_counter()
    try:
        for rows, came in source:
            shown = None if rows is None else view.show(rows, came)
            if shown is not None and not draw(shown.picture):
                break
            if time.perf_counter() - told >= TOLD:
                told = time.perf_counter()
                say(view.told() + (f"; force {shown.force:.2f} N" if shown else ""))
    finally:
        say(f"rest from {view.rest_found}" if view.rest_found else "rest was not found")
        tell(f"{view.frames} frames: {view.told()}")
    return 0


def _followed(options: argparse.Namespace) -> Iterator[tuple[Recording | None, float]]:
    """New rows of a growing file and when they came; None now and then while there are none."""
    from ..live import Growing

    growing, last = Growing(options.recording), time.perf_counter()
    while options.idle is None or time.perf_counter() - last < options.idle:
        came = time.perf_counter()
        rows = growing.poll()
        if rows is None:
            time.sleep(POLL)
        else:
            last = came
        yield rows, came


def _played(options: argparse.Namespace) -> Iterator[tuple[Recording | None, float]]:
    """The rows of a finished recording when their time has come."""
    import dataclasses

    import numpy as np

    from .. import recordings

    whole = recordings.read(options.recording)
    began, done = time.perf_counter(), 0
    while done < len(whole):
        due = int(np.searchsorted(whole.time, time.perf_counter() - began, side="right"))
        if due <= done:
            time.sleep(POLL)
            continue
        yield dataclasses.replace(whole, electrodes=whole.electrodes[done:due]), time.perf_counter()
        done = due


def _file(path: str) -> Callable[[np.ndarray], bool]:
    """Writes pictures to a file that is always whole."""
    import io

    from .. import atomic
    from ..png_file import write_png

    def draw(picture: np.ndarray) -> bool:
        out = io.BytesIO()
        write_png(out, picture)
        try:
            atomic.write_bytes(path, out.getvalue())
        except OSError as error:
            raise TactileError(path, f"cannot be written ({error.strerror})", "a file in a writable folder") from error
        return True

    return draw


def _window(title: str) -> Callable[[np.ndarray], bool]:
    """Shows pictures in a window; False when it was closed. Raises TactileError without a display."""
    from matplotlib import pyplot

    if pyplot.get_backend().lower() == "agg":
        raise TactileError("the window", "no display", "a screen", "Write the pictures to a file: --out now.png")
    figure, axes = pyplot.subplots(num=title, figsize=(3, 4))
    axes.set_axis_off()
    shown = None

    def draw(picture: np.ndarray) -> bool:
        nonlocal shown
        if shown is None:
            shown = axes.imshow(picture)
            pyplot.show(block=False)
        shown.set_data(picture)
        figure.canvas.draw_idle()
        figure.canvas.flush_events()
        return pyplot.fignum_exists(figure.number)

    return draw
