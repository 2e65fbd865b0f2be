"""The range of frames that an option names, as Python slices do: "100:200", ":50", "::10"."""

from __future__ import annotations

import re

import numpy as np

from ..errors import TactileError


def parse_frames(text: str) -> slice:
    """Parse ``"A:B:STEP"`` as in Python, with STEP above 0; raises TactileError for anything else."""
    if not re.fullmatch(r"(-?\d{1,9})?:(-?\d{1,9})?(:\d{0,9})?", text):
        raise TactileError("--frames", repr(text), "A:B or A:B:STEP, such as 100:200 or ::10")
    first, last, step = ([int(part) if part else None for part in text.split(":")] + [None])[:3]
    if step == 0:
        raise TactileError("--frames", repr(text), "a STEP above 0")
    return slice(first, last, step)


def select(frames: slice, count: int) -> np.ndarray:
    """Return the indices (n,) of the selected ones of `count` frames; raises TactileError where there is none."""
    chosen = np.arange(count)[frames]
    if not len(chosen):
        found = f"{frames_text(frames)} takes none of the {count} frames"
        raise TactileError("--frames", found, f"indices from 0 to {count - 1}", "Widen it")
    return chosen


def frames_text(frames: slice) -> str:
    """Return the text that `parse_frames` reads; "all" for a selection without limits."""
    first, last, step = [("" if part is None else str(part)) for part in (frames.start, frames.stop, frames.step)]
    return ":".join([first, last, step] if step else [first, last]) if first or last or step else "all"
