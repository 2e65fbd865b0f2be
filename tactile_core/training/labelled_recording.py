"""A real recording that says where and how hard it was touched, as `fine_tune` learns from it."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..recordings import prepare, read
from ..recordings.flags import Flag
from ..sensors import unrolling
from ..simulation.pairs_file import Split, split_presses
from ..translation.contact_frame import ContactFrame
from ..translation.gel_place import place_on

# A place in millimetres reads as tens, in metres as hundredths: no fingertip is longer than half a metre.
METRES_BELOW = 0.5
OFF_SKIN = 4e-3  # m; a contact place farther from the skin is in another frame or unit (assumed; dents are below 2 mm)
OFF_SHARE = 0.1  # of the contacts that may lie off the skin, as places of real robots do
TOUCH = 0.05  # N: below, a frame is no contact (assumed; force sensors of robots are no better)
FEWEST = 200  # frames in contact (assumed)
BLOCKS = 20  # parts of a recording without pauses, which then stand for presses
BAD = Flag.SATURATED | Flag.DEAD_CHANNEL


@dataclass(frozen=True)
class LabelledRecording:
    """Frames in contact, F of them.

    change : (F, 19) float32 counts          rectified : whether their sign is lost
    place : (F, 2) float32, as the first two numbers of a DIGIT latent           force : (F,) float32 N, magnitude
    split : of the frames, by press          dropped : sentences on what was left out
    """

    change: np.ndarray
    rectified: bool
    place: np.ndarray
    force: np.ndarray
    split: Split
    dropped: tuple[str, ...]


def read_labelled(path: str | os.PathLike, frame: ContactFrame, seed: int) -> LabelledRecording:
    """Read a recording with contact places and forces (Narang et al.: contact_loc, force_vec) for the gel's frame.

    Places are taken to be SynTouch's frame of the electrodes (docs/sources.md), in m or mm as their size shows; of
    forces only the magnitude counts, whatever their frame. Places are unrolled onto the gel.
    Raises TactileError: no labels, places that are not on the skin, too few contacts.
    """
    recording = read(path)
    position, forces = recording.position, recording.force
    if position is None or forces is None:
        found = "no contact places" if position is None else "no forces"
        advice = "Give a file with electrode_vals/data, contact_loc/data and force_vec/data"
        raise TactileError(path, found, "a contact place and a force a frame", advice)
    signals = prepare(recording)
    force = np.linalg.norm(forces, axis=1)
    known = np.isfinite(position).all(1) & np.isfinite(force)
    whole = (signals.flags & np.uint16(BAD)) == 0
    touched = known & (force > TOUCH)
    used = np.flatnonzero(touched & whole)
    dropped = [f"{(~known).sum()} frames without a label"] if not known.all() else []
    if (touched & ~whole).any():
        dropped.append(f"{(touched & ~whole).sum()} frames with a saturated or dead electrode")
    place, off = _places(position[used], frame, path)
    if off.any():
        dropped.append(f"{off.sum()} contacts that are not on the pad")
    used, place = used[~off], place[~off]
    if len(used) < FEWEST:
        found = f"{len(used)} usable frames in contact ({', '.join(dropped) or f'force above {TOUCH} N'})"
        raise TactileError(path, found, f"at least {FEWEST}", "Give a longer recording")
    change = signals.typical[used].astype(np.float32)
    rectified = signals.kind == "rectified"
    split = split_presses(_presses(used), seed, path)
    labels = place.astype(np.float32), force[used].astype(np.float32)
    return LabelledRecording(np.abs(change) if rectified else change, rectified, *labels, split, tuple(dropped))


def _places(position: np.ndarray, frame: ContactFrame, path: str | os.PathLike) -> tuple[np.ndarray, np.ndarray]:
    """Places (F, 2) on the gel's lattice, in its units, of contacts (F, 3); and which lie off the pad (F,)."""
    if not len(position):
        return np.zeros((0, 2)), np.zeros(0, bool)
    metres = position if np.abs(position).max() < METRES_BELOW else 1e-3 * position
    rest, unrolled = sensors.biotac_surface().rest, unrolling.unrolled_nodes()
    points = sensors.from_maker(metres, sensors.SOURCE)
    nearest, gap = np.empty(len(points), int), np.empty(len(points))
    for start in range(0, len(points), FEWEST):  # bounds the table of distances
        part = slice(start, start + FEWEST)
        far = np.linalg.norm(points[part, None] - rest, axis=-1)
        nearest[part], gap[part] = far.argmin(1), far.min(1)
    off = gap > OFF_SKIN
    if off.mean() > OFF_SHARE:
        raise TactileError(
            f"{os.fspath(path)}, contact places", f"{off.mean():.0%} lie more than {OFF_SKIN * 1e3:g} mm off the skin",
            "places in SynTouch's frame (x to the tip, z <= 0 on the pad), m or mm", "Turn them into that frame",
        )  # fmt: skip
    on_gel = unrolled[nearest]
    off |= np.isnan(on_gel[:, 0])  # the finger's back rolls onto no gel
    place = np.zeros_like(on_gel)
    place[~off] = place_on(frame, on_gel[~off])
    return place, off


def _presses(used: np.ndarray) -> np.ndarray:
    """Press number (F,) of each frame: runs of contact, or equal parts where there are too few runs."""
    runs = np.cumsum(np.diff(used, prepend=used[0]) > 1)
    return runs if runs[-1] + 1 >= BLOCKS else np.arange(len(used)) * BLOCKS // len(used)
