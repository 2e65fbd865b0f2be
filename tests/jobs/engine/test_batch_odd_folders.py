"""Jobs in folders that hold what others put there, and inputs that are no plain files."""

import json
import os
import shutil

import pytest

from tactile_core.errors import TactileError
from tactile_core.jobs import pairs
from tactile_core.jobs.engine import inputs, local, manifest
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs
from tactile_core.jobs.engine.tasks import Task


def none(done: int, total: int) -> None:
    """Progress that nobody watches."""


def test_a_worker_takes_no_modules_from_the_folder_it_is_started_in(new_job, tmp_path, monkeypatch):
    folder, _ = new_job()
    (folder / jobs.PREPARED).mkdir()
    (tmp_path / "h5py.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    monkeypatch.chdir(tmp_path)
    with local.Local(folder, 1) as place:
        place.submit(Task(0))
        ((_, reply),) = [next(place.results(lambda: 1))]
    assert reply.shards == 3 and not (tmp_path / "ran").exists()


def test_the_folder_of_parts_keeps_what_others_put_there(new_job, do, tmp_path):
    _, job = new_job()
    out = tmp_path / "result"
    folder = runs.folder_of(out)
    folder.mkdir()
    (folder / "thesis.txt").write_text("mine")
    with pytest.raises(TactileError, match=r"holds thesis\.txt, and no job"), runs.begun(out, job):
        pass
    (folder / "thesis.txt").rename(tmp_path / "thesis.txt")
    with runs.completed(out, job, lambda at: local.Local(at, 1, command=do.__globals__["COMMAND"])):
        (tmp_path / "thesis.txt").rename(folder / "thesis.txt")
    assert [path.name for path in folder.iterdir()] == ["thesis.txt"]


def test_parts_behind_a_link_are_removed(new_job, do, tmp_path):
    _, job = new_job()
    (tmp_path / "scratch").mkdir()
    runs.folder_of(tmp_path / "result").symlink_to(tmp_path / "scratch")
    with runs.completed(tmp_path / "result", job, lambda at: local.Local(at, 1, command=do.__globals__["COMMAND"])):
        pass
    assert not list((tmp_path / "scratch").iterdir())


def test_shards_that_are_gone_or_exchanged_are_seen_and_made_anew(finished, do, content):
    folder, job = finished
    before = content(folder)
    first, second, third, *_ = sorted((folder / jobs.SHARDS).iterdir())
    first.unlink()
    shutil.copy(second, third)
    assert manifest.damaged(folder, none) == [first, third]
    done = do(folder, job)
    assert (done.made, done.kept) == (2, 3) and content(folder) == before


def test_a_refused_job_leaves_the_folder_of_others_as_it_was(command, recordings, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("mine")
    done = command(*recordings, "--out", tmp_path / "mine")
    assert done.returncode == 2 and "holds thesis.txt, and no job" in done.stderr
    assert [each.name for each in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


def test_verify_says_what_is_missing_and_what_is_not_complete(command, recordings, tmp_path):
    out = tmp_path / "job"
    command(*recordings, "--out", out, "--shard-frames", "50", "--plan")
    assert "not complete: 0 of 0 shards" in command("--out", out, "--verify").stderr
    command("--out", out)
    sorted((out / "shards").iterdir())[1].unlink()
    said = command("--out", out, "--verify")
    assert said.returncode == 2 and "00000_a-000001.h5: missing; the same command makes it again" in said.stderr


def test_a_damaged_prepared_recording_is_no_end_of_the_job(new_job, do, recordings):
    folder, job = new_job()
    do(folder, job)
    file = jobs.prepared_file(folder, job.inputs[0].name)
    file.write_bytes(file.read_bytes()[:2000])
    recordings[0].unlink()
    done = do(folder, job)
    assert list(done.aside) == ["00000_a"] and "cannot be read" in str(done.aside["00000_a"])
    assert json.loads((folder / jobs.MANIFEST).read_text())["recordings"][0]["shards"] == []


@pytest.mark.parametrize("name", [jobs.SHARDS, jobs.ASIDE, jobs.MANIFEST])
def test_what_stands_in_a_jobs_way_is_told(name, new_job, do):
    folder, job = new_job()
    if name == jobs.MANIFEST:
        (folder / name).mkdir()
    else:
        (folder / name).write_text("")
    with pytest.raises(TactileError, match=f"{name}: cannot be written"):
        do(folder, job)


def test_only_a_jobs_own_leftovers_are_cleared(tmp_path):
    (tmp_path / ".x.tactile-partial").write_text("of a living writer")
    with runs.opened(tmp_path, None):
        pass
    assert (tmp_path / ".x.tactile-partial").exists()


def test_a_conflicted_copy_is_no_block_of_pairs(tmp_path):
    made = inputs.Input("00000_presses", "/a", "0" * 64, 1)
    job = jobs.make([made], jobs.Pairs(10, 0, [], []), None)
    (tmp_path / jobs.SHARDS).mkdir()
    (tmp_path / jobs.SHARDS / "00000_presses-000000 (conflicted copy).h5").write_bytes(b"")
    assert pairs.inspect_input(tmp_path, job, 0) is None


def test_lists_name_what_is_there(recordings, tmp_path):
    folder, listed = recordings[0].parent, tmp_path / "list.txt"
    (folder / "empty").mkdir()
    listed.write_bytes(b"\xef\xbb\xbfin/a.csv\r\n\r\nin/b.csv\r\n")  # as Windows' editor writes it
    assert inputs.find([f"@{listed}"], tmp_path / "out") == recordings
    for line, said in (("in/empty", "names no recording"), ("in/none*", "names no recording"), ("@other", "no lists")):
        listed.write_text(f"in/a.csv\n{line}\n")
        with pytest.raises(TactileError, match=rf"list\.txt, line 2.*{said}"):
            inputs.find([f"@{listed}"], tmp_path / "out")


@pytest.mark.parametrize("name", ["a" * 300, "a" * 300 + "#1"])
def test_names_that_no_disk_takes_are_told(name, tmp_path):
    (tmp_path / "list.txt").write_text(name)
    with pytest.raises(TactileError, match=r"cannot be read \(File name too long\)"):
        inputs.hashed(inputs.find([f"@{tmp_path / 'list.txt'}"], tmp_path / "out"), none)


@pytest.mark.skipif(os.name == "nt", reason="links and pipes of POSIX")
def test_links_to_nothing_and_pipes_are_told(tmp_path):
    (tmp_path / "*.csv").symlink_to(tmp_path / "none")
    (tmp_path / "loop.csv").symlink_to(tmp_path / "loop.csv")
    os.mkfifo(tmp_path / "pipe.csv")
    for name, said in (("*.csv", "cannot be read"), ("loop.csv", "cannot be read"), ("pipe.csv", "no regular file")):
        with pytest.raises(TactileError, match=said):
            inputs.hashed(inputs.find([str(tmp_path / name)], tmp_path / "out"), none)
    with pytest.raises(TactileError, match="no regular file"):
        inputs.find([f"@{tmp_path / 'pipe.csv'}"], tmp_path / "out")
    os.mkfifo(tmp_path / jobs.FILE)
    with pytest.raises(TactileError, match="no regular file"):
        jobs.read(tmp_path)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--counts-per-unit", "nan"], "counts_per_unit: nan"),
        (["--smooth", "2"], "smooth: 2 frames"),
        (["--shard-frames", "200000"], "--shard-frames: 200000"),
    ],
)
def test_options_that_no_recording_can_meet_make_no_job(words, said, command, recordings, tmp_path):
    done = command(*recordings, "--out", tmp_path / "job", *words)
    assert done.returncode == 2 and said in done.stderr
    assert not (tmp_path / "job" / jobs.FILE).exists()


@pytest.mark.parametrize("after", [0, 1, 3])
def test_a_folder_that_is_removed_while_the_job_runs_is_told_in_a_sentence(
    after, command, recordings, tmp_path, monkeypatch
):
    out, submitted = tmp_path / "job", []

    def submit(self, task):
        if len(submitted) == after:
            out.rename(tmp_path / "gone")  # at once, whatever workers are writing
        submitted.append(task)
        self._todo.put(task)

    monkeypatch.setattr(local.Local, "submit", submit)
    done = command(*recordings, "--out", out, "--keep", "latent", "--shard-frames", "50")
    assert done.returncode == 2 and not out.exists()
    assert (
        done.stderr
        == f"tactile: error: {out}: was removed while the job ran; expected the job's folder. Begin it again\n"
    )


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="needs a user who may not write everywhere")
def test_folders_that_cannot_be_written_are_told_in_a_sentence(finished, command):
    folder, _ = finished
    next((folder / jobs.SHARDS).iterdir()).unlink()
    left = folder / jobs.SHARDS / ".killed.tactile-partial"
    for present in (False, True):
        if present:
            left.touch()
        (folder / jobs.SHARDS).chmod(0o555)
        done = command("--out", folder)
        (folder / jobs.SHARDS).chmod(0o755)
        assert done.returncode == 2 and done.stderr.count("\n") == 1 and "cannot be written" in done.stderr
