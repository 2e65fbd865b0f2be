"""Get LLVM for Mitsuba without root, on Debian and Ubuntu: unpack the distribution's own package into a folder.

    python scripts/fetch_llvm.py DIR          prints the library's path; set DRJIT_LIBLLVM_PATH to it
    export DRJIT_LIBLLVM_PATH=$(python scripts/fetch_llvm.py .llvm)

About 30 MB to fetch, 130 MB unpacked; nothing is installed. A second call finds what the first one left. Exits 1, and
says why on stderr, where there is no apt or no LLVM 18 or newer: pictures are then drawn without it, more slowly.
"""

from __future__ import annotations

import argparse
import glob
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# The newest first; each works with Mitsuba 3.9 (18, 19, 22: blender.md).
PACKAGES = ("libllvm20", "libllvm19", "libllvm18", "libllvm19t64", "libllvm18t64")
SECONDS = 300


class NoLlvm(Exception):
    """Error that says why there is no LLVM."""


def main(arguments: list[str] | None = None) -> int:
    """Fetch LLVM and print its path; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="DIR", type=Path, help="where to unpack it")
    try:
        print(fetch_llvm(parser.parse_args(arguments).folder))
    except NoLlvm as reason:
        print(f"fetch_llvm: {reason}", file=sys.stderr)
        return 1
    return 0


def fetch_llvm(folder: Path) -> str:
    """Return the path of libLLVM in `folder`; unpack it there if need be. Raises NoLlvm if apt has none."""
    found = library_in(folder)
    if found:
        return found
    for tool in ("apt-get", "dpkg"):
        if shutil.which(tool) is None:
            raise NoLlvm(f"there is no {tool} here")
    said = ""
    with tempfile.TemporaryDirectory() as scratch:
        for package in PACKAGES:
            command = ["apt-get", "download", package]
            done = subprocess.run(command, cwd=scratch, capture_output=True, text=True, timeout=SECONDS)
            files = glob.glob(os.path.join(scratch, "*.deb"))
            if done.returncode == 0 and files:
                folder.mkdir(parents=True, exist_ok=True)
                subprocess.run(["dpkg", "-x", files[0], str(folder)], check=True, timeout=SECONDS)
                break
            said = said or done.stderr.strip().replace("\n", " ")[:200]
    found = library_in(folder)
    if not found:
        raise NoLlvm(f"apt has none of {', '.join(PACKAGES)} ({said}); `apt-get update` may help")
    return found


def library_in(folder: Path) -> str:
    """Return the path of libLLVM under a folder, not of a link to it; "" if there is none."""
    files = [path for path in folder.glob("usr/lib/**/libLLVM.so*") if path.is_file() and not path.is_symlink()]
    files += [path for path in folder.glob("usr/lib/**/libLLVM-*.so.*") if path.is_file() and not path.is_symlink()]
    return str(files[0].resolve()) if files else ""


if __name__ == "__main__":
    sys.exit(main())
