"""Compiled loops are kept on disk for the next process, whatever name the package has there."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INTERPOLATE = """
import os, sys, types
sys.path.insert(0, os.getcwd())
import numpy as np
sys.modules["bl_ext"] = types.ModuleType("bl_ext")
sys.modules["bl_ext"].__path__ = sys.path[:1]
if {package!r} == "tactile_core":
    del sys.modules["bl_ext"]
from {package}.geometry.cubic_spline import on_grid
nodes = np.stack(np.meshgrid(np.arange(4.0), np.arange(5.0), [0.0], indexing="ij"))[..., 0]
print(on_grid(nodes, np.array([[1.5], [2.25]]), closed=False).round(6).tolist())
"""


def interpolated(package):
    """What a process prints that knows the package by this name."""
    command = [sys.executable, "-c", INTERPOLATE.format(package=package)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_what_blender_compiles_under_its_own_name_does_not_break_other_processes(tmp_path, monkeypatch):
    """There the package is bl_ext.user_default.tactile.tactile_core, and its worker calls it tactile_core."""
    pytest.importorskip("numba")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    for package in ("bl_ext.tactile_core", "tactile_core", "bl_ext.tactile_core"):
        assert interpolated(package) == "[[1.5, 2.25, 0.0]]\n"
    assert list(tmp_path.rglob("*.nbi"))
