"""ROS 1 and ROS 2 bags and MCAP files, read without ROS, by the project's own message definitions.

A bag's own message definitions are compared, never compiled: the decoding library generates code from definitions.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO

import numpy as np

from ..errors import TactileError
from ..files import installed, outside
from ..sensors import ELECTRODES
from .array_store import damage_reported
from .assemble import MAX_FRAMES, assemble, check_electrodes
from .fingers import named
from .recording import Recording

LOOKED_AT = 100  # frames from which the fingers of a hand are recognised
STARTS = {b"#ROSBAG V": "ros1", b"\x89MCAP0\r\n": "mcap", b"SQLite format 3\0": "sqlite"}
START_BYTES = 16  # bytes of a file from which its kind is known
MARK = "metadata.yaml"  # of a folder that is a ROS 2 bag
MAX_CHUNK = 256 * 2**20  # bytes of an unpacked chunk; recorders make them of 1 to 16 MB (assumed enough)
MAX_METADATA = 2**20  # bytes of YAML, of which four times as many take 30 s (assumed enough)
PACKED = re.compile(rb"compression_mode:\s*[\"']?(file|message)", re.IGNORECASE)


@dataclass(frozen=True)
class Bag:
    """An open bag. topics : message type -> its connections; finger : requested as ``path#finger``, or None."""

    path: str
    ros1: bool
    finger: int | None
    topics: dict[str, list[Any]]
    reader: Any


def is_bag_folder(path: str) -> bool:
    """Return true for the folder of a ROS 2 bag.

    Raises TactileError for one that is compressed file by file, or holds links out of its folder.
    """
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
    """Return the kind of bag that a file's first START_BYTES begin: ros1, mcap or sqlite; None for any other file."""
    return next((name for mark, name in STARTS.items() if start.startswith(mark)), None)


@contextmanager
def open_bag(path: str, file: BinaryIO, finger: int | None = None) -> Iterator[Bag]:
    """Open for reading; raises TactileError for damage, and without the extra [ros].

    file : the opened file, from its start; an empty one where the bag is a folder that `is_bag_folder` has passed
    """
    with installed.needing("ros"):
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2
        from rosbags.rosbag2.storage_mcap import McapReader
        from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

    _bound_unpacking()
    kind = kind_of(file.read(START_BYTES)) or "folder"
    openers: dict[str, Any] = {"ros1": Reader1, "mcap": McapReader, "sqlite": Sqlite3Reader, "folder": Reader2}
    with damage_reported(path, "bag"):
        reader = openers[kind](Path(path))
        reader.open()
    try:
        if not all(isinstance(name, str) for one in reader.connections for name in (one.topic, one.msgtype)):
            raise TactileError(path, "a topic without a name or a message type", "both, as text", "The bag is damaged")
        topics: dict[str, list[Any]] = {}
        for connection in sorted(reader.connections, key=lambda one: one.topic):
            topics.setdefault(connection.msgtype, []).append(connection)
        yield Bag(path, kind == "ros1", finger, topics, reader)
    finally:
        reader.close()


def _bound_unpacking() -> None:
    """Make the library unpack no chunk to more than MAX_CHUNK; by default it unpacks whatever size a file declares."""
    import bz2

    import lz4.frame
    from rosbags.rosbag1 import reader
    from rosbags.rosbag2 import storage_mcap

    def bounded(unpacker: Callable[[], Any]) -> Callable[..., bytes]:
        def unpack(data: bytes, size: int = 0) -> bytes:
            found = unpacker().decompress(data, max_length=MAX_CHUNK)
            if len(found) >= MAX_CHUNK:
                raise ValueError(f"a chunk of over {MAX_CHUNK // 2**20} MB")
            return found

        return unpack

    lz4_bounded = bounded(lz4.frame.LZ4FrameDecompressor)
    reader.decompressors |= {"bz2": bounded(bz2.BZ2Decompressor), "lz4": lz4_bounded}
    storage_mcap.DECOMPRESSORS |= {"lz4": lz4_bounded, "zstd": bounded(storage_mcap.zstd.ZstdDecompressor)}


def read_bag(
    bag: Bag, layout: ModuleType, frames: int = MAX_FRAMES + 1, context: int = 0
) -> Iterator[tuple[Recording, int]]:
    """Yield recordings of `frames` frames, each with the number of first frames that it repeats from the one before.

    Reads the requested finger, or the first that is not all zeros; a warning names the others.
    """
    rows = np.empty((0, layout.WIDTH + 1))
    warnings: list[str] = []
    finger, repeated = bag.finger, 0
    for block in _blocks(bag, layout, frames):
        if finger is None:
            finger, warnings = _choose(bag, block)
        if finger >= block.shape[1]:
            raise TactileError(bag.path, f"{block.shape[1]} fingers, no number {finger}", "path#finger, from 0")
        rows = np.concatenate([rows[len(rows) - repeated :], block[:, finger]])
        yield named(_recording(bag, layout, rows, warnings), bag.finger), repeated
        repeated = min(context, len(rows))
    if finger is None:
        raise TactileError(bag.path, f"no {layout.MESSAGE} message", "at least one frame")


def fingers_of(bag: Bag, layout: ModuleType) -> tuple[int, ...]:
    """Return the numbers of a hand's fingers whose electrodes are not all zeros in its first frames."""
    block = next(_blocks(bag, layout, LOOKED_AT), np.empty((0, 0, ELECTRODES)))
    return tuple(int(number) for number in _live(block))


def _live(block: np.ndarray) -> np.ndarray:
    """Fingers with signals in frames (n, fingers, 1 + WIDTH), electrodes last."""
    return np.flatnonzero(block[..., -ELECTRODES:].any(axis=(0, 2)))


def _blocks(bag: Bag, layout: ModuleType, frames: int) -> Iterator[np.ndarray]:
    """Yield (n, fingers, 1 + WIDTH) float, stamp first, n up to `frames`."""
    connections = bag.topics[layout.MESSAGE]
    connections = [one for one in connections if one.topic == connections[0].topic]
    rows: list[np.ndarray] = []
    for stamp, message in _messages(bag, layout, connections):
        sensors = layout.sensors(message)
        if rows and len(sensors) != len(rows[-1]):
            raise TactileError(bag.path, f"{len(sensors)} fingers after {len(rows[-1])}", "as many in each message")
        row = np.empty((len(sensors), layout.WIDTH + 1))
        for finger, sensor in enumerate(sensors):
            values = layout.row(sensor)
            if len(values) != layout.WIDTH:
                check_electrodes(bag.path, len(values) - layout.WIDTH + ELECTRODES, layout.MESSAGE)
            row[finger, 0], row[finger, 1:] = stamp, values
        rows.append(row)
        if len(rows) == frames:
            yield np.stack(rows)
            rows = []
    if rows:
        yield np.stack(rows)


def _messages(bag: Bag, layout: ModuleType, connections: list[Any]) -> Iterator[tuple[float, Any]]:
    """Yield stamps (unix s) and decoded messages of one topic; the header's stamp, or the bag's where that is 0."""
    decode = None
    with damage_reported(bag.path, "bag"):
        messages = bag.reader.messages(connections)
        for connection, written, data in messages:
            decode = decode or _decoder(bag, layout, connection)
            message = decode(data)
            stamp = message.header.stamp
            seconds = stamp.sec + 1e-9 * stamp.nanosec
            yield seconds or 1e-9 * written, message


def _decoder(bag: Bag, layout: ModuleType, connection: Any) -> Callable[[bytes], Any]:
    """Return the decoder of a connection's messages, by that of the project's definitions whose hash it has."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    stores = []
    for version in layout.VERSIONS:
        store = get_typestore(Stores.ROS1_NOETIC if bag.ros1 else Stores.ROS2_HUMBLE)
        for name, text in version.items():
            store.register(get_types_from_msg(text, name))
        stores.append(store)
    hashes = [
        store.generate_msgdef(layout.MESSAGE)[1] if bag.ros1 else store.hash_rihs01(layout.MESSAGE) for store in stores
    ]
    if connection.digest in hashes:
        stores = [stores[hashes.index(connection.digest)]]
    elif bag.ros1 or connection.digest:
        found = f"{layout.MESSAGE} of hash {connection.digest[:32]}"
        raise TactileError(bag.path, found, " or ".join(hashes), "Export it as CSV with a ROS of its own version")

    def decode(data: bytes) -> Any:
        for store in stores[:-1]:
            with suppress(Exception):  # of the library, on another version's bytes
                message = _decoded(store, layout, data, bag.ros1)
                if all(len(layout.row(sensor)) == layout.WIDTH for sensor in layout.sensors(message)):
                    return message
        return _decoded(stores[-1], layout, data, bag.ros1)

    return decode


def _decoded(store: Any, layout: ModuleType, data: bytes, ros1: bool) -> Any:
    return (store.deserialize_ros1 if ros1 else store.deserialize_cdr)(data, layout.MESSAGE)


def _choose(bag: Bag, block: np.ndarray) -> tuple[int, list[str]]:
    """Choose the finger to read, and warn of the others. block : (n, fingers, 1 + WIDTH), electrodes last."""
    if not block.shape[1]:
        raise TactileError(bag.path, "a hand without fingers", "at least one BioTac")
    live = _live(block)
    if not len(live):
        return 0, [f"all electrodes of all {block.shape[1]} fingers are 0: finger 0 is read"]
    if len(live) == 1:
        return int(live[0]), []
    others = ", ".join(str(number) for number in live[1:])
    advice = f"ask for one as {Path(bag.path).name}#{live[-1]}"
    warning = f"finger {live[0]} is read; others with signals: {others} ({advice})"
    return int(live[0]), [warning]


def _recording(bag: Bag, layout: ModuleType, rows: np.ndarray, warnings: list[str]) -> Recording:
    stamps, pdc, tac, tdc = rows[:, :4].T
    return assemble(
        bag.path, layout.NAME, electrodes=rows[:, -ELECTRODES:], stamps=stamps, warnings=warnings,
        pdc=pdc, tac=tac, tdc=tdc, pac=rows[:, 4:-ELECTRODES],
    )  # fmt: skip
