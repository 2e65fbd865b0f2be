"""MATLAB 5 files of the Penn Haptic Adjective Corpus 2: F0Electrodes and F1Electrodes (19, T) of two fingers at 100 Hz,
F0pac (22, T), F0pdc, F0tac, F0tdc (1, T) and the same of F1. The gripper's channels are ignored."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

from ...errors import TactileError
from ...sensors import ELECTRODES
from ..array_store import Store
from ..assemble import MAX_FRAMES, assemble, check_electrodes
from ..recording import Recording

CONTAINER = "mat"
NAME = "MATLAB 5 with F0Electrodes (19, T), optional F0pac, F0pdc, F0tac, F0tdc; F1... of a second finger"
_ELECTRODES = re.compile(r"F([0-4])Electrodes")


def score(keys: Collection[str]) -> float:
    """Return 1 if a finger's electrodes are among keys, the arrays' names, else 0."""
    return float(bool(fingers(keys)))


def fingers(keys: Collection[str]) -> tuple[int, ...]:
    """Return the numbers of the fingers that a file holds, ascending; keys : its arrays' names"""
    return tuple(sorted(int(found[1]) for key in keys if (found := _ELECTRODES.fullmatch(key))))


def read(store: Store, finger: int) -> Recording:
    """Return a finger's recording. Raises TactileError for another sensor, different lengths, and too many frames."""
    lengths = {number: store.shapes[f"F{number}Electrodes"][0] for number in fingers(store.shapes)}
    name = f"F{finger}Electrodes"
    if len(lengths[finger]) == 2 and lengths[finger][0] != ELECTRODES:
        check_electrodes(store.path, lengths[finger][0], name)
    if len({shape[-1:] for shape in lengths.values()}) > 1:
        found = "fingers of " + " and ".join(f"{shape[-1] if shape else 0}" for shape in lengths.values()) + " frames"
        raise TactileError(store.path, found, "as many of each finger", "Export it again")
    if lengths[finger][-1] > MAX_FRAMES:  # before they are unpacked
        advice = "Split the recording"
        raise TactileError(store.path, f"{lengths[finger][-1]:,} frames", f"at most {MAX_FRAMES:,}", advice)
    electrodes = store.array(name, (ELECTRODES, None)).T
    frames = len(electrodes)
    store.taken.update(f"F{other}{each}" for other in lengths for each in ("Electrodes", "pac", "pdc", "tac", "tdc")
                       if other != finger)  # fmt: skip
    rows = {each: store.optional(f"F{finger}{each}", (1, frames)) for each in ("pdc", "tac", "tdc")}
    columns: dict[str, Any] = {each: None if values is None else values[0] for each, values in rows.items()}
    if f"F{finger}pac" in store.shapes:
        columns["pac"] = store.array(f"F{finger}pac", (*store.shapes[f"F{finger}pac"][0][:1], frames)).T
    return assemble(store.path, NAME, electrodes=electrodes, stamps=None, **columns)
