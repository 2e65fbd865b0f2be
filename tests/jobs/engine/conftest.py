"""Small jobs without networks, each frame a dent."""

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from tactile_core.cli.main import main
from tactile_core.jobs import convert
from tactile_core.jobs.engine import inputs, local
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs

WORKER = Path(__file__).parent / "fake_worker.py"
COMMAND = (sys.executable, str(WORKER))


@pytest.fixture
def recordings(write_slide, tmp_path) -> list[Path]:
    """Two recordings of 130 and 70 frames: shards of 50 are three and two."""
    return two_recordings(write_slide, tmp_path)


@pytest.fixture(scope="session")
def shared_recordings(write_slide, tmp_path_factory) -> list[Path]:
    """The same two, which no test may change."""
    return two_recordings(write_slide, tmp_path_factory.mktemp("shared"))


def two_recordings(write_slide, folder: Path) -> list[Path]:
    (folder / "in").mkdir()
    return [write_slide(name, frames, folder / "in") for name, frames in (("a", 130), ("b", 70))]


@pytest.fixture
def new_job(recordings, tmp_path):
    """new_job("out", keep=[...]) -> folder and job."""

    def make(name="out", keep=("latent",), paths=None):
        return job_of(paths or recordings, tmp_path / name, keep)

    return make


def job_of(recordings: list[Path], folder: Path, keep=("latent",)) -> tuple[Path, jobs.Job]:
    recipe = jobs.Translate(list(keep), "0" * 64, shard_frames=50)
    job = jobs.make(inputs.hashed(recordings, lambda done, total: None), recipe, None)
    jobs.write(folder, job)
    return folder, job


@pytest.fixture
def do():
    """do(folder, job, workers=1, part=None) -> what a run did, with fake workers."""
    return run_job


def run_job(folder: Path, job: jobs.Job, workers=1, part=None, restart=200) -> runs.Outcome:
    with runs.opened(folder, part):
        place = local.Local(folder, workers, restart, COMMAND)
        return runs.run(folder, job, place, part, lambda done, total: None)


@pytest.fixture(scope="session")
def finished_once(shared_recordings, tmp_path_factory) -> tuple[Path, jobs.Job]:
    """Folder and job of ``new_job`` after an undisturbed run; tests take their own copy, ``finished``."""
    folder, job = job_of(shared_recordings, tmp_path_factory.mktemp("finished") / "job")
    run_job(folder, job)
    return folder, job


@pytest.fixture
def finished(finished_once, tmp_path) -> tuple[Path, jobs.Job]:
    """A copy of a finished job, to compare with or to damage."""
    folder, job = finished_once
    return shutil.copytree(folder, tmp_path / "finished"), job


@pytest.fixture
def command(monkeypatch, capsys):
    """command("day1", "--out", "job") -> status and output of `tactile batch` in this process, with fake workers."""
    networks = SimpleNamespace(sha256="0" * 64, source="biotac", target="digit")
    monkeypatch.setattr(convert, "load_translator", lambda *words: networks)
    monkeypatch.setattr(local, "WORKER_COMMAND", COMMAND)

    def call(*words):
        capsys.readouterr()
        status = main(["batch", *map(str, words)])
        printed = capsys.readouterr()
        return SimpleNamespace(returncode=status, stdout=printed.out, stderr=printed.err)

    return call


@pytest.fixture
def command_process():
    """The same as a process of its own."""

    def call(*words):
        return subprocess.run([*COMMAND, "batch", *map(str, words)], capture_output=True, text=True, timeout=120)

    return call


def contents(folder: Path) -> dict[str, bytes]:
    """Every file that counts, by name."""
    parts = [folder / jobs.MANIFEST, *(folder / jobs.PREPARED).iterdir(), *(folder / jobs.SHARDS).iterdir()]
    return {str(file.relative_to(folder)): file.read_bytes() for file in parts}


@pytest.fixture
def content():
    return contents


def has(module: str) -> bool:
    return importlib.util.find_spec(module) is not None
