"""A job with the shipped networks makes the same bytes in this process, by worker processes and on Dask."""

import os
import subprocess
import sys

import pytest

from tactile_core.jobs.engine import inputs
from tactile_core.jobs.engine import job as jobs
from tactile_core.translation.translate import load_translator

START = """
import sys
from pathlib import Path
from tactile_core.jobs.engine import job as jobs, run as runs
folder = Path(sys.argv[1])
def run_on(place):
    with runs.opened(folder, None):
        assert not runs.run(folder, jobs.read(folder), place, None, lambda done, total: None).aside
"""
PLACES = {
    "in_process": "from tactile_core.jobs.engine.local import InProcess\nrun_on(InProcess(folder))",
    "workers": "from tactile_core.jobs.engine.local import Local\nrun_on(Local(folder, 2))",
    "dask": """
from distributed import LocalCluster
from tactile_core.jobs.engine.dask_cluster import Cluster, loop
few = {"n_workers": 1, "threads_per_worker": 2, "processes": False, "dashboard_address": None, "host": "127.0.0.1"}
with LocalCluster(**few, loop=loop(), protocol="tcp://") as cluster:
    run_on(Cluster(folder, cluster.scheduler_address))
""",
}


@pytest.fixture(scope="module")
def by_workers(shared_recordings, tmp_path_factory):
    return run_by("workers", shared_recordings, tmp_path_factory.mktemp("workers") / "job")


def run_by(place, recordings, folder):
    recipe = jobs.Translate(["latent", "displacement"], load_translator().sha256, shard_frames=50)
    jobs.write(folder, jobs.make(inputs.hashed(recordings, lambda done, total: None), recipe, None))
    # Two threads, in kernels whose sums are seen to differ by that; those of AVX-512 are the same for this job.
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2", "OPENBLAS_CORETYPE": "Haswell"}
    subprocess.run([sys.executable, "-c", START + PLACES[place], folder], env=environment, check=True, timeout=600)
    return folder


@pytest.mark.parametrize("place", ["in_process", "dask"])
def test_every_place_makes_the_bytes_of_workers(place, by_workers, shared_recordings, tmp_path, content):
    if place == "dask":
        pytest.importorskip("distributed", reason="distributed is absent: pip install tactile-core[batch]")
    folder = run_by(place, shared_recordings, tmp_path / "job")
    assert content(folder) == content(by_workers)
