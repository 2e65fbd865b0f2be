"""Bench for ``fault_kinds.py``: a small job, an undisturbed run of it, and comparisons with that."""

from __future__ import annotations

import random
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np

Lost = tuple[int, int]  # files that differ, are missing or left over; blows that struck
ROOT = Path(__file__).resolve().parents[2]
TACTILE = [sys.executable, "-m", "tactile_core", "batch"]
SHARD = 40  # frames: many shards of little work
MOST = 600  # s that a single command may take; a machine may be slow, but a hang must end
LONG = 3000  # s, of one on very many frames or recordings
started: list[subprocess.Popen] = []

HEADER_ROW = "timestamp,tdc,tac,pdc," + ",".join([f"pac{i}" for i in range(1, 23)] + [f"ele{i}" for i in range(1, 20)])


class Bench:
    """Recordings, an undisturbed run, and comparisons with it."""

    def __init__(self, folder: Path, quick: bool, seed: int) -> None:
        self.folder, self.random = folder, random.Random(seed)
        self.blows = 2 if quick else 10
        self.long = 5_000 if quick else 1_000_000  # frames
        self.inputs = folder / "in"
        self.inputs.mkdir()
        for index, frames in enumerate((130, 45) if quick else (400, 90, 7, 1000)):
            write_recording(self.inputs / f"touch{index}.csv", frames, seed + index)
        self.calm = self.run("calm")
        self.known = contents(self.calm)

    def command(self, out: Path, *words: str) -> list[str]:
        """Start or go on with the job in `out`."""
        return [*TACTILE, str(self.inputs), "--out", str(out), "--keep", "displacement",
                "--shard-frames", str(SHARD), *words]  # fmt: skip

    def run(self, name: str, *words: str) -> Path:
        """A job that must end well; its folder."""
        out = self.folder / name
        call(self.command(out, *words))
        return out

    def lost(self, out: Path) -> int:
        """Files that are not as in the undisturbed run, and leftovers."""
        found = contents(out)
        wrong = sum(found.get(name) != content for name, content in self.known.items())
        return wrong + len(found.keys() - self.known.keys())


def write_recording(path: Path, frames: int, seed: int) -> None:
    """A press that comes and goes, in the slide set's layout."""
    noise = np.random.default_rng(seed)
    press = 100 * np.clip(np.sin(np.arange(frames) / 30), 0, 1)[:, None] * np.linspace(-1, 1, 19)
    electrodes = np.rint(3000 + press + noise.normal(0, 1, (frames, 19)))
    rows = np.full((frames, 45), 2000.0)
    rows[:, 0], rows[:, 26:] = 1.6e9 + np.arange(frames) / 100, electrodes
    np.savetxt(path, rows, fmt=["%.6f"] + ["%d"] * 44, delimiter=",", header=HEADER_ROW, comments="")


def write_hdf5(path: Path, frames: int) -> None:
    """Presses that come and go every two seconds, in the HDF5 layout without time stamps."""
    import h5py

    random = np.random.default_rng(frames)
    press = 100 * np.clip(np.sin(np.arange(frames) / 30), 0, 1)
    with h5py.File(path, "w") as file:
        data = file.create_dataset("electrode_vals/data", (frames, 19), "i2", chunks=(min(frames, 4096), 19))
        for start in range(0, frames, 100_000):
            part = press[start : start + 100_000, None] * np.linspace(-1, 1, 19)
            data[start : start + len(part)] = np.rint(3000 + part + random.normal(0, 1, part.shape))


def contents(out: Path) -> dict[str, bytes]:
    """Read every file of a job but its lock and job file, by name; leftovers too."""
    skipped = {"job.json"}
    files = [file for file in out.rglob("*") if file.is_file() and not file.name.startswith(".tactile-batch-lock")]
    return {str(file.relative_to(out)): file.read_bytes() for file in files if file.name not in skipped}


def call(command: list[str], expected: int = 0, most: int = MOST) -> subprocess.CompletedProcess:
    """Run a command and check its exit status."""
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=most)
    if done.returncode != expected:
        raise AssertionError(f"{command}: exit status {done.returncode}\n{done.stderr}")
    return done


def start(command: list[str]) -> subprocess.Popen:
    """A command that will be disturbed; `end_all` ends it whatever happens."""
    started.append(subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
    return started[-1]


def end_all() -> None:
    """Kill what was started and still runs; its own workers end by themselves."""
    for process in started:
        if process.poll() is None:
            process.kill()
            process.wait()
    started.clear()


def workers_of(process: subprocess.Popen) -> list[int]:
    """Process ids of a command's own workers (Linux)."""
    with suppress(OSError):
        text = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text()
        tasks = Path(f"/proc/{process.pid}/task")
        return [int(word) for task in tasks.iterdir() for word in (task / "children").read_text().split()] or [
            int(word) for word in text.split()
        ]
    return []
