"""What a converted recording leaves behind: the layout of a result folder, and where it may stand.

<recording>/frames.h5           numbers, T first, SI units; see ``frames_file``
<recording>/images/%05d.png     DIGIT pictures, 240 wide, 320 high, numbered by the frame's index in the recording
<recording>/contact_sheet.png   a few frames to look at
<recording>/note.json           where it came from: versions, weights, options, warnings; same input, same bytes
<recording>/timings.json        ms a frame of each stage on this machine; differs from run to run
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from . import __version__, atomic, keep_words
from .errors import TactileError

FORMAT = "tactile-result-1"
FRAMES, IMAGES, SHEET, NOTE, TIMINGS = "frames.h5", "images", "contact_sheet.png", "note.json", "timings.json"
OURS = {FRAMES, IMAGES, SHEET, NOTE, TIMINGS, "exr", "rest.exr"}  # the last two of `tactile render --exr`
IMAGE_NAME = "{:05d}.png"

KEEPABLE = ("latent", "displacement", "height", "image")
DEFAULT_KEEP = ("latent", "displacement", "image")


def parse_keep(text: str) -> tuple[str, ...]:
    """``"latent,image"`` -> ("latent", "image") in the order of KEEPABLE; ``""`` keeps only what is always written.

    Raises TactileError for an unknown word.
    """
    return keep_words.parse(text, KEEPABLE, least=0)


def result_folders(recordings: Sequence[str | os.PathLike], out: str | os.PathLike, overwrite: bool) -> list[Path]:
    """The result folder of each recording; all that can be refused before any work is refused here.

    Makes `out` where it is missing, and clears what killed runs left in it. Raises TactileError: an empty `out`,
    two recordings of the same name, a result that exists (unless `overwrite`), something that is no result in its
    place, a folder that cannot be written.
    """
    if not os.fspath(out):
        raise TactileError("--out", "an empty name", "a folder to write", "Name one")
    out = Path(out)
    seen: dict[str, Path] = {}
    for recording in map(Path, recordings):
        twin = seen.setdefault(recording.stem.casefold(), recording)  # macOS and Windows fold case in file names
        if twin is not recording:
            advice = "Convert them into different --out folders"
            raise TactileError(recording, f"has the same name as {twin}", "one name for each result folder", advice)
    check_writable(out)
    atomic.sweep(out)
    folders = [out / Path(recording).stem for recording in recordings]
    for folder in folders:
        check_free(folder, overwrite)
    return folders


def check_free(folder: Path, overwrite: bool, maker: str = "") -> None:
    """Raises TactileError where a result may not stand: one is there (unless `overwrite`), or something else is.

    maker : what its note says of who made it; another verb's result is something else, and so is one among whose files
        there are others
    """
    if not os.path.lexists(folder):
        return
    if not is_result(folder, maker):
        raise TactileError(folder, "exists and is no result of this verb", "a free place", "Name another --out folder")
    names = sorted(path.name for path in folder.iterdir())
    others = [name for name in names if name not in OURS and not name.startswith(".")]  # as .DS_Store
    if others:
        found, advice = f"holds {others[0]:.80}, which is not of the result", "Name another --out, or move it away"
        raise TactileError(folder, found, "a result alone", advice)
    if not overwrite:
        raise TactileError(folder, "already holds a result", "a free place", "Add --overwrite, or another --out")


def check_writable(out: Path) -> None:
    """Make the folder and try a file in it; raises TactileError."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except OSError as error:
        found, advice = f"cannot be written ({error.strerror or error})", "Name another --out, or allow writing"
        raise TactileError(out, found, "a writable folder", advice) from error


def is_result(folder: Path, maker: str = "") -> bool:
    """Whether a folder holds a result of ours, made by `maker`, so that --overwrite may replace it."""
    try:
        note = json.loads((folder / NOTE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(note, dict) and note.get("format") == FORMAT and note.get("made_by", "") == maker


def sha256(path: str | os.PathLike) -> str:
    """Hash of a file's bytes; of a folder (a bag): of its files' names and hashes."""
    import hashlib

    if os.path.isdir(path):
        files = sorted(file for file in Path(path).iterdir() if file.is_file())
        told = "".join(f"{sha256(file)} {file.name}\n" for file in files)
        return hashlib.sha256(told.encode(errors="surrogateescape")).hexdigest()
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def versions(*more: str) -> dict[str, str]:
    """What can change the bytes of a result, besides its input and the weights; more : libraries that made it too."""
    import importlib
    import platform

    # Asked of the modules, not of the package index: inside Blender they have no metadata.
    modules = {name: importlib.import_module(name).__version__ for name in ("numpy", "h5py", *more)}
    return {"tactile_core": __version__, "python": platform.python_version(), **modules}


def machine() -> dict[str, str | int | None]:
    """What can change the timings."""
    import platform

    return {"system": platform.platform(), "processor": _processor(), "cores": os.cpu_count()}


def _processor() -> str:
    """The processor's name; Linux tells it only in /proc."""
    import platform

    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())
