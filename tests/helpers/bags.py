"""ROS bags of a made-up press, as the public drivers of the BioTac write them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

START = 1_580_000_000
TYPES = {
    "all": "sr_robot_msgs/msg/BiotacAll",
    "hand": "biotac_sensors/msg/BioTacHand",
    "one": "sr_robot_msgs/msg/Biotac",
    "text": "std_msgs/msg/String",
}


@dataclass
class Topic:
    """A topic of a bag.

    kind : a key of TYPES; fingers : that are pressed, a count a number above the press where they are several
    electrodes : of Shadow's messages, those beyond 19 repeat the first; package : another name of the
        messages' package
    """

    name: str
    kind: str
    press: Any
    fingers: tuple[int, ...] = (0,)
    version: int = 0
    electrodes: int = 19
    package: str = ""
    stamped: bool = True

    def counts(self, frame: int, finger: int) -> np.ndarray:
        """Return the counts (electrodes,) of a finger, a finger's number above those of the press."""
        return np.resize(self.press.electrodes[frame], self.electrodes) + finger * (len(self.fingers) > 1)


def write_bag(path: Path, press, container: str, kind: str, finger: int = 0, version: int = 0, topic: str = "/biotac"):
    """container : ros1, mcap or sqlite3 (a folder); kind : all or hand; the press is that of one finger."""
    write_topics(path, container, [Topic(topic, kind, press, (finger,), version)])


def write_topics(path: Path, container: str, topics: list[Topic]) -> None:
    """Write a bag of several topics, one after the other."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    if container == "ros1":
        writer = Writer1(path)
    else:
        plugin = StoragePlugin.MCAP if container == "mcap" else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=plugin)
    with writer:
        for topic in topics:
            kind, store = registered(topic, container == "ros1")
            serialize = store.serialize_ros1 if container == "ros1" else store.serialize_cdr
            connection = writer.add_connection(topic.name, kind, typestore=store)
            for frame, stamp in enumerate(topic.press.time):
                message = _message(store, topic, frame, _header(store, stamp if topic.stamped else -START))
                nanoseconds = round((START + stamp) * 1e9)
                writer.write(connection, nanoseconds, bytes(serialize(message, kind)))


def registered(topic: Topic, ros1: bool):
    """Return the type of a topic's messages, and a store that knows it."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    from tactile_core.recordings.bags.ros_messages import KNOWN

    store, kind = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE), TYPES[topic.kind]
    package, renamed = kind.split("/")[0], lambda text: text
    if topic.package:
        renamed = lambda text: text.replace(package, topic.package)  # noqa: E731 - a name for both cases
    for name, text in KNOWN[kind][topic.version].items() if kind in KNOWN else ():
        store.register(get_types_from_msg(renamed(text), renamed(name)))
    return renamed(kind), store


def _header(store, stamp: float):
    nanoseconds = round(stamp * 1e9)
    time = store.types["builtin_interfaces/msg/Time"](START + nanoseconds // 10**9, nanoseconds % 10**9)
    header = store.types["std_msgs/msg/Header"]
    return header(0, time, "hand") if "seq" in header.__dataclass_fields__ else header(time, "hand")


def _message(store, topic: Topic, frame: int, header):
    package = topic.package or TYPES[topic.kind].split("/")[0]
    if topic.kind == "text":
        return store.types[TYPES["text"]]("nothing to feel")
    if topic.kind == "one":
        return _shadow(store, package, topic, frame, topic.fingers[0])
    if topic.kind == "all":
        none = store.types[f"{package}/msg/Biotac"](0, 0, 0, 0, 0, np.zeros(topic.electrodes, np.int16))
        tactiles = [_shadow(store, package, topic, frame, i) if i in topic.fingers else none for i in range(5)]
        return store.types[f"{package}/msg/BiotacAll"](header, tactiles)
    data = [_data(store, package, topic, frame, i) for i in range(max(topic.fingers) + 1)]
    time = store.types[f"{package}/msg/BioTacTime"](
        header.stamp, header.stamp, 0, 0, 0, np.zeros(22, np.uint32), np.zeros(19, np.uint32)
    )
    return store.types[f"{package}/msg/BioTacHand"](header, "left", data, time)


def _shadow(store, package: str, topic: Topic, frame: int, finger: int):
    slow = [int(getattr(topic.press, name)[frame]) for name in ("pdc", "tac", "tdc")]
    counts = topic.counts(frame, finger).astype(np.int16)
    return store.types[f"{package}/msg/Biotac"](2000, 2001, *slow, counts)


def _data(store, package: str, topic: Topic, frame: int, finger: int):
    sensor = store.types[f"{package}/msg/BioTacData"]
    if finger not in topic.fingers:
        return sensor("", finger, 0, 0, 0, np.zeros(22, np.uint16), np.zeros(19, np.uint16))
    slow = [int(getattr(topic.press, name)[frame]) for name in ("tdc", "tac", "pdc")]
    counts = topic.counts(frame, finger).astype(np.uint16)
    return sensor("1", finger, *slow, np.full(22, 2000, np.uint16), counts)
