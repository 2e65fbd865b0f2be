"""Show the newest frame of a growing recording as a picture, as soon as it is there."""

from .digit_camera import DigitCamera
from .frame_server import FrameServer
from .live_view import LiveSignals, Shown, View
from .playback import Growing, followed, played, watch

__all__ = ["DigitCamera", "FrameServer", "Growing", "LiveSignals", "Shown", "View", "followed", "played", "watch"]
