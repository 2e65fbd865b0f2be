"""A finished job of two recordings with pictures."""

import sys
from pathlib import Path

import numpy as np
import pytest

from tactile_core.jobs.engine import inputs, local
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs

WORKER = Path(__file__).resolve().parents[2] / "jobs" / "engine" / "fake_worker.py"


@pytest.fixture(scope="session")
def job(tmp_path_factory):
    """A finished job of two recordings with pictures."""
    folder = tmp_path_factory.mktemp("job")
    paths = []
    for name, frames in (("a", 40), ("b", 25)):
        press = np.clip(np.arange(frames) - 20, 0, 30)[:, None] * np.linspace(1, 3, 19)
        noise = np.random.default_rng(frames).normal(0, 1, (frames, 19))
        paths.append(folder.parent / f"{name}.npz")
        np.savez(paths[-1], electrodes=np.rint(3000 + press + noise), time=np.arange(frames) / 100)
    recipe = jobs.Translate(["latent", "height", "image"], "0" * 64, shard_frames=20)
    made = jobs.make(inputs.hashed(paths, lambda done, total: None), recipe, None)
    jobs.write(folder, made)
    with runs.opened(folder, None):
        place = local.Local(folder, 1, command=(sys.executable, str(WORKER)))
        runs.run(folder, made, place, None, lambda done, total: None)
    return folder
