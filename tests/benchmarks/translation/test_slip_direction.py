"""Direction of slip: what a classifier is shown, and that it is judged where it has not looked."""

import numpy as np
import pytest
from benchmarks.translation import slip_direction as judge

from tactile_core.errors import TactileError


def test_changes_and_summaries_are_the_protocols():
    values = np.arange(60.0)[:, None] * [1, 2]
    moved = judge.change(values)
    assert moved[: judge.FIRST].mean() == pytest.approx(0)
    shown = judge.summary(values).reshape(8, 2)  # six parts, spread, pace
    np.testing.assert_allclose(shown[:6, 0], np.arange(60).reshape(6, 10).mean(1))
    np.testing.assert_allclose(shown[7], [1, 2])


def test_random_maps_are_as_many_again_and_bounded():
    maps = list(judge.random_maps(6, 24))
    counts = 3300 + 50 * np.random.default_rng(0).standard_normal((20, 24))
    first, again = maps[0](counts), next(judge.random_maps(6, 24))(counts)
    np.testing.assert_array_equal(first, again)
    assert len(maps) == judge.MAPS and first.shape == (20, 6) and np.abs(first).max() <= 1
    assert np.abs(first - maps[1](counts)).max() > 0.1


def test_objects_and_classes_come_from_names(tmp_path):
    with pytest.raises(TactileError, match="no CSV file"):
        judge.find(tmp_path, "biotac_sp")
    for kind in "ns":
        (tmp_path / kind).mkdir()
        names = ",".join(f"ff_e{number}" for number in range(1, 25))
        line = ",".join(["3300"] * 24)
        (tmp_path / kind / "strippes12.csv").write_text("\n".join([names, *[line] * 30]) + "\n")
    found = judge.find(tmp_path, "biotac_sp")
    assert [(kind, of) for kind, of, _ in found] == [("n", "striped"), ("s", "striped")]
    assert found[0][2].electrodes.shape == (30, 24)


def test_a_class_that_is_shown_is_found_and_an_objects_own_mark_is_not():
    pytest.importorskip("sklearn", reason="the protocol's folds are scikit-learn's")
    random = np.random.default_rng(0)
    kinds, objects = np.repeat(["n", "s"], 20), np.tile(np.arange(4), 10)
    shown = 0.1 * random.standard_normal((40, 3)) + (kinds == "n")[:, None]
    assert judge.accuracies(shown, kinds, objects) == (1.0, 1.0)
    folds, apart = judge.accuracies(random.standard_normal((40, 3)), kinds, objects)
    assert folds < 0.8 and apart < 0.8
