"""Rows of whole recordings against each frame alone."""

from benchmarks.translation import followed_rows

from tactile_core.translation.answer import Answer
from tactile_core.translation.translate import load_translator


def test_following_is_worth_more_than_frames_alone():
    rows = {row["name"]: row for row in followed_rows.rows(load_translator())}
    for name in ("followed_place", "followed_place_90", "followed_step", "followed_force_90", "followed_touch_wrong"):
        assert rows[name]["value"] < rows[name]["baseline"], name
    assert rows["followed_step"]["value"] < 0.5 * rows["followed_step"]["baseline"]
    assert rows["followed_touch_wrong"]["value"] < 0.005


def test_frames_that_are_not_followed_are_their_own_baseline(monkeypatch):
    network = load_translator()
    alone = Answer(frames_apart=True)
    monkeypatch.setattr(network, "answer", alone)
    assert all(row["value"] == row["baseline"] for row in followed_rows.rows(network))
