"""Videos of presses: the deepest frame of each press is taken, and some of the untouched gel."""

import sys

import numpy as np
import pytest
from plain_unit import plain_unit
from pressed_unit import PLACES, drawn, photograph

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.pictures.calibrate import video_frames
from tactile_core.pictures.calibrate.photographs import read_photographs
from tactile_core.pictures.height_map import rest_height_map

UNIT = plain_unit()
PRESS = (0.0, 0.0, 0.4, 0.8, 1.0, 0.8, 0.4, 0.0)  # of the depth, frame by frame


@pytest.fixture(scope="module", params=[("presses.avi", "MJPG"), ("presses.mp4", "mp4v")], ids=lambda name: name[0])
def video(request, tmp_path_factory):
    cv2 = pytest.importorskip("cv2", reason="OpenCV is absent: pip install tactile-core[camera]")
    name, codec = request.param
    path, noise = tmp_path_factory.mktemp("video") / name, np.random.default_rng(0)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*codec), 30, (240, 320))
    rest = rest_height_map(UNIT.camera)
    for right, down, depth in PLACES[:3]:
        for share in PRESS:
            place = right, down, share * depth
            frame = photograph(UNIT, place, noise) if share else drawn(UNIT, rest, noise)
            writer.write(np.ascontiguousarray(frame[..., ::-1]))
    writer.release()
    return path


def test_a_video_is_a_folder_of_its_deepest_frames(video):
    found = read_photographs(video)
    assert [press.name for press in found.presses] == [f"{video.name}#{number}" for number in (4, 12, 20)]
    assert len(found.untouched) == video_frames.UNTOUCHED
    assert np.abs(found.background - 128).mean() < 3  # grey levels; the codecs lose .5 and 2.3
    # Red, green, blue: exchanged they are 9 levels off, and what the codecs lose and noise together 1.1 and 2.2.
    assert np.abs(found.presses[0].picture - photograph(UNIT, PLACES[0]).astype(float)).mean() < 3
    beside = read_photographs(video.parent)
    assert [press.name for press in beside.presses] == [press.name for press in found.presses]


def test_long_and_strange_videos_are_refused(video, tmp_path, monkeypatch):
    (tmp_path / "none.mp4").write_bytes(b"no video")
    with pytest.raises(TactileError, match=r"none\.mp4: no frame that OpenCV can read"):
        read_photographs(tmp_path / "none.mp4")
    with pytest.raises(TactileError, match=r"absent\.avi: is no file"):
        read_photographs(tmp_path / "absent.avi")
    for limit, said in (("MOST_FRAMES", "more than 5 frames"), ("MOST_PIXELS", "240 x 320 pixels")):
        with monkeypatch.context() as patch, pytest.raises(TactileError, match=said):
            patch.setattr(video_frames, limit, 5)
            read_photographs(video)


def test_without_opencv_the_verb_says_what_to_install(tmp_path, monkeypatch, capsys):
    (tmp_path / "presses.mp4").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "cv2", None)
    words = ["calibrate", str(tmp_path / "presses.mp4"), "--ball-diameter", "6", "--out", str(tmp_path / "unit.toml")]
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "needs cv2" in said and "camera" in said
    assert not (tmp_path / "unit.toml").exists()


def test_no_more_frames_than_wanted_are_taken():
    changed = np.tile([0, 0, 9, 30, 9, 0], 100)
    changed[9] = 3 * video_frames.LEAST  # one press hardly touches
    wanted = video_frames._wanted(changed)
    assert sum(changed[number] == 30 for number in wanted) == video_frames.MOST_PRESSES
    assert len(wanted) == video_frames.MOST_PRESSES + video_frames.UNTOUCHED
