"""The judging of real recordings: made-up slides with known answers, and the tool beside the public recordings."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.translation import evaluation, recordings, slide_metrics, slide_set
from conftest import SLIDE_HEADER

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.recordings import Signals
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.translation.translate import load_translator
from tactile_core.translation.translator import Translation, Translator

ROOT = Path(__file__).resolve().parents[3]
FRAMES = 500
START = 1.6e9


def write_slide(folder: Path, name: str, seed: int = 0, electrodes: np.ndarray | None = None) -> Path:
    """A contact that varies and is lost in the last second, while the arm slides; electrodes follow the pressure."""
    random = np.random.default_rng(seed)
    time = np.arange(FRAMES) / 100
    pressure = np.maximum(60 + 20 * np.sin(3 * time + seed) + 10 * np.sin(7.3 * time) - 8 * time, 20)
    pressure *= np.clip((4.0 - time) / 0.3, 0, 1)
    if electrodes is None:
        electrodes = pressure[:, None] * np.linspace(1.5, 0.1, 19) + random.normal(0, 1, (FRAMES, 19))
    rows = np.zeros((FRAMES, len(SLIDE_HEADER)))
    rows[:, 0], rows[:, 3], rows[:, 26:] = START + time, np.rint(pressure), np.rint(np.abs(electrodes))
    path = folder / f"{name}_bio.csv"
    formats = ["%.6f"] + ["%d"] * 44
    np.savetxt(path, rows, fmt=formats, delimiter=",", header=",".join(SLIDE_HEADER), comments="")
    robot = np.arange(-0.05, time[-1] + 0.1, 1 / 150)
    wrench = np.column_stack([START + robot, np.zeros((len(robot), 6))])
    pose = np.column_stack([START + robot, 0.7 - 0.025 * robot, np.zeros((len(robot), 2))])
    for topic, table in (("cw", wrench), ("cp", pose)):
        header = ",".join(["timestamp", *"abcdef"][: table.shape[1]])
        np.savetxt(folder / f"{name}_{topic}.csv", table, fmt="%.6f", delimiter=",", header=header, comments="")
    return path


class Answering(Translator):
    """The shipped networks' posterior, and the answers of `network`."""

    def __call__(self, signals, state=None):
        return network(signals)


def network(signals: Signals) -> Translation:
    """Force and dent follow the electrodes' mean change; the place follows electrode 1 against the mean."""
    strength = np.abs(signals.change).mean(axis=1)
    rest = sensors.digit_surface().rest
    moved = np.zeros((len(strength), len(rest), 3))
    moved[..., 1] = 1e-6 * strength[:, None] * np.exp(-((rest[:, 0] + 8e-3) ** 2 + rest[:, 2] ** 2) / 2.5e-3**2)
    center = np.column_stack([-8e-3 + 1e-6 * signals.change[:, 0], 1e-6 * strength])
    center[strength < 5] = np.nan
    count = len(strength)
    force = np.outer(strength, [0, 0.01, 0])
    skin = np.zeros((count, 3, 3))
    codes = np.repeat(strength[:, None], 4, axis=1)
    errors = [1e-6 * strength] * 4
    flags = np.zeros(count, np.uint16)
    sure = np.ones(count)
    second = np.full_like(center, np.nan), np.zeros_like(force)
    return Translation(
        codes, codes, codes, skin, moved, force, 50 * strength, center, sure, *errors, flags, sure, *second
    )


def by_name(rows: list[dict]) -> dict[str, dict]:
    return {row["name"].removeprefix("recordings_"): row for row in rows}


def test_a_translation_that_follows_the_pressure_meets_the_targets(tmp_path):
    for k in range(3):
        write_slide(tmp_path, f"mat1_{k}", seed=k)
    rows = by_name(recordings.rows(tmp_path, network, tmp_path / "out"))
    assert rows["force_rank_median"]["value"] > 0.98 and rows["force_rank_median"]["ok"]
    assert abs(rows["force_silence"]["value"]) < 0.05 and rows["force_silence"]["ok"]
    assert rows["not_finite"]["value"] == 0 and rows["not_finite"]["ok"]
    assert rows["contact_missed"]["value"] == 0
    assert "step_at_repaired" not in rows  # nothing had to be repaired
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [f"mat1_{k}.npz" for k in range(3)]


def test_a_translation_of_noise_misses_them(tmp_path):
    write_slide(tmp_path, "mat1_1", electrodes=np.random.default_rng(1).normal(30, 5, (FRAMES, 19)))
    rows = by_name(recordings.rows(tmp_path, network))
    for name in ("rank_median", "rank_quartile", "silence", "roughness"):
        assert rows[f"force_{name}"]["ok"] is False


def test_what_is_written_is_what_was_measured(tmp_path):
    path = write_slide(tmp_path, "mat2_3")
    found = recordings.translate(path, network)
    recordings.write(tmp_path, "mat2_3", found)
    first = (tmp_path / "mat2_3.npz").read_bytes()
    with np.load(tmp_path / "mat2_3.npz", allow_pickle=False) as file:
        assert set(file.files) == {"t", "force", "volume", "centre", "feat"}
        assert file["t"][0] == pytest.approx(START) and len(file["t"]) == FRAMES
        assert np.isfinite(file["centre"]).all()  # held where contact is lost
        assert np.array_equal(file["force"], found.force)
    recordings.write(tmp_path, "mat2_3", found)
    assert (tmp_path / "mat2_3.npz").read_bytes() == first


def test_numbers_that_are_none_and_contacts_not_found_are_counted(tmp_path):
    def broken(signals: Signals) -> Translation:
        found = network(signals)
        found.force[0] = np.nan
        found.contact_center[:] = np.nan
        return found

    found = recordings.judge(write_slide(tmp_path, "mat2_3"), broken, None)
    chunks = -(-FRAMES // recordings.CHUNK)
    assert found.not_finite == 3 * chunks and found.missed == 1.0


def test_a_glitch_is_no_step_where_it_is_repaired(tmp_path):
    values = 40 + 10 * np.sin(np.arange(FRAMES) / 40)[:, None] * np.ones(19)
    values[200] = 3000
    found = recordings.judge(write_slide(tmp_path, "mat5_50", electrodes=values), network, None)
    assert found.step <= recordings.NO_LARGER < found.step_unrepaired


def test_a_sensor_is_taken_off_before_the_translation(tmp_path):
    path = write_slide(tmp_path, "mat2_3")
    plain = recordings.translate(path, network)
    halved = recordings.translate(path, network, sensor=ElectrodeGains("made up", [2.0] * 19, [0.0] * 19))
    np.testing.assert_allclose(halved.force, plain.force / 2)


def test_volume_is_the_area_times_the_depth_of_an_even_dent():
    digit = sensors.digit_surface()
    moved = np.zeros((1, len(digit.rest), 3))
    moved[0, :, 1] = 1e-3
    corners = digit.rest[digit.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert recordings.displaced_volume(moved)[0] == pytest.approx(1e-3 * area)
    assert recordings.displaced_volume(-moved)[0] == 0


def test_the_pose_is_taken_off():
    arm = np.linspace(0.5, 0.7, 400)
    cubic = 3 - arm + 20 * arm**2 - 50 * arm**3
    wave = np.sin(200 * arm)
    assert np.abs(slide_set.without_pose(cubic, arm)).max() < 1e-9
    left = slide_set.without_pose(cubic + wave, arm)
    assert slide_metrics.rank_correlation(left, wave) > 0.95 > abs(slide_metrics.rank_correlation(cubic + wave, wave))


def test_a_constant_strength_has_no_rank():
    assert np.isnan(slide_metrics.rank_correlation(np.ones(5), np.arange(5.0)))


def test_roughness_of_white_noise_is_root_six():
    """The second difference of white noise has 1 + 4 + 1 times its variance; 1 % is twice the scatter of 40,000."""
    noise = np.random.default_rng(0).normal(size=40_000)
    assert slide_metrics.roughness(noise) == pytest.approx(6**0.5, rel=0.01)


def test_a_recording_without_wrench_is_converted_but_not_judged(tmp_path):
    write_slide(tmp_path, "mat1_1")
    write_slide(tmp_path, "mat1_2").with_name("mat1_2_cw.csv").unlink()
    rows = by_name(recordings.rows(tmp_path, network, tmp_path / "out"))
    assert rows["force_rank_median"]["set"] == "1 recordings" and rows["not_finite"]["set"].endswith("2 recordings")
    (tmp_path / "mat1_1_cw.csv").unlink()
    with pytest.raises(TactileError, match="none with its"):
        recordings.rows(tmp_path, network)


def test_what_cannot_be_judged_says_why(tmp_path):
    with pytest.raises(TactileError, match=r"no \*_bio\.csv"):
        recordings.rows(tmp_path, network)
    path = write_slide(tmp_path, "mat1_1")
    pose = tmp_path / "mat1_1_cp.csv"
    text = pose.read_text()
    pose.write_text(text.replace("1600000001.", "never"))
    with pytest.raises(TactileError, match="without a number"):
        slide_set.load(path)
    pose.write_text("\n".join(text.splitlines()[:50]))
    with pytest.raises(TactileError, match="frames in the time of its"):
        slide_set.load(path)


def test_what_may_be_chosen_by_is_not_reported(tmp_path):
    for name in ("mat1_7", "mat2_7"):
        (tmp_path / f"{name}{slide_set.BIO}").touch()
    assert len(slide_set.reporting(tmp_path)) == 2  # where there is no other
    for name in ("mat1_31", "mat1_17", "mat5_50"):
        (tmp_path / f"{name}{slide_set.BIO}").touch()
    assert [slide_set.name_of(path) for path in slide_set.reporting(tmp_path)] == ["mat1_17", "mat1_31", "mat5_50"]


@pytest.fixture(scope="module")
def judged(tmp_path_factory, outside_data):
    """Our metrics of six real recordings, and what the tool beside them prints of the same files."""
    data = outside_data("biotac_recordings") / "slide"
    tool = data.parents[2] / "tools" / "judge_recordings.py"
    if not tool.exists():
        pytest.skip(f"outside tool: {tool} is absent")
    folder = tmp_path_factory.mktemp("slides")
    for path in slide_set.reporting(data)[:6]:
        for topic in (slide_set.BIO, slide_set.WRENCH, slide_set.POSE):
            name = slide_set.name_of(path) + topic
            (folder / name).symlink_to(data / name)
    rows = by_name(recordings.rows(folder, network, folder / "out"))
    command = [sys.executable, str(tool), "slide", str(folder), "--n", "0", "--translated", str(folder / "out")]
    return rows, subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_our_rows_are_the_numbers_that_the_tool_prints(judged):
    rows, printed = judged
    ranks, rest = printed.split("across recordings at fixed arm x")
    roughs, silences = rest.split("roughness")[1].split("silence")

    def numbers(text: str, label: str) -> list[float]:
        line = next(line for line in text.splitlines() if line.startswith(label + " "))
        return [float(number) for number in re.findall(r"-?\d+\.\d+", line[len(label) :])]

    for label, name in (("translated force", "force"), ("translated volume", "volume")):
        median, lower = numbers(ranks, label)[3:5]  # after median and quartiles of the plain correlation
        assert rows[f"{name}_rank_median"]["value"] == pytest.approx(median, abs=6e-4)  # printed with three decimals
        assert rows[f"{name}_rank_quartile"]["value"] == pytest.approx(lower, abs=6e-4)
        assert rows[f"{name}_roughness"]["value"] == pytest.approx(numbers(roughs, label)[0], abs=6e-4)
        assert rows[f"{name}_silence"]["value"] == pytest.approx(numbers(silences, label)[0], abs=6e-4)
    for label, name in (("electrode 1", "electrode_1"), ("sum |E|", "electrode_sum"), ("rms E", "electrode_rms")):
        assert rows[f"{name}_rank_median"]["value"] == pytest.approx(numbers(ranks, label)[3], abs=6e-4)
    assert rows["force_roughness"]["baseline"] == pytest.approx(numbers(roughs, "sum |E|")[0], abs=6e-4)
    within = [float(x) for x in re.search(r"translated centre.*within \[([^\]]*)\]", printed)[1].split()]
    found = [rows[f"centre_spread_{word}"]["value"] for word in ("along", "across")]
    assert found == pytest.approx(within, abs=6e-3)  # printed with two decimals
    raw = [float(x) for x in re.search(r"squared centroid.*within \[([^\]]*)\]", printed)[1].split()][:2]
    assert [rows[f"centre_spread_{word}"]["baseline"] for word in ("along", "across")] == pytest.approx(raw, abs=6e-3)


def test_the_script_prints_its_rows_and_tells_bad_input(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(evaluation.translate, "load_translator", lambda folder: Answering(load_translator().nets))
    arguments = ["--recordings", str(tmp_path), "--out", str(tmp_path / "out"), "--json", str(tmp_path / "rows.json")]
    assert evaluation.main(arguments) == 2 and "no *_bio.csv" in capsys.readouterr().err
    write_slide(tmp_path, "mat1_1")
    status = evaluation.main(arguments)
    printed = capsys.readouterr()
    assert "recordings_force_rank_median" in printed.out and (tmp_path / "rows.json").exists()
    assert status == int("MISSED" in printed.err)
