"""The judging of real recordings: made-up slides with known answers, and the tool beside the public recordings."""

import re
import subprocess
import sys
from pathlib import Path

import evaluate_translation
import numpy as np
import pytest
from benchmarks.translation import slides
from conftest import write_counts

from tactile_core.errors import TactileError
from tactile_core.recordings import Recording, Signals, read
from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.repair import fill
from tactile_core.translation.translator import Translation

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
    path = folder / f"{name}_bio.csv"
    write_counts(path, np.rint(np.abs(electrodes)), pdc=np.rint(pressure))
    robot = np.arange(-0.05, time[-1] + 0.1, 1 / 150)
    wrench = np.column_stack([START + robot, np.zeros((len(robot), 6))])
    pose = np.column_stack([START + robot, 0.7 - 0.025 * robot, np.zeros((len(robot), 2))])
    for topic, table in (("cw", wrench), ("cp", pose)):
        header = ",".join(["timestamp", *"abcdef"][: table.shape[1]])
        np.savetxt(folder / f"{name}_{topic}.csv", table, fmt="%.6f", delimiter=",", header=header, comments="")
    return path


def follows(signals: Signals) -> Translation:
    """Force and dent follow the electrodes' mean change; the place follows electrode 1 against the mean."""
    strength = np.abs(signals.change).mean(axis=1)
    center = np.column_stack([-8e-3 + 1e-6 * signals.change[:, 0], 1e-6 * strength])
    center[strength < 5] = np.nan
    fields = dict.fromkeys(Translation.__dataclass_fields__, np.zeros(len(strength)))
    return Translation(**fields | {"force": np.outer(strength, [0, 0.01, 0]), "contact_center": center})


def network(recording: Recording) -> Translation:
    return follows(Preparer()(recording))


def by_name(rows: list[dict]) -> dict[str, dict]:
    return {row["name"].removeprefix("recordings_"): row for row in rows}


def test_a_translation_that_follows_the_pressure_meets_the_targets(tmp_path):
    for k in range(3):
        write_slide(tmp_path, f"mat1_{k}", seed=k)
    rows = by_name(slides.rows(tmp_path, network))
    assert rows["force_rank_median"]["value"] > 0.98 and rows["force_rank_median"]["ok"]
    assert abs(rows["force_silence"]["value"]) < 0.05 and rows["force_silence"]["ok"]
    assert rows["contact_missed"]["value"] == 0


def test_a_translation_of_noise_misses_them(tmp_path):
    write_slide(tmp_path, "mat1_1", electrodes=np.random.default_rng(1).normal(30, 5, (FRAMES, 19)))
    rows = by_name(slides.rows(tmp_path, network))
    for name in ("rank_median", "rank_quartile", "silence"):
        assert rows[f"force_{name}"]["ok"] is False


def test_contacts_that_are_not_found_are_counted(tmp_path):
    def blind(recording: Recording) -> Translation:
        found = network(recording)
        found.contact_center[:] = np.nan
        return found

    write_slide(tmp_path, "mat2_3")
    assert by_name(slides.rows(tmp_path, blind))["contact_missed"]["value"] == 1.0


def test_the_pose_is_taken_off():
    arm = np.linspace(0.5, 0.7, 400)
    cubic = 3 - arm + 20 * arm**2 - 50 * arm**3
    wave = np.sin(200 * arm)
    assert np.abs(slides.without_pose(cubic, arm)).max() < 1e-9
    left = slides.without_pose(cubic + wave, arm)
    assert slides.rank_correlation(left, wave) > 0.95 > abs(slides.rank_correlation(cubic + wave, wave))


def test_a_constant_strength_has_no_rank():
    assert np.isnan(slides.rank_correlation(np.ones(5), np.arange(5.0)))


def test_a_recording_without_wrench_is_not_judged(tmp_path):
    write_slide(tmp_path, "mat1_1")
    write_slide(tmp_path, "mat1_2").with_name("mat1_2_cw.csv").unlink()
    assert by_name(slides.rows(tmp_path, network))["force_rank_median"]["set"] == "1 recordings"
    (tmp_path / "mat1_1_cw.csv").unlink()
    with pytest.raises(TactileError, match="none with its"):
        slides.rows(tmp_path, network)


def test_what_cannot_be_judged_says_why(tmp_path):
    with pytest.raises(TactileError, match=r"no \*_bio\.csv"):
        slides.rows(tmp_path, network)
    path = write_slide(tmp_path, "mat1_1")
    pose = tmp_path / "mat1_1_cp.csv"
    text = pose.read_text()
    pose.write_text(text.replace("1600000001.", "never"))
    with pytest.raises(TactileError, match="without a number"):
        slides.load(path)
    pose.write_text("\n".join(text.splitlines()[:50]))
    with pytest.raises(TactileError, match="frames in the time of its"):
        slides.load(path)


def test_what_may_be_chosen_by_is_not_reported(tmp_path):
    for name in ("mat1_7", "mat2_7"):
        (tmp_path / f"{name}{slides.BIO}").touch()
    assert len(slides.reporting(tmp_path)) == 2  # where there is no other
    for name in ("mat1_31", "mat1_17", "mat5_50"):
        (tmp_path / f"{name}{slides.BIO}").touch()
    names = [path.name.removesuffix(slides.BIO) for path in slides.reporting(tmp_path)]
    assert names == ["mat1_17", "mat1_31", "mat5_50"]


@pytest.fixture(scope="module")
def judged(tmp_path_factory, outside_data):
    """Our metrics of six real recordings, and what the tool beside them prints of the same files."""
    data = outside_data("biotac_recordings") / "slide"
    tool = data.parents[2] / "tools" / "judge_recordings.py"
    if not tool.exists():
        pytest.skip(f"outside tool: {tool} is absent")
    folder = tmp_path_factory.mktemp("slides")
    (folder / "out").mkdir()
    for path in slides.reporting(data)[:6]:
        for topic in (slides.BIO, slides.WRENCH, slides.POSE):
            beside = slides.beside(path, topic)
            (folder / beside.name).symlink_to(beside)
        recording = read(path)
        found = network(recording)
        lost = ~np.isfinite(found.contact_center)
        arrays = {"t": recording.start_time + recording.time, "force": np.linalg.norm(found.force, axis=1)}
        np.savez(
            folder / "out" / path.name.replace(slides.BIO, ".npz"),
            centre=1e3 * fill(found.contact_center, lost),
            **arrays,
        )
    rows = by_name(slides.rows(folder, network))
    command = [sys.executable, str(tool), "slide", str(folder), "--n", "0", "--translated", str(folder / "out")]
    return rows, subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_our_rows_are_the_numbers_that_the_tool_prints(judged):
    rows, printed = judged
    ranks, rest = printed.split("across recordings at fixed arm x")
    silences = rest.split("silence")[1]

    def numbers(text: str, label: str) -> list[float]:
        line = next(line for line in text.splitlines() if line.startswith(label + " "))
        return [float(number) for number in re.findall(r"-?\d+\.\d+", line[len(label) :])]

    median, lower = numbers(ranks, "translated force")[3:5]  # after median and quartiles of the plain correlation
    assert rows["force_rank_median"]["value"] == pytest.approx(median, abs=6e-4)  # printed with three decimals
    assert rows["force_rank_quartile"]["value"] == pytest.approx(lower, abs=6e-4)
    assert rows["force_silence"]["value"] == pytest.approx(numbers(silences, "translated force")[0], abs=6e-4)
    assert rows["force_rank_median"]["baseline"] == pytest.approx(numbers(ranks, "sum |E|")[3], abs=6e-4)
    within = [float(x) for x in re.search(r"translated centre.*within \[([^\]]*)\]", printed)[1].split()]
    found = [rows[f"centre_spread_{word}"]["value"] for word in ("along", "across")]
    assert found == pytest.approx(within, abs=6e-3)  # printed with two decimals
    raw = [float(x) for x in re.search(r"squared centroid.*within \[([^\]]*)\]", printed)[1].split()][:2]
    assert [rows[f"centre_spread_{word}"]["baseline"] for word in ("along", "across")] == pytest.approx(raw, abs=6e-3)


def test_the_script_prints_its_rows_and_tells_bad_input(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(evaluate_translation.translate, "translate", lambda recording, **options: network(recording))
    arguments = ["--recordings", str(tmp_path), "--json", str(tmp_path / "rows.json")]
    assert evaluate_translation.main(arguments) == 2 and "no *_bio.csv" in capsys.readouterr().err
    write_slide(tmp_path, "mat1_1")
    status = evaluate_translation.main(arguments)
    printed = capsys.readouterr()
    assert "recordings_force_rank_median" in printed.out and (tmp_path / "rows.json").exists()
    assert status == int("MISSED" in printed.err)
