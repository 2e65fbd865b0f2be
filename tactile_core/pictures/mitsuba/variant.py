"""Choose the variant of Mitsuba for this machine: compiled by LLVM, or one ray at a time without it."""

from __future__ import annotations

import dataclasses
import functools
import os
import subprocess
import sys
from typing import Any

from ...errors import TactileError
from ..presets import FAST, cheapest, measured

LLVM, SCALAR = "llvm_ad_rgb", "scalar_rgb"
OLDEST_LLVM = 18  # 15 and 16 abort the process on their first kernel on some machines, 14 is refused (blender.md)
PROBE_SECONDS = 60.0

# Run in a process of its own, because a bad LLVM ends it: rays against a sphere, compiled; then LLVM's own version,
# where the system can say which file was loaded (LLVM has that function since 16).
_PROBE = """
import mitsuba
mitsuba.set_variant("llvm_ad_rgb")
import drjit
scene = mitsuba.load_dict({"type": "scene", "ball": {"type": "sphere"}})
rays = mitsuba.Ray3f(mitsuba.Point3f(drjit.linspace(mitsuba.Float, -2, 2, 64), 0, 5), mitsuba.Vector3f(0, 0, -1))
assert 30 <= drjit.sum(drjit.select(scene.ray_test(rays), 1, 0))[0] <= 34
import ctypes
try: files = {line.split()[-1] for line in open("/proc/self/maps") if "libLLVM" in line}
except OSError: files = set()
for file in sorted(files):
    major = ctypes.c_uint(0)
    try: ctypes.CDLL(file).LLVMGetVersion(ctypes.byref(major), None, None)
    except AttributeError: pass
    print("LLVM", major.value, file)
"""


@dataclasses.dataclass(frozen=True)
class Choice:
    """Name of the variant of Mitsuba to use, and a sentence that says why."""

    name: str
    why: str


def choose_variant(wanted: str | None = None) -> Choice:
    """Choose a variant of Mitsuba. wanted : llvm_ad_rgb or scalar_rgb; None for the faster one that works here. Raises
    TactileError for an unknown one or one that does not work; ModuleNotFoundError without mitsuba."""
    import mitsuba  # noqa: F401 (so that its absence is reported before anything is probed)

    if wanted not in (None, LLVM, SCALAR):
        raise TactileError("variant", repr(wanted), f"{LLVM} or {SCALAR}")
    if wanted == SCALAR:
        return Choice(SCALAR, "asked for")
    trouble = llvm_trouble(os.environ.get("DRJIT_LIBLLVM_PATH", ""))
    if not trouble:
        return Choice(LLVM, "LLVM works here")
    if wanted == LLVM:
        raise TactileError("variant", f"{LLVM}, but {trouble}", "LLVM 18 or newer", "See `tactile doctor`")
    return Choice(SCALAR, trouble)


def fitting(error: float, variant: str | None = None) -> str:
    """Return the name of the fastest preset within an ``error``, grey levels. variant : of Mitsuba; None for the one
    that works here, or the one without LLVM if Mitsuba is missing"""
    if measured()["presets"][FAST]["error"] <= error:
        return FAST  # the cheapest by any variant: Mitsuba need not even be looked for
    try:
        chosen = choose_variant(variant).name
    except ModuleNotFoundError:
        chosen = SCALAR
    return cheapest(error, chosen)


def variant_for(preset: str, wanted: str | None = None) -> str:
    """Return the variant of Mitsuba that all workers of a job use, so that pictures agree; "" for the preset ``fast``.
    wanted : the variant to use; None for the faster one that works here"""
    return "" if preset == "fast" else choose_variant(wanted).name


@functools.cache
def llvm_trouble(library: str) -> str:
    """Return a sentence on why LLVM does not work, "" if it does. library : DRJIT_LIBLLVM_PATH, "" if unset"""
    try:
        command = [sys.executable, "-P", "-c", _PROBE]  # -P: nothing is imported from the current folder
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=PROBE_SECONDS)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"LLVM could not be tried ({type(error).__name__})"
    where = f"{library} (DRJIT_LIBLLVM_PATH)" if library else "LLVM"
    if library and not os.path.exists(library):
        return f"DRJIT_LIBLLVM_PATH names {library}, which is not there"
    if done.returncode < 0:
        return f"{where} ends the process (signal {-done.returncode}), as LLVM before {OLDEST_LLVM} does"
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["it gave no reason"])[-1]
        return f"{where} was not found or is too old ({last[:160]})"
    return _too_old(done.stdout)


def _too_old(message: str) -> str:
    """Describe the LLVM older than 16 that a line of the probe's ``message`` names, "" for none; such a line is "LLVM
    14 /usr/lib/libLLVM.so", and 0 counts as old."""
    for line in message.splitlines():
        word, _, rest = line.partition(" ")
        major, _, file = rest.partition(" ")
        if word == "LLVM" and major.isdigit() and int(major) < OLDEST_LLVM:
            version = major if int(major) else "before 16"
            return f"{file} is LLVM {version}; {OLDEST_LLVM} or newer is needed (older ones may end the process)"
    return ""


def activate(variant: str) -> Any:
    """Activate a variant of Mitsuba, by its name, and return Mitsuba's module."""
    import mitsuba

    if mitsuba.variant() != variant:  # 0.1 s
        mitsuba.set_variant(variant)
    return mitsuba
