"""Frames for other programs: what the page's reader reads of them, and what watch publishes."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import fake_tools
import numpy as np
import pytest

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs import convert, live
from tactile_core.jobs.live.frame_server import FORMAT, GREETING, MOST, READY, message
from tactile_core.jobs.live.live_view import Shown

READER = Path(__file__).resolve().parents[3] / "docs" / "read_frames.py"
PICTURE = np.arange(4 * 3 * 3, dtype=np.uint8).reshape(4, 3, 3)


def shown(frame: int = 7, force: float = 1.5) -> Shown:
    return Shown(frame, PICTURE, np.array([0.0, force, 0.0]), 0.01, 0.008, 0.25, 64, "guess")


@pytest.fixture
def zmq():
    return pytest.importorskip("zmq", reason="pyzmq is absent: pip install tactile-core[live]")


def test_a_message_is_a_line_of_json_and_the_arrays_bytes():
    heights = np.linspace(0, 1, 12, dtype=np.float32).reshape(3, 4).T  # not contiguous: sent row by row all the same
    header, _, raw = message(shown(), {"picture": PICTURE, "heights": heights}).partition(b"\n")
    found = json.loads(header)
    assert (found["format"], found["frame"], found["force_n"], found["latency_s"]) == (FORMAT, 7, 1.5, 0.01)
    assert (found["confidence"], found["flags"], found["trust"]) == (0.25, 64, "guess")
    assert found["arrays"] == [["picture", "|u1", [4, 3, 3]], ["heights", "<f4", [4, 3]]]
    assert raw == PICTURE.tobytes() + np.ascontiguousarray(heights).tobytes()
    assert json.loads(message(shown(force=np.nan), {}))["force_n"] is None


def test_the_page_s_reader_reads_what_is_served_on_this_machine_alone(zmq):
    server, ended = live.FrameServer(0), threading.Event()
    assert server.address.startswith("tcp://127.0.0.1:")
    command = [sys.executable, READER, server.address.rpartition(":")[2]]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as reader:

        def serve():
            while not ended.wait(0.01):
                server.send(shown(), {"picture": PICTURE, "camera": PICTURE + 1})

        sending = threading.Thread(target=serve)
        sending.start()
        line = reader.stdout.readline()
        ended.set()
        sending.join()
        reader.kill()
    server.close()
    frame, force, confidence, levels = line.split(maxsplit=3)
    assert (frame, force, confidence) == ("7", "1.5", "0.25")
    np.testing.assert_allclose(np.array(levels.strip("[]\n ").split(), float), PICTURE.mean(axis=(0, 1)))


CODE = """
import resource
import numpy as np
from tactile_core.cli.main import stopping
from tactile_core.jobs.live.frame_server import FrameServer
from tactile_core.jobs.live.live_view import Shown
import time
used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
server, picture = FrameServer(0), np.zeros((320, 240, 3), np.uint8)
print(server.address, flush=True)
try:
    with stopping():
        for frame in range(10**9):
            server.send(Shown(frame, picture, np.zeros(3), 0.01, 0.008, 1.0, 0, ""), {"picture": picture})
            time.sleep(0.01)
except KeyboardInterrupt as stop:
    server.close()
    print(stop, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - used)
"""


def subscription(word: bytes) -> bytes:
    return b"\x02" + (1 + len(word)).to_bytes(8, "big") + b"\x01" + word


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGTERM to hear")
def test_what_readers_subscribe_to_costs_neither_memory_nor_frames_nor_the_end(zmq):
    """Four strangers subscribe to 50 MB each, one to very many words; others say nothing, and take all places."""
    words = [subscription(bytes([number]) * 50_000_000) for number in range(4)]
    words.append(b"".join(subscription(b"%d" % number) for number in range(1_000_000)))
    with subprocess.Popen([sys.executable, "-c", CODE], stdout=subprocess.PIPE, text=True) as child:
        address = child.stdout.readline().strip()
        host, port = address.removeprefix("tcp://").split(":")
        strangers = [socket.create_connection((host, int(port))) for _ in range(MOST + 5)]
        for stranger, word in zip(strangers, words, strict=False):
            threading.Thread(target=said, args=(stranger, word), daemon=True).start()
        for stranger in strangers[5:]:
            stranger.close()
        reader = zmq.Context().socket(zmq.SUB)
        reader.subscribe(b"")
        reader.connect(address)  # again and again, until a place is free
        for _ in range(100):
            assert reader.poll(60_000)
            reader.recv()
        child.send_signal(signal.SIGTERM)
        word, kilobytes = child.stdout.read().split()
        reader.context.destroy(linger=0)
    assert word == "SIGTERM" and int(kilobytes) < 64_000  # a frame for each of 64 readers would be 15,000


def said(stranger: socket.socket, word: bytes) -> None:
    with suppress(OSError):  # ended by the server
        stranger.sendall(GREETING + READY.replace(b"PUB", b"SUB") + word)


def test_without_a_reader_nothing_is_waited_for_and_a_port_is_had_once(zmq):
    server = live.FrameServer(0)
    for frame in range(2000):  # far more than are kept for anybody
        server.send(shown(frame), {"picture": PICTURE})
    with pytest.raises(TactileError, match="free port"):
        live.FrameServer(int(server.address.rpartition(":")[2]))
    server.close()


def test_watch_publishes_every_picture(slide_csv, monkeypatch, capsys):
    published = []

    class Server:
        address = "tcp://127.0.0.1:7311"

        def __init__(self, port: int) -> None:
            assert port == 7311

        def send(self, shown: Shown, arrays: dict[str, np.ndarray]) -> bool:
            published.append((shown.frame, arrays["picture"]))
            return True

        def close(self) -> None:
            published.append(None)

    monkeypatch.setattr(live, "FrameServer", Server)
    monkeypatch.setattr(convert, "load_tools", lambda *files, **options: fake_tools.tools())
    assert main(["watch", str(slide_csv(frames=90)), "--play", "--speed", "0", "--serve", "7311"]) == 0
    assert "serving frames at tcp://127.0.0.1:7311" in capsys.readouterr().err
    *frames, end = published
    assert end is None and len(frames) > 20 and frames[-1][0] == 89
    assert 50 < frames[-1][1][0, -1, 0] < 70  # grey levels, of the last frame's press
