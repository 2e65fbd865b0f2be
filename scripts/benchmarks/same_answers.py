"""Compare all bytes that a fixed set of commands writes before and after a refactoring.

    python scripts/benchmarks/same_answers.py before.json                       on the commit before
    python scripts/benchmarks/same_answers.py after.json --than before.json     on the one after, on the same machine

The commands make translations, solved gels, pairs, a simulation and pictures of each preset, from recordings and scenes
that ship, and contacts by ``tactile.solve``. Writes the SHA-256 of each file (minutes); with --than it names those that
differ, are gone or are new, and exits with 1 if there are any. Notes and timings hold versions and clocks: left out.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import tactile_core as tactile
from tactile_core.files import atomic

ROOT = Path(__file__).resolve().parents[2]
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
SCENES = ROOT / "scenes"
KEPT = "latent,displacement,height,image,traction"
# Run in this order; {out} is the folder that all of them write to.
COMMANDS = (
    f"convert {{recording}} --out {{out}}/demo --keep {KEPT} --error 5levels --samples 3",
    "convert {recording} --out {out}/solved --gel solved --frames 300:500:20",
    "pairs {scenes}/press_sphere/scene.toml --count 6 --seed 1 --out {out}/ball_pairs.h5",
    "pairs {scenes}/training/scene.toml --count 8 --seed 3 --out {out}/pairs.h5",
    "simulate {scenes}/press/scene.toml --seed 2 --out {out}/press.h5",
    "render {frames} --out {out}/fast --preset fast --frames 350:480:40 --exr --noise",
    "render {frames} --out {out}/standard --preset standard --frames 350:480:40 --exr --scene-out {out}/scene.xml",
    "render {frames} --out {out}/quality --preset quality --frames 350:480:40 --exr --noise",
)
HOLD_CLOCKS = ("timings.json", "note.json")
PLACES = {"digit": tactile.Placement(x=-6e-3, z=0.0), "biotac": tactile.Placement(x=-6e-3, z=1e-3)}
FORCES = 0.5, 2.0  # N


def main(arguments: list[str] | None = None) -> int:
    """Run the commands, hash what they write, compare with ``--than``'s hashes; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path, metavar="FILE", help="write the digests here (JSON)")
    parser.add_argument("--than", type=Path, metavar="FILE", help="digests of the commit before")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        for command in COMMANDS:
            words = words_of(command, folder)
            print("tactile " + " ".join(words), flush=True)
            subprocess.run([sys.executable, "-m", "tactile_core", *words], cwd=ROOT, check=True)
        found = digests(Path(folder)) | contacts()
    atomic.write_json(options.out, found)
    if options.than is None:
        print(f"{len(found)} answers in {options.out}")
        return 0
    lines = differences(json.loads(options.than.read_text(encoding="utf-8")), found)
    print("\n".join(lines) or f"{len(found)} answers, all the same")
    return int(bool(lines))


def words_of(command: str, out: str) -> list[str]:
    """Return the words of one of COMMANDS, with the names in braces replaced; out : folder that it writes to"""
    frames = f"{out}/demo/{RECORDING.stem}/frames.h5"
    return [word.format(recording=RECORDING, scenes=SCENES, out=out, frames=frames) for word in command.split()]


def digests(folder: Path) -> dict[str, str]:
    """Return path -> SHA-256 of every file under a folder, without notes and timings, which always differ."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in HOLD_CLOCKS)
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def contacts() -> dict[str, str]:
    """Return name, such as "solve digit 0.5 N", -> SHA-256 of the displacement under a ball of 3 mm radius."""
    ball, found = tactile.indenters.Sphere(radius=3e-3), {}
    for sensor, place in PLACES.items():
        for force in FORCES:
            moved = tactile.solve(sensor, ball, place, force=force).displacement
            found[f"solve {sensor} {force:g} N"] = hashlib.sha256(moved.tobytes()).hexdigest()
    return found


def differences(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """Return a line for each answer, by name, that differs between before and after, is gone or is new."""
    names = sorted(before.keys() | after.keys())
    words = {name: "gone" if name not in after else "new" if name not in before else "differs" for name in names}
    return [f"{word}: {name}" for name, word in words.items() if before.get(name) != after.get(name)]


if __name__ == "__main__":
    sys.exit(main())
