"""Fetch a real Blender from Debian into a folder of its own, run the extension's tests in it and photograph its window.

    python3 scripts/fetch_blender.py                        trixie's 4.3.2 into out/blender-trixie: 90 s, 1.7 GB
    python3 scripts/fetch_blender.py --suite sid            sid's 5.2
    python3 scripts/fetch_blender.py --no-tests             only the screenshots, in out/screenshots

Needs Linux, root (it makes a Debian tree and changes into it) and apt-get with Debian's packages; nothing is installed
on the machine itself. The checkout, /tmp, /dev and /proc are mounted into the tree for its Blender alone.
"""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ["blender", "xvfb", "xauth", "xdotool", "imagemagick"]
PACKAGES += ["libgl1-mesa-dri", "libegl1", "libllvm19", "python3-numpy"]
# sid's Blender needs them for its extensions' command line.
EXTRA = {"sid": ["python3-cattr", "python3-requests"]}
STAGES = ("imported", "translated", "rendered", "authored")
STAGE_SECONDS = 900  # of a photograph: half a minute; a busy machine takes minutes more for a first contact's matrices
# A mirror that lags behind serves sid's lists past their date; they are signed all the same.
OLD_LISTS = ["-o", "Acquire::Check-Valid-Until=false"]
MIRROR = "http://deb.debian.org/debian"
WRAPPER = """\
#!/bin/sh
# Runs the tree's Blender with these arguments; after --inside, another command.
set -e
[ -n "$MOUNTED_FOR_BLENDER" ] || exec env MOUNTED_FOR_BLENDER=1 \\
    unshare --mount --propagation private --pid --fork --kill-child "$0" "$@"
for place in {root} /tmp /dev; do
    mkdir -p {tree}"$place"
    mount --bind "$place" {tree}"$place"
done
mkdir -p {tree}/proc
mount -t proc proc {tree}/proc
if [ "$1" = --inside ]; then shift; else set -- blender "$@"; fi
if [ ! -d {tree}"$PWD" ]; then cd /; fi
# Not by exec: an X server signals its parent that it is ready, unless that is process 1.
chroot {tree} /usr/bin/env --chdir="$PWD" LIBGL_ALWAYS_SOFTWARE=1 "$@"
"""


def main(arguments: list[str] | None = None) -> int:
    """Fetch Blender, run the tests in it, take screenshots; return the tests' exit status, 2 if another step failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--suite", choices=("trixie", "sid"), default="trixie")
    parser.add_argument("--folder", type=Path, help="of the Debian tree (default: out/blender-SUITE)")
    parser.add_argument("--no-tests", action="store_true", help="do not run the tests")
    parser.add_argument("--no-screenshots", action="store_true", help="take none")
    options = parser.parse_args(arguments)
    if os.name != "posix" or os.geteuid() != 0:
        print("fetch_blender.py: error: it must run as root on Linux", file=sys.stderr)
        return 2
    tree = (options.folder or ROOT / "out" / f"blender-{options.suite}").resolve()
    try:
        fetch(tree, options.suite)
        binary = wrapper(tree)
        tests = [sys.executable, str(ROOT / "scripts" / "dev.py"), "test-blender", "--binary", str(binary), "-q"]
        status = 0 if options.no_tests else subprocess.call(tests)
        if not options.no_screenshots:
            photograph(binary)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        print(f"fetch_blender.py: error: {error}", file=sys.stderr)
        return 2
    return status


def fetch(tree: Path, suite: str) -> None:
    """Install a Debian ``suite`` with Blender into the folder ``tree``, unless it is there."""
    if (tree / "usr" / "bin" / "blender").exists():
        return
    tools = tree.parent / "debootstrap"
    tools.mkdir(parents=True, exist_ok=True)
    subprocess.run(["apt-get", *OLD_LISTS, "update", "-qq"], check=True)
    subprocess.run(["apt-get", "download", "-qq", "debootstrap"], cwd=tools, check=True)
    subprocess.run(["dpkg", "-x", str(max(tools.glob("debootstrap_*.deb"))), str(tools)], check=True)
    scripts = os.environ | {"DEBOOTSTRAP_DIR": str(tools / "usr" / "share" / "debootstrap")}
    command = [str(tools / "usr" / "sbin" / "debootstrap"), "--variant=minbase", suite, str(tree), MIRROR]
    subprocess.run(command, env=scripts, check=True)
    words = ["-y", "-qq", "--no-install-recommends", *PACKAGES, *EXTRA.get(suite, [])]
    for install in (["update", "-qq"], ["install", *words]):
        subprocess.run(["chroot", str(tree), "apt-get", *OLD_LISTS, *install], check=True)


def wrapper(tree: Path) -> Path:
    """Write a program that runs the command after --inside in the tree, else the tree's Blender; return its path.

    The checkout, /tmp, /dev and /proc are mounted in a namespace of that process alone: whoever deletes the tree while
    it runs, or after it was killed, deletes nothing else; and all that it started ends with it.
    """
    path = tree.parent / f"{tree.name}.sh"
    path.write_text(WRAPPER.format(tree=shlex.quote(str(tree)), root=shlex.quote(str(ROOT))))
    path.chmod(0o755)
    return path


def photograph(binary: Path) -> None:
    """Save a screenshot of the window at each of ``STAGES``, out/screenshots/<stage>.png; binary : by ``wrapper``"""
    out = ROOT / "out" / "screenshots"
    out.mkdir(parents=True, exist_ok=True)
    ask = [str(binary), "-b", "--python-expr", "import sys; print('PY %d.%d' % sys.version_info[:2])"]
    answer = subprocess.run(ask, check=True, capture_output=True, text=True).stdout
    python = answer.split("PY ")[1].split()[0]
    script = str(ROOT / "scripts" / "build_extension.py")
    build = [sys.executable, script, "--debian", "--python", python, "--out", str(out)]
    packed = subprocess.run(build, check=True, capture_output=True, text=True).stdout.rsplit(" (", 1)[0].strip()
    for stage in STAGES:
        known = {"STAGE": stage, "OUT": str(out / f"{stage}.png"), "ZIP": packed,
                 "BLENDER_USER_RESOURCES": str(out / f"user-{stage}"), "HOME": "/root"}  # fmt: skip
        variables = [f"{name}={value}" for name, value in known.items()]
        window = ["blender", "--factory-startup", "--window-geometry", "0", "0", "1280", "800", "--python"]
        shot = ROOT / "tests" / "blender" / "screenshot.py"
        run = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", *window, str(shot)]
        subprocess.run([str(binary), "--inside", "env", *variables, *run], check=True, timeout=STAGE_SECONDS)
        print(out / f"{stage}.png")


if __name__ == "__main__":
    sys.exit(main())
