"""The type that every reader returns, and paths of single recordings in a file of several: ``path#topic/finger``."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import TactileError
from ..files.short_text import Summary
from ..sensors import SAMPLE_RATE, SOURCE, TARGET

BLOCK = 2**12  # frames that are worked on at a time, which bounds the memory of a long recording
FINGERS = 5  # of a hand, at most
FINGER = re.compile(r"(.+)#/*(?:([^#]+)/)?(?:finger)?(\d{1,3})$")
TOPIC = re.compile(r"(.+)#/*([^#]*[^#/])/*$")
UNFIT = re.compile(r"[^A-Za-z0-9._-]+")  # of a topic in the name of a file
LEAST_STEP = 1e-6  # s between stamps; less is no time (assumed), and its inverse no number


@dataclass(frozen=True, eq=False, repr=False)
class Truth(Summary):
    """True values of a simulated recording; real ones have none. None stands for arrays that its file leaves out.

    displacement_biotac : (T, N, 3) float32, m, displacement of the N nodes of the outer skin
    displacement_digit : (T, M, 3) float32, m, displacement of the M nodes of the gel's surface
    force : (T, 3) float, N, of the object on the BioTac or, if that was not solved, on the first sensor that was
    contact_center : (T, 2) float, m, (x, z) of the center of pressure on the first gel at rest; NaN without contact
    traction_biotac : (T, N, 3) float32, Pa, traction of the object at the nodes of the skin at rest
    traction_digit : (T, M, 3) float32, Pa, traction of the object at the nodes of the gel at rest
    displacement, traction : arrays as above for further sensors, by the sensor's name"""

    displacement_biotac: np.ndarray | None
    displacement_digit: np.ndarray | None
    force: np.ndarray
    contact_center: np.ndarray | None
    traction_biotac: np.ndarray | None = None
    traction_digit: np.ndarray | None = None
    displacement: Mapping[str, np.ndarray] = field(default_factory=dict)
    traction: Mapping[str, np.ndarray] = field(default_factory=dict)

    def at(self, frames: np.ndarray) -> Truth:
        """Return the values of frames (n,) alone."""
        held: dict[str, Any] = {name: value for name, value in vars(self).items() if value is not None}
        for name, value in held.items():
            arrays = isinstance(value, Mapping)
            held[name] = {sensor: each[frames] for sensor, each in value.items()} if arrays else value[frames]
        return replace(self, **held)

    @property
    def displacements(self) -> dict[str, np.ndarray]:
        """Return the displacements (T, n, 3) m that the file has, by the sensor's name."""
        held = {SOURCE: self.displacement_biotac, TARGET: self.displacement_digit, **self.displacement}
        return {sensor: values for sensor, values in held.items() if values is not None}

    @property
    def tractions(self) -> dict[str, np.ndarray]:
        """Return the tractions (T, n, 3) Pa that the file has, by the sensor's name."""
        held = {SOURCE: self.traction_biotac, TARGET: self.traction_digit, **self.traction}
        return {sensor: values for sensor, values in held.items() if values is not None}


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Summary):
    """Content of a recording's file, unchanged: one frame per data row, in file order, nothing resampled or dropped.

    name : the file's name without extension, with topic and finger if the file holds several
    sensor : name of the sensor, "biotac" or "biotac_sp"
    section : name of the section that has the recording's unit in a file of `tactile adapt`
    layout : the file's layout, in words
    time : (T,) float, s from the first frame; it goes back where the file's stamps do; NaN for snapshots, which do not
        follow each other
    start_time : unix time of the first frame, s; 0.0 if unknown
    electrodes : (T, 19) float, E1 to E19, (T, 24) for a BioTac SP: counts, or as in the file; NaN where it is
        unreadable
    rows : (T,) int, each frame's line in a text file (the header is line 1), its index in other files
    flags : (T,) uint16, bits of :class:`tactile_core.recordings.flags.Flag`
    pdc, tac, tdc : (T,) float or None, counts
    pac : (T, P) float or None, counts; P = 22 at 2,200 Hz, or what the file holds
    position, force : (T, 3) float or None, in the file's own frame and unit of measurement
    labels : name -> (T,) object array of str, such as object, material or trial, which translation ignores
    warnings : sentences for the user; simulated : true if the file says that it is; truth : its true values, or None
    not_taken : topics, arrays, columns and fields of the file that were not read, in words
    about : other information in the file (simulated: sensor, scene, seed, made_by, note; BioTac SP: finger, labels)"""

    name: str
    path: str
    layout: str
    time: np.ndarray
    start_time: float
    electrodes: np.ndarray
    rows: np.ndarray
    flags: np.ndarray
    pdc: np.ndarray | None = None
    tac: np.ndarray | None = None
    tdc: np.ndarray | None = None
    pac: np.ndarray | None = None
    position: np.ndarray | None = None
    force: np.ndarray | None = None
    warnings: tuple[str, ...] = ()
    not_taken: tuple[str, ...] = ()
    simulated: bool = False
    truth: Truth | None = None
    about: dict[str, Any] = field(default_factory=dict)
    sensor: str = SOURCE
    section: str = "unit"
    labels: dict[str, np.ndarray] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.electrodes)

    def at(self, frames: np.ndarray) -> Recording:
        """Return the recording with only the frames (n,), given by index; its warnings stay."""
        held: dict[str, Any] = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        rows = {name: value[frames] for name, value in held.items()}
        labels = {name: column[frames] for name, column in self.labels.items()}
        return replace(self, **rows, labels=labels, truth=None if self.truth is None else self.truth.at(frames))

    def check(self) -> None:
        """Raise TactileError for fields that do not fit each other, as of a recording that was changed by hand."""
        for name, kind, expected in (("warnings", tuple | list, "sentences in a tuple"), ("about", dict, "a dict")):
            if not isinstance(value := getattr(self, name), kind):
                found = f"a {type(value).__name__}"
                raise TactileError(f"{self.path}, {name}", found, expected, "Leave it empty: () or {}")
        for name, axes in {"electrodes": 2, "time": 1, "rows": 1, "flags": 1, "pdc": 1}.items():
            value = getattr(self, name)
            if value is None and name == "pdc":
                continue
            found, expected = f"a {type(value).__name__}", f"a plain numpy array of numbers, {axes}-D, a row a frame"
            if isinstance(value, np.ndarray):
                found += f" {value.shape} of {value.dtype}, beside electrodes {np.shape(self.electrodes)}"
            plain = isinstance(value, np.ndarray) and not isinstance(value, np.ma.MaskedArray | np.matrix)
            kinds = "iu" if name == "flags" else "iuf"
            plain = plain and value.dtype.kind in kinds and value.dtype.itemsize <= 8  # bytes; numpy refuses more
            if not plain or value.ndim != axes or len(value) != len(self.electrodes):
                raise TactileError(f"{self.path}, {name}", found, expected, "Recording.at takes frames out of all")

    @cached_property
    def rate(self) -> float:
        """Return the frames per second: one over the median step of time; the nominal 100 Hz for a single frame."""
        steps = np.diff(self.time)
        steps = steps[steps > 0]
        return 1.0 / max(float(np.median(steps)), LEAST_STEP) if len(steps) else SAMPLE_RATE

    @property
    def duration(self) -> float:
        """Return the time from the first frame to the last, s; 0 for snapshots, which have none."""
        return float(np.nan_to_num(self.time[-1] - self.time[0]))

    @property
    def row_word(self) -> str:
        """Return what messages call a frame's row: "line" in a text file, "frame" in others."""
        return "line" if self.layout.startswith("CSV") else "frame"


class Chosen(NamedTuple):
    """What a path such as ``hand.bag#left/biotac/finger2`` names. file : path of the file
    finger : the finger's number, None if none is named; topic : the bag's topic, "" if none is named"""

    file: str
    finger: int | None
    topic: str = ""

    @property
    def name(self) -> str:
        """Return the name of the recording and its results: the file's without extension, topic and finger."""
        topic = f"_{UNFIT.sub('_', self.topic)}" if self.topic else ""
        return Path(self.file).stem + topic + ("" if self.finger is None else f"_finger{self.finger}")

    @property
    def section(self) -> str:
        """Return its section in a file of `tactile adapt`: ``unit``, ``finger2``, ``left/biotac/finger2``."""
        return (f"{self.topic}/" if self.topic else "") + ("unit" if self.finger is None else f"finger{self.finger}")


def split(path: str) -> Chosen:
    """Split ``hand.bag#2`` or ``hand.bag#left/biotac/finger2``; a path that exists is taken for a file."""
    if os.path.exists(path):
        return Chosen(path, None)
    if found := FINGER.match(path):
        return Chosen(found[1], int(found[3]), (found[2] or "").strip("/"))
    found = TOPIC.match(path)
    return Chosen(path, None) if found is None or not os.path.exists(found[1]) else Chosen(found[1], None, found[2])


def name_of(path: str | os.PathLike) -> str:
    """Return the name of a recording's results: ``hand_left_finger2`` for ``hand.bag#left/finger2``."""
    return split(os.fspath(path)).name


def short_of(path: str | os.PathLike) -> str:
    """Return a recording's path without its folders, as ``hand.bag#left/biotac/finger2``."""
    file, text = split(os.fspath(path)).file, os.fspath(path)
    return Path(file).name + text[len(file) :]


def named(recording: Recording, chosen: Chosen) -> Recording:
    """Return the recording with the name and the unit's section that the chosen topic and finger have."""
    return replace(recording, name=chosen.name, section=chosen.section)
