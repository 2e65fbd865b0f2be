"""A real SLURM of one node, where there is one; test_batch_run and test_batch_dask have its parts everywhere.

What a cluster would do with several nodes, limits and accounting is not tried.
"""

import os
import stat
import subprocess
import sys

import one_node_slurm
import pytest
from conftest import ROOT
from one_node_slurm import wait

from tactile_core.jobs.engine import inputs, local
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs
from tactile_core.jobs.engine.dask_cluster import Cluster
from tactile_core.translation import translate


@pytest.fixture(scope="module")
def calm(shared_recordings, tmp_path_factory):
    """A job by one local process, and how to begin it again in another folder."""
    recipe = jobs.Translate(["latent"], translate.load_translator().sha256, shard_frames=50)

    def begin(folder):
        job = jobs.make(inputs.hashed(shared_recordings, lambda done, total: None), recipe, None)
        jobs.write(folder, job)
        return folder, job

    folder, job = begin(tmp_path_factory.mktemp("calm") / "job")
    with runs.opened(folder, None):
        runs.run(folder, job, local.Local(folder, 1), None, lambda done, total: None)
    return folder, begin


@pytest.fixture
def slurm(tmp_path, monkeypatch):
    """A folder in which SLURM runs, with this checkout's command in front of the path."""
    if absent := one_node_slurm.missing():
        pytest.skip(absent)
    (tmp_path / "bin").mkdir()
    command = tmp_path / "bin" / "tactile"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m tactile_core "$@"\n')
    command.chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{command.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    with one_node_slurm.slurm(tmp_path / "slurm") as environment:
        for name in ("SLURM_CONF", "PATH"):
            monkeypatch.setenv(name, environment[name])
        yield tmp_path


def the_page_s(command, other):
    """The very command of docs/batch.md, but for the folder and 4 parts in place of 100."""
    page = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")
    command = next(line for line in page.splitlines() if line.startswith(command))
    return command.replace("0-99", "0-3").replace("/100", "/4").replace("/shared/job", str(other))


def queue_is_empty():
    said = subprocess.run(["squeue", "-h"], capture_output=True, text=True, check=True, timeout=60)
    return not said.stdout.strip()


def test_an_array_of_a_real_slurm(slurm, calm, tmp_path, content, monkeypatch):
    """Cancelled once on its way, and submitted again."""
    folder, begin = calm
    other, job = begin(tmp_path / "array")
    monkeypatch.chdir(slurm)
    for shards in (1, 5):
        subprocess.run(["bash", "-c", the_page_s("sbatch ", other)], check=True, timeout=300, capture_output=True)
        wait(lambda shards=shards: len(list((other / "shards").rglob("*.h5"))) >= shards or queue_is_empty())
        if shards == 1:
            subprocess.run(["scancel", "--user=root"], check=True, timeout=60)
        wait(queue_is_empty)
    with runs.opened(other, None):
        done = runs.run(other, job, local.Local(other, 1), None, lambda done, total: None)
    said = [path.read_text() for path in slurm.glob("slurm-*.out")]
    assert (done.kept, done.made) == (5, 0), said
    assert content(folder) == content(other)


def test_workers_of_a_real_slurm(slurm, calm, tmp_path, content, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is absent: pip install tactile-core[batch]")
    folder, begin = calm
    other, job = begin(tmp_path / "queue")
    monkeypatch.chdir(slurm)
    toml = slurm / "slurm.toml"
    toml.write_text(
        'queue = "slurm"\njobs = 1\n[options]\ncores = 1\nmemory = "2GB"\nwalltime = "00:10:00"\nqueue = "cpu"\n'
    )
    with runs.opened(other, None):
        done = runs.run(other, job, Cluster(other, str(toml)), None, lambda done, total: None)
    assert done.made == 5 and content(folder) == content(other)
    wait(queue_is_empty)
