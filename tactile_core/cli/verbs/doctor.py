"""``tactile doctor``: check which libraries work on this machine, and how to get more."""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

from ...files.installed import advice, checkout
from ...files.version import __version__
from ..terminal import tell

BRIEF = "check which libraries work here, and how to get more"
TEXT = """\
Print which libraries are here, what each is for, and how Mitsuba draws: compiled by LLVM, or without LLVM one ray at
a time. Each library is tried in a process of its own, so that a broken one breaks nothing; this takes some seconds."""
EPILOG = """\
example:
  tactile doctor"""


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add no arguments: this verb has none."""


def run(options: argparse.Namespace) -> int:
    """Print what works on this machine; returns the exit status."""
    for line in report():
        tell(line)
    return 0


TRY_SECONDS = 60.0  # torch takes five on a slow disk

_TRY = """
import importlib, importlib.metadata, sys
module = importlib.import_module(sys.argv[1])
try: print(importlib.metadata.version(sys.argv[2]))  # inside Blender some have none
except importlib.metadata.PackageNotFoundError: print(getattr(module, "__version__", ""))
"""


@dataclasses.dataclass(frozen=True)
class Library:
    """A library that the toolkit may use. module : its name in Python; package : its name in the package index
    use : what needs it; extra : extra of this package that installs it, "" if every installation has it"""

    module: str
    package: str
    extra: str
    use: str


LIBRARIES = (
    Library("numpy", "numpy", "", "everything"),
    Library("h5py", "h5py", "", "recordings and results"),
    Library("PIL", "pillow", "", "PNG pictures"),
    Library("matplotlib", "matplotlib", "", "contact sheets"),
    Library("msgspec", "msgspec", "", "scenes"),
    Library("tqdm", "tqdm", "", "progress bars"),
    Library("threadpoolctl", "threadpoolctl", "", "the same bytes whatever the number of threads"),
    Library("mitsuba", "mitsuba", "render", "physically based pictures (tactile render)"),
    Library("OpenEXR", "OpenEXR", "render", "float pictures (tactile render --exr)"),
    Library("scipy", "scipy", "fem", "contact mechanics (tactile simulate, pairs, mesh --press)"),
    Library("trimesh", "trimesh", "fem", "indenters from mesh files"),
    Library("cholespy", "cholespy", "fem", "solid mechanics"),
    Library("numba", "numba", "fem", "compiled contacts, and pictures"),
    Library("pypardiso", "pypardiso", "mkl", "faster solid mechanics"),
    Library("rosbags", "rosbags", "ros", "ROS bags and MCAP"),
    Library("distributed", "distributed", "batch", "batches on many machines (tactile batch --cluster)"),
    Library("pyarrow", "pyarrow", "batch", "LeRobot data sets (tactile export)"),
    Library("zmq", "pyzmq", "live", "reading what tactile watch --serve publishes (docs/read_frames.py)"),
    Library("cv2", "opencv-python-headless", "camera", "a DIGIT's camera (watch --camera), LeRobot v2.1's videos"),
    Library("torch", "torch", "train", "training (tactile train)"),
)


MISSING, BROKEN = "missing", "broken"  # in place of a version


def report() -> Iterator[str]:
    """Yield lines on this machine: versions, each library, and the variant of Mitsuba in use. Never raises an error."""
    yield f"tactile {__version__}, Python {platform.python_version()}, {platform.platform()}, {os.cpu_count()} cores"
    found = {}
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        tried = list(pool.map(try_library, LIBRARIES))
    for library, (state, words) in zip(LIBRARIES, tried, strict=True):
        found[library.module] = state not in (MISSING, BROKEN)
        yield f"  {library.package:<22} {state:<12} {library.use}" + (f": {words}" if words else "")
    yield from _mitsuba(found["mitsuba"])


def try_library(library: Library) -> tuple[str, str]:
    """Import a library; return its version (or MISSING, BROKEN), and what is wrong or how to install it, else ""."""
    install = advice(library.extra) if library.extra else f"python -m pip install {library.package}"
    try:
        if importlib.util.find_spec(library.module) is None:
            return MISSING, install
    except (ImportError, ValueError, AttributeError):
        return MISSING, install
    command = [sys.executable, "-P", "-c", _TRY, library.module, library.package]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=TRY_SECONDS)
    except (OSError, subprocess.TimeoutExpired) as error:
        return BROKEN, f"could not be tried ({type(error).__name__})"
    if done.returncode:
        last = (done.stderr.strip().splitlines() or [f"exit status {done.returncode}"])[-1]
        return BROKEN, last[:100]
    return (done.stdout.split() or ["works"])[-1], ""


def _mitsuba(works: bool) -> Iterator[str]:
    """Yield lines on the variant of Mitsuba in use, why, and how to get the faster one; works : Mitsuba does"""
    if not works:
        yield "pictures: preset fast alone, which needs no Mitsuba"
        return
    from ...pictures.mitsuba.variant import LLVM, OLDEST_LLVM, llvm_trouble

    trouble = llvm_trouble(os.environ.get("DRJIT_LIBLLVM_PATH", ""))
    if not trouble:
        yield f"pictures: Mitsuba with {LLVM}, the faster variant: LLVM works here"
        return
    yield f"pictures: Mitsuba with scalar_rgb, one ray at a time, because {trouble}"
    yield f"  several times faster with LLVM {OLDEST_LLVM} or newer: {_advice()}"


def _advice() -> str:
    if sys.platform == "darwin":
        return "brew install llvm"
    if sys.platform == "win32":
        return "install LLVM (winget install LLVM.LLVM) and set DRJIT_LIBLLVM_PATH to its LLVM-C.dll"
    root = checkout()
    without_root = "" if root is None else f", or without root: python {root / 'scripts' / 'fetch_llvm.py'} DIR"
    return f"apt install libllvm19 (Debian, Ubuntu){without_root}"
