"""Open ROS 1 and ROS 2 bags and MCAP files without ROS, and separate topics with BioTacs from the others."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from ...errors import TactileError
from ...files import installed, outside
from ...files.outside import damage_reported
from ...files.short_text import listed
from .ros_messages import Definition, definitions, sensors_in

STARTS = {b"#ROSBAG V": "ros1", b"\x89MCAP0\r\n": "mcap", b"SQLite format 3\0": "sqlite"}
START_BYTES = 16  # bytes of a file from which its kind is known
MARK = "metadata.yaml"  # of a folder that is a ROS 2 bag
MAX_CHUNK = 256 * 2**20  # bytes of an unpacked chunk; recorders make them of 1 to 16 MB (assumed enough)
MAX_METADATA = 2**20  # bytes of YAML (assumed enough; four times as many take 30 s to parse)
PACKED = re.compile(rb"compression_mode:\s*[\"']?(file|message)", re.IGNORECASE)
# Errors of the library about undamaged files that it does not read; its KeyErrors are about unknown formats.
UNDAMAGED = re.compile(r"not supported|[Uu]nsupported|not ros2|not indexed|not in timestamp order|are missing")


@dataclass(frozen=True)
class Topic:
    """A topic whose messages hold BioTacs.
    kind : name of its message type; definitions : what that type may hold, one of which fits
    connections : the topic's connections, objects of the library rosbags"""

    name: str
    kind: str
    connections: list[Any]
    definitions: list[Definition]


@dataclass(frozen=True)
class Bag:
    """An open bag.
    ros1 : true for a bag of ROS 1, false for ROS 2; reader : opened reader of the library rosbags
    topics : topics with BioTacs, sorted by name; others : the other topics, each in words
    middle : unix time half-way between the bag's start and end, ns"""

    path: str
    ros1: bool
    topics: list[Topic]
    others: tuple[str, ...]
    reader: Any
    middle: int


def is_bag_folder(path: str) -> bool:
    """Return true for a ROS 2 bag's folder. Raises TactileError for compressed files in it, and for links out of it."""
    if not os.path.isfile(os.path.join(path, MARK)):
        return False
    with outside.open_file(outside.inside(path, MARK), "a bag's metadata") as file:
        metadata = file.read(MAX_METADATA + 1)
    if len(metadata) > MAX_METADATA or PACKED.search(metadata):
        advice = "Unpack it: ros2 bag convert"
        raise TactileError(path, "a bag packed file by file, or with huge metadata", "a plain bag", advice)
    for name in sorted(os.listdir(path)):
        if not os.path.isdir(os.path.join(path, name)):
            outside.check(outside.inside(path, name, "a bag's own file"), "a bag's own file")
    return True


def kind_of(start: bytes) -> str | None:
    """Return the kind of bag that begins with these bytes: "ros1", "mcap" or "sqlite"; None for any other file."""
    return next((name for mark, name in STARTS.items() if start.startswith(mark)), None)


@contextmanager
def open_bag(path: str, file: BinaryIO) -> Iterator[Bag]:
    """Open a bag to read. Raises TactileError for damage, for a bag without a BioTac, and if rosbags (the package's
    extra [ros]) is not installed.
    file : the opened file, at its start; an empty one if the bag is a folder, which `is_bag_folder` has checked"""
    with installed.needing("ros"):
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2
        from rosbags.rosbag2.storage_mcap import McapReader
        from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

    _bound_unpacking()
    kind = kind_of(file.read(START_BYTES)) or "folder"
    openers: dict[str, Any] = {"ros1": Reader1, "mcap": McapReader, "sqlite": Sqlite3Reader, "folder": Reader2}
    with refused(path):
        reader = openers[kind](Path(path))
        reader.open()
    try:
        if not all(isinstance(name, str) for one in reader.connections for name in (one.topic, one.msgtype)):
            raise TactileError(path, "a topic without a name or a message type", "both, as text", "The bag is damaged")
        yield _sorted(path, reader, kind == "ros1")
    finally:
        reader.close()


@contextmanager
def refused(path: str) -> Iterator[None]:
    """Raise errors of rosbags in the block as TactileError: of damage, or of a bag that is whole but cannot be read."""
    try:
        with damage_reported(path, "bag"):
            yield
    except TactileError as error:
        if not UNDAMAGED.search(str(error.__cause__)) and not isinstance(error.__cause__, KeyError):
            raise
        advice = "Mend or convert it with ROS: rosbag reindex, ros2 bag reindex, ros2 bag convert"
        raise TactileError(path, f"cannot be read ({error.__cause__})", "a plain, indexed bag", advice) from error


def _sorted(path: str, reader: Any, ros1: bool) -> Bag:
    """Return the bag of an open reader. Raises TactileError if no topic has a BioTac and a message."""
    grouped: dict[tuple[str, str], list[Any]] = {}
    for connection in reader.connections:
        grouped.setdefault((connection.topic, connection.msgtype), []).append(connection)
    topics: dict[str, Topic] = {}
    others = []
    for (name, kind), connections in sorted(grouped.items()):
        text = connections[0].msgdef
        known = [each for each in definitions(kind, text.data, text.format.name == "IDL") if sensors_in(each)]
        with refused(path):  # counts that a file states may be missing
            empty = bool(known) and next(iter(reader.messages(connections)), None) is None
        if known and not empty and name not in topics:
            topics[name] = Topic(name, kind, connections, known)
        else:
            count = sum(each.msgcount for each in connections)
            others.append(f"topic {name} ({kind}, {'no' if empty else count} messages)")
    if not topics:
        found = f"no messages of a BioTac: {listed(others)}" if others else "no topics"
        expected = "messages with 19 or 24 numbers called electrodes or electrode_data, as sr_robot_msgs/msg/BiotacAll"
        raise TactileError(path, found, expected, "Record the topic of the BioTacs' driver")
    with refused(path):
        times = reader if hasattr(reader, "start_time") else reader.metadata  # a folder's reader has them itself
        middle = (times.start_time + times.end_time) // 2
    return Bag(path, ros1, list(topics.values()), tuple(others), reader, middle)


def _bound_unpacking() -> None:
    """Make rosbags stop at `MAX_CHUNK` bytes where it unpacks a chunk, whatever size the file declares."""
    import bz2

    import lz4.frame
    from rosbags.rosbag1 import reader
    from rosbags.rosbag2 import storage_mcap

    def bounded(unpacker: Callable[[], Any]) -> Callable[..., bytes]:
        """Return a function that unpacks a chunk by a new ``unpacker()``, to less than `MAX_CHUNK` bytes."""

        def unpack(data: bytes, size: int = 0) -> bytes:
            """Return the bytes of a chunk; size is ignored. Raises ValueError for `MAX_CHUNK` bytes and more."""
            found = unpacker().decompress(data, max_length=MAX_CHUNK)
            if len(found) >= MAX_CHUNK:
                raise ValueError(f"a chunk of over {MAX_CHUNK // 2**20} MB")
            return found

        return unpack

    lz4_bounded = bounded(lz4.frame.LZ4FrameDecompressor)
    reader.decompressors |= {"bz2": bounded(bz2.BZ2Decompressor), "lz4": lz4_bounded}
    storage_mcap.DECOMPRESSORS |= {"lz4": lz4_bounded, "zstd": bounded(storage_mcap.zstd.ZstdDecompressor)}
