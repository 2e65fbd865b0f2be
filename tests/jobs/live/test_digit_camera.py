"""The camera of a real DIGIT, played from a video file: upright, beside the simulated picture, and gone at the end."""

import fake_tools
import numpy as np
import pytest
from PIL import Image

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs import convert, live

SHAPE = (320, 240, 3)


@pytest.fixture
def cv2():
    return pytest.importorskip("cv2", reason="OpenCV is absent: pip install tactile-core[camera]")


@pytest.fixture
def video(cv2, tmp_path):
    """Writes ``count`` frames as a DIGIT's camera gives them: lying, here red above and blue below, at 200 a second."""

    def write(count: int):
        path = tmp_path / "digit.avi"
        writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 200, (320, 240))
        frame = np.zeros((240, 320, 3), np.uint8)
        frame[:120, :, 2] = frame[120:, :, 0] = 250  # OpenCV's order is blue, green, red
        for _ in range(count):
            writer.write(frame)
        writer.release()
        return str(path)

    return write


def wait_for(true) -> None:
    """Wait until something is true, which the test's own time limit ends."""
    import threading

    while not true():
        threading.Event().wait(0.005)


def test_a_lying_picture_is_turned_upright_and_black_when_the_camera_is_gone(video):
    camera = live.DigitCamera(video(120))
    wait_for(lambda: camera.picture(SHAPE).any())
    seen = camera.picture(SHAPE).astype(int)
    assert seen.shape == SHAPE
    left, right = seen[20:-20, 20:100].mean(axis=(0, 1)), seen[20:-20, 140:-20].mean(axis=(0, 1))
    assert left[0] > 200 > 60 > left[2]  # the upper, red half comes to lie left: a quarter turn to the left
    assert right[2] > 200 > 60 > right[0]
    wait_for(lambda: camera.lost)
    assert not camera.picture(SHAPE).any()
    camera.close()


def test_watch_goes_on_when_the_camera_vanishes_and_says_so_once(video, slide_csv, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(convert, "load_tools", lambda *files, **options: fake_tools.tools())
    path = video(1)
    opened = live.DigitCamera(path)
    wait_for(lambda: opened.lost)
    monkeypatch.setattr(live, "DigitCamera", lambda source: opened)
    out = tmp_path / "now.png"
    command = ["watch", str(slide_csv(frames=90)), "--play", "--speed", "0", "--out", str(out), "--camera", path]
    assert main(command) == 0
    said = capsys.readouterr()
    assert said.out.startswith("90 frames: ") and said.err.count("watching goes on without it") == 1
    picture = np.asarray(Image.open(out))
    assert picture.shape == (320, 480, 3)
    assert 50 < picture[0, 239, 0] < 70 and not picture[:, 240:].any()  # the simulated one, and nothing beside it


@pytest.mark.parametrize("source", ["none.avi", "rtsp://camera", "97"])
def test_what_is_no_camera_is_said(cv2, source):
    with pytest.raises(TactileError, match="camera"):
        live.DigitCamera(source)
