"""Build a release into a folder, try it in an empty environment, and print its hashes.

    python3 scripts/release.py                 wheel, sdist and the extension's zips, in dist/
    python3 scripts/release.py --no-zips       wheel and sdist alone: two minutes

The version is the one of tactile_core/files/version.py; the manifest, CITATION.cff and the newest heading of
CHANGELOG.md must name the same. The wheel is built from the sdist, installed into an empty environment and must convert
the recording that ships. The same commit and packages give the same wheel and zips, to the byte; the sdist holds the
times of the checkout's files.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

import build_extension
from build_extension import ROOT

# Where the version stands, the first line that is it.
VERSIONS = {
    "tactile_core/files/version.py": r'(?m)^__version__ = "(.+)"$',
    "blender_manifest.toml": r'(?m)^version = "(.+)"$',
    "CITATION.cff": r"(?m)^version: (.+)$",
    "CHANGELOG.md": r"(?m)^## (\S+)",
}
ZIPS = [(platform, python, False) for platform in build_extension.PLATFORMS for python in ("3.11", "3.13")]
ZIPS += [("linux-x64", "3.13", True), ("linux-x64", "3.14", True)]  # Debian's


class ReleaseError(Exception):
    """Error for a checkout that cannot be released; the message says what to do."""


def main(arguments: list[str] | None = None) -> int:
    """Build wheel, sdist and zips, convert with the wheel alone, print hashes; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--no-zips", action="store_true", help="leave out the extension's zips")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", metavar="DIR", help="new or empty (default: dist)")
    options = parser.parse_args(arguments)
    options.out = options.out.resolve()  # commands run in the checkout
    try:
        version = agreed_version(ROOT)
        check_clean(options.out)
        wheel = build_packages(options.out)
        try_wheel(wheel, version)
        if not options.no_zips:
            build_zips(options.out)
    except (ReleaseError, OSError, subprocess.CalledProcessError) as error:
        print(f"release.py: error: {error}", file=sys.stderr)
        return 2
    print(write_hashes(options.out), end="")
    return 0


def agreed_version(root: Path) -> str:
    """Return the version that all files of ``VERSIONS`` name. Raises ReleaseError if two differ."""
    found = {}
    for name, pattern in VERSIONS.items():
        match = re.search(pattern, (root / name).read_text(encoding="utf-8"))
        found[name] = match.group(1) if match else None
    if len(set(found.values())) != 1:
        told = ", ".join(f"{name}: {version}" for name, version in found.items())
        raise ReleaseError(f"the version differs between files ({told}). Write one into all of them")
    return str(found["CHANGELOG.md"])


def check_clean(out: Path) -> None:
    """Raise ReleaseError if the checkout has uncommitted changes, or if the folder ``out`` is not empty."""
    changed = run("git", "status", "--porcelain")
    if changed:
        raise ReleaseError(f"these changes are in no commit; commit or drop them first:\n{changed}")
    if out.exists() and any(out.iterdir()):
        raise ReleaseError(f"{out} is not empty. Name another folder by --out, or remove it")


def build_packages(out: Path) -> Path:
    """Build the sdist, and from it the wheel, whose files get the commit's time; return the wheel's path."""
    with tempfile.TemporaryDirectory() as folder:
        python = new_environment(Path(folder), "build")
        os.environ["SOURCE_DATE_EPOCH"] = run("git", "log", "-1", "--format=%ct")
        run(str(python), "-m", "build", "--outdir", str(out), str(ROOT))
    return next(out.glob("*.whl"))


def try_wheel(wheel: Path, version: str) -> None:
    """Install the wheel alone and convert the recording in it. Raises ReleaseError unless it reports ``version``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        python = new_environment(folder / "venv", "--constraint", str(ROOT / "constraints.txt"), str(wheel))
        tactile = [str(python), "-m", "tactile_core"]
        told = run(*tactile, "--version", folder=folder)
        if told != f"tactile {version}":
            raise ReleaseError(f"the wheel says {told!r}, not 'tactile {version}'")
        run(*tactile, "scenes", "copy", folder=folder)
        recording = next((folder / "scenes").rglob("press_roll_slide.h5"))
        run(*tactile, "convert", str(recording), "--out", "results", folder=folder)


def build_zips(out: Path) -> None:
    """Build the extension's zip without wheels, and one per platform and Python. Raises ReleaseError if one fails."""
    wanted = [["--no-wheels"]]
    wanted += [["--platform", one, "--python", python, *["--debian"] * debian] for one, python, debian in ZIPS]
    for options in wanted:
        if build_extension.main([*options, "--out", str(out)]):
            raise ReleaseError(f"build_extension.py {' '.join(options)} failed")


def new_environment(folder: Path, *packages: str) -> Path:
    """Make an empty virtual environment, install packages into it and return its Python."""
    venv.create(folder, with_pip=True)
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    run(str(python), "-m", "pip", "install", "--quiet", "--no-input", *packages)
    return python


def run(*command: str, folder: Path = ROOT) -> str:
    """Run a command in a folder, without modules of this checkout; returns what it printed."""
    variables = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(command, cwd=folder, env=variables, check=True, stdout=subprocess.PIPE, text=True)
    return done.stdout.strip()


def write_hashes(out: Path) -> str:
    """Write SHA256SUMS of all files of a release; returns its text."""
    files = sorted(path for path in out.iterdir() if path.name != "SHA256SUMS")
    text = "".join(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n" for path in files)
    (out / "SHA256SUMS").write_text(text, encoding="utf-8")
    return text


if __name__ == "__main__":
    sys.exit(main())
