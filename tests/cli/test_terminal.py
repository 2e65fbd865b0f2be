"""What the terminal gets: no control characters, whatever a file is called."""

import os
import subprocess
import sys

import pytest

from tactile_core.cli import terminal
from tactile_core.cli.main import main


def test_control_characters_are_escaped(capsys):
    terminal.say("a\x1b]0;owned\x07\nb\x9b31m")
    terminal.tell("one\x1b[2J\ntwo é µ")
    out, err = capsys.readouterr()
    assert out == "one\\x1b[2J\ntwo é µ\n"
    assert err == "tactile: a\\x1b]0;owned\\x07 b\\x9b31m\n"


@pytest.mark.parametrize("verb", ["info", "adapt"])
def test_a_file_s_name_reaches_the_terminal_escaped(verb, capsys, tmp_path):
    assert (
        main([verb, str(tmp_path / "a\x1b[31m.csv"), *(["--out", str(tmp_path / "x")] if verb == "adapt" else [])]) == 2
    )
    assert "\x1b" not in capsys.readouterr().err


def test_durations_in_the_unit_that_is_read_best():
    assert [terminal.duration(each) for each in (40, 90, 720, 12600)] == ["40 s", "90 s", "12 min", "3.5 h"]


def test_numbers_of_things():
    found = [terminal.counted(*each) for each in ((1, "shard"), (0, "shard"), (2, "press"), (1, "%"), (100, "%"))]
    assert found == ["1 shard", "0 shards", "2 presses", "1 %", "100 %"]


def test_progress_in_a_log_is_a_line_every_ten_seconds(monkeypatch, capsys):
    now = 0.0
    monkeypatch.setattr(terminal.time, "monotonic", lambda: now)
    with terminal.bar("pairs", "block", forced=False) as show:
        for done in range(1, 31):  # a block a second
            now = float(done)
            show(done, 30)
    assert capsys.readouterr().err.splitlines() == [f"tactile: pairs: {done} of 30 blocks" for done in (10, 20, 30)]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device stands for a full disk here")
def test_a_full_disk_under_what_is_printed_is_named():
    with open("/dev/full", "w") as full:
        done = subprocess.run([sys.executable, "-m", "tactile_core", "scenes"], stdout=full, stderr=subprocess.PIPE)
    said = done.stderr.decode()
    assert done.returncode == 2 and said.startswith("tactile: error: what is printed: cannot be written"), said
    assert said.count("\n") == 1


def test_what_comes_next_stands_below_the_result_in_a_log(tmp_path):
    command = [sys.executable, "-m", "tactile_core", "scenes", "copy", "press", "--out", str(tmp_path)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=True)
    assert [line.partition(":")[0] for line in done.stdout.splitlines()] == [str(tmp_path / "press"), "tactile"]


@pytest.mark.skipif(os.name == "nt", reason="a shell closes it")
def test_a_closed_output_is_no_error():
    command = ["sh", "-c", '"$@" >&-', "sh", sys.executable, "-m", "tactile_core", "scenes"]
    done = subprocess.run(command, stderr=subprocess.PIPE)
    assert done.returncode == 0 and not done.stderr
