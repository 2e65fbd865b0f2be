import json
import os
import re
import signal
import subprocess
import sys
import textwrap

import pytest

from tactile_core.errors import TactileError
from tactile_core.files import atomic


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "numbers.bin"
    path.write_bytes(b"old")
    with pytest.raises(RuntimeError), atomic.new_file(path) as partial:
        partial.write_bytes(b"half")
        raise RuntimeError
    assert path.read_bytes() == b"old"
    with atomic.new_file(path) as partial:
        partial.write_bytes(b"new")
        assert path.read_bytes() == b"old"
    assert path.read_bytes() == b"new"
    assert names(tmp_path) == ["numbers.bin"]


def test_json_is_the_same_for_equal_content_and_keeps_odd_file_names(tmp_path):
    atomic.write_json(tmp_path / "a", {"b": 1, "a": "Größe \udc80"})
    atomic.write_json(tmp_path / "b", {"a": "Größe \udc80", "b": 1})
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert json.loads((tmp_path / "a").read_text(encoding="utf-8"))["a"] == "Größe \udc80"
    with pytest.raises(ValueError, match="JSON"):
        atomic.write_json(tmp_path / "c", float("nan"))
    assert names(tmp_path) == ["a", "b"]


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    path = tmp_path / "result"
    with pytest.raises(RuntimeError), atomic.new_folder(path) as partial:
        (partial / "half").write_text("x")
        raise RuntimeError
    assert names(tmp_path) == []
    with atomic.new_folder(path) as partial:
        (partial / "first").write_text("x")
        assert not path.exists()
    with pytest.raises(TactileError, match="already exists"), atomic.new_folder(path):
        pass
    with pytest.raises(KeyboardInterrupt), atomic.new_folder(path, overwrite=True) as partial:
        raise KeyboardInterrupt
    assert names(path) == ["first"]
    with atomic.new_folder(path, overwrite=True) as partial:
        (partial / "second").write_text("x")
    assert names(path) == ["second"]
    assert names(tmp_path) == ["result"]


def test_an_exchange_cut_between_its_two_moves_is_undone(tmp_path):
    old = tmp_path / ".result.tactile-old"
    old.mkdir()
    (old / "kept").write_text("x")
    (tmp_path / ".result.tactile-partial").mkdir()
    with pytest.raises(TactileError, match="already exists"), atomic.new_folder(tmp_path / "result"):
        pass
    assert names(tmp_path) == ["result"]
    assert names(tmp_path / "result") == ["kept"]


WRITER = textwrap.dedent(
    """
    import sys
    from tactile_core.files import atomic
    with atomic.new_folder(sys.argv[1]) as partial:
        (partial / "half").write_text("x")
        print("writing", flush=True)
        sys.stdin.read()
    """
)


def start_writer(path) -> subprocess.Popen:
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout.readline() == "writing\n"
    return writer


def test_what_a_killed_writer_left_is_cleared_but_a_living_one_is_let_alone(tmp_path):
    path = tmp_path / "result"
    writer = start_writer(path)
    try:
        with pytest.raises(TactileError, match="another process"), atomic.new_folder(path):
            pass
        atomic.sweep(tmp_path)
        assert (tmp_path / ".result.tactile-partial" / "half").exists()
    finally:
        writer.kill()
        writer.wait()
        writer.stdin.close(), writer.stdout.close()
    assert not path.exists()
    atomic.sweep(tmp_path)
    assert names(tmp_path) == []


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")
def test_ctrl_c_leaves_nothing(tmp_path):
    writer = start_writer(tmp_path / "result")
    writer.send_signal(signal.SIGINT)
    assert writer.wait(timeout=30) != 0
    writer.stdin.close(), writer.stdout.close()
    assert names(tmp_path) == []


def test_sweep_lets_files_of_others_alone(tmp_path):
    (tmp_path / ".editor.lock").write_text("x")
    (tmp_path / ".editor.partial").mkdir()
    atomic.sweep(tmp_path)
    assert names(tmp_path) == [".editor.lock", ".editor.partial"]


@pytest.mark.skipif(os.name == "nt", reason="links and pipes of POSIX")
def test_what_a_stranger_put_in_a_temporary_place_is_not_written_through(tmp_path):
    (tmp_path / "victim").write_text("mine")
    (tmp_path / ".a.txt.tactile-partial").symlink_to(tmp_path / "victim")
    os.mkfifo(tmp_path / ".b.txt.tactile-partial")
    for name in ("a.txt", "b.txt"):
        atomic.write_bytes(tmp_path / name, b"new")
        assert (tmp_path / name).read_bytes() == b"new" and not (tmp_path / name).is_symlink()
    assert (tmp_path / "victim").read_text() == "mine"
    (tmp_path / "c.txt").symlink_to(tmp_path / "none")
    with pytest.raises(TactileError, match="exists already"):
        atomic.claim(tmp_path / "c.txt")


def test_odd_names_beside_a_folder_are_let_alone_or_told(tmp_path, monkeypatch):
    (tmp_path / "..tactile-lock").touch()
    (tmp_path / ".other.tactile-lock").mkdir()
    (tmp_path / ".old.tactile-old").write_text("mine")
    atomic.sweep(tmp_path)
    assert (tmp_path / ".other.tactile-lock").is_dir() and not (tmp_path / "old").exists()
    (tmp_path / ".x.tactile-lock").mkdir()
    with pytest.raises(TactileError, match="cannot be opened"), atomic.new_folder(tmp_path / "x"):
        pass
    (tmp_path / ".y.tactile-partial").write_text("left")
    with atomic.new_folder(tmp_path / "y"):
        pass
    with pytest.raises(TactileError, match="cannot be written"):
        atomic.claim(tmp_path / ("a" * 300))
    monkeypatch.chdir(tmp_path / "y")
    with atomic.new_folder(".", overwrite=True) as folder:
        (folder / "new").touch()
    assert [path.name for path in (tmp_path / "y").iterdir()] == ["new"]


def test_a_name_as_long_as_file_systems_take(tmp_path):
    path = tmp_path / ("n" * 250 + ".csv")
    atomic.claim(path)
    atomic.write_bytes(path, b"x")
    atomic.write_bytes(path, b"y", shared=True)
    assert path.read_bytes() == b"y"
    with atomic.new_folder(tmp_path / ("m" * 254)) as folder:
        (folder / "a").write_bytes(b"x")
    assert sorted(len(each.name) for each in tmp_path.iterdir()) == [254, 254]


def test_json_has_plain_lists_on_one_line_and_reads_back(tmp_path):
    hostile = ["a", 'b "c", [\n1\n]', "\\", "ä", -1.5e-300, 3, True, None]
    content = {"z": hostile, "a": [[1, 2], [], [{"b": [0.25]}]], "s": "[\n  1,\n  2\n]", "e": {}, 'k"[': ["x"]}
    atomic.write_json(tmp_path / "a.json", content)
    text = (tmp_path / "a.json").read_text(encoding="utf-8")
    assert json.loads(text) == content and list(json.loads(text)) == sorted(content)
    assert "[1, 2]" in text and '"b": [0.25]' in text and len(text.splitlines()) < 24


def test_what_is_refused_leaves_no_folder(tmp_path):
    """Folders above a result are made when it is written, not when its name is checked."""
    path = tmp_path / "new" / "deep" / "a.txt"
    atomic.claim(path)
    assert not list(tmp_path.iterdir())
    for writer in (atomic.new_file, atomic.new_folder):
        with pytest.raises(ValueError, match="half-way"), writer(path):
            raise ValueError("half-way")
        assert not list(tmp_path.iterdir())
    atomic.write_bytes(path, b"x")
    assert path.read_bytes() == b"x"


def test_a_folder_under_a_file_is_refused_by_its_own_name(tmp_path):
    (tmp_path / "file").write_text("mine")
    with (
        pytest.raises(TactileError, match=rf"^{re.escape(str(tmp_path / 'file' / 'x'))}: cannot be written"),
        atomic.writing(tmp_path / "file" / "x"),
        atomic.new_folder(tmp_path / "file" / "x"),
    ):
        pass
    assert (tmp_path / "file").read_text() == "mine"
