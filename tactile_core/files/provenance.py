"""Describe where a result comes from (hashes of inputs, versions of libraries, the machine), and how long it took."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import outside
from .version import __version__


def sha256(path: str | os.PathLike) -> str:
    """Return the SHA-256 of a file's bytes; for a folder (a bag) that of its files' hashes and names."""
    import hashlib

    if os.path.isdir(path):
        files = sorted(file for file in Path(path).iterdir() if file.is_file())
        listing = "".join(f"{sha256(file)} {file.name}\n" for file in files)
        return hashlib.sha256(listing.encode(errors="surrogateescape")).hexdigest()
    with outside.open_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def entry(path: str | os.PathLike) -> dict[str, str]:
    """Return, for a result's note, ``file``, the name without folders, and ``sha256``, the hash of its content."""
    return {"file": os.path.basename(path), "sha256": sha256(path)}


def versions(*more: str) -> dict[str, str]:
    """Return name -> version of what can change a result: this package, Python, numpy, h5py, libraries `more`."""
    import importlib
    import platform

    # Asked of the modules, not of the package index: inside Blender they have no metadata.
    modules = {name: importlib.import_module(name).__version__ for name in ("numpy", "h5py", *more)}
    return {"tactile_core": __version__, "python": platform.python_version(), **modules}


def machine() -> dict[str, str | int | None]:
    """Return what can change timings: ``system`` and ``processor``, in words, and ``cores``, their number."""
    import platform

    return {"system": platform.platform(), "processor": _processor(), "cores": os.cpu_count()}


def _processor() -> str:
    """Return the name of the processor; Linux has it only in /proc."""
    import platform

    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), platform.machine())


class Stopwatch:
    """Sums, by the stage's name, of wall time (`seconds`) and of this process's CPU time (`cpu_seconds`), in s."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.cpu_seconds: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time that the block takes to the stage ``name``."""
        start, cpu_start = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + time.perf_counter() - start
            self.cpu_seconds[name] = self.cpu_seconds.get(name, 0.0) + time.process_time() - cpu_start

    def timings(self, frames: int) -> dict[str, Any]:
        """Return, for timings.json, ms a frame by the wall clock and of CPU, by stage and in all, and the machine.
        frames : their number"""
        found: dict[str, Any] = {"frames": frames, "machine": machine()}
        for name, seconds in (("ms_a_frame", self.seconds), ("cpu_ms_a_frame", self.cpu_seconds)):
            stages = seconds | {"all": sum(seconds.values())}
            found[name] = {stage: round(1e3 * each / frames, 4) for stage, each in stages.items()}
        return found
