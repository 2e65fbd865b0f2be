"""What the terminal gets: no control characters, whatever a file is called."""

import pytest

from tactile_core.cli import terminal
from tactile_core.cli.main import main


def test_control_characters_are_escaped(capsys):
    terminal.say("a\x1b]0;owned\x07\nb\x9b31m")
    terminal.tell("one\x1b[2J\ntwo é µ")
    out, err = capsys.readouterr()
    assert out == "one\\x1b[2J\ntwo é µ\n"
    assert err == "tactile: a\\x1b]0;owned\\x07 b\\x9b31m\n"


@pytest.mark.parametrize("verb", ["info", "plan"])
def test_a_file_s_name_reaches_the_terminal_escaped(verb, capsys, tmp_path):
    assert main([verb, str(tmp_path / "a\x1b[31m.csv")]) == 2
    assert "\x1b" not in capsys.readouterr().err


def test_durations_in_the_unit_that_is_read_best():
    assert [terminal.duration(each) for each in (40, 90, 720, 12600)] == ["40 s", "90 s", "12 min", "3.5 h"]
