"""Labels are cleaned, counted, and kept as runs that unfold to the same texts."""

import numpy as np

from tactile_core.recordings.labels import LONGEST, MOST_WORDS, extend, labels_of, summary, unfold


def test_texts_become_fit_for_a_file_and_empty_ones_are_left_out():
    found = labels_of({"a/b": ["x\0", " y "], "empty": ["", " "], "long": ["z" * 1000, "\ud800"], "..": ["w", "w"]})
    assert {name: column.tolist() for name, column in found.items()} == {
        "a_b": ["x", "y"], "long": ["z" * LONGEST, "?"],
    }  # fmt: skip


def test_frames_are_counted():
    many = np.array([f"w{i}" for i in range(MOST_WORDS + 3)], dtype=object)
    counted = summary({"object": np.array(["foam", "steel", "steel"], dtype=object), "many": many})
    assert counted["object"] == {"steel": 2, "foam": 1}
    assert counted["many"]["3 more"] == 3 and len(counted["many"]) == MOST_WORDS + 1


def test_runs_of_parts_unfold_to_the_whole():
    runs = {}
    extend(runs, {"object": np.array(["foam", "foam"], dtype=object)}, 0, 2)
    extend(runs, {"object": np.array(["foam"], dtype=object), "trial": np.array(["7"], dtype=object)}, 2, 3)
    extend(runs, {}, 3, 5)
    assert {name: column.tolist() for name, column in unfold(runs).items()} == {
        "object": ["foam", "foam", "foam", "", ""], "trial": ["", "", "7", "", ""],
    }  # fmt: skip
