"""Find a job's inputs, with names and hashes: scenes, and recordings given by file, folder, glob or ``@list``."""

from __future__ import annotations

import functools
import glob
import hashlib
import logging
import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from ...errors import TactileError
from ...files import provenance
from ...files.outside import read_small
from ...recordings.bags.bag import MARK
from ...recordings.opened_file import FOLDER_ENDINGS
from ...recordings.readers import list_fingers
from ...recordings.recording import name_of, split
from ...sensors.calibration_file import load_calibration

if TYPE_CHECKING:
    from ...simulation.scene import Scene

log = logging.getLogger(__name__)
MOST_STARS, MOST_PARTS = 2, 100  # of a glob: '**', whose work multiplies; parts, each a call deeper in Python's glob
MOST_QUOTED = 200  # characters of a glob in an error: a line of a list may have millions
SLIDE, BESIDE = "_bio.csv", ("_cw.csv", "_cp.csv")  # of the slide set; its wrenches and poses are no recordings


class Input(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """An input of a job. name : unique, begins the names of its files
    path : absolute, with ``#finger`` for a finger of a hand; sha256, bytes : hash and size of the file's content"""

    name: str
    path: str
    sha256: str
    bytes: int


def find(words: Sequence[str], out: Path) -> list[Path]:
    """Return the recordings that `words` (paths, folders, globs, @lists) name, in order, each once, but those in `out`.
    Raises TactileError for a word that names nothing, and a glob that may visit folders again and again."""
    own = out.resolve()
    within = functools.cache(lambda folder: list(_of_folder(folder)))  # a list may name a folder on each line
    found: dict[Path, None] = {}
    for word, place in _words(words):
        paths = [path for path in _named(word, within) if not path.is_relative_to(own)]
        if not paths:
            expected, advice = f"files ({', '.join(FOLDER_ENDINGS)}), folders or globs", "Check the path"
            advice += "; quote a glob, so that the shell leaves it alone" if not place else ""
            raise TactileError(f"{place}{word[:MOST_QUOTED]}", "names no recording", expected, advice)
        found |= dict.fromkeys(paths)
    return list(found)


def _words(words: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield each path or glob in `words` or in their lists (@list.txt), with its source: "list.txt, line 3, " or ""."""
    for word in words:
        if word.startswith("@"):
            for number, line in _lines(Path(word[1:])):
                yield os.path.join(os.path.dirname(word[1:]), line), f"{word[1:]}, line {number}, "
        else:
            yield word, ""


def _named(word: str, within: Callable[[Path], list[Path]]) -> Iterator[Path]:
    """Yield the recordings that a word, a path or glob, names. within : lists those in a folder"""
    there = os.path.lexists(word) or not glob.has_magic(word)
    for path in [word] if there else _globbed(word):
        real = os.path.realpath(path)
        if os.path.isdir(real):
            yield from within(Path(real))
        else:
            yield Path(real)


def _globbed(word: str) -> list[str]:
    """Return a glob's paths, sorted. Raises TactileError for one that may visit the same folders again and again."""
    parts = word.replace(os.sep, "/").split("/")
    wild = next(place for place, part in enumerate(parts) if glob.has_magic(part))
    if ".." in parts[wild:] or parts.count("**") > MOST_STARS or len(parts) > MOST_PARTS:
        expected = f"no '..' after a wildcard, at most {MOST_STARS} '**' and {MOST_PARTS} parts"
        raise TactileError(word[:MOST_QUOTED], "a glob that goes through folders again and again", expected)
    return sorted(glob.glob(word, recursive=True))


def _lines(file: Path) -> list[tuple[int, str]]:
    """Return (line number, path) of a list file, without blank lines and those that begin with #; or TactileError."""
    try:
        text = read_small(file)
        if "\0" in text:
            raise ValueError("it holds a zero byte")
    except (OSError, ValueError) as error:
        raise TactileError(file, f"cannot be read ({error})", "a text file with one path a line") from error
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), start=1)]
    for number, line in lines:
        if line.startswith("@"):
            advice = f"Give both lists to the command, or write ./{line[:MOST_QUOTED]} for a file"
            raise TactileError(f"{file}, line {number}", line[:MOST_QUOTED], "a path: lists name no lists", advice)
    return [(number, line) for number, line in lines if line and not line.startswith("#")]


def _of_folder(folder: Path) -> Iterator[Path]:
    """Yield the recordings in a folder and below, by name; log linked and unreadable folders, and links to nothing."""
    if _is_bag(folder):
        yield folder
        return
    for place, folders, names in walked(folder, bags=True):
        bags = [name for name in folders if _is_bag(Path(place, name))]
        folders[:] = sorted(name for name in folders if name not in bags)
        beside = BESIDE if any(name.endswith(SLIDE) for name in names) else ()
        files = [name for name in names if name.lower().endswith(FOLDER_ENDINGS)]
        for name in sorted([*bags, *(name for name in files if not name.endswith(beside))]):
            if os.path.exists(os.path.join(place, name)):
                yield Path(place) / name
            else:
                log.warning("%s: a link that leads nowhere, passed over", os.path.join(place, name))


def walked(folder: Path, *, bags: bool = False) -> Iterator[tuple[str, list[str], list[str]]]:
    """Yield what `os.walk` does, without hidden folders and files; linked and unreadable folders are logged.
    bags : true if the caller takes linked ROS 2 bags itself"""
    for place, folders, names in os.walk(folder, onerror=_passed_over):
        folders[:] = [name for name in folders if not name.startswith(".")]
        for path in (os.path.join(place, name) for name in folders):
            if os.path.islink(path) and not (bags and _is_bag(Path(path))):
                log.warning("%s: a linked folder, passed over; copy it, or name it apart", path)
        yield place, folders, [name for name in names if not name.startswith(".")]


def _passed_over(error: OSError) -> None:
    """Log a warning for a folder that `os.walk` would skip silently."""
    log.warning("%s: cannot be looked into (%s), passed over", error.filename, error.strerror)


def _is_bag(folder: Path) -> bool:
    """Return true if a folder is a ROS 2 bag; false if it may not be read."""
    return os.path.isfile(folder / MARK)


def hashed(paths: Sequence[Path], progress: Callable[[int, int], None]) -> list[Input]:
    """Return an input for each recording in the files ``paths``; a hand has one for each finger.
    progress : called with (files done, in all). Raises TactileError for a file that cannot be read."""
    found: list[Input] = []
    for done, path in enumerate(paths, 1):
        digest, size = content_hash(path)
        for finger in list_fingers([path]):
            name = f"{len(found):05d}_{re.sub(r'[^A-Za-z0-9._-]', '_', name_of(finger))[:80]}"
            found.append(Input(name, finger, digest, size))
        progress(done, len(paths))
    return found


def unit_hash(calibration: Path) -> str:
    """Return the SHA-256 of a calibration file and the photograph that it names. Raises TactileError for a bad file."""
    photograph = load_calibration(calibration).photograph
    digests = [content_hash(Path(file))[0] for file in (calibration, photograph) if file]
    return hashlib.sha256(" ".join(digests).encode()).hexdigest() if photograph else digests[0]


def content_hash(path: Path) -> tuple[str, int]:
    """Return SHA-256 and bytes of a file, or of a bag's folder. Raises TactileError for what cannot be read."""
    path = Path(split(str(path))[0])
    if os.path.exists(path) and not (os.path.isfile(path) or os.path.isdir(path)):
        raise TactileError(path, "no regular file", "a recording", "Copy what it gives into a file")
    try:
        files = [file for file in path.iterdir() if file.is_file()] if path.is_dir() else [path]
        return provenance.sha256(path), sum(file.stat().st_size for file in files)
    except OSError as error:
        raise TactileError(path, f"cannot be read ({error.strerror or error})", "a recording") from error


def check_unchanged(one: Input) -> None:
    """Raise TactileError if an input's content has changed since the job was made."""
    if content_hash(Path(one.path)) != (one.sha256, one.bytes):
        found = "another content than when the job was made"
        raise TactileError(one.path, found, f"sha256 {one.sha256[:12]}...", "Start a new job")


def read_scene(scene_path: str | os.PathLike, names: list[str]) -> tuple[Scene, str, list[Input], list[str]]:
    """Return a scene, its TOML text, an input for each of ``names``, all this scene, and the SHA-256 of its meshes.
    Raises TactileError for a bad scene."""
    from ...simulation.scene import load_scene

    scene, text = load_scene(scene_path)
    file = Path(scene_path).resolve()
    file = file / "scene.toml" if file.is_dir() else file
    digest, size = content_hash(file)
    inputs = [Input(f"{index:05d}_{name}", str(file), digest, size) for index, name in enumerate(names)]
    return scene, text, inputs, _hashes(scene)


def load_scene_of(one: Input, files: tuple[str, ...]) -> tuple[Scene, str]:
    """Return an input's scene and its TOML text. files : SHA-256 of its meshes when the job was made
    Raises TactileError if the scene or a mesh has changed since then."""
    from ...simulation.scene import load_scene

    scene, text = load_scene(one.path)
    if content_hash(Path(one.path))[0] != one.sha256 or tuple(_hashes(scene)) != files:
        found = "another content than when the job was made"
        raise TactileError(one.path, found, f"sha256 {one.sha256[:12]}... and the same meshes", "Start a new job")
    return scene, text


def _hashes(scene: Scene) -> list[str]:
    from ...simulation.indenter_specs import MeshSpec, SeveralSpec

    bodies = []
    for spec in scene.indenters:
        bodies += [part.body for part in spec.parts] if isinstance(spec, SeveralSpec) else [spec]
    return [provenance.sha256(body.file) for body in bodies if isinstance(body, MeshSpec)]
