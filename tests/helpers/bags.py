"""ROS bags of a made-up press, as the public drivers of the BioTac write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

START = 1_580_000_000


def write_bag(path: Path, press, container: str, kind: str, finger: int = 0, version: int = 0, topic: str = "/biotac"):
    """container : ros1, mcap or sqlite3 (a folder); kind : all or hand; the press is that of one finger."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    from tactile_core.recordings.formats import bag_biotac_all, bag_biotac_hand

    layout = {"all": bag_biotac_all, "hand": bag_biotac_hand}[kind]
    store = get_typestore(Stores.ROS1_NOETIC if container == "ros1" else Stores.ROS2_HUMBLE)
    for name, text in layout.VERSIONS[version].items():
        store.register(get_types_from_msg(text, name))
    if container == "ros1":
        writer = Writer1(path)
    else:
        plugin = StoragePlugin.MCAP if container == "mcap" else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=plugin)
    serialize = store.serialize_ros1 if container == "ros1" else store.serialize_cdr
    with writer:
        connection = writer.add_connection(topic, layout.MESSAGE, typestore=store)
        for frame, stamp in enumerate(press.time):
            message = {"all": _all, "hand": _hand}[kind](store, press, frame, finger, _header(store, stamp))
            nanoseconds = round((START + stamp) * 1e9)
            writer.write(connection, nanoseconds, bytes(serialize(message, layout.MESSAGE)))


def _header(store, stamp: float):
    nanoseconds = round(stamp * 1e9)
    time = store.types["builtin_interfaces/msg/Time"](START + nanoseconds // 10**9, nanoseconds % 10**9)
    header = store.types["std_msgs/msg/Header"]
    return header(0, time, "hand") if "seq" in header.__dataclass_fields__ else header(time, "hand")


def _all(store, press, frame: int, finger: int, header):
    sensor = store.types["sr_robot_msgs/msg/Biotac"]
    tactiles = [sensor(0, 0, 0, 0, 0, np.zeros(19, np.int16)) for _ in range(5)]
    slow = [int(getattr(press, name)[frame]) for name in ("pdc", "tac", "tdc")]
    tactiles[finger] = sensor(2000, 2001, *slow, press.electrodes[frame].astype(np.int16))
    return store.types["sr_robot_msgs/msg/BiotacAll"](header, tactiles)


def _hand(store, press, frame: int, finger: int, header):
    sensor = store.types["biotac_sensors/msg/BioTacData"]
    data = [sensor("", i, 0, 0, 0, np.zeros(22, np.uint16), np.zeros(19, np.uint16)) for i in range(finger + 1)]
    slow = [int(getattr(press, name)[frame]) for name in ("tdc", "tac", "pdc")]
    pac = np.full(22, 2000, np.uint16)
    data[finger] = sensor("1", finger, *slow, pac, press.electrodes[frame].astype(np.uint16))
    time = store.types["biotac_sensors/msg/BioTacTime"](
        header.stamp, header.stamp, 0, 0, 0, np.zeros(22, np.uint32), np.zeros(19, np.uint32)
    )
    return store.types["biotac_sensors/msg/BioTacHand"](header, "left", data, time)
