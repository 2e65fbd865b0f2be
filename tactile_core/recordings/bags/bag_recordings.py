"""Make recordings of a bag: one for each finger in each topic."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import TactileError
from ...files.short_text import listed
from ..assemble import MAX_FRAMES, assemble, check_electrodes, sensor_with
from ..recording import Chosen, Recording, named
from .bag import Bag, Topic, refused
from .ros_messages import channels, decoded, in_message, not_read, sensors_in, stamp_of

# Messages read to find a hand's fingers with signals, from the bag's start and, for drivers that start late, from its
# middle; more if none has signals.
LOOKED_AT = 100


@dataclass
class Finger:
    """One sensor in a topic's messages. electrodes : their number; live : true if one of them is ever non-zero"""

    electrodes: int
    live: bool = False

    @property
    def silence(self) -> str:
        """Return in words why a finger is not live: no sensor has so many electrodes, or all its readings are 0."""
        known = sensor_with(self.electrodes)
        return f"{self.electrodes} electrodes" if not known else "all zeros at the start and in the middle"


@dataclass(frozen=True)
class Stream:
    """One finger in a topic's messages. hand : all fingers in the topic; number : this one's index in that list"""

    topic: Topic
    number: int
    hand: list[Finger]

    @property
    def name(self) -> str:
        """Return the part of the path after # that selects this stream in a bag of several topics."""
        return f"{self.topic.name.strip('/')}/finger{self.number}"

    @property
    def sensor(self) -> str:
        """Return the name of the sensor that has as many electrodes as this finger; "" if there is none."""
        return sensor_with(self.hand[self.number].electrodes)


def streams_of(bag: Bag, chosen: Chosen) -> list[Stream]:
    """Return the fingers with signals in the chosen topic, or in all topics if none is chosen; the first finger of a
    topic without signals. A chosen finger is returned alone, with signals or not.
    chosen : what a path names, by `recording.split`. Raises TactileError for a topic or finger that the bag lacks."""
    topics, finger = _topics(bag, chosen)
    found: list[Stream] = []
    fingers = 0
    for topic in topics:
        hand = _hand(bag, topic)
        fingers = max(fingers, len(hand))
        live = [number for number, one in enumerate(hand) if one.live] or [0]
        found += [Stream(topic, one, hand) for one in (live if finger is None else [finger]) if one < len(hand)]
    if not found:
        raise TactileError(bag.path, f"{fingers} fingers, no number {finger or 0}", "path#finger, from 0")
    return found


def _topics(bag: Bag, chosen: Chosen) -> tuple[list[Topic], int | None]:
    """Return the chosen topics and finger, or None for all fingers; a topic may be called ``left/finger0``."""
    named = {topic.name.strip("/"): topic for topic in bag.topics}
    if chosen.topic in named:
        return [named[chosen.topic]], chosen.finger
    for word in (f"finger{chosen.finger}", f"{chosen.finger}"):
        if (whole := f"{chosen.topic}/{word}".strip("/")) in named:
            return [named[whole]], None
    if not chosen.topic:
        return bag.topics, chosen.finger
    held = listed([topic.name for topic in bag.topics] + list(bag.others))
    advice = "Name it as path#topic/finger"
    raise TactileError(bag.path, f"no BioTac in a topic {chosen.topic!r}", f"one of {held}", advice)


def names_of(bag: Bag, path: str, chosen: Chosen) -> list[str]:
    """Return a path for each recording: ``bag#0``, in a bag of several topics ``bag#topic/finger0``; the path itself if
    it names one recording. chosen : what the path names, by `recording.split`"""
    found = streams_of(bag, chosen)
    whole = bool(chosen.topic) or len(bag.topics) > 1
    if len(found) == 1 and (not whole or (chosen.topic and chosen.finger is not None)):
        return [path]
    return [f"{chosen.file}#{one.name if whole else one.number}" for one in found]


def _hand(bag: Bag, topic: Topic) -> list[Finger]:
    """Return a topic's fingers, by some messages from its start and middle, by more if none has signals."""
    hand: list[Finger] = []
    for start in (None, bag.middle):
        for count, (_, sensors) in enumerate(_messages(bag, topic, start), start=1):
            for number, (_, electrodes) in enumerate(sensors):
                if number == len(hand):
                    hand.append(Finger(len(electrodes)))
                hand[number].live |= any(electrodes) and bool(sensor_with(hand[number].electrodes))
            if count >= LOOKED_AT and any(one.live for one in hand):
                break
    return hand


def read_bag(
    bag: Bag, chosen: Chosen, frames: int = MAX_FRAMES + 1, context: int = 0
) -> Iterator[tuple[Recording, int]]:
    """Yield pairs (recording, repeated) of the chosen finger, or of the first with signals: a warning names the others.
    A recording has up to `frames` new frames, after `repeated` ones (at most `context`) of the recording before.
    Raises TactileError for a topic or finger that the bag lacks, and for messages that do not fit their type."""
    first, *others = streams_of(bag, chosen)
    warnings = _warnings(bag, chosen, first, others)
    not_taken = _not_taken(bag, first)
    rows, repeated = np.empty((0, 0)), 0
    for block in _blocks(bag, first, frames):
        rows = np.concatenate([rows[len(rows) - repeated :], block]) if repeated else block
        found = _recording(bag, first, rows, warnings)
        yield named(replace(found, not_taken=not_taken), chosen), repeated
        repeated = min(context, len(rows))


def _warnings(bag: Bag, chosen: Chosen, first: Stream, others: list[Stream]) -> list[str]:
    """Return sentences on the fingers with signals that are not read, or on the lack of any signal."""
    if chosen.finger is None and not first.hand[first.number].live:
        return [f"all electrodes of all {len(first.hand)} fingers are 0: finger {first.number} is read"]
    if not others:
        return []
    names = [one.name if len(bag.topics) > 1 else str(one.number) for one in (first, *others)]
    advice = f"ask for one as {Path(bag.path).name}#{names[-1]}"
    return [f"finger {names[0]} is read; others with signals: {listed(names[1:])} ({advice})"]


def _not_taken(bag: Bag, stream: Stream) -> tuple[str, ...]:
    """Return the topics, silent fingers and fields of messages that are not read, each in words."""
    topic = stream.topic
    silent: dict[str, list[str]] = {}
    for number, one in enumerate(stream.hand):
        if not one.live and number != stream.number:
            silent.setdefault(one.silence, []).append(str(number))
    fingers = [f"finger {', '.join(numbers)} of {topic.name} ({why})" for why, numbers in silent.items()]
    unread = not_read(topic.definitions[0], sensors_in(topic.definitions[0]))
    return (*bag.others, *fingers, *([f"fields {listed(unread, 40)} of {topic.name}"] if unread else []))


def _blocks(bag: Bag, stream: Stream, frames: int) -> Iterator[np.ndarray]:
    """Yield rows (n, columns) of up to `frames` messages: stamp (unix s), pdc, tac, tdc, pac, electrodes (counts)."""
    topic, wanted = stream.topic, stream.hand[stream.number].electrodes
    if not stream.sensor:
        check_electrodes(bag.path, wanted, f"{topic.name}, finger {stream.number}")
    rows: list[list[float]] = []
    for count, (stamp, sensors) in enumerate(_messages(bag, topic)):
        place = f"{bag.path}, {topic.name}, message {count}"
        if len(sensors) <= stream.number:
            raise TactileError(place, f"{len(sensors)} fingers after {len(stream.hand)}", "as many in each message")
        others, electrodes = sensors[stream.number]
        row = [stamp, *others, *electrodes]
        if len(electrodes) != wanted or (rows and len(row) != len(rows[-1])):
            found = f"{len(others)} other readings and {len(electrodes)} electrodes"
            raise TactileError(place, found, "as many as before", "Split the bag where its sensors change")
        rows.append(row)
        if len(rows) == frames:
            yield np.array(rows)
            rows = []
    if rows:
        yield np.array(rows)


def _messages(
    bag: Bag, topic: Topic, start: int | None = None
) -> Iterator[tuple[float, list[tuple[list[float], list[float]]]]]:
    """Yield, for each message from `start` (unix ns) on, its stamp, unix s, and for each sensor the other readings
    (pdc, tac, tdc, pac) and the electrodes, counts. A message without a stamp has the time at which it was recorded."""
    known = [(each, sensors_in(each)) for each in topic.definitions]
    with refused(bag.path):
        for count, (_, written, data) in enumerate(bag.reader.messages(topic.connections, start)):
            message, known = _decoded(f"{bag.path}, {topic.name}, message {count}", topic.kind, known, bag.ros1, data)
            sensors = [channels(one, fields) for fields in known[0][1] for one in in_message(message, fields)]
            yield stamp_of(message) or 1e-9 * written, sensors


def _decoded(place: str, kind: str, known: list[Any], ros1: bool, data: bytes) -> tuple[dict[str, Any], list[Any]]:
    """Return a message, decoded by the first `known` pair (definition, sensors) that fits, and that pair in a list."""
    for one in known:
        try:
            return decoded(one[0], ros1, data), [one]
        except (ValueError, KeyError, RecursionError):  # another definition's bytes
            continue
    advice = "Export the topic as CSV with a ROS of its own version"
    raise TactileError(place, f"is not as its type {kind} is defined", "messages of one definition", advice)


def _recording(bag: Bag, stream: Stream, rows: np.ndarray, warnings: list[str]) -> Recording:
    """Return the recording of rows (n, columns): stamp (unix s), pdc, tac, tdc, pac, electrodes (counts)."""
    count = stream.hand[stream.number].electrodes
    slow = [values if np.isfinite(values).any() else None for values in rows[:, 1:4].T]
    pac = rows[:, 4:-count]
    return assemble(
        bag.path, f"bag with {stream.topic.kind.replace('/msg/', '/')}", electrodes=rows[:, -count:],
        stamps=rows[:, 0], warnings=warnings, sensor=stream.sensor, pdc=slow[0], tac=slow[1], tdc=slow[2],
        pac=pac if pac.size else None,
    )  # fmt: skip
