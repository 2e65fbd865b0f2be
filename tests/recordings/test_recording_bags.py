"""Bags: every container and message version, fingers, parts, and hostile ones."""

from __future__ import annotations

import bz2
import contextlib
import sqlite3

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="rosbags is absent: pip install tactile-core[ros]")

from bags import write_bag

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings import bag, chunks
from tactile_core.recordings.formats import bag_biotac_all, bag_biotac_hand


@pytest.mark.parametrize("container", ["ros1", "mcap", "sqlite3"])
@pytest.mark.parametrize(("kind", "version"), [("all", 0), ("all", 1), ("hand", 0)])
def test_every_container_and_version_reads_the_same(container, kind, version, make, tmp_path):
    press = make(frames=60)
    write_bag(tmp_path / "touch", press, container, kind, version=version)
    recording = recordings.read(tmp_path / "touch")
    np.testing.assert_array_equal(recording.electrodes, press.electrodes)
    np.testing.assert_array_equal(recording.pdc, press.pdc)
    np.testing.assert_allclose(recording.time, press.time, atol=1e-6)  # unix stamps hold 2.4e-7 s in a float64
    assert recording.warnings == () and recording.start_time == 1.58e9
    assert recording.pac.shape == (60, 22 if kind == "hand" else 2)


def test_the_definitions_have_the_published_hashes():
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    for layout, version, published in (
        (bag_biotac_all, 1, "47a346cfb98ba8199f53056f3ea612f1"),
        (bag_biotac_hand, 0, "d96f900cbfb096d61de125081e11dcab"),
    ):
        store = get_typestore(Stores.ROS1_NOETIC)
        for name, text in layout.VERSIONS[version].items():
            store.register(get_types_from_msg(text, name))
        assert store.generate_msgdef(layout.MESSAGE)[1] == published


def test_a_single_mcap_file_and_parts(make, tmp_path, monkeypatch):
    press = make(frames=700)
    write_bag(tmp_path / "touch", press, "mcap", "hand")
    (path,) = (tmp_path / "touch").glob("*.mcap")
    monkeypatch.setattr(chunks, "PART_FRAMES", 300)
    found = list(chunks.read_parts(path))
    assert [(len(one.recording), one.repeated) for one in found] == [(300, 0), (500, 200), (300, 200)]
    joined = np.concatenate([one.recording.electrodes[one.repeated :] for one in found])
    np.testing.assert_array_equal(joined, press.electrodes)
    time = np.concatenate([one.recording.time[one.repeated :] for one in found])
    np.testing.assert_allclose(time, press.time, atol=2e-6)


def test_the_finger_with_signals_is_found_and_another_can_be_asked_for(make, tmp_path):
    press = make(frames=20)
    write_bag(tmp_path / "touch.bag", press, "ros1", "all", finger=3)
    recording = recordings.read(tmp_path / "touch.bag")
    np.testing.assert_array_equal(recording.electrodes, press.electrodes)
    assert not recordings.read(f"{tmp_path / 'touch.bag'}#1").electrodes.any()
    write_bag(tmp_path / "hand.bag", press, "ros1", "hand", finger=1)
    with pytest.raises(TactileError, match="2 fingers, no number 4"):
        recordings.read(f"{tmp_path / 'hand.bag'}#4")


def test_a_hand_without_signals_is_read_and_told(make, tmp_path):
    press = make(frames=60)
    press.electrodes[:] = 0
    write_bag(tmp_path / "touch", press, "mcap", "hand", finger=1)
    recording = recordings.read(tmp_path / "touch")
    assert recording.warnings[0] == "all electrodes of all 2 fingers are 0: finger 0 is read"
    np.testing.assert_array_equal(recording.electrodes, 0)


def test_another_version_of_a_message_is_refused_and_none_of_its_text_is_run(make, tmp_path, monkeypatch):
    evil = {**bag_biotac_all.VERSIONS[0], "sr_robot_msgs/msg/Biotac": "int16 pac0\nint16[] electrodes\n"}
    write_bag(tmp_path / "good.bag", make(frames=3), "ros1", "all")
    monkeypatch.setattr(bag_biotac_all, "VERSIONS", [evil])
    with pytest.raises(TactileError, match="of hash"):
        recordings.read(tmp_path / "good.bag")


def test_bags_without_a_biotac_are_refused(make, tmp_path, monkeypatch):
    write_bag(tmp_path / "touch.bag", make(frames=3), "ros1", "all")
    monkeypatch.setattr(bag_biotac_all, "MESSAGE", "other/msg/Thing")
    with pytest.raises(TactileError, match="no known recording: messages"):
        recordings.read(tmp_path / "touch.bag")


def test_a_chunk_that_unpacks_to_too_much_is_refused(make, tmp_path, monkeypatch):
    monkeypatch.setattr(bag, "MAX_CHUNK", 2**20)
    bag._bound_unpacking()
    from rosbags.rosbag1.reader import decompressors

    with pytest.raises(ValueError, match="a chunk of over 1 MB"):
        decompressors["bz2"](bz2.compress(bytes(2**22)))
    assert decompressors["bz2"](bz2.compress(b"short")) == b"short"


def test_a_bag_packed_file_by_file_is_refused(make, tmp_path):
    write_bag(tmp_path / "touch", make(frames=3), "mcap", "hand")
    mark = tmp_path / "touch" / "metadata.yaml"
    mark.write_text(mark.read_text().replace("compression_mode: ''", "compression_mode: FILE"))
    assert "FILE" in mark.read_text()
    with pytest.raises(TactileError, match="packed file by file"):
        recordings.read(tmp_path / "touch")
    mark.write_text(mark.read_text().replace("FILE", "''") + "#" * bag.MAX_METADATA)
    with pytest.raises(TactileError, match="huge metadata"):
        recordings.read(tmp_path / "touch")


@pytest.mark.parametrize(("column", "value"), [("type", None), ("name", None), ("name", b"/biotac"), ("type", 3.5)])
def test_a_topic_whose_name_or_type_is_no_text_is_refused(column, value, make, tmp_path):
    """Found by fuzzing: single bytes of a database make a column NULL, a number or bytes."""
    write_bag(tmp_path / "touch", make(frames=3), "sqlite3", "hand")
    (path,) = (tmp_path / "touch").glob("*.db3")
    with contextlib.closing(sqlite3.connect(path)) as database, database:
        database.execute("CREATE TABLE loose AS SELECT * FROM topics")  # without the columns' constraints
        database.execute("DROP TABLE topics")
        database.execute("ALTER TABLE loose RENAME TO topics")
        database.execute(f"UPDATE topics SET {column} = ?", [value])
    with pytest.raises(TactileError, match=r"touch.*db3"):
        recordings.read(path)


@pytest.mark.parametrize("container", ["ros1", "mcap", "sqlite3"])
def test_damaged_bags_end_in_one_error(container, make, tmp_path):
    write_bag(tmp_path / "touch", make(frames=20), container, "hand")
    whole = tmp_path / "touch"
    path = whole if whole.is_file() else next(file for file in whole.iterdir() if file.suffix != ".yaml")
    data = path.read_bytes()
    random = np.random.default_rng(3)
    for _ in range(40):
        broken = bytearray(data)
        for place in random.integers(16, len(data), 6):
            broken[place] = random.integers(256)
        (tmp_path / "broken").write_bytes(broken[: random.integers(20, len(broken))])
        with contextlib.suppress(TactileError):  # anything else fails the test
            assert len(recordings.read(tmp_path / "broken")) <= 20
