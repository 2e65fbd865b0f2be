"""Describe the layout of a converted recording's result folder, and check where it may be written.

<recording>/frames.h5           arrays, T first, SI units (``frames_file``)
<recording>/images/%05d.png     DIGIT pictures, 240 wide, 320 high, numbered by the frame's index in the recording
<recording>/contact_sheet.png   a few frames to look at
<recording>/note.json           where it came from: versions, weights, options, warnings; same input, same bytes
<recording>/timings.json        ms per frame of each stage on this machine; differs from run to run"""

from __future__ import annotations

import contextlib
import json
import os
import re
import unicodedata
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..errors import TactileError
from ..files import atomic
from ..files.outside import read_small
from ..recordings.recording import name_of

FORMAT = "tactile-result-1"
FRAMES, IMAGES, SHEET, NOTE, TIMINGS = "frames.h5", "images", "contact_sheet.png", "note.json", "timings.json"
OURS = {FRAMES, IMAGES, SHEET, NOTE, TIMINGS, "exr", "rest.exr"}  # the last two of `tactile render --exr`
IMAGE_NAME = "{:05d}.png"

TRANSLATED, SOLVED = "translated", "solved"  # the networks' gel, or the found contact solved on it (``solved_gel``)
BALL = "ball:"  # solved under a ball of this diameter, mm, that is known to have touched
_DIAMETERS = 1.0, 2000.0  # mm, from a pin's head to a plate
KEEPABLE = ("latent", "displacement", "height", "image", "traction", "marker_motion")
DEFAULT_KEEP = ("latent", "displacement", "image")


def ball_radius(gel: str) -> float | None:
    """Return the radius, m, of the ball that a --gel of ``"ball:28"`` states by its diameter in mm; None for
    "translated" and "solved". Raises TactileError for anything else."""
    if gel in (TRANSLATED, SOLVED):
        return None
    least, most = _DIAMETERS
    with contextlib.suppress(ValueError):
        if gel.startswith(BALL) and least <= float(gel.removeprefix(BALL)) <= most:
            return float(gel.removeprefix(BALL)) / 2e3
    expected = f"{TRANSLATED}, {SOLVED} or {BALL}MM, a diameter of {least:g} to {most:g} mm"
    raise TactileError("--gel", repr(gel), expected, f"A plate is {BALL}{most:g}")


def result_folders(recordings: Sequence[str | os.PathLike], out: str | os.PathLike, overwrite: bool) -> list[Path]:
    """Return the result folder of each recording, after all checks that need no work; remove what killed runs left
    there. Raises TactileError for an empty `out`, two recordings of one name, a result that exists (unless
    `overwrite`), something else in its place, and a folder that cannot be written."""
    if not os.fspath(out):
        raise TactileError("--out", "an empty name", "a folder to write", "Name one")
    out = Path(out)
    seen: dict[str, str | os.PathLike] = {}
    for recording in recordings:
        # macOS and Windows fold case in file names, macOS the two ways to write an accent, too.
        name = unicodedata.normalize("NFC", name_of(recording)).casefold()
        if name in seen:
            found, advice = f"has the same name as {seen[name]}", "Convert them into different --out folders"
            raise TactileError(recording, found, "one name for each result folder", advice)
        seen[name] = recording
    folders = [out / name_of(recording) for recording in recordings]
    for folder in folders:
        check_free(folder, overwrite)
    check_writable(out)
    atomic.sweep(out)
    return folders


def check_free(folder: Path, overwrite: bool, maker: str = "") -> None:
    """Raise TactileError if a folder exists, unless it is a result of the same verb and `overwrite` is true. A result
    of another verb, or with other files in it, is refused whatever `overwrite` says.
    maker : verb that must have made it, as its note says; "" for `tactile convert`"""
    if not os.path.lexists(folder):
        return
    try:
        note = json.loads(read_small(folder / NOTE))
    except (OSError, ValueError, RecursionError, TactileError):
        note = None
    if not (isinstance(note, dict) and note.get("format") == FORMAT and note.get("made_by", "") == maker):
        raise TactileError(folder, "exists and is no result of this verb", "a free place", "Name another --out folder")
    names = sorted(path.name for path in folder.iterdir())
    others = [name for name in names if name not in OURS and not name.startswith(".")]  # as .DS_Store
    if others:
        found, advice = f"holds {others[0]:.80}, which is not of the result", "Name another --out, or move it away"
        raise TactileError(folder, found, "a result alone", advice)
    if not overwrite:
        raise TactileError(folder, "already holds a result", "a free place", "Add --overwrite, or another --out")


def check_writable(out: Path) -> None:
    """Raise TactileError if a folder cannot be made or written; a missing one is not made."""
    with atomic.writing(out, advice="Name another --out, or allow writing"):
        atomic.probe(out)


def parse_words(text: str, known: tuple[str, ...], least: int = 1) -> tuple[str, ...]:
    """Return the words of ``"image,electrodes"`` in known's order; TactileError for others or too few."""
    words = [word.strip() for word in text.split(",") if word.strip()]
    for word in words:
        if word not in known:
            raise TactileError("--keep", repr(word), f"words out of {', '.join(known)}", "Separate them by commas")
    if len(words) < least:
        raise TactileError("--keep", "nothing", f"one or more of {', '.join(known)}")
    return tuple(word for word in known if word in words)


def parse_frames(text: str) -> slice:
    """Return the slice of ``"A:B:STEP"`` as in Python, with STEP above 0. Raises TactileError for anything else."""
    if not re.fullmatch(r"(-?\d{1,9})?:(-?\d{1,9})?(:\d{0,9})?", text):
        raise TactileError("--frames", repr(text), "A:B or A:B:STEP, such as 100:200 or ::10")
    first, last, step = ([int(part) if part else None for part in text.split(":")] + [None])[:3]
    if step == 0:
        raise TactileError("--frames", repr(text), "a STEP above 0")
    return slice(first, last, step)


def select(frames: slice, count: int) -> np.ndarray:
    """Return the indices (n,) that a slice selects of `count` frames. Raises TactileError if it selects none."""
    chosen = np.arange(count)[frames]
    if not len(chosen):
        found = f"{frames_text(frames)} takes none of the {count} frames"
        raise TactileError("--frames", found, f"indices from 0 to {count - 1}", "Widen it")
    return chosen


def frames_text(frames: slice) -> str:
    """Return a slice as text that `parse_frames` reads; "all" if it has no limits."""
    first, last, step = [("" if part is None else str(part)) for part in (frames.start, frames.stop, frames.step)]
    return ":".join([first, last, step] if step else [first, last]) if first or last or step else "all"
