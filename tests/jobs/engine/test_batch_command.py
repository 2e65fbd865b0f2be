"""``tactile batch`` as its user meets it."""

import json
import os

import pytest

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs.engine import inputs
from tactile_core.jobs.engine import job as jobs


def test_a_job_from_start_to_end(command, recordings, tmp_path):
    out = tmp_path / "job"
    done = command(recordings[0].parent, "--out", out, "--keep", "latent", "--shard-frames", "60", "--workers", "2")
    assert done.returncode == 0 and "5 shards made, 0 kept, 0 set aside" in done.stdout, done.stderr
    assert "warning: 1 recording: polarity assumed" in done.stderr and "next: tactile export" in done.stderr
    again = command("--out", out)
    assert "0 shards made, 5 kept" in again.stdout
    status = command("--out", out, "--status")
    assert "2 of 2 prepared, 200 frames" in status.stdout and "5 of 5" in status.stdout and "complete" in status.stdout
    assert command("--out", out, "--verify").returncode == 0
    next((out / "shards").iterdir()).write_bytes(b"")
    bad = command("--out", out, "--verify")
    assert bad.returncode == 2 and "the same command makes it again" in bad.stderr


def test_other_options_or_contents_in_the_same_folder_are_refused(command, recordings, tmp_path):
    out = tmp_path / "job"
    assert command(*recordings, "--out", out, "--plan").returncode == 0
    for words in ([*recordings, "--keep", "height"], recordings[:1]):
        done = command(*words, "--out", out)
        assert done.returncode == 2 and "holds another job" in done.stderr
    for option in (["--keep", "height"], ["--contacts", "2"]):
        assert "given without INPUTS" in command("--out", out, *option).stderr


def test_the_same_job_elsewhere_has_the_same_id(new_job, tmp_path):
    first, second = new_job("x")[1], new_job("y")[1]
    assert first.id == second.id == jobs.read(tmp_path / "x").id
    assert new_job("z", keep=("height",))[1].id != first.id


def test_inputs_are_files_folders_globs_and_lists(recordings, tmp_path):
    folder, out = recordings[0].parent, tmp_path / "out"
    (folder / "list.txt").write_text("# two\nb.csv\n\na.csv\n")
    assert inputs.find([str(folder)], out) == recordings
    assert inputs.find([str(folder / "*.csv"), str(recordings[0])], out) == recordings
    assert inputs.find([f"@{folder / 'list.txt'}"], out) == recordings[::-1]
    for name in ("mat1_7_bio.csv", "mat1_7_cw.csv", "mat1_7_cp.csv"):
        (folder / name).write_bytes(recordings[0].read_bytes())
    assert [path.name for path in inputs.find([str(folder)], out)] == ["a.csv", "b.csv", "mat1_7_bio.csv"]
    for word in ("nothing*", str(tmp_path / "out")):
        with pytest.raises(TactileError, match="names no recording"):
            (tmp_path / "out").mkdir(exist_ok=True)
            inputs.find([word], out)


def test_a_list_that_names_a_folder_often_goes_through_it_once(recordings, tmp_path, monkeypatch):
    (tmp_path / "list.txt").write_text(f"{recordings[0].parent}\n" * 100 + f"{tmp_path}/*\n")
    walk, walked = os.walk, []
    monkeypatch.setattr(os, "walk", lambda folder, **more: walked.append(folder) or walk(folder, **more))
    assert inputs.find([f"@{tmp_path / 'list.txt'}"], tmp_path / "out") == [*recordings, tmp_path / "list.txt"]
    assert walked == [recordings[0].parent]


@pytest.mark.parametrize("word", ["*/../*/../*.csv", "**/**/**", "[a/" + "./" * 1000 + "b"])
def test_globs_that_may_take_for_ever_are_refused(word, tmp_path):
    with pytest.raises(TactileError, match="again and again"):
        inputs.find([word], tmp_path / "out")


@pytest.mark.parametrize("name", ["stat", "scandir"])
def test_a_folder_that_may_not_be_read_is_passed_over(name, recordings, tmp_path, monkeypatch, caplog):
    def refused(path, *words, **more):
        if "closed" in str(path):
            raise PermissionError(13, "Permission denied", str(path))
        return real(path, *words, **more)

    (recordings[0].parent / "closed").mkdir()
    real = getattr(os, name)
    monkeypatch.setattr(os, name, refused)
    assert inputs.find([str(recordings[0].parent)], tmp_path / "out") == recordings
    told = "closed: cannot be looked into (Permission denied), passed over" in caplog.text
    assert told or name == "stat"


@pytest.mark.skipif(os.name == "nt", reason="Windows lets administrators alone make links")
def test_links_in_a_folder_that_lead_nowhere_or_to_folders_are_told(recordings, tmp_path, caplog):
    folder = recordings[0].parent
    (folder / "circle.csv").symlink_to("circle.csv")
    (folder / "more").symlink_to(tmp_path)
    assert inputs.find([str(folder)], tmp_path / "out") == recordings
    assert "circle.csv: a link that leads nowhere" in caplog.text and "more: a linked folder" in caplog.text


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--array", "3/3"], "--array: '3/3'"),
        (["--array", "0/2"], "no job yet"),
        (["--workers", "0"], "--workers: 0"),
        (["x.csv", "--status"], "--out DIR alone"),
        (["--status"], "job.json: cannot be read"),
        ([], "no job here"),
        (["missing.csv"], "cannot be read"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_told_in_one_line(words, said, tmp_path, capsys):
    assert main(["batch", *words, "--out", str(tmp_path / "job")]) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1


def test_the_calibration_belongs_to_the_job(command, recordings, tmp_path):
    from tactile_core.sensors.calibration_file import SHIPPED

    out, unit = tmp_path / "job", tmp_path / "unit.toml"
    unit.write_bytes(SHIPPED.read_bytes())
    words = [recordings[1], "--out", out, "--keep", "latent"]
    assert command(*words, "--calibration", unit, "--plan").returncode == 0
    assert "holds another job" in command(*words).stderr
    unit.write_bytes(SHIPPED.read_bytes() + b"\n")
    done = command("--out", out)
    assert done.returncode == 2 and "as in the job" in done.stderr


def damage(job):
    yield "not json", ""
    yield "[" * 100_000, ""
    yield json.dumps(job | {"more": 1}), ""
    for more in ({"name": "00000_/../../x"}, {"path": "/a\0b"}, {"path": "/a\ud800"}):
        yield json.dumps(job | {"inputs": [job["inputs"][0] | more]}), ".*inputs"
    yield json.dumps(job | {"recipe": job["recipe"] | {"shard_frames": 0}}), ""
    yield json.dumps(job | {"format": "other"}), ""


def test_a_job_file_of_others_is_checked(new_job):
    folder, _ = new_job()
    good = json.loads((folder / jobs.FILE).read_text())
    for text, field in damage(good):
        (folder / jobs.FILE).write_text(text)
        with pytest.raises(TactileError, match=r"job\.json" + field):
            jobs.read(folder)


def test_a_job_of_another_version_is_read_but_not_gone_on_with(new_job, capsys):
    folder, _ = new_job()
    text = json.loads((folder / jobs.FILE).read_text())
    (folder / jobs.FILE).write_text(json.dumps(text | {"recipe": text["recipe"] | {"version": "0"}}))
    assert jobs.read(folder).recipe.version == "0"
    with pytest.raises(TactileError, match=r"made by version 0; expected version"):
        jobs.read_to_run(folder)
    before = {path: path.read_bytes() for path in folder.rglob("*.json")}
    assert main(["batch", "--out", str(folder)]) == 2
    assert {path: path.read_bytes() for path in folder.rglob("*.json")} == before
    assert main(["batch", "--out", str(folder), "--status"]) == 0
    assert "version 0, which began it, goes on" in capsys.readouterr().out


def test_a_refused_batch_leaves_no_folder(tmp_path, capsys):
    assert main(["batch", str(tmp_path / "absent.csv"), "--out", str(tmp_path / "job")]) == 2
    assert not (tmp_path / "job").exists()
    (tmp_path / "kept").mkdir()
    assert main(["batch", str(tmp_path / "absent.csv"), "--out", str(tmp_path / "kept")]) == 2
    assert (tmp_path / "kept").exists()
