"""What the fetched Blender runs in: the checkout is mounted for its processes alone, so that no deletion reaches it."""

import os
import re
import runpy
import shutil
import subprocess
from pathlib import Path

import pytest
from conftest import ROOT


def can_mount() -> bool:
    """Root in a container may still be forbidden to."""
    if os.name != "posix" or os.geteuid() != 0 or not all(map(shutil.which, ("unshare", "ldd", "chroot"))):
        return False
    tried = subprocess.run(["unshare", "--mount", "mount", "--bind", "/tmp", "/tmp"], capture_output=True)
    return tried.returncode == 0


@pytest.fixture
def tree(tmp_path) -> Path:
    """A tree with three programs and their libraries, as small as one can be changed into."""
    for program in ("/bin/sh", "/usr/bin/env", "/bin/ls"):
        linked = subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout
        for file in (program, *re.findall(r"/\S+", linked)):
            inside = tmp_path / "tree" / file.lstrip("/")
            inside.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, inside)
    return tmp_path / "tree"


@pytest.mark.skipif(not can_mount(), reason="needs root that may mount, unshare, ldd and chroot")
def test_the_checkout_is_there_for_the_tree_alone(tree):
    binary = runpy.run_path(str(ROOT / "scripts" / "fetch_blender.py"))["wrapper"](tree)
    command = [str(binary), "--inside", "/bin/ls", str(ROOT)]
    seen = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert {"addon", "tactile_core", "README.md"} <= set(seen)
    assert str(tree) not in Path("/proc/mounts").read_text()
    assert list((tree / str(ROOT).lstrip("/")).iterdir()) == []
