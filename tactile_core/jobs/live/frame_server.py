"""Frames for other programs on this machine: a ZeroMQ message each, to whoever listens.

A message is one line of JSON and then the bytes of the arrays that it names, one after the other;
docs/read_frames.py reads it.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np

from ...errors import TactileError

if TYPE_CHECKING:
    from .live_view import Shown

FORMAT = "tactile-frame-1"
HOST = "127.0.0.1"  # this machine alone
_KEPT = 2  # messages for a reader that is slow; what comes meanwhile it does not get


class FrameServer:
    """Publishes frames at a port of this machine: whether anybody reads them, and how fast, changes nothing here.

    port : 0 for any free one. Every user of this machine can read them.
    Raises TactileError for a port that cannot be had, ModuleNotFoundError without the extra [live].
    """

    def __init__(self, port: int) -> None:
        import zmq

        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.PUB)
        self._socket.set(zmq.SNDHWM, _KEPT)
        self._socket.set(zmq.LINGER, 0)
        try:
            self._socket.bind(f"tcp://{HOST}:{'*' if port == 0 else port}")
        except zmq.ZMQError as error:
            self.close()
            found = f"{port}: {error.strerror or error}"
            raise TactileError("--serve, port", found, "a free port of this machine", "0 takes any") from error
        self.address = self._socket.get(zmq.LAST_ENDPOINT).rstrip(b"\0").decode()

    def send(self, shown: Shown, arrays: dict[str, np.ndarray]) -> None:
        """Publish a frame; never waits for a reader."""
        self._socket.send(message(shown, arrays))

    def close(self) -> None:
        """Close the port."""
        self._context.destroy(linger=0)


def message(shown: Shown, arrays: dict[str, np.ndarray]) -> bytes:
    """Return a frame's header in JSON, a line feed, and its arrays' bytes, row by row.

    Of the header: frame, its index; force_n; latency_s, from the newest row to the picture; arrays, a name, a type of
    numpy's and a shape each.
    """
    header = {
        "format": FORMAT,
        "frame": shown.frame,
        "force_n": shown.newtons if math.isfinite(shown.newtons) else None,  # JSON has no NaN
        "latency_s": shown.latency,
        "arrays": [[name, array.dtype.str, array.shape] for name, array in arrays.items()],
    }
    return json.dumps(header).encode() + b"\n" + b"".join(array.tobytes() for array in arrays.values())
