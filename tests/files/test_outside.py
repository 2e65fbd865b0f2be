"""Files from outside: what is no regular file, too large, or leads out of its folder is refused, and nothing waits."""

import os
import socket
import threading

import pytest

from tactile_core.errors import TactileError
from tactile_core.files import outside
from tactile_core.sensors.calibration_file import SHIPPED, load_calibration
from tactile_core.translation import weights

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no named pipes in folders")


def pipe(path):
    os.mkfifo(path)


def bound_socket(path):
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(path))


def device(path):
    path.symlink_to("/dev/zero")


@pytest.mark.parametrize(("make", "said"), [(pipe, "a named pipe"), (bound_socket, "a socket"), (device, "a device")])
def test_what_is_no_regular_file_is_refused(make, said, tmp_path):
    make(tmp_path / "a")
    for ask in (outside.check, outside.open_file, lambda path: outside.read(path, 10)):
        with pytest.raises(TactileError, match=said):
            ask(tmp_path / "a")


def test_a_pipe_that_takes_the_files_place_after_the_look_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a"
    path.write_bytes(b"good")
    real = outside.check

    def exchanged(path, expected):
        found = real(path, expected)
        path.unlink()
        os.mkfifo(path)
        return found

    monkeypatch.setattr(outside, "check", exchanged)
    done = []

    def ask():
        with pytest.raises(TactileError, match="a named pipe"):
            outside.open_file(path)
        done.append(1)

    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    asking.join(60)
    assert done


def test_bytes_up_to_a_size(tmp_path):
    (tmp_path / "a").write_bytes(bytes(10))
    assert outside.read(tmp_path / "a", 10) == bytes(10)
    with pytest.raises(TactileError, match="more than 9 bytes"):
        outside.read(tmp_path / "a", 9)
    with pytest.raises(IsADirectoryError):
        outside.read(tmp_path, 9)
    with pytest.raises(FileNotFoundError):
        outside.read(tmp_path / "b", 9)


def test_links_stay_inside_of_their_folder(tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "secret").write_bytes(b"x")
    (folder / "own").write_bytes(b"x")
    (folder / "near").symlink_to("own")
    (folder / "out").symlink_to("../secret")
    (folder / "round").symlink_to("round")
    (tmp_path / "also").symlink_to(folder)
    assert outside.inside(folder, "near").read_bytes() == outside.inside(tmp_path / "also", "own").read_bytes() == b"x"
    for name in ("out", "../secret"):
        with pytest.raises(TactileError, match="a link out of its folder"):
            outside.inside(folder, name)


def test_neither_weights_nor_a_calibration_follow_a_link_out_of_their_folder(tmp_path):
    folder = tmp_path / "unit"
    folder.mkdir()
    (tmp_path / "secret").write_bytes(b"x")
    (folder / weights.CARD_NAME).symlink_to(tmp_path / "secret")
    with pytest.raises(TactileError, match="a link out of its folder"):
        weights.read_card(folder)
    (folder / "rest.png").symlink_to(tmp_path / "secret")
    text = SHIPPED.read_text(encoding="utf-8")
    (folder / "a.toml").write_text(text.replace('photograph = ""', 'photograph = "rest.png"'), encoding="utf-8")
    with pytest.raises(TactileError, match="a link out of its folder"):
        load_calibration(folder / "a.toml")
