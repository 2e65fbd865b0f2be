"""Build installable zips of the Blender extension.

    python3 scripts/build_extension.py                               linux-x64, for Blender 4.2 to 5.0 (Python 3.11)
    python3 scripts/build_extension.py --platform windows-x64 --python 3.13      Blender 5.1 and later
    python3 scripts/build_extension.py --python 3.13 --debian        Debian's 4.3, whose Python is another
    python3 scripts/build_extension.py --no-wheels                   42 MB, any platform: numpy alone, see Preferences

A zip holds the files that git tracks, and the wheels of what simulating and rendering need: 173 to 229 MB per platform
and Python, so each has a zip of its own. The same commit, platform and wheels give the same bytes.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# platform of Blender -> platforms of wheels, newest first
PLATFORMS = {
    "linux-x64": [f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 24, 17)] + ["manylinux2014_x86_64"],
    "linux-arm64": [f"manylinux_2_{minor}_aarch64" for minor in (28, 27, 24, 17)] + ["manylinux2014_aarch64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": [f"macosx_{major}_0_arm64" for major in range(14, 10, -1)],
}
# Python -> the first Blender that has it, and the first that has another
BLENDERS = {"3.11": ("4.2.0", "5.1.0"), "3.13": ("5.1.0", None), "3.14": (None, None)}
# Never torch (users translate with numpy), never numpy (Blender ships it).
WHEELS = (
    "h5py", "msgspec", "scipy", "cholespy", "trimesh", "rtree", "numba", "llvmlite", "mitsuba", "drjit", "OpenEXR",
    "threadpoolctl", "rosbags", "apsw", "backports.zstd", "lz4", "ruamel.yaml", "typing_extensions",
)  # fmt: skip
MISSING = {("backports.zstd", "3.14"), ("cholespy", "linux-arm64")}  # part of that Python; no wheel: SciPy's solver
PACKED = ("__init__.py", "blender_manifest.toml", "LICENSE", "addon/", "tactile_core/", "scenes/")
LEFT_OUT = ("scenes/training/", "tactile_core/training/")  # 1.8 MB for tests; torch
KEPT = ("tactile_core/training/__init__.py", "tactile_core/training/options.py")  # the verb `train` names its choices
EPOCH = (1980, 1, 1, 0, 0, 0)  # zip's own zero, so that the time of building changes no byte


def main(arguments: list[str] | None = None) -> int:
    """Build one zip and say how large it is; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--platform", choices=tuple(PLATFORMS), default="linux-x64")
    parser.add_argument(
        "--python", choices=tuple(BLENDERS), default="3.11", help="of the Blender it is for (default: 3.11)"
    )
    parser.add_argument("--debian", action="store_true", help="of a distribution: no bounds on the Blender's version")
    parser.add_argument("--no-wheels", action="store_true", help="without wheels, for any platform and Python")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", metavar="DIR", help="default: dist")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        try:
            wheels = [] if options.no_wheels else fetch(options.platform, options.python, Path(folder))
            platform = None if options.no_wheels else options.platform
            path = build(options.out, platform, options.python, wheels, options.debian)
        except (subprocess.CalledProcessError, OSError) as error:
            print(f"build_extension.py: error: {error}", file=sys.stderr)
            return 2
    print(f"{path} ({path.stat().st_size / 1e6:.1f} MB)")
    return 0


def tracked() -> list[str]:
    """List the checkout's files that belong in the zip, sorted."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout.decode()
    packed = (name for name in listed.split("\0") if name.startswith(PACKED))
    return sorted(name for name in packed if name in KEPT or not name.startswith(LEFT_OUT))


def fetch(platform: str, python: str, folder: Path) -> list[Path]:
    """Download the wheels for a platform and a Python into a folder; return their paths. Raises CalledProcessError
    after pip has said what is missing."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:",
               "--implementation", "cp", "--python-version", python, "--dest", str(folder)]  # fmt: skip
    for name in PLATFORMS[platform]:
        command += ["--platform", name]
    subprocess.run([*command, *requirements(python, platform)], check=True)
    return sorted(folder.glob("*.whl"))


def requirements(python: str, platform: str) -> list[str]:
    """List ``name==version`` of every wheel for a Python and platform."""
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    pins = dict(re.findall(r"(?m)^([A-Za-z0-9_.-]+)==(\S+)$", text))
    return [f"{name}=={pins[name]}" for name in WHEELS if not {(name, python), (name, platform)} & MISSING]


def manifest(platform: str | None, python: str, wheels: list[Path], debian: bool) -> str:
    """Return the text of blender_manifest.toml, with platform, Blender's versions and wheels of one zip filled in.
    platform : None for a zip without wheels; debian : true for a distribution's Blender, of any version"""
    text = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    if platform is None:
        return text
    oldest, beyond = (None, None) if debian else BLENDERS[python]
    if oldest:
        text = re.sub(r'(?m)^(blender_version_min = ").*"$', rf'\g<1>{oldest}"', text)
    limit = f'blender_version_max = "{beyond}"\n' if beyond else ""
    names = "".join(f'    "./wheels/{wheel.name}",\n' for wheel in wheels)
    return text.replace("[permissions]", f'{limit}platforms = ["{platform}"]\nwheels = [\n{names}]\n\n[permissions]')


def build(out: Path, platform: str | None, python: str, wheels: list[Path], debian: bool = False) -> Path:
    """Write the zip into the folder ``out`` and return its path. platform, python, wheels, debian : of ``manifest``"""
    text = manifest(platform, python, wheels, debian)
    version = re.search(r'(?m)^version = "(.+)"$', text).group(1)
    tag = f"-{platform}-py{python}{'-debian' * debian}" if platform else ""
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"tactile-{version}{tag}.zip"
    partial = path.with_suffix(".partial")
    with zipfile.ZipFile(partial, "w") as file:
        for name in tracked():
            content = text.encode() if name == "blender_manifest.toml" else (ROOT / name).read_bytes()
            add(file, name, content, zipfile.ZIP_DEFLATED)
        for wheel in wheels:
            add(file, f"wheels/{wheel.name}", wheel.read_bytes(), zipfile.ZIP_STORED)  # already packed
    partial.replace(path)
    return path


def add(file: zipfile.ZipFile, name: str, content: bytes, how: int) -> None:
    """Add one member to a zip, compressed by ``how`` (zipfile's constant), without time or the builder's file modes."""
    member = zipfile.ZipInfo(name, EPOCH)
    member.compress_type, member.external_attr = how, 0o644 << 16
    file.writestr(member, content)


if __name__ == "__main__":
    sys.exit(main())
