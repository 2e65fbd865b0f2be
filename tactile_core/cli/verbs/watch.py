"""``tactile watch``: show a recording live while it is being made, or is played again."""

from __future__ import annotations

import argparse
import contextlib
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from ...errors import TactileError
from ...files.threads import one_thread
from ..terminal import say, tell
from .common import UNIT, add, columns_of

if TYPE_CHECKING:
    import numpy as np

    from ...jobs.live.playback import Output

BRIEF = "show a recording live while it is being written"
TEXT = """\
Follow a CSV recording while another program writes it, and show the newest frame's DIGIT picture: in a window, or in
a PNG file that is replaced with each picture. --serve publishes the frames for other programs of this machine
(docs/read_frames.py reads them), and --camera shows the camera of a real DIGIT beside the simulated picture.
With --play or --rosbag-play a finished recording is played at its own pace, or --speed times as fast. Rest is taken
from the first quiet part, so begin without contact; or name frames by --tare, or a unit's known rest by --sensor.
The time from frame to picture, and how much of it was computing, is printed each second and at the end."""
EPILOG = """\
examples:
  tactile watch touch.csv
  tactile watch touch.csv --out now.png --idle 10
  tactile watch touch.csv --play --tare 0:50 --sensor sensor.toml
  tactile watch touch.csv --serve 7311 --camera 0
  tactile watch --rosbag-play touch.bag --speed 2"""


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("recording", nargs="?", metavar="PATH", help="a CSV file that grows; with --play any recording")
    verb.add_argument("--play", action="store_true", help="play a finished recording, of any layout, bags too")
    verb.add_argument("--rosbag-play", metavar="FILE", help="play this ROS 1 or 2 bag or MCAP file (bag#topic/finger2)")
    verb.add_argument(
        "--speed",
        type=float,
        metavar="X",
        help="with --play: multiple of the recording's own pace; 0: every frame, as fast as it is drawn (default: 1)",
    )
    verb.add_argument("--out", metavar="FILE", help="write each picture to this PNG file instead of a window")
    verb.add_argument(
        "--serve",
        type=int,
        metavar="PORT",
        help="publish each frame by ZeroMQ at this port, for programs of this machine (0: any free port); no window",
    )
    verb.add_argument(
        "--camera",
        metavar="N|FILE",
        help="show a real DIGIT's camera, by number (0: /dev/video0) or from a video file, beside the simulated one",
    )
    verb.add_argument("--idle", type=float, metavar="S", help="end after S s without a new frame (default: never)")
    verb.add_argument("--rate", type=float, metavar="HZ", help="its rate (default: as its stamps say, 100 without)")
    add(verb, "--polarity", "--columns")
    add(verb, "--tare", among=", of the first 10 s,")
    add(verb, *UNIT)


def run(options: argparse.Namespace) -> int:
    """Show the newest frames until the recording ends, the window is closed, or Ctrl-C; returns the exit status."""
    one_thread()  # before numpy is imported
    from ...jobs import convert, live
    from ...jobs.frame_pass import describe_gel
    from ...recordings import PrepareOptions
    from ...recordings.opened_file import container_of
    from ...recordings.readers import sensor_of_first
    from ...recordings.recording import split
    from ...recordings.tables.column_map import refuse_bag

    _check(options)
    path = options.recording if options.rosbag_play is None else options.rosbag_play
    container = container_of(path)
    playing = options.play or options.rosbag_play is not None
    if options.rosbag_play is not None and container != "bag":
        raise TactileError(path, "no bag", "a ROS 1 or 2 bag, or MCAP", "Play others with --play")
    if container != "csv" and not playing:
        raise TactileError(path, f"a finished recording ({container})", "a CSV file that grows", "Play it: add --play")
    columns = columns_of(options)
    if columns is not None:
        refuse_bag(path, container)
    speed = 1.0 if options.speed is None else options.speed
    sensor = None if options.weights else sensor_of_first([path], columns)
    asked = convert.ToolOptions(options.weights, options.calibration, target=options.target, source=sensor)
    tools = convert.load_tools(asked)
    sensor = tools.translator.source
    if playing:
        source = live.played(path, speed, say, columns, sensor)
    else:
        source = live.followed(path, options.idle, say, columns, sensor, wait=options.rate is None)
    prepare = PrepareOptions(tare=None if options.tare == "auto" else options.tare, polarity=options.polarity)
    unit = None
    if options.sensor is not None:
        from ...recordings import electrode_gains  # reads by msgspec

        unit = electrode_gains.read(options.sensor).gains_for(path, split(path).section, options.sensor, sensor)
    view = live.View(tools, options.rate, prepare, unit)
    for sentence in describe_gel(tools.drawer.target, tools.drawer.found_on):
        say(sentence)
    with contextlib.ExitStack() as opened:
        camera = None
        if options.camera is not None:
            camera = opened.enter_context(contextlib.closing(live.DigitCamera(options.camera)))
        live.watch(source, view, camera, _outputs(options, path, opened), say, tell)
    return 0


def _check(options: argparse.Namespace) -> None:
    """Raise TactileError for options that do not go together."""
    if (options.recording is None) == (options.rosbag_play is None):
        raise TactileError("tactile watch", "no recording, or two", "PATH or --rosbag-play FILE")
    if options.serve is not None and not 0 <= options.serve < 2**16:
        raise TactileError("--serve, port", f"{options.serve}", "0 to 65535")
    from ...jobs.live.live_view import LEAST_RATE, MOST_RATE

    if options.rate is not None and not LEAST_RATE <= options.rate <= MOST_RATE:
        raise TactileError("--rate", f"{options.rate:g}", f"{LEAST_RATE:g} to {MOST_RATE:g} Hz")
    if options.speed is not None:
        if not (options.play or options.rosbag_play):
            raise TactileError("--speed", f"{options.speed:g}", "--play or --rosbag-play beside it")
        if not 0 <= options.speed <= 1000:
            raise TactileError("--speed", f"{options.speed:g}", "0 to 1000")
    if options.idle is not None:
        if options.play or options.rosbag_play:
            raise TactileError("--idle", "given with a finished recording", "one that grows", "Leave it out")
        if not 0 <= options.idle < math.inf:
            raise TactileError("--idle", f"{options.idle:g}", "seconds, 0 or more")
    if options.out is not None:
        from ...files import atomic
        from ...files.png_writer import SIGNATURE

        atomic.claim_over(options.out, SIGNATURE, "PNG picture", "Name another --out")


def _outputs(options: argparse.Namespace, path: str, opened: contextlib.ExitStack) -> list[Output]:
    """Return the outputs of frames: file and port, or a window if neither is asked for. ``opened`` closes the port."""
    outputs: list[Output] = []
    if options.serve is not None:
        from ...jobs.live import FrameServer

        server = opened.enter_context(contextlib.closing(FrameServer(options.serve)))
        say(f"serving frames at {server.address}, to programs of this machine alone")
        outputs.append(server.send)
    if options.out is not None:
        outputs.append(_drawn(_file(options.out)))
    return outputs or [_drawn(_window(path))]


def _drawn(draw: Callable[[np.ndarray], bool]) -> Output:
    """Return an output that draws a frame's pictures side by side. draw : takes (H, W, 3) uint8, returns false once
    closed"""
    import numpy as np

    return lambda shown, seen: draw(np.concatenate(list(seen.values()), axis=1))


def _file(path: str) -> Callable[[np.ndarray], bool]:
    """Return a function that writes a picture (H, W, 3) to a file, which is complete at every moment."""
    from ...files import atomic
    from ...files.png_writer import pack_png

    def draw(picture: np.ndarray) -> bool:
        with atomic.writing(path, "a file in a writable folder", ""):
            atomic.write_bytes(path, pack_png(picture))
        return True

    return draw


def _window(title: str) -> Callable[[np.ndarray], bool]:
    """Return a function that shows a picture (H, W, 3) and returns False once the window is closed. Raises TactileError
    without a display."""
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
