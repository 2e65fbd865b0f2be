"""Serve frames to other programs on this machine, in a ZeroMQ message each.

A message is one line of JSON and then the bytes of the arrays that it names, one after the other; docs/read_frames.py
reads it. The publisher's half of ZeroMQ's protocol (ZMTP 3.0, rfc.zeromq.org/spec/23) is written here: the library's
own publisher stores subscriptions of strangers without limit, in the thread that sends."""

from __future__ import annotations

import json
import math
import socket
import threading
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from ...errors import TactileError

if TYPE_CHECKING:
    from .live_view import Shown

FORMAT = "tactile-frame-1"
HOST = "127.0.0.1"  # this machine alone
MOST = 64  # readers at a time (assumed); further ones are turned away
PATIENCE = 5.0  # s that a reader may take nothing (assumed), after which its place is another's
GREETING = b"\xff" + 8 * b"\0" + b"\x7f\x03\0" + b"NULL".ljust(20, b"\0") + 32 * b"\0"  # version 3.0, no encryption
READY = b"\x04\x19\x05READY\x0bSocket-Type" + (3).to_bytes(4, "big") + b"PUB"


class FrameServer:
    """Publisher of frames at a port of this machine, open to all its users; slow readers do not delay the view.

    port : 0 for any free one; address : tcp://127.0.0.1:PORT. Raises TactileError for a port that is not available.
    Whatever readers send is ignored: their libraries drop what they did not subscribe to. A slow one misses frames."""

    def __init__(self, port: int) -> None:
        try:
            self._listener = socket.create_server((HOST, port))
        except OSError as error:
            found = f"{port}: {error.strerror or error}"
            raise TactileError("--serve, port", found, "a free port of this machine", "0 takes any") from error
        self.address = f"tcp://{HOST}:{self._listener.getsockname()[1]}"
        self._news, self._message, self._sent, self._closed = threading.Condition(), b"", 0, False
        self._places = threading.BoundedSemaphore(MOST)
        threading.Thread(target=self._accept, daemon=True).start()

    def send(self, shown: Shown, arrays: dict[str, np.ndarray]) -> bool:
        """Publish a frame and its arrays, name -> array, without waiting for a reader. Return true: `watch` goes on."""
        content = message(shown, arrays)
        with self._news:
            self._message, self._sent = b"\x02" + len(content).to_bytes(8, "big") + content, self._sent + 1
            self._news.notify_all()
        return True

    def close(self) -> None:
        """Close the port; readers lose the connection."""
        with self._news:
            self._closed = True
            self._news.notify_all()
        with suppress(OSError):  # macOS refuses it, and wakes the waiting thread by closing alone
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _accept(self) -> None:
        """Accept readers, each served by a thread of its own, until the port is closed."""
        with suppress(OSError):
            while True:
                reader, _ = self._listener.accept()
                if self._places.acquire(blocking=False):
                    threading.Thread(target=self._feed, args=(reader,), daemon=True).start()
                else:
                    reader.close()

    def _feed(self, reader: socket.socket) -> None:
        """Send a reader the newest message whenever there is one, until it leaves or blocks."""
        sent = self._sent
        with reader, suppress(OSError):
            reader.settimeout(PATIENCE)
            reader.sendall(GREETING + READY)
            while True:
                with self._news:
                    while not (self._closed or self._sent > sent):
                        self._news.wait()
                    content, sent = self._message, self._sent
                if self._closed:
                    break
                reader.sendall(content)
        self._places.release()


def message(shown: Shown, arrays: dict[str, np.ndarray]) -> bytes:
    """Return a frame's header in JSON, a line feed, and its arrays' bytes, row by row.

    The header has frame, its index; force_n, and confidence 0..1, null if unknown; flags, bits of
    ``recordings.flags``; trust, these in words; latency_s, from the newest row to the picture; arrays, a list of
    (name, numpy's type, shape)."""
    known = math.isfinite(shown.newtons + shown.confidence)  # JSON has no NaN
    header = {
        "format": FORMAT,
        "frame": shown.frame,
        "force_n": shown.newtons if known else None,
        "confidence": shown.confidence if known else None,
        "flags": shown.flags,
        "trust": shown.words,
        "latency_s": shown.latency,
        "arrays": [[name, array.dtype.str, array.shape] for name, array in arrays.items()],
    }
    return json.dumps(header).encode() + b"\n" + b"".join(array.tobytes() for array in arrays.values())
