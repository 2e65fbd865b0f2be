"""Name the recordings of files that hold several: ``path#finger``, of bags also ``path#topic/finger``."""

from __future__ import annotations

import dataclasses
import os
import re
from pathlib import Path
from typing import NamedTuple

from .recording import Recording

FINGERS = 5  # of a hand, at most
FINGER = re.compile(r"(.+)#/*(?:([^#]+)/)?(?:finger)?(\d{1,3})$")
TOPIC = re.compile(r"(.+)#/*([^#]*[^#/])/*$")
UNFIT = re.compile(r"[^A-Za-z0-9._-]+")  # of a topic in the name of a file


class Chosen(NamedTuple):
    """One of a file's recordings. finger, topic : None and empty where the path names none; no / around the topic"""

    file: str
    finger: int | None
    topic: str = ""

    @property
    def name(self) -> str:
        """Name of the recording and its results: the file's without extension, with topic and finger."""
        topic = f"_{UNFIT.sub('_', self.topic)}" if self.topic else ""
        return Path(self.file).stem + topic + ("" if self.finger is None else f"_finger{self.finger}")

    @property
    def section(self) -> str:
        """Name of its unit's section in a file of `tactile adapt`: ``unit``, ``finger2``, ``left/biotac/finger2``."""
        return (f"{self.topic}/" if self.topic else "") + ("unit" if self.finger is None else f"finger{self.finger}")


def split(path: str) -> Chosen:
    """Split ``hand.bag#2`` or ``hand.bag#left/biotac/finger2``; a path that exists is taken as it is."""
    if os.path.exists(path):
        return Chosen(path, None)
    if found := FINGER.match(path):
        return Chosen(found[1], int(found[3]), (found[2] or "").strip("/"))
    found = TOPIC.match(path)
    return Chosen(path, None) if found is None or not os.path.exists(found[1]) else Chosen(found[1], None, found[2])


def name_of(path: str | os.PathLike) -> str:
    """Name a recording and its results, as ``hand_left_biotac_finger2`` for ``hand.bag#left/biotac/finger2``."""
    return split(os.fspath(path)).name


def short_of(path: str | os.PathLike) -> str:
    """Return a recording's path without its folders, as ``hand.bag#left/biotac/finger2``."""
    file, text = split(os.fspath(path)).file, os.fspath(path)
    return Path(file).name + text[len(file) :]


def named(recording: Recording, chosen: Chosen) -> Recording:
    """Name a recording and its unit by its topic and finger, as `Chosen` does."""
    return dataclasses.replace(recording, name=chosen.name, section=chosen.section)
