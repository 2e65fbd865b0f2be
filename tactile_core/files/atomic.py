"""Write files and folders that appear whole or not at all, whatever interrupts the writing."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..errors import TactileError
from . import lock, outside

# What json.dumps writes for a number, name or constant, and for a list of them, one per line. Strings hold no newline.
_PLAIN = re.compile(r'"(?:[^"\\]|\\.)*"|[-+.\w]+')
_PLAIN_LIST = re.compile(rf"\[\n\s*(?:{_PLAIN.pattern})(?:,\n\s*(?:{_PLAIN.pattern}))*\n\s*\]")
_LONGEST = 200  # bytes of a name; with a dot, a word and a token it stays below the 255 of common file systems


@contextlib.contextmanager
def new_file(path: str | os.PathLike, *, shared: bool = False) -> Iterator[Path]:
    """Yield a temporary path in the same folder; leaving the block flushes it to disk and moves it to `path`.

    Folders above it that are missing are made. An error inside the block removes what was made and leaves what was at
    `path` untouched. A killed process leaves `.<name>.tactile-partial`, which the next writer of the file replaces.
    shared : several processes may write the same file at once; each has its own temporary name, and `sweep_files`
        clears those of killed ones. Their folder must be there: one that was removed is not made again
    """
    path = Path(path)
    partial = _beside(path, "partial")
    if shared:
        partial = path.with_name(f".{_short(path.name)}.{secrets.token_hex(6)}.tactile-partial")
    if os.path.lexists(partial):  # a killed writer's, or what a stranger put there: a link would be written through
        partial.unlink()
    with contextlib.nullcontext() if shared else _parents(path):
        try:
            yield partial
            _sync(partial)
            os.replace(partial, path)
        except BaseException:  # Ctrl-C, too; raised again
            partial.unlink(missing_ok=True)
            raise
    _sync_folder(path.parent)


def write_bytes(path: str | os.PathLike, content: bytes, *, shared: bool = False) -> None:
    """Write content to a file, whole or not at all. shared : true if several processes may write it at once"""
    with new_file(path, shared=shared) as partial:
        partial.write_bytes(content)


def write_json(path: str | os.PathLike, content: Any, *, shared: bool = False) -> None:
    """Write content as readable JSON, keys sorted, lists of numbers or names on one line. Raises ValueError for NaN.
    shared : true if several processes may write it at once"""
    text = json.dumps(content, indent=2, sort_keys=True, ensure_ascii=False, allow_nan=False)
    text = _PLAIN_LIST.sub(lambda found: "[" + ", ".join(_PLAIN.findall(found[0])) + "]", text)
    # A file name that is no UTF-8 holds lone surrogates, which become JSON's own escapes.
    write_bytes(path, (text + "\n").encode(errors="backslashreplace"), shared=shared)


@contextlib.contextmanager
def new_folder(path: str | os.PathLike, *, overwrite: bool | None = None) -> Iterator[Path]:
    """Yield an empty folder beside `path`; leaving the block moves it to `path` as one piece.

    An error or Ctrl-C inside the block removes it and leaves what was at `path` untouched. What a killed process left
    behind is cleared by the next one (or by `sweep`): a lock on `.<name>.tactile-lock`, which the system drops when its
    holder dies, shows whether a writer is dead. Raises TactileError when the folder exists and `overwrite` is
    not true (None: the user has no such option), and when another process is writing it.
    """
    path = Path(os.path.abspath(path))
    partial, old = _beside(path, "partial"), _beside(path, "old")
    with _parents(path), locked(path):
        _recover(path)
        if path.exists() and not overwrite:
            advice = "Name another one" + ("" if overwrite is None else ", or add --overwrite")
            raise TactileError(path, "already exists", "a new folder", advice)
        try:
            partial.mkdir()
            yield partial
            _sync_all([file for file in sorted(partial.rglob("*")) if file.is_file()])
            if path.exists():
                os.replace(path, old)
            os.replace(partial, path)
            _sync_folder(path.parent)
        finally:
            _recover(path)


def sweep(folder: str | os.PathLike) -> None:
    """Remove from `folder` what is left of writers that were killed; files of running writers and of others stay."""
    for file in Path(folder).glob(".*.tactile-lock"):
        name = file.name.removeprefix(".").removesuffix(".tactile-lock")
        if name in ("", ".", "..") or file.is_symlink() or not file.is_file():
            continue
        path = file.with_name(name)
        with contextlib.suppress(TactileError), locked(path):
            _recover(path)


def sweep_files(folder: str | os.PathLike) -> None:
    """Remove the temporary files of killed writers; call it only when no writer is running."""
    for leftover in Path(folder).glob(".*.tactile-partial"):
        if not leftover.is_dir():
            leftover.unlink(missing_ok=True)


def _beside(path: Path, role: str) -> Path:
    """Return a hidden path beside `path` for a role, such as "lock". Raises TactileError if `path` has no name."""
    if not path.name:
        raise TactileError(path, "no name", "a new file or folder")
    return path.with_name(f".{_short(path.name)}.tactile-{role}")


def _short(name: str) -> str:
    """Return a name, a long one cut and with its hash, so that hidden names made from it fit the file system."""
    encoded = os.fsencode(name)
    if len(encoded) <= _LONGEST:
        return name
    return f"{os.fsdecode(encoded[:60])}-{hashlib.sha256(encoded).hexdigest()[:16]}"


def _recover(path: Path) -> None:
    """Finish or undo an exchange of folders that was interrupted, and remove what it left beside `path`."""
    partial, old = _beside(path, "partial"), _beside(path, "old")
    if old.is_dir() and not old.is_symlink() and not path.exists():
        os.replace(old, path)
    for leftover in (partial, old):
        if leftover.is_symlink() or leftover.is_file():
            leftover.unlink()
        elif leftover.exists():
            shutil.rmtree(leftover)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of the only writer of the folder `path`. Raises TactileError if another process holds it."""
    file = _beside(path, "lock")
    while True:
        try:
            descriptor = os.open(file, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            if os.path.lexists(file):
                raise TactileError(file, f"cannot be opened ({error.strerror})", "no file of others there") from error
            found = f"cannot be written ({error.strerror})"
            raise TactileError(path, found, "a place in a writable folder", "Name another one") from error
        try:
            lock.take(descriptor)
        except OSError:
            os.close(descriptor)
            advice = "Wait for it, or name another folder"
            raise TactileError(path, "another process is writing it", "one writer at a time", advice) from None
        # The last holder may have removed the file between our opening and locking it: then the lock guards nothing.
        with contextlib.suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(descriptor), os.stat(file)):
                break
        os.close(descriptor)
    try:
        yield
    finally:
        if os.name == "nt":  # Windows removes only what is closed
            os.close(descriptor)
            with contextlib.suppress(OSError):
                file.unlink()
        else:
            file.unlink(missing_ok=True)
            os.close(descriptor)


def _sync(path: Path) -> None:
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def _sync_all(paths: list[Path]) -> None:
    """Flush files to disk. Raises OSError if the disk refuses one."""
    from concurrent.futures import ThreadPoolExecutor

    # The disk gathers what several ask for at once: 700 pictures took 2.9 s one by one and 0.1 s so, on one core.
    with ThreadPoolExecutor(8) as pool:
        for _ in pool.map(_sync, paths):
            pass


def _sync_folder(path: Path) -> None:
    """Flush a folder's list of files to disk, if the system can (Windows cannot open folders)."""
    if os.name != "nt":
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def claim(path: str | os.PathLike, advice: str = "Choose another name") -> None:
    """Check before a long job that a file can be written to `path`. advice : what to do if something is there
    Raises TactileError for an empty or long name, for what exists, and if the folder cannot be made or written."""
    if not os.fspath(path):
        raise TactileError("--out", "an empty name", "a file to write")
    path = Path(path)
    if len(os.fsencode(path.name)) > 255:
        found = f"a name of {len(os.fsencode(path.name))} bytes, which cannot be written"
        raise TactileError(path.parent, found, "at most 255, as file systems take", "Choose a shorter --out")
    if os.path.lexists(path):
        raise TactileError(path, f"exists already ({_kind(path)})", "a new name", advice)
    with writing(path, "a place in a writable folder", "Choose another --out"):
        probe(path.parent)


def claim_over(path: str | os.PathLike, start: bytes, kind: str, advice: str) -> None:
    """Check before a long job that a file can be written to `path`, in place of nothing, of an empty file or of one
    that begins with ``start``. kind : of such a file, as "PNG picture"; advice : what to do if something else is there
    Raises TactileError for another file and a folder, and if the folder cannot be made or written."""
    expected = f"a new file, or a {kind} to replace"
    if os.path.isdir(path):
        raise TactileError(path, "a folder", expected, advice)
    with writing(path, "a file in a writable folder", advice):
        if os.path.lexists(path):
            with outside.open_file(path, expected) as file:
                if file.read(len(start)) not in (start, b""):
                    raise TactileError(path, f"a file that is no {kind}", expected, advice)
        probe(os.path.dirname(path) or ".")


def probe(folder: str | os.PathLike) -> None:
    """Raise OSError if a folder cannot be written; a missing one is made and removed. Nothing is left behind."""
    made = _make_parents(Path(folder) / "probe")
    try:
        with tempfile.TemporaryFile(dir=os.fspath(folder)):
            pass
    finally:
        _remove_empty(made)


@contextlib.contextmanager
def _parents(path: Path) -> Iterator[None]:
    """Make the folders above a path; if the block raises, remove those that were missing and are empty."""
    made = _make_parents(path)
    try:
        yield
    except BaseException:  # Ctrl-C, too; raised again
        _remove_empty(made)
        raise


def _make_parents(path: Path) -> list[Path]:
    """Make the folders above a path; return those that were missing, the innermost first."""
    missing = [folder for folder in path.parents if not os.path.lexists(folder)]
    path.parent.mkdir(parents=True, exist_ok=True)
    return missing


def _remove_empty(folders: list[Path]) -> None:
    for folder in folders:
        with contextlib.suppress(OSError):  # it holds something
            folder.rmdir()


def _kind(path: Path) -> str:
    """Return in words what is at a path: a link, folder or file."""
    if path.is_symlink():
        return "a link"
    return "a folder" if path.is_dir() else "a file"


@contextlib.contextmanager
def writing(
    path: str | os.PathLike,
    expected: str = "a writable folder",
    advice: str = "Make room, or name another --out folder",
) -> Iterator[None]:
    """Raise an OSError of the block, as of a full disk, as TactileError on ``path``, with `expected` and `advice`."""
    try:
        yield
    except OSError as error:
        raise TactileError(path, f"cannot be written ({error.strerror or error})", expected, advice) from error
