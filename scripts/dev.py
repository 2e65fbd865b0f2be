"""Set up and run the project on a fresh machine, with the standard library alone (Linux, macOS, Windows).

    python3 scripts/dev.py demo                     convert the recording that ships; results in out/demo/
    python3 scripts/dev.py test                     check the style, then run the tests, on up to four cores
    python3 scripts/dev.py test --train             the same with torch, so that the training tests run too
    python3 scripts/dev.py test tests/cli/test_cli.py -x    what is not known here goes to pytest
    python3 scripts/dev.py check                    check style and types (ruff, mypy)
    python3 scripts/dev.py docs                     build the pages and the API reference as a site in out/site/
    python3 scripts/dev.py test-blender             the extension's tests in the bpy wheel (--bpy 4.2.0 for another)
    python3 scripts/dev.py test-blender --binary /usr/bin/blender    and in a real Blender, from the zip that users get

The first two make `.venv` in the checkout and install the project there (editable, versions from constraints.txt).
Afterwards `.venv/bin/tactile` and `.venv/bin/python` work (Windows: `.venv\\Scripts\\`). A second call is instant.
The file keeps to the syntax of Python 3.7, so that an old Python reads it far enough to say what it lacks.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import subprocess
import sys
import venv
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OLDEST, NEWEST = (3, 11), (3, 13)
DEMO_RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
TEST_PACKAGES = ("pytest", "pytest-timeout")
# What the extension's tests need beside bpy; 4.2 to 5.0 were built for the first numpy's binary interface.
BLENDER_PACKAGES = (
    *TEST_PACKAGES, "h5py", "msgspec", "scipy", "cholespy", "trimesh", "rtree", "threadpoolctl", "OpenEXR",
)  # fmt: skip
WORKERS = 4  # processes of tests at most; each takes up to 4 GB
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
BLENDER_SECONDS = 1800  # some Blenders hang at exit (4.5 where an operator stays registered): no run may last longer
# What a command of the same name as its extra runs, by `python -m`.
TOOLS = {
    "check": (["ruff", "check", "."], ["ruff", "format", "--check", "."], ["mypy"]),
    "docs": (["sphinx", "--fail-on-warning", "--keep-going", "-q", "docs", "out/site"],),
}
STAMP = "tactile-dev.json"


class SetupError(Exception):
    """The machine lacks something; the message says what to do."""


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit status: that of the tool it ran, 2 when set-up failed, 130 on Ctrl-C."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a path may hold what the terminal cannot show
    layout = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=layout)
    commands = parser.add_subparsers(dest="command", required=True)
    demo = commands.add_parser("demo", help="convert the recording that ships", allow_abbrev=False)
    # No abbreviations: `-t` and the like belong to pytest.
    test = commands.add_parser("test", help="run ruff and pytest; other arguments go to pytest", allow_abbrev=False)
    test.add_argument("--train", action="store_true", help="also install torch and run the training tests")
    test.add_argument("--numpy", metavar="VERSION", help="install this numpy, and no extra that needs a newer one")
    check = commands.add_parser("check", help="check style and types", allow_abbrev=False)
    docs = commands.add_parser("docs", help="build the site of the documentation", allow_abbrev=False)
    blender = commands.add_parser("test-blender", help="test the extension inside Blender", allow_abbrev=False)
    blender.add_argument("--bpy", metavar="VERSION", default="4.5.15", help="of the wheel (default: %(default)s)")
    blender.add_argument("--binary", type=Path, metavar="PATH", help="a real Blender in place of the wheel")
    blender.add_argument("--venv", type=Path, help="where to install (default: .venv-bpy-VERSION)")
    for command in (demo, test, check, docs):
        command.add_argument("--venv", type=Path, default=ROOT / ".venv", help="where to install (default: .venv)")
    options, rest = parser.parse_known_args(arguments)
    if rest and options.command in ("demo", *TOOLS):
        parser.error("unknown arguments: " + " ".join(rest))
    try:
        check_python(sys.version_info[:2])
        if options.command == "test-blender":
            return run_in_binary(options.binary, rest) if options.binary else run_in_bpy(options, rest)
        if options.command in TOOLS:
            return run_all(install(options.venv, (options.command,)), TOOLS[options.command], environment())
        return run_demo(options.venv) if options.command == "demo" else run_tests(options, rest)
    except SetupError as error:
        print(f"dev.py: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("dev.py: interrupted; the next call goes on from here", file=sys.stderr)
        return 130


def check_python(version: tuple[int, int]) -> None:
    """Raise SetupError for a Python that the pinned packages have no wheels for."""
    if not OLDEST <= version <= NEWEST:
        raise SetupError(
            "this is Python {}.{}; the project needs {}.{} to {}.{}. Run it with one of these, such as "
            "`python3.11 scripts/dev.py ...`".format(*version, *OLDEST, *NEWEST)
        )


def run_demo(folder: Path) -> int:
    """Convert the shipped recording into out/demo in the environment ``folder``; print the files; return the status."""
    python = install(folder, extras=())
    out = ROOT / "out" / "demo"
    command = ["-m", "tactile_core", "convert", str(DEMO_RECORDING), "--out", str(out), "--overwrite"]
    say(f"tactile convert {relative(DEMO_RECORDING)} --out {relative(out)} --overwrite")
    status = subprocess.call([str(python), *command], cwd=str(ROOT), env=environment())
    if status == 0:
        result = out / DEMO_RECORDING.stem
        print(f"\nThe demo's files, in {relative(result)}:")
        for path in sorted(result.iterdir()):
            pictures = f" ({len(list(path.iterdir()))} pictures)" if path.is_dir() else ""
            print(f"  {path.name}{pictures}")
        print("Open {} first.".format(relative(result / "contact_sheet.png")))
    return status


def run_tests(options: argparse.Namespace, pytest_arguments: list[str]) -> int:
    """Run ruff, then pytest even if ruff fails; return the first status that is not 0, or 0. If all tests are to run,
    they run in up to WORKERS processes of one thread."""
    extras = ("plain" if options.numpy else "dev", *(("train",) if options.train else ()))
    python = install(options.venv, extras, options.numpy)
    variables, workers = environment(), min(os.cpu_count() or 1, WORKERS)
    if set(pytest_arguments) <= {"-q", "-v"} and workers > 1:
        pytest_arguments = [*pytest_arguments, "-n", str(workers), "--dist", "worksteal"]
        for name in THREADS:
            variables.setdefault(name, "1")
    return run_all(python, (["ruff", "check", "."], ["pytest", *pytest_arguments]), variables)


def run_all(python: Path, commands: Iterable[list[str]], variables: dict[str, str]) -> int:
    """Run commands, each a Python module and its arguments, even if one fails; return the first status that is not 0,
    or 0. variables : environment variables"""
    failed = []
    for command in commands:
        say(" ".join(command))
        status = subprocess.call([str(python), "-m", *command], cwd=str(ROOT), env=variables)
        failed += [status] if status else []
    return failed[0] if failed else 0


def run_in_bpy(options: argparse.Namespace, pytest_arguments: list[str]) -> int:
    """Run the extension's tests in the bpy wheel of one version; returns pytest's status."""
    folder = options.venv or ROOT / (".venv-bpy-" + options.bpy)
    old = tuple(int(part) for part in options.bpy.split(".")[:2]) < (5, 1)
    needed = (3, 11) if old else (3, 13)
    if sys.version_info[:2] != needed:
        raise SetupError("bpy {} has wheels for Python {}.{} alone".format(options.bpy, *needed))
    packages = ("bpy==" + options.bpy, *BLENDER_PACKAGES)
    python = install(folder, packages, "1.26.4" if old else None, packages)
    say(f"pytest tests/blender, {packages[0]}")
    return call_with_limit([str(python), "-m", "pytest", "tests/blender", *pytest_arguments], environment())


def run_in_binary(binary: Path, pytest_arguments: list[str]) -> int:
    """Run the extension's tests inside a real Blender, on the zip with the wheels of its Python; returns the status."""
    code = "import sys; print('PYTHON %d.%d' % sys.version_info[:2])"
    try:
        command = [str(binary), "--background", "--factory-startup", "--python-expr", code]
        asked = subprocess.run(command, stdout=subprocess.PIPE, timeout=120)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise SetupError(f"{binary} does not run ({error})") from None
    found = re.search(r"PYTHON (\d+\.\d+)", asked.stdout.decode(errors="replace"))
    if not found:
        raise SetupError(f"{binary} runs no Python")
    work = ROOT / "out" / "test-blender"
    site, wheels = work / "site", work / "dist"
    build = [sys.executable, str(ROOT / "scripts" / "build_extension.py"), "--debian", "--python", found.group(1)]
    constraint = ["--constraint", str(ROOT / "constraints.txt")]
    pytest = [sys.executable, "-m", "pip", "install", "--upgrade", "--target", str(site), *constraint]
    for step in ([*build, "--out", str(wheels)], [*pytest, *TEST_PACKAGES]):
        if subprocess.call(step, env=environment()):
            raise SetupError("the step before failed")
    packed = max(wheels.glob(f"*-py{found.group(1)}-debian.zip"), key=lambda path: path.stat().st_mtime)
    run = ROOT / "tests" / "blender" / "run_in_blender.py"
    say(f"pytest tests/blender, {binary}, {packed.name}")
    known = dict(environment(), TACTILE_ZIP=str(packed), TACTILE_SITE=str(site))
    options = ["--background", "--factory-startup", "--python-exit-code", "1", "--python", str(run), "--"]
    return call_with_limit([str(binary), *options, *pytest_arguments], known)


def call_with_limit(command: list[str], variables: dict[str, str]) -> int:
    """Run a Blender with environment variables, at most ``BLENDER_SECONDS``; return its status, 124 for too long."""
    try:
        return subprocess.call(command, cwd=str(ROOT), env=variables, timeout=BLENDER_SECONDS)
    except subprocess.TimeoutExpired:
        print(f"dev.py: error: not done after {BLENDER_SECONDS} s", file=sys.stderr)
        return 124


def install(
    folder: Path, extras: tuple[str, ...], numpy: str | None = None, packages: tuple[str, ...] | None = None
) -> Path:
    """Make the virtual environment ``folder`` hold the project with extras, or ``packages`` alone; return its Python.

    numpy : its version, None for that of constraints.txt
    A stamp file records what is installed, so that a second call costs nothing. Extras of earlier calls stay."""
    folder = Path(os.path.abspath(str(folder)))
    python = make_venv(folder)
    have = read_stamp(folder)
    wanted = {"root": str(ROOT), "python": python_version(), "numpy": numpy, "sources": sources_hash()}
    current = all(have.get(key) == value for key, value in wanted.items())
    there = set(have.get("extras", [])) if current else set()
    missing = [extra for extra in ("", *extras) if extra not in there]
    if not missing:
        return python
    # pip reads `.[extra]` relative to its working folder, whatever characters the path of that folder holds.
    what = packages or ("--editable", ".[{}]".format(",".join(extras)) if extras else ".")
    name = packages[0] if packages else "tactile-core" + what[1][1:]
    say(f"installing {name} into {relative(folder)}; downloads some 50 to 650 MB")
    if "train" in missing:
        say("torch takes up to 3,000 MB; its CPU build 190: PIP_EXTRA_INDEX_URL=https://download.pytorch.org/whl/cpu")
    write_stamp(folder, dict(wanted, extras=[], state="installing"))
    installed = run_pip(python, folder, what, numpy)
    write_stamp(folder, dict(wanted, extras=sorted(there | {"", *extras}) if installed else [], state="ready"))
    if not installed:
        raise SetupError(
            "pip could not install the packages; its reason is above. Where it reaches no package index, check the "
            "network, or set PIP_INDEX_URL or HTTPS_PROXY; then run this again"
        )
    return python


def make_venv(folder: Path) -> Path:
    """Make the environment ``folder``, or make it again if it is half made, moved, or of another Python; return its
    Python. Raises SetupError if the folder holds something else, or if the environment cannot be made."""
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    if folder.is_file() or (folder.is_dir() and folder != ROOT / ".venv" and is_foreign(folder)):
        raise SetupError(f"{folder} holds something else. Name a new or an empty folder")
    if folder.is_dir() and any(folder.iterdir()):
        why = why_unusable(python, read_stamp(folder))
        if why is None:
            return python
        say(f"making {relative(folder)} again: {why}")
    else:
        say(f"making {relative(folder)} with Python {python_version()}")
    try:
        venv.create(str(folder), clear=True, with_pip=True, symlinks=os.name != "nt")
    except (OSError, subprocess.CalledProcessError) as error:
        raise SetupError(
            "cannot make a virtual environment in {} ({}). Check that the folder can be written; on Debian and "
            "Ubuntu: apt install python{}.{}-venv".format(folder, error, *sys.version_info[:2])
        ) from None
    return python


def is_foreign(folder: Path) -> bool:
    """Return true if a folder holds files but no virtual environment: making one there would destroy them."""
    return any(folder.iterdir()) and not (folder / "pyvenv.cfg").exists()


def why_unusable(python: Path, have: dict) -> str | None:
    """Return why an existing environment cannot be used, None if it can; python : its own; have : its `read_stamp`"""
    if have and have.get("root") != str(ROOT):
        return "it was made for {}".format(have.get("root"))
    if have.get("state") == "installing":
        return "its installation was interrupted"
    code = "import pip, sys; print('%d.%d.%d' % sys.version_info[:3])"
    try:
        done = subprocess.run([str(python), "-c", code], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    except OSError:
        return "it is half made"
    found = done.stdout.decode(errors="replace").strip()
    if done.returncode:
        return "it is half made"
    return None if found == python_version() else f"it holds Python {found}, this is {python_version()}"


def run_pip(python: Path, folder: Path, what: tuple[str, ...], numpy: str | None) -> bool:
    """Install packages ``what`` by pip, which prints what it does; return true if it worked. numpy : of ``install``"""
    constraints = ROOT / "constraints.txt"
    if numpy:
        text = re.sub(r"(?m)^numpy==.*$", f"numpy=={numpy}", constraints.read_text(encoding="utf-8"))
        constraints = folder / "constraints.txt"
        constraints.write_text(text, encoding="utf-8")
    # Python compiles what it imports; of all that lies in these packages that is a small part.
    command = [str(python), "-m", "pip", "install", "--no-input", "--no-compile", "--constraint", str(constraints)]
    return not subprocess.call([*command, *what], cwd=str(ROOT), env=environment())


def environment() -> dict[str, str]:
    """Return the environment variables without those that would lead Python or pip away from the virtual environment.

    PYTHONDONTWRITEBYTECODE, which containers set, is dropped too: packages are installed uncompiled, and each command
    of a test would compile them again, so that `tactile --version` takes five times as long.
    """
    dropped = ("PYTHONHOME", "PYTHONPATH", "PIP_USER", "PYTHONDONTWRITEBYTECODE")
    kept = {key: value for key, value in os.environ.items() if key not in dropped}
    kept["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
    kept.setdefault("PIP_RETRIES", "2")  # pip's five keep a user without a network waiting for a minute
    if not kept.get("HOME") and os.name != "nt":
        # An empty HOME makes caches land in the working folder.
        kept.pop("HOME", None)
    return kept


def read_stamp(folder: Path) -> dict:
    """Read the record that `write_stamp` left in an environment of what is installed; {} without one."""
    try:
        found = json.loads((folder / STAMP).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def write_stamp(folder: Path, content: dict) -> None:
    """Write the record of what is installed in an environment, replacing the former one in one step."""
    fresh = folder / (STAMP + ".new")
    fresh.write_text(json.dumps(content, indent=1), encoding="utf-8")
    os.replace(str(fresh), str(folder / STAMP))


def sources_hash() -> str:
    """Return a hash, hexadecimal, that changes when pyproject.toml or constraints.txt do: the lists of packages."""
    digest = hashlib.sha256()
    for name in ("pyproject.toml", "constraints.txt"):
        digest.update((ROOT / name).read_bytes())
    return digest.hexdigest()


def python_version() -> str:
    """Return the running Python's version, such as 3.11.4."""
    return ".".join(str(number) for number in sys.version_info[:3])


def relative(path: Path) -> str:
    """Return a path as text, relative to the checkout if it lies there."""
    try:
        return str(path.relative_to(ROOT))
    except ValueError:
        return str(path)


def say(text: str) -> None:
    """Print a line of this script's own, at once."""
    print("[dev] " + text, flush=True)


if __name__ == "__main__":
    sys.exit(main())
