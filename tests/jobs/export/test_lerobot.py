"""Data sets in both of LeRobot's layouts, read with pyarrow, OpenCV, and LeRobot where it is installed."""

import io
import json
import shutil
from pathlib import Path

import fake_tools
import h5py
import numpy as np
import pytest
from PIL import Image

from tactile_core.errors import TactileError
from tactile_core.files import checksummed
from tactile_core.jobs import export
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.export.lerobot_set import EpisodeStats, aggregate

pq = pytest.importorskip(
    "pyarrow.parquet", reason="pyarrow is absent, or newer than this numpy: pip install tactile-core[batch]",
    exc_type=ImportError,
)  # fmt: skip
PICTURE = "observation.images.digit"


def silent(done, total):
    """Progress that nobody watches."""


@pytest.fixture
def labelled(job, tmp_path):
    """The job, with a label in one of its two recordings, and no place or electrode in some frames."""
    shutil.copytree(job, tmp_path / "job")
    for name in ("00000_a", "00001_b"):
        for number in range(2):
            path = jobs.shard_file(tmp_path / "job", name, number)
            with h5py.File(path, "r+") as file:
                file["contact_center"][:5] = np.nan
                file["electrodes"][:3, 4] = np.nan
            checksummed.write_checksum(path)
    with h5py.File(jobs.prepared_file(tmp_path / "job", "00000_a"), "r+") as file:
        about = json.loads(file["about"][()].tobytes()) | {"labels": {"object": [["ball", 20], ["box", 20]]}}
        del file["about"]
        file["about"] = np.frombuffer(json.dumps(about).encode(), np.uint8)
    return tmp_path / "job"


def columns(out, info):
    """All rows of a data set, in order: name -> array."""
    tables = [pq.read_table(path) for path in sorted((out / "data").glob("*/*.parquet"))]
    assert all({*table.column_names, PICTURE} == set(info["features"]) for table in tables)
    names = [name for name in tables[0].column_names if name != PICTURE]
    return {name: np.concatenate([np.array(table[name].to_pylist()) for table in tables]) for name in names}


def test_lerobot_reads_back_with_plain_pyarrow(job, tmp_path):
    source = export.export(job, "lerobot", tmp_path / "out", silent)
    out = tmp_path / "out"
    info = json.loads((out / "meta" / "info.json").read_text())
    assert (info["codebase_version"], info["total_episodes"], info["total_frames"]) == ("v3.0", 2, 65)
    assert info["fps"] == 100
    episodes = pq.read_table(out / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [one["length"] for one in episodes] == [40, 25]
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


@pytest.mark.parametrize("layout", ["lerobot", "lerobot21"])
def test_no_number_is_missing_labels_are_features_and_pictures_have_statistics(layout, labelled, tmp_path):
    pytest.importorskip("cv2", reason="OpenCV is absent: pip install tactile-core[camera]")
    source = export.export(labelled, layout, tmp_path / "out", silent)
    info = json.loads((tmp_path / "out/meta/info.json").read_text())
    rows, stats = columns(tmp_path / "out", info), json.loads((tmp_path / "out/meta/stats.json").read_text())
    assert all(np.isfinite(values).all() for values in rows.values() if values.dtype.kind in "fiu")
    assert not any(np.isnan(value).any() for one in stats.values() for value in map(np.array, one.values()))
    place = np.concatenate([block["contact_center"] for one in source.recordings for block in one.blocks()])
    np.testing.assert_array_equal(rows["observation.contact"], np.isfinite(place[:, 0]))
    assert {tuple(row) for row in rows["observation.contact_center"][rows["observation.contact"] == 0]} == {(0, 0)}
    assert rows["labels.object"].tolist() == ["ball"] * 20 + ["box"] * 20 + [""] * 25
    assert info["features"]["labels.object"]["dtype"] == "string" and "labels.object" not in stats
    np.testing.assert_allclose(rows["timestamp"], rows["frame_index"] / info["fps"], rtol=1e-6)  # float32
    for episode in (0, 1):
        of = rows["episode_index"] == episode
        state, action = rows["observation.state"][of], rows["action"][of]
        parts = [
            rows[f"observation.{name}"][of].reshape(of.sum(), -1) for name in ("force", "contact_center", "contact")
        ]
        np.testing.assert_array_equal(state, np.concatenate(parts, axis=1))
        np.testing.assert_array_equal(action, [*state[1:], state[-1]])
    pictures = np.concatenate([block["image"] for one in source.recordings for block in one.blocks()]) / 255
    for name in ("min", "max", "mean", "std"):
        expected = getattr(pictures, name)(axis=(0, 1, 2)).reshape(3, 1, 1)
        np.testing.assert_allclose(stats[PICTURE][name], expected, rtol=1e-9, atol=1e-9)


def test_statistics_of_episodes_add_up_to_those_of_all():
    values = np.random.default_rng(0).normal(3, 2, (100, 4))
    parts = []
    for part in (values[:20], values[20:]):
        gathered = EpisodeStats()
        gathered.add({"a": part[:7], "word": np.array(["x"] * 7)})
        gathered.add({"a": part[7:], "word": np.array(["x"] * (len(part) - 7))})
        parts.append(gathered.summarise())
    (found,) = aggregate(parts).values()
    assert found["count"].tolist() == [100]
    for name in ("min", "max", "mean", "std"):
        np.testing.assert_allclose(found[name], getattr(values, name)(axis=0), rtol=1e-12)
    np.testing.assert_allclose(parts[1]["a"]["q90"], np.quantile(values[20:], 0.9, axis=0))


def test_version_2_1_has_a_file_and_a_video_an_episode_and_what_gr00t_asks_for(job, tmp_path):
    cv2 = pytest.importorskip("cv2", reason="OpenCV is absent: pip install tactile-core[camera]")
    source, out = export.export(job, "lerobot21", tmp_path / "out", silent), tmp_path / "out"
    export.export(job, "lerobot21", tmp_path / "again", silent)
    for path in filter(Path.is_file, out.rglob("*")):
        assert path.read_bytes() == (tmp_path / "again" / path.relative_to(out)).read_bytes()
    info = json.loads((out / "meta/info.json").read_text())
    assert (info["codebase_version"], info["total_videos"], info["features"][PICTURE]["dtype"]) == ("v2.1", 2, "video")
    lines = {name: (out / f"meta/{name}.jsonl").read_text().splitlines() for name in ("episodes", "episodes_stats")}
    assert [json.loads(line)["length"] for line in lines["episodes"]] == [40, 25]
    assert [json.loads(line)["stats"]["action"]["count"] for line in lines["episodes_stats"]] == [[40], [25]]
    assert json.loads((out / "meta/tasks.jsonl").read_text())["task_index"] == 0
    for index, one in enumerate(source.recordings):
        place = {"episode_chunk": 0, "episode_index": index, "video_key": PICTURE}
        assert pq.read_metadata(out / info["data_path"].format(**place)).num_rows == one.frames
        video, read = cv2.VideoCapture(str(out / info["video_path"].format(**place))), []
        while (frame := video.read())[0]:
            read.append(frame[1][..., ::-1])
        pictures = np.concatenate([block["image"] for block in one.blocks()])
        assert video.get(cv2.CAP_PROP_FPS) == info["fps"]
        # grey levels, of a codec; channels swapped: far more
        assert np.abs(np.array(read, float) - pictures).mean() < 8
    stats = json.loads((out / "meta/stats.json").read_text())
    modality = json.loads((out / "meta/modality.json").read_text())
    for kind in ("state", "action"):
        ends = [0, *(part["end"] for part in modality[kind].values())]
        assert sorted(ends)[-1] == info["features"]["action"]["shape"][0]
        for part in modality[kind].values():  # as GR00T cuts each statistic
            for value in stats[part["original_key"]].values():
                assert len(value[part["start"] : part["end"]]) == part["end"] - part["start"]


def test_lerobot_loads_it_as_its_training_does(labelled, tmp_path):
    pytest.importorskip("lerobot", reason="LeRobot is absent: scripts/check_lerobot.py installs it")
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    export.export(labelled, "lerobot", tmp_path / "out", silent)
    data = LeRobotDataset("tactile/touch", root=tmp_path / "out", delta_timestamps={"action": [0, 0.01]})
    assert len(data) == 65 and data.meta.stats[PICTURE]["mean"].shape == (3, 1, 1)
    row = data[39]
    assert row["labels.object"] == "box" and row["action_is_pad"].tolist() == [False, True]
    assert tuple(row[PICTURE].shape) == (3, *fake_tools.SHAPE) and row["task"]


def test_labels_go_into_npz(labelled, tmp_path):
    export.export(labelled, "npz", tmp_path / "out", silent)
    with np.load(tmp_path / "out/00000_a.npz", allow_pickle=False) as arrays:
        assert arrays["labels/object"].tolist() == ["ball"] * 20 + ["box"] * 20
    with np.load(tmp_path / "out/00001_b.npz", allow_pickle=False) as arrays:
        assert not [name for name in arrays if name.startswith("labels")]


@pytest.mark.parametrize(("stretch", "said"), [(3.0, "as the first"), (1e6, "1 or more")])
def test_lerobot_takes_one_rate(stretch, said, job, tmp_path):
    shutil.copytree(job, tmp_path / "job")
    for name, number in (("00001_b", 0), ("00001_b", 1), *([("00000_a", 0), ("00000_a", 1)] if stretch > 99 else [])):
        path = jobs.shard_file(tmp_path / "job", name, number)
        with h5py.File(path, "r+") as file:
            file["time"][:] *= stretch
        checksummed.write_checksum(path)
    with pytest.raises(TactileError, match=said):
        export.export(tmp_path / "job", "lerobot", tmp_path / "out", silent)
