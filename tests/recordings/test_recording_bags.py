"""Bags: every container and message version, fingers, parts, and hostile ones."""

import bz2
import contextlib
import sqlite3
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="rosbags is absent: pip install tactile-core[ros]")

from bags import Topic, registered, write_bag, write_topics

from tactile_core import recordings
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.recordings import chunks, electrode_gains
from tactile_core.recordings.bags import bag, ros_messages
from tactile_core.recordings.readers import each_finger, sensor_of
from tactile_core.recordings.recording import name_of


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
    for kind, version, published in (
        ("all", 1, "47a346cfb98ba8199f53056f3ea612f1"),
        ("hand", 0, "d96f900cbfb096d61de125081e11dcab"),
    ):
        name, store = registered(Topic("/x", kind, None, version=version), ros1=True)
        assert store.generate_msgdef(name)[1] == published, kind


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


def test_none_of_a_bag_s_definitions_is_compiled(make, tmp_path, monkeypatch):
    from rosbags.typesys.store import Typestore

    press = make(frames=3)
    write_topics(tmp_path / "touch.bag", "ros1", [Topic("/biotac", "all", press, package="evil_msgs")])

    def refuse(*_):
        raise AssertionError("generates code from a stranger's text")

    monkeypatch.setattr(Typestore, "register", refuse)
    monkeypatch.setattr(Typestore, "get_msgdef", refuse)
    np.testing.assert_array_equal(recordings.read(tmp_path / "touch.bag").electrodes, press.electrodes)


def test_bags_without_a_biotac_are_refused_with_what_they_hold(make, tmp_path):
    press = make(frames=3)
    empty = Topic("/rh/tactile", "all", make(frames=2), package="")
    empty.press.time = []
    write_topics(tmp_path / "touch.bag", "ros1", [Topic("/chatter", "text", press), empty])
    with pytest.raises(TactileError, match=r"no messages of a BioTac: topic /chatter \(std_msgs/msg/String, 3 m"):
        recordings.read(tmp_path / "touch.bag")


def three_topics(press, empty) -> list[Topic]:
    """Two hands in the messages of two drivers, one of other names, each with two fingers; and what is no touch."""
    return [
        Topic("/left/biotac", "hand", press, (0, 1), package="our_msgs"),
        Topic("/right/biotac", "all", press, (1, 3), electrodes=24),
        Topic("/ns/one", "one", press),
        Topic("/chatter", "text", press),
        Topic("/silent", "all", empty),
    ]


NAMED = ["left/biotac/finger0", "left/biotac/finger1", "ns/one/finger0", "right/biotac/finger1", "right/biotac/finger3"]


@pytest.mark.parametrize("container", ["ros1", "mcap", "sqlite3"])
def test_every_finger_of_every_topic_is_read_or_named(container, make, tmp_path, capsys):
    press, empty = make(frames=60), make(frames=2)
    empty.time = []
    path = tmp_path / "hands.bag"
    write_topics(path, container, three_topics(press, empty))
    found = each_finger(path)
    assert found == [f"{path}#{name}" for name in NAMED]
    assert [name_of(one) for one in found] == ["hands_" + name.replace("/", "_") for name in NAMED]
    for one, name in zip(found, NAMED, strict=True):
        sensor = "biotac_sp" if "right" in name else "biotac"
        assert sensor_of(one) == sensor
        recording = recordings.read(one, sensor=sensor)
        assert recording.name == name_of(one) and recording.warnings == ()
        more = 0 if name.startswith("ns") else int(name[-1])
        np.testing.assert_array_equal(recording.electrodes[:, :19], press.electrodes + more)
        np.testing.assert_array_equal(recording.pdc, press.pdc)
        np.testing.assert_allclose(recording.time, press.time, atol=1e-6)  # the lone one by the bag's own stamps
    assert main(["info", str(path)]) == 0
    told = capsys.readouterr().out
    for text in (*NAMED, "/chatter (std_msgs/msg/String, 60 messages)", "finger 0, 2, 4 of /right/biotac (all zeros"):
        assert text in told, text
    assert "fields hand_id, bt_time, bt_serial, bt_position of /left/biotac" in told


def test_a_topic_and_its_finger_are_chosen_in_any_spelling(make, tmp_path):
    press, empty = make(frames=20), make(frames=2)
    empty.time = []
    path = tmp_path / "hands.bag"
    write_topics(path, "ros1", three_topics(press, empty))
    for word in ("left/biotac/finger1", "/left/biotac/finger1", "left/biotac/1", "//left/biotac//1"):
        np.testing.assert_array_equal(recordings.read(f"{path}#{word}").electrodes, press.electrodes + 1)
    assert each_finger(f"{path}#/left/biotac") == [f"{path}#left/biotac/finger{number}" for number in (0, 1)]
    assert each_finger(f"{path}#1") == [f"{path}#{topic}/finger1" for topic in ("left/biotac", "right/biotac")]
    warning = recordings.read(path).warnings[0]
    assert warning.startswith("finger left/biotac/finger0 is read; others with signals: left/biotac/finger1, ns/one")
    with pytest.raises(TactileError, match="no BioTac in a topic 'middle'; expected one of /left/biotac, "):
        recordings.read(f"{path}#middle/finger0")
    with pytest.raises(TactileError, match="2 fingers, no number 4"):
        recordings.read(f"{path}#left/biotac/4")
    with pytest.raises(TactileError, match="topic 'left' of a file without topics"):
        recordings.read(f"{__file__}#left/0")


def test_each_topic_s_finger_is_a_unit_of_its_own(make, tmp_path):
    """Two hands' first fingers are two units: one section for both would be the rest of neither."""
    for number in range(3):
        press = make(frames=60, seed=number)
        other = type(press)(**(vars(press) | {"electrodes": press.electrodes + 100}))
        topics = [Topic(f"/{name}", "one", each, electrodes=24) for name, each in (("left", press), ("right", other))]
        write_topics(tmp_path / f"{number}.bag", "ros1", topics)
    bags, out = [str(tmp_path / f"{number}.bag") for number in range(3)], str(tmp_path / "rest.toml")
    assert main(["adapt", *bags, "--out", out]) == 0
    units = electrode_gains.read(out).sections()
    assert list(units) == ["left/finger0", "right/finger0"]
    left, right = (np.array(unit.rest_counts) for unit in units.values())
    assert (right > left + 50).all()  # 100 apart; what fits rest to simulated contacts moves each by up to 50
    assert main(["info", f"{bags[0]}#right/finger0", "--sensor", out]) == 0


def test_a_topic_may_be_called_like_a_finger(make, tmp_path):
    press, path = make(frames=5), tmp_path / "touch.bag"
    write_topics(path, "ros1", [Topic("/left/finger0", "one", press), Topic("/left/finger1", "one", press)])
    assert each_finger(path) == [f"{path}#left/finger{number}/finger0" for number in (0, 1)]
    assert name_of(f"{path}#left/finger1") == "touch_left_finger1" == recordings.read(f"{path}#left/finger1").name


class LateTopic(Topic):
    """A topic whose second finger's driver starts after 1.5 s."""

    def counts(self, frame, finger):
        return super().counts(frame, finger) * (finger == 0 or frame >= 150)


@pytest.mark.parametrize("container", ["ros1", "mcap", "sqlite3"])
def test_a_finger_whose_driver_starts_late_is_read(container, make, tmp_path):
    write_topics(tmp_path / "touch", container, [LateTopic("/biotac", "all", make(frames=400), (0, 1))])
    assert each_finger(tmp_path / "touch") == [f"{tmp_path / 'touch'}#{number}" for number in (0, 1)]
    if container != "ros1":  # the file in the folder
        (path,) = (each for each in (tmp_path / "touch").iterdir() if each.suffix != ".yaml")
        assert each_finger(path) == [f"{path}#{number}" for number in (0, 1)]


def test_messages_without_stamps_take_the_bag_s(make, tmp_path):
    press, path = make(frames=30), tmp_path / "touch"
    write_topics(path, "mcap", [Topic("/biotac", "hand", press, stamped=False)])
    recording = recordings.read(path)
    np.testing.assert_allclose(recording.time, press.time, atol=1e-6)
    assert recording.start_time == 1.58e9


def test_messages_that_are_not_as_defined_are_no_damage(make, tmp_path, monkeypatch):
    """Bags of before 2023 have no definitions: the known ones are tried, the one that fits is taken."""
    press, path = make(frames=5), tmp_path / "touch"
    write_topics(path, "sqlite3", [Topic("/biotac", "all", press, version=1)])
    (database,) = path.glob("*.db3")
    with contextlib.closing(sqlite3.connect(database)) as opened, opened:
        opened.execute("DELETE FROM message_definitions")
    np.testing.assert_array_equal(recordings.read(path).electrodes, press.electrodes)
    kind = "sr_robot_msgs/msg/BiotacAll"
    monkeypatch.setitem(ros_messages.KNOWN, kind, ros_messages.KNOWN[kind][:1])
    with pytest.raises(TactileError, match=f"message 0: is not as its type {kind} is defined") as refused:
        recordings.read(path)
    assert "damaged" not in str(refused.value)


def test_a_bag_that_was_not_closed_is_not_called_damaged(make, tmp_path):
    write_bag(tmp_path / "touch.bag", make(frames=5), "ros1", "all")
    data = bytearray((tmp_path / "touch.bag").read_bytes())
    place = data.index(b"index_pos=") + len(b"index_pos=")
    data[place : place + 8] = bytes(8)
    (tmp_path / "touch.bag").write_bytes(data)
    with pytest.raises(TactileError, match=r"cannot be read \(Bag is not indexed.*rosbag reindex") as refused:
        recordings.read(tmp_path / "touch.bag")
    assert "damaged" not in str(refused.value)


def defined(*types: str):
    """The definition of the first of these types, each written as ROS writes it, such as ``x/A`` and its fields."""
    first, *others = types
    text = first.split("\n", 1)[1] + "".join(f"{'=' * 80}\nMSG: {each}" for each in others)
    (definition,) = ros_messages.definitions("x/msg/A", text, idl=False)
    return definition


def test_definitions_that_multiply_cost_no_time():
    """From strangers: lists of lists of nothing, and messages of messages, would be searched for years."""
    nothing = [f"x/{name}\nx/{within}[1000] a\n" for name, within in ("BC", "CD", "DE")]
    bomb = defined("x/A\nint16[19] electrodes\nx/B[1000] a\n", *nothing, "x/E\n")
    with pytest.raises(ValueError, match="more entries than bytes"):
        ros_messages.decoded(bomb, True, bytes(4000))
    wide = [f"x/{name}\n" + "".join(f"x/{within} f{i}\n" for i in range(100)) for name, within in pairwise("ABCDEF")]
    assert ros_messages.sensors_in(defined(*wide, "x/F\nint16 electrodes\n")) == []
    assert len(ros_messages.sensors_in(defined(*wide, "x/F\nint16[] electrodes\n"))) == ros_messages.MOST_SENSORS
    assert ros_messages.sensors_in(defined("x/A\nx/A[] electrodes\n")) == []


def test_the_bags_of_others_are_read_whole(outside_data):
    """Two hands of SynTouch's driver, two of Shadow's, and a BioTac SP in Shadow's message, called damaged before."""
    folder = outside_data("outside/bags")
    for name, sensor, fingers in (
        ("two_hands.bag", "biotac", ["left_hand/biotac_pub/finger0", "right_hand/biotac_pub/finger0"]),
        ("shadow_bimanual", "biotac", [f"{hand}/tactile/finger{number}" for hand in ("lh", "rh") for number in (0, 1)]),
        ("shadow24_sp", "biotac_sp", ["0", "1"]),
        ("shadow24_sp/shadow24_sp.mcap", "biotac_sp", ["0", "1"]),
    ):
        found = each_finger(folder / name)
        assert found == [f"{folder / name}#{finger}" for finger in fingers]
        for one in found:
            assert recordings.read(one, sensor=sensor).electrodes.mean() > 3000  # counts: none is a finger of zeros


def test_the_decoder_agrees_with_the_library_s(make):
    """Alignment, lists, texts, nested messages in both formats; the library compiles definitions, this one does not."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    text = "bool a\nfloat64[] empty\nuint8 b\nint64 c\nstring d\nuint8[3] e\nfloat64 f\nstring[] g\n"
    text += "geometry_msgs/Point32[] h\nint16[] electrodes\nbuiltin_interfaces/Duration j\nuint32 k\n"
    for ros1, stores in ((True, Stores.ROS1_NOETIC), (False, Stores.ROS2_HUMBLE)):
        store = get_typestore(stores)
        store.register(get_types_from_msg(text, "x/msg/Odd"))
        types = store.types
        point, duration = types["geometry_msgs/msg/Point32"], types["builtin_interfaces/msg/Duration"]
        sent = types["x/msg/Odd"](
            True, np.empty(0), 7, -(2**40), "käse", np.array([1, 2, 3], np.uint8), 0.1, ["", "ab"],
            [point(1.0, 2.0, 3.0), point(4.0, 5.0, 6.0)], np.array([-1, 5], np.int16), duration(1, 2), 9,
        )  # fmt: skip
        data = bytes((store.serialize_ros1 if ros1 else store.serialize_cdr)(sent, "x/msg/Odd"))
        whole = store.generate_msgdef("x/msg/Odd", ros_version=1 if ros1 else 2)[0]
        (definition,) = ros_messages.definitions("x/msg/Odd", whole, idl=False)
        found = ros_messages.decoded(definition, ros1, data)
        assert (found["a"], found["b"], found["c"], found["d"], found["f"]) == (True, 7, -(2**40), "käse", 0.1)
        assert found["g"] == ["", "ab"] and found["electrodes"].tolist() == [-1, 5] and found["k"] == 9
        assert found["e"].tolist() == [1, 2, 3] and found["empty"].size == 0
        assert [float(each["y"]) for each in found["h"]] == [2.0, 5.0] and found["j"]["sec"] == 1
        with pytest.raises(ValueError, match="8 bytes are left"):
            ros_messages.decoded(definition, ros1, data + bytes(8))


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
