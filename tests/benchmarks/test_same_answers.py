"""The script that compares answers before and after a change of structure: what it reports, and that it can run."""

import json

import pytest
from benchmarks import same_answers

from tactile_core.cli.main import main


def test_answers_are_written_and_named_where_they_differ(tmp_path, monkeypatch, capsys):
    """One short command, and one contact."""
    command = "convert {recording} --out {out}/demo --keep latent --frames 300:303"
    monkeypatch.setattr(same_answers, "COMMANDS", (command,))
    monkeypatch.setattr(same_answers, "PLACES", {"digit": same_answers.PLACES["digit"]})
    monkeypatch.setattr(same_answers, "FORCES", (0.5,))
    before, after = tmp_path / "before.json", tmp_path / "after.json"
    before.write_text('{"solve digit 0.5 N": "another", "pairs.h5": "any"}')
    assert same_answers.main([str(after), "--than", str(before)]) == 1
    found = json.loads(after.read_text())
    assert {"demo/press_roll_slide/frames.h5", "demo/press_roll_slide/contact_sheet.png"} <= found.keys()
    assert not any(name.endswith(same_answers.HOLD_CLOCKS) for name in found)
    said = capsys.readouterr().out
    for line in ("differs: solve digit 0.5 N", "gone: pairs.h5", "new: demo/press_roll_slide/frames.h5"):
        assert line in said


def test_what_differs_is_gone_or_new_is_named():
    lines = same_answers.differences({"a": "1", "b": "1", "c": "1"}, {"a": "1", "b": "2", "d": "1"})
    assert lines == ["differs: b", "gone: c", "new: d"]
    assert same_answers.differences({"a": "1"}, {"a": "1"}) == []


@pytest.mark.parametrize("command", same_answers.COMMANDS)
def test_its_commands_have_words_that_the_verbs_know(command, tmp_path, capsys):
    """With a word too many each ends in that word's refusal, before it does anything."""
    with pytest.raises(SystemExit):
        main([*same_answers.words_of(command, str(tmp_path)), "--no-such-option"])
    assert capsys.readouterr().err.strip().endswith("unrecognized arguments: --no-such-option")
