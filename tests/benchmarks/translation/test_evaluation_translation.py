"""Metrics of the translation on paired contacts: zero for the truth, the baseline answer for nothing, fair averages."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import evaluate_translation
import numpy as np
import pytest
from benchmarks.measured_rows import read_table
from benchmarks.translation import test_set
from benchmarks.translation.test_set import GAIN, NOISE, as_read
from small_pairs import bodies, write_pairs

from tactile_core import jobs
from tactile_core.accuracy import COSTS
from tactile_core.simulation.pairs_file import read_pairs
from tactile_core.training import step_errors
from tactile_core.training.step_errors import error_columns, translation_metrics, true_displacement
from tactile_core.translation.networks import WEIGHTS_FOLDER


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    return read_pairs(write_pairs(tmp_path_factory.mktemp("pairs") / "pairs.h5", presses=8))


class Answers:
    """Networks that know the answers of a file of pairs, times a factor: latents are rows of it."""

    def __init__(self, pairs, share):
        self.pairs, self.share, self.rows = pairs, share, np.arange(len(pairs.press))

    def encode_signal(self, change, rectified=False):
        return self.rows[: len(change)]

    encode_source = encode_target = encode_signal

    def contact(self, rows, rectified=False):
        return rows

    m2m = m2m_back = m2s = contact

    def latents(self, rows, state, rectified=False):
        return rows, rows

    def likely_latents(self, rows, rectified=False):
        return rows, rows

    def force_in(self, state, rows):
        return self.force(rows)

    def decode_source(self, rows):
        return self.share * true_displacement(self.pairs, "biotac", rows)

    def decode_target(self, rows):
        return self.share * true_displacement(self.pairs, "digit", rows)

    def decode_signal(self, rows):
        return self.share * self.pairs.signal[rows]

    def force(self, rows):
        return self.share * self.pairs.force[rows]

    def pressure(self, change, rectified=False):
        return self.share * self.pairs.pressure[: len(change)]

    def expected_error(self, change, rectified=False):
        return np.full((len(change), 2), 1e-5)


def metrics(pairs, share):
    rows = np.arange(len(pairs.press))
    return translation_metrics(Answers(pairs, share), pairs, rows, pairs.signal, bodies())


STEPS = ("MVB", "MVD", "S2MPN", "M2MPN", "chain", "D2B")


def test_the_truth_has_no_error(pairs):
    found = metrics(pairs, 1.0)
    for step in STEPS:
        assert np.nanmax(found[f"{step}_rms_um"]) == 0 and found[f"{step}_max_um"].max() == 0
    assert np.nanmax(found["S2MPN_position_mm"]) == 0
    assert np.nanmax(found["force_percent"]) == 0 and found["D2S_counts"].max() == 0
    np.testing.assert_array_equal(found["chain_iou"], found["true_mesh_iou"])


def test_nothing_has_the_error_of_the_baseline(pairs):
    found = metrics(pairs, 0.0)
    for step in STEPS:
        baseline = step_errors.BASELINES.get(step, "baseline_digit")
        np.testing.assert_array_equal(found[f"{step}_rms_um"], found[f"{baseline}_rms_um"])
    loaded = np.isfinite(found["force_percent"])
    np.testing.assert_allclose(found["force_percent"][loaded], 100)
    np.testing.assert_array_equal(loaded, np.linalg.norm(pairs.force, axis=1) > 0.2)
    np.testing.assert_allclose(found["B2S_counts"], found["baseline_counts"])


def test_half_of_it_is_half_an_error(pairs):
    found = metrics(pairs, 0.5)
    np.testing.assert_allclose(found["M2MPN_rms_um"], 0.5 * found["baseline_digit_rms_um"], rtol=1e-5)
    peaks = found["M2MPN_peak_depth_percent"]
    np.testing.assert_allclose(peaks[np.isfinite(peaks)], 50, rtol=1e-5)
    errors = error_columns(Answers(pairs, 0.5), pairs, np.arange(len(pairs.press)), pairs.signal, bodies(), 0.0)
    deepest = np.linalg.norm(true_displacement(pairs, "digit", np.arange(len(pairs.press))), axis=-1).max(1)
    np.testing.assert_allclose(errors["digit_max_m"], 0.5 * deepest, rtol=1e-5)


def test_bins_and_indenters_count_alike():
    depth = np.array([0.2e-3] * 100 + [0.5e-3] * 2 + [5e-3])
    indenter = np.array([0] * 99 + [1] + [0, 0] + [0])
    values = np.array([1.0] * 99 + [3.0] + [10.0, np.nan] + [1e9])
    assert step_errors.in_bins(values, depth, indenter) == pytest.approx(((1 + 3) / 2 + 10) / 2)
    assert step_errors.in_bins(values, depth + 1, indenter) is None


def test_rows_say_what_they_met():
    assert step_errors.metric_row("a_rms_um", 3.0, 9.0, 4.0, "s")["ok"] is True
    patch = step_errors.metric_row("a_iou", 0.8, None, 0.85, "s")
    assert (patch["unit"], patch["ok"], patch["baseline"], patch["set"]) == ("1", False, None, "s")
    assert step_errors.metric_row("a_rms_um", 3.0, None, None, "s")["ok"] is None


def test_slices_cover_each_contact_once(pairs):
    masks = np.array([mask for _, mask in step_errors.slices(pairs, np.arange(len(pairs.press)))])
    np.testing.assert_array_equal(masks.sum(0), 1)


def test_readings_have_the_stated_errors_and_repeat():
    change = np.full((4000, 19), 300.0)
    read = as_read(change, 3)
    assert read.std() == pytest.approx(np.hypot(NOISE, 300 * GAIN), rel=0.02)  # 76,000 draws
    np.testing.assert_array_equal(read, as_read(change, 3))


def test_the_script_measures_the_shipped_networks_on_the_shipped_contacts(request, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(request.config.rootpath)
    shutil.copy("docs/translation.md", tmp_path / "card.md")
    # prime as well; targets are met on the whole set alone
    monkeypatch.setattr(evaluate_translation, "QUICK_PRESSES", 29)
    monkeypatch.setattr(evaluate_translation, "QUICK_CONTACTS", 6)
    monkeypatch.setattr(jobs.pairs, "BLOCK", 1)  # press, of four that are solved together
    written = ["--json", str(tmp_path / "rows.json"), "--card", str(tmp_path / "card.md")]
    status = evaluate_translation.main(["--quick", "--weights", str(WEIGHTS_FOLDER), *written])
    rows = json.loads((tmp_path / "rows.json").read_text())
    missed = [row["name"] for row in rows if row["ok"] is False and row["unit"] not in COSTS]
    assert status == int(bool(missed))
    assert all(f"MISSED: {name} =" in capsys.readouterr().err for name in missed[:1])
    found = {row["name"]: row for row in rows if row["set"] == "seen indenters"}
    assert set(test_set.TARGETS) <= set(found)
    for step, share in {"MVB": 0.2, "MVD": 0.3, "M2MPN": 0.6, "S2MPN": 0.5, "D2B": 0.5}.items():
        assert found[f"{step}_rms_um"]["value"] < share * found[f"{step}_rms_um"]["baseline"]
    card = (tmp_path / "card.md").read_text(encoding="utf-8")
    names = {each["name"] for each in read_table(tmp_path / "card.csv")}
    assert "M2MPN_rms_um" in names and (tmp_path / "translation_cases.png").exists()
    words = [line for line in Path("docs/translation.md").read_text(encoding="utf-8").splitlines() if line[:1] != "|"]
    assert [line for line in card.splitlines() if line[:1] != "|"] == words
    assert "| test contacts | 368 of 119" in Path("docs/translation.md").read_text() and "| 368 of" not in card


def test_a_file_that_is_no_test_set_is_refused(tmp_path, capsys):
    (tmp_path / "a.h5").write_bytes(b"nothing")
    assert evaluate_translation.main(["--test-set", str(tmp_path / "a.h5")]) == 2
    assert "a.h5" in capsys.readouterr().err


def test_what_was_kept_apart_is_measured_alone(pairs):
    """The one indenter that is unseen where the pad is seen, and both where it is not, each contact in one set."""
    nets = Answers(pairs, 1.0)

    def apart(without, below):
        fake = SimpleNamespace(
            nets=nets,
            card={"options": {"without": without, "without_below_x": below}},
            out_of_range=lambda change: np.zeros(len(change), bool),
            silent=lambda quantity: 0.0,
            bound=lambda expected, x, surface: 2.0 * expected,
        )
        return {row["set"] for row in test_set.unseen_rows(fake, pairs, bodies())}

    assert apart(["sphere"], None) == {"unseen sphere"}
    assert apart(["sphere"], -5e-3) == {"unseen sphere", "unseen region and indenter"}
    assert apart([], -5e-3) == {"unseen region"}
    assert apart([], None) == set()
