"""A finished job in the layouts of others, read back with their own tools."""

import csv
import json
import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from PIL import Image

from tactile_core.cli.main import main
from tactile_core.cli.verbs import export as verb
from tactile_core.errors import TactileError
from tactile_core.files import checksummed
from tactile_core.jobs import export
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.export import finished_job

FRAMES = {"00000_a": 40, "00001_b": 25}


def silent(done, total):
    """Progress that nobody watches."""


def test_every_layout_has_a_test_here():
    assert set(export.layouts()) == {"npz", "png", "imagefolder", "exr", "lerobot", "lerobot21"} == set(verb.LAYOUTS)


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


def test_imagefolder_has_a_row_and_a_picture_a_frame(job, tmp_path):
    source = export.export(job, "imagefolder", tmp_path / "out", silent)
    with open(tmp_path / "out" / "train" / "metadata.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(FRAMES.values())
    for one in source.recordings:
        held = {name: np.concatenate([block[name] for block in one.blocks()]) for name in ("image", "force", "flags")}
        for row in (row for row in rows if row["recording"] == one.name):
            frame = int(row["frame"])
            picture = np.asarray(Image.open(tmp_path / "out" / "train" / row["file_name"]))
            np.testing.assert_array_equal(picture, held["image"][frame])
            assert float(row["force_y_n"]) == pytest.approx(held["force"][frame, 1], rel=1e-5)
            assert bool(row["flags"]) == bool(held["flags"][frame])


def test_arrays_of_another_pair_are_read_as_ours_and_stored_as_theirs(tmp_path):
    with h5py.File(tmp_path / "shard.h5", "w") as file:
        for name in ("frame", "latent_biotac_sp", "latent_gelsight_mini", "force"):
            file[name] = np.zeros(3, np.int32)
    one = finished_job.Recorded("a", 3, (tmp_path / "shard.h5",), {}, pair=("biotac_sp", "gelsight_mini"))
    assert set(next(one.blocks())) == set(one.arrays()) == {"frame", "latent_biotac", "latent_digit", "force"}
    assert [one.stored(name) for name in ("latent_digit", "force")] == ["latent_gelsight_mini", "force"]


def test_exr_holds_heights_and_pictures(job, tmp_path):
    pytest.importorskip("OpenEXR", reason="OpenEXR is absent: pip install tactile-core[render]")
    from tactile_core.files.exr_file import read_exr

    source = export.export(job, "exr", tmp_path / "a", silent)
    for one in source.recordings:
        files = sorted((tmp_path / "a" / one.name).iterdir())
        assert [file.name for file in files] == [f"{frame:06d}.exr" for frame in range(FRAMES[one.name])]
        block = next(one.blocks())
        planes, about = read_exr(files[15])
        np.testing.assert_array_equal(planes["height"], block["height_map"][15])
        np.testing.assert_array_equal(np.stack([planes[c] for c in "RGB"], -1), block["image"][15])
        assert about["frame"] == "15" and about["recording"] == one.name


def test_what_cannot_be_exported_is_told(job, tmp_path):
    with pytest.raises(TactileError, match="already exists"):
        export.export(job, "npz", tmp_path, silent)
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


def test_a_job_begun_before_there_were_normals_is_read_but_not_half_of_one(job, tmp_path):
    shutil.copytree(job, tmp_path / "job")
    first, *others = (path for one in finished_job.load(tmp_path / "job").recordings for path in one.shards)
    for path in (first, *others):
        with h5py.File(path, "r+") as file:
            del file["contact_normal"]
        checksummed.write_checksum(path)
        if path == first:
            with pytest.raises(TactileError, match=r"contact_normal: frames are .*; expected absent, as in "):
                finished_job.load(tmp_path / "job")
    export.export(tmp_path / "job", "npz", tmp_path / "out", silent)


def test_what_a_job_did_not_keep_is_said_of_its_folder(job):
    with pytest.raises(TactileError, match=f"^{re.escape(str(job))}: holds no traction_digit"):
        finished_job.load(job).check_kept("traction_digit", "traction")


def test_what_was_written_is_told_and_warnings_of_the_recordings_go_with_it(job, tmp_path, capsys):
    assert main(["export", str(job), "--to", "npz", "--out", str(tmp_path / "out")]) == 0
    out, err = capsys.readouterr()
    assert out == f"{tmp_path / 'out'}\n" and "next: it holds one NPZ file a recording" in err
    listed = {one["name"]: one["warnings"] for one in json.loads((job / jobs.MANIFEST).read_text())["recordings"]}
    assert listed["00001_b"] and json.loads((tmp_path / "out" / "note.json").read_text())["warnings"] == listed


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
