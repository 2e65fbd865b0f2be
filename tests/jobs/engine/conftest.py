"""Small jobs without networks, each frame a dent."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tactile_core.jobs.engine import inputs, local, recipes
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs

WORKER = Path(__file__).parent / "fake_worker.py"
COMMAND = (sys.executable, str(WORKER))


@pytest.fixture
def recordings(slide_csv, tmp_path) -> list[Path]:
    """Two recordings of 130 and 70 frames: shards of 50 are three and two."""
    folder = tmp_path / "in"
    folder.mkdir()
    return [slide_csv("a", frames=130, folder=folder), slide_csv("b", frames=70, folder=folder)]


@pytest.fixture
def new_job(recordings, tmp_path):
    """new_job("out", keep=[...]) -> folder and job."""

    def make(name="out", keep=("latent",), paths=None):
        folder = tmp_path / name
        recipe = recipes.Translate(list(keep), "0" * 64, shard_frames=50)
        found = inputs.hashed(paths or recordings, lambda done, total: None)
        job = jobs.make(found, recipe, None)
        jobs.write(folder, job)
        return folder, job

    return make


@pytest.fixture
def do():
    """do(folder, job, workers=1, part=None) -> what a run did, with fake workers."""

    def run(folder, job, workers=1, part=None, restart=200):
        with runs.opened(folder, part):
            place = local.Local(folder, workers, restart, COMMAND)
            return runs.run(folder, job, place, part, lambda done, total: None)

    return run


@pytest.fixture
def command():
    """command("batch", ...) -> the finished process of `tactile batch` with fake workers."""

    def call(*words, **environment):
        arguments = [*COMMAND, "batch", *map(str, words)]
        return subprocess.run(arguments, env={**os.environ, **environment}, capture_output=True, text=True, timeout=120)

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
