"""A finished job in the layouts of others, read back with their own tools."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
from pathlib import Path

import fake_tools
import h5py
import numpy as np
import pytest
from PIL import Image

from tactile_core.cli.main import main
from tactile_core.cli.verbs import export as verb
from tactile_core.errors import TactileError
from tactile_core.files import checksummed
from tactile_core.jobs import export
from tactile_core.jobs.engine import inputs, local, recipes
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs
from tactile_core.jobs.export import finished_job

WORKER = Path(__file__).resolve().parents[2] / "jobs" / "engine" / "fake_worker.py"
FRAMES = {"00000_a": 70, "00001_b": 45}


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """A finished job of two recordings with pictures."""
    folder = tmp_path_factory.mktemp("job")
    paths = []
    for name, frames in (("a", 70), ("b", 45)):
        press = np.clip(np.arange(frames) - 20, 0, 30)[:, None] * np.linspace(1, 3, 19)
        noise = np.random.default_rng(frames).normal(0, 1, (frames, 19))
        paths.append(folder.parent / f"{name}.npz")
        np.savez(paths[-1], electrodes=np.rint(3000 + press + noise), time=np.arange(frames) / 100)
    recipe = recipes.Translate(["latent", "height", "image"], "0" * 64, shard_frames=40)
    made = jobs.make(inputs.hashed(paths, lambda done, total: None), recipe, None)
    jobs.write(folder, made)
    with runs.opened(folder, None):
        place = local.Local(folder, 1, command=(sys.executable, str(WORKER)))
        runs.run(folder, made, place, None, lambda done, total: None)
    return folder


def silent(done, total):
    """Progress that nobody watches."""


def test_every_layout_has_a_test_here():
    assert set(export.layouts()) == {"npz", "png", "exr", "lerobot"} == set(verb.LAYOUTS)


def test_npz_holds_every_array_whole_and_the_same_bytes_each_time(job, tmp_path):
    source = export.export(job, "npz", tmp_path / "a", silent)
    export.export(job, "npz", tmp_path / "b", silent)
    for one in source.recordings:
        path = tmp_path / "a" / f"{one.name}.npz"
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
        with np.load(path, allow_pickle=False) as arrays:
            for name in arrays:
                joined = np.concatenate([block[name] for block in one.blocks()])
                np.testing.assert_array_equal(arrays[name], joined)
                assert len(joined) == FRAMES[one.name]


def test_png_pictures_are_those_of_the_shards(job, tmp_path):
    source = export.export(job, "png", tmp_path / "out", silent)
    for one in source.recordings:
        files = sorted((tmp_path / "out" / one.name).iterdir())
        assert [file.name for file in files] == [f"{frame:06d}.png" for frame in range(one.frames)]
        pictures = np.concatenate([block["image"] for block in one.blocks()])
        np.testing.assert_array_equal(np.asarray(Image.open(files[-1])), pictures[-1])


def test_exr_holds_heights_and_pictures(job, tmp_path):
    pytest.importorskip("OpenEXR", reason="OpenEXR is absent: pip install tactile-core[render]")
    from tactile_core.files.exr_file import read_exr

    source = export.export(job, "exr", tmp_path / "a", silent)
    for one in source.recordings:
        files = sorted((tmp_path / "a" / one.name).iterdir())
        assert [file.name for file in files] == [f"{frame:06d}.exr" for frame in range(FRAMES[one.name])]
        block = next(one.blocks())
        planes, about = read_exr(files[30])
        np.testing.assert_array_equal(planes["height"], block["height_map"][30])
        np.testing.assert_array_equal(np.stack([planes[c] for c in "RGB"], -1), block["image"][30])
        assert about["frame"] == "30" and about["recording"] == one.name


def test_lerobot_reads_back_with_plain_pyarrow(job, tmp_path):
    reason = "pyarrow is absent, or newer than this numpy: pip install tactile-core[batch]"
    pq = pytest.importorskip("pyarrow.parquet", reason=reason, exc_type=ImportError)
    source = export.export(job, "lerobot", tmp_path / "out", silent)
    out = tmp_path / "out"
    info = json.loads((out / "meta" / "info.json").read_text())
    assert (info["codebase_version"], info["total_episodes"], info["total_frames"], info["fps"]) == (
        "v3.0",
        2,
        115,
        100,
    )
    episodes = pq.read_table(out / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [one["length"] for one in episodes] == [70, 45]
    assert pq.read_table(out / "meta" / "tasks.parquet").to_pylist()[0]["task_index"] == 0
    for one, episode in zip(source.recordings, episodes, strict=True):
        path = info["data_path"].format(chunk_index=episode["data/chunk_index"], file_index=episode["data/file_index"])
        table = pq.read_table(out / path)
        assert set(table.column_names) == set(info["features"])
        rows = [row for row in table.to_pylist() if row["episode_index"] == episode["episode_index"]]
        first, last = episode["dataset_from_index"], episode["dataset_to_index"]
        assert [row["index"] for row in rows] == list(range(first, last))
        assert [row["frame_index"] for row in rows] == list(range(one.frames))
        arrays = {name: np.concatenate([block[name] for block in one.blocks()]) for name in one.arrays()}
        for name in ("electrodes", "force", "latent_digit"):
            found = np.array([row[f"observation.{name}"] for row in rows], np.float32)
            np.testing.assert_array_equal(found, arrays[name])
        picture = Image.open(io.BytesIO(rows[-1]["observation.images.digit"]["bytes"]))
        np.testing.assert_array_equal(np.asarray(picture), arrays["image"][-1])
        assert list(info["features"]["observation.images.digit"]["shape"]) == [*fake_tools.SHAPE, 3]
    stats = json.loads((out / "meta" / "stats.json").read_text())
    forces = np.concatenate([block["force"] for one in source.recordings for block in one.blocks()])
    np.testing.assert_allclose(
        stats["observation.force"]["std"], forces.std(axis=0, dtype=np.float64), rtol=1e-6, atol=1e-9
    )


def test_what_cannot_be_exported_is_told(job, tmp_path):
    with pytest.raises(TactileError, match="already exists"):
        export.export(job, "npz", tmp_path, silent)
    with pytest.raises(TactileError, match="--to"):
        export.export(job, "zarr", tmp_path / "out", silent)
    file = next((job / "shards").iterdir())
    whole = file.read_bytes()
    try:
        file.write_bytes(whole[:-1])
        with pytest.raises(TactileError, match="damaged"):
            export.export(job, "npz", tmp_path / "out", silent)
        file.unlink()
        with pytest.raises(TactileError, match="3 of 4 shards"):
            export.export(job, "npz", tmp_path / "out", silent)
    finally:
        file.write_bytes(whole)
    assert not (tmp_path / "out").exists()


def without_force(file):
    del file["force"]


def with_another_array(file):
    file["odd"] = np.zeros(len(file["frame"]))


def with_a_scalar(file):
    del file["force"]
    file["force"] = 1.0


def with_other_rows(file):
    del file["force"]
    file["force"] = np.zeros((3, 3), np.float32)


def with_another_type(file):
    force = file["force"][:]
    del file["force"]
    file["force"] = force.astype(np.float64)


def with_a_secret(file):
    secret = Path(file.filename).parent / "secret.bin"
    secret.write_bytes(bytes(1000))
    del file["force"]
    file.create_dataset("force", (len(file["frame"]), 3), "f4", external=[(str(secret), 0, 1000)])


def with_a_link(file):
    del file["force"]
    file["force"] = h5py.ExternalLink("other.h5", "force")


def as_another_shard(file):
    file.attrs["shard"] = 1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without_force, "arrays .*; expected .*force"),
        (with_another_array, "arrays .*odd"),
        (with_a_scalar, r"force: shape \(\)"),
        (with_other_rows, r"force: shape \(3, 3\)"),
        (with_another_type, "force: .*float64.*float32"),
        (with_a_secret, "values lie in other files"),
        (with_a_link, "a link to another file"),
        (as_another_shard, "another shard under this name"),
    ],
)
def test_shards_of_strangers_are_read_with_care(change, said, job, tmp_path):
    """A seal is a hash that anyone can make."""
    shutil.copytree(job, tmp_path / "job")
    path = jobs.shard_file(tmp_path / "job", "00001_b", 0)
    with h5py.File(path, "r+") as file:
        change(file)
    checksummed.write_checksum(path)
    with pytest.raises(TactileError, match=said):
        export.export(tmp_path / "job", "npz", tmp_path / "out", silent)
    assert not (tmp_path / "out").exists()


def test_warnings_of_the_recordings_go_with_them(job, tmp_path):
    export.export(job, "npz", tmp_path / "out", silent)
    listed = {one["name"]: one["warnings"] for one in json.loads((job / jobs.MANIFEST).read_text())["recordings"]}
    assert listed["00001_b"]
    assert json.loads((tmp_path / "out" / "note.json").read_text())["warnings"] == listed


def test_what_a_job_did_not_keep_is_said_of_its_folder(job):
    with pytest.raises(TactileError, match=f"^{re.escape(str(job))}: holds no traction_digit"):
        finished_job.load(job).check_kept("traction_digit", "traction")


def test_what_was_written_is_told(job, tmp_path, capsys):
    assert main(["export", str(job), "--to", "npz", "--out", str(tmp_path / "out")]) == 0
    out, err = capsys.readouterr()
    assert out == f"{tmp_path / 'out'}\n" and "next: it holds one NPZ file a recording" in err


def test_what_was_set_aside_is_told(job, tmp_path, capsys):
    shutil.copytree(job, tmp_path / "job")
    jobs.prepared_file(tmp_path / "job", "00001_b").unlink()
    (tmp_path / "job" / jobs.ASIDE / "00001_b.json").write_text('{"task": "00001_b", "why": "b.npz: damaged"}')
    words = ["export", str(tmp_path / "job"), "--to", "npz", "--out", str(tmp_path / "out")]
    assert main(words) == 0
    assert "warning: 00001_b was set aside and is left out: b.npz: damaged" in capsys.readouterr().err
    assert json.loads((tmp_path / "out" / "note.json").read_text())["left_out"] == {"00001_b": "b.npz: damaged"}
    assert main(words) == 2
    assert "--overwrite" not in capsys.readouterr().err  # which this verb does not have


@pytest.mark.parametrize(("stretch", "said"), [(3.0, "as the first"), (1e6, "1 or more")])
def test_lerobot_takes_one_rate(stretch, said, job, tmp_path):
    reason = "pyarrow is absent, or newer than this numpy: pip install tactile-core[batch]"
    pytest.importorskip("pyarrow.parquet", reason=reason, exc_type=ImportError)
    shutil.copytree(job, tmp_path / "job")
    for name, number in (("00001_b", 0), ("00001_b", 1), *([("00000_a", 0), ("00000_a", 1)] if stretch > 99 else [])):
        path = jobs.shard_file(tmp_path / "job", name, number)
        with h5py.File(path, "r+") as file:
            file["time"][:] *= stretch
        checksummed.write_checksum(path)
    with pytest.raises(TactileError, match=said):
        export.export(tmp_path / "job", "lerobot", tmp_path / "out", silent)
