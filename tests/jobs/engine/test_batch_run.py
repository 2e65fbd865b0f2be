"""A job gives the same bytes whatever happens to it on the way."""

import json
import os
import signal
import subprocess
import time

import fake_tools
import h5py
import numpy as np
import pytest
from conftest import ROOT

from tactile_core.errors import TactileError
from tactile_core.files import checksummed
from tactile_core.jobs import convert, prepared_signals, results
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import manifest
from tactile_core.jobs.engine import run as runs

COMMAND = (os.sys.executable, str(ROOT / "tests" / "jobs" / "engine" / "fake_worker.py"))


def test_shards_hold_what_convert_makes(new_job, do, recordings, tmp_path):
    folder, job = new_job(keep=("latent", "displacement", "height", "image"))
    done = do(folder, job)
    assert (done.made, done.kept, done.aside) == (5, 0, {})
    options = convert.Options(keep=("latent", "displacement", "height"))
    (out,) = results.result_folders(recordings[:1], tmp_path / "plain", False)
    plain = convert.convert(recordings[0], out, options, fake_tools.tools()).folder
    shards = [h5py.File(jobs.shard_file(folder, job.inputs[0].name, n)) for n in range(3)]
    with h5py.File(plain / "frames.h5") as whole:
        assert [len(shard["frame"]) for shard in shards] == [50, 50, 30]
        for name, data in whole.items():
            np.testing.assert_array_equal(np.concatenate([shard[name][:] for shard in shards]), data[:], err_msg=name)
    assert shards[0]["displacement_digit"].chunks[0] == shards[0]["image"].chunks[0] == 1
    assert shards[2]["image"].shape == (30, 320, 240, 3)
    assert shards[1].attrs["recording"] == "a" and shards[1].attrs["shards"] == 3


def test_workers_and_restarts_change_no_byte(finished, new_job, do, content):
    folder, _ = finished
    other, same = new_job("three")
    do(other, same, workers=3, restart=1)
    assert content(folder) == content(other)
    said = json.loads((folder / jobs.MANIFEST).read_text())
    assert [one["frames"] for one in said["recordings"]] == [130, 70]
    assert [len(one["shards"]) for one in said["recordings"]] == [3, 2] and said["aside"] == {}


def test_what_is_whole_is_kept_and_what_is_damaged_made_anew(finished, do, content):
    folder, job = finished
    before = content(folder)
    files = sorted((folder / jobs.SHARDS).iterdir())
    for file, place in zip(files[:3], (3, 600, -1), strict=True):  # in the seal, in the head, in the data
        data = bytearray(file.read_bytes())
        data[place] ^= 1
        file.write_bytes(data)
    files[3].write_bytes(files[3].read_bytes()[:-10])
    assert manifest.damaged(folder, lambda done, total: None) == files[:4]
    done = do(folder, job)
    assert (done.made, done.kept) == (4, 1)
    assert content(folder) == before


@pytest.mark.parametrize("about", [b"", b"[" * 100_000, b"[]", b"{}"])
def test_what_is_told_of_a_recording_is_checked(finished, about):
    folder, job = finished
    file = jobs.prepared_file(folder, job.inputs[0].name)
    with h5py.File(file, "r+") as data:
        del data["about"]
        data["about"] = np.frombuffer(about, np.uint8)
    with pytest.raises(TactileError, match="damaged prepared recording"):
        prepared_signals.Prepared(file).read(np.arange(1))
    assert checksummed.verified_checksum(file) is None  # so that the next run makes it again
    with open(file, "r+b") as spoiled:
        spoiled.seek(len(checksummed.MAGIC) + 65)  # another number of frames
        spoiled.write(b"7")
    assert checksummed.verified_checksum(file) is None
    file.unlink()
    assert manifest.status(folder, job).prepared == len(job.inputs) - 1


def test_a_shard_that_kills_its_worker_is_set_aside_and_the_rest_goes_on(new_job, do, monkeypatch):
    folder, job = new_job()
    monkeypatch.setenv("FAKE_KILL", "00000_a-000001")
    done = do(folder, job, workers=2)
    assert list(done.aside) == ["00000_a-000001"] and done.made == 4
    assert "killed its worker 3 times (signal 9)" in str(done.aside["00000_a-000001"])
    found = manifest.status(folder, job)
    assert found.aside == {name: str(why) for name, why in done.aside.items()} and not found.complete
    monkeypatch.delenv("FAKE_KILL")
    assert do(folder, job).made == 1  # the next run tries it again
    assert manifest.status(folder, job).complete and manifest.status(folder, job).aside == {}


def test_a_worker_that_dies_once_costs_nothing(finished, new_job, do, content, monkeypatch, tmp_path):
    folder, _ = finished
    other, same = new_job("killed")
    monkeypatch.setenv("FAKE_KILL", "00000_a-000001")
    monkeypatch.setenv("FAKE_KILL_ONCE", str(tmp_path / "once"))
    assert do(other, same).aside == {}
    assert (tmp_path / "once").exists() and content(folder) == content(other)


def test_array_parts_make_the_same_files_in_any_order(finished, new_job, do, content):
    folder, _ = finished
    other, same = new_job("parts")
    made = [do(other, same, part=(i, 3)).made for i in (2, 0, 1)]
    assert sum(made) == 5 and min(made) >= 1
    do(other, same)  # writes the manifest
    assert content(folder) == content(other)


def test_a_second_job_in_the_folder_is_refused(new_job):
    folder, _ = new_job()
    with runs.opened(folder, None):
        for part in (None, (0, 2)):
            with pytest.raises(TactileError, match="another job is running here"), runs.opened(folder, part):
                pass
    with runs.opened(folder, (0, 2)), runs.opened(folder, (1, 2)):
        for part in (None, (0, 2)):
            with pytest.raises(TactileError, match="another job is running here"), runs.opened(folder, part):
                pass


def test_a_bad_recording_is_set_aside_by_name(new_job, do, recordings):
    recordings[0].write_text("nothing of the kind\n1\n")
    folder, job = new_job(paths=recordings)
    done = do(folder, job)
    assert list(done.aside) == ["00000_a"] and "no known recording" in str(done.aside["00000_a"]) and done.made == 2


def test_a_recording_that_changed_after_the_job_was_made_is_refused(new_job, do, recordings):
    folder, job = new_job()
    recordings[1].write_text(recordings[1].read_text().replace("2000", "2001"))
    assert "another content" in str(do(folder, job).aside["00001_b"])


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_a_killed_client_leaves_nothing_half_and_the_same_command_goes_on(
    finished, content, recordings, command_process
):
    calm, _ = finished
    folder = calm.parent / "killed"
    words = ["batch", *map(str, recordings), "--out", str(folder), "--keep", "latent", "--shard-frames", "50"]
    process = subprocess.Popen([*COMMAND, *words], env={**os.environ, "FAKE_HOLD": "1"})
    while not list(folder.glob("shards/*.h5")) and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    there = list(folder.glob("shards/*.h5"))
    assert 0 < len(there) < 5 and all(checksummed.verified_checksum(file) for file in there)
    done = command_process(*words[1:])
    assert done.returncode == 0, done.stderr
    assert content(folder) == content(calm)
    assert not list(folder.rglob(".*.tactile-partial"))


@pytest.mark.parametrize("cut", [1, 4])
def test_a_power_cut_at_a_write_loses_nothing(cut, finished, content, recordings, command_process, monkeypatch):
    calm, _ = finished
    folder = calm.parent / "cut"
    words = [*recordings, "--out", folder, "--keep", "latent", "--shard-frames", "50"]
    monkeypatch.setenv("FAKE_CUT", str(cut))
    assert command_process(*words).returncode
    monkeypatch.delenv("FAKE_CUT")
    done = command_process(*words)
    assert done.returncode == 0, done.stderr
    assert content(folder) == content(calm) and not list(folder.rglob(".*.tactile-partial"))


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit on the size of a process's files")
@pytest.mark.parametrize(
    ("limit", "needed"),  # below a prepared file (0.3 MB), and between it and a shard of 50 frames (3.9 MB)
    [(30_000, "room for 2 of 2 inputs that were not begun"), (1_000_000, "some 15.8 MB for the 5 shards")],
)
def test_a_full_disk_stops_the_job_in_words_and_the_same_command_goes_on(
    limit, needed, recordings, tmp_path, command_process
):
    import resource

    folder = tmp_path / "full"
    words = ["batch", *map(str, recordings), "--out", str(folder), "--keep", "displacement", "--shard-frames", "50"]
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        done = command_process(*words[1:])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert done.returncode == 2 and done.stderr.startswith(f"tactile: error: --out {folder}: cannot be written")
    assert "File too large; " in done.stderr and " MB free" in done.stderr and "Make room" in done.stderr
    assert needed in done.stderr and "tactile-partial" not in done.stderr
    assert not list(folder.rglob(".*.tactile-partial")) and "Traceback" not in done.stderr
    assert command_process(*words[1:]).returncode == 0
