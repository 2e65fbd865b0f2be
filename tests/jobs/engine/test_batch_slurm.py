"""SLURM of one node where there is one; everywhere its stand-ins, that start and end processes of this machine.

What a cluster would do with several nodes, limits and accounting is not tried.
"""

from __future__ import annotations

import os
import stat
import subprocess
import sys

import one_node_slurm
import pytest
from conftest import ROOT
from one_node_slurm import wait

from tactile_core.jobs.engine import inputs, local, recipes
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs
from tactile_core.jobs.engine.dask_cluster import Cluster
from tactile_core.translation import translate

SBATCH = """#!{python}
import os, re, subprocess, sys
words = sys.argv[1:]
array = next((re.fullmatch(r"--array=(\\d+)-(\\d+)", word) for word in words if word.startswith("--array")), None)
# The script is read at once, as the real one does: it is removed as soon as this returns.
command = words[words.index("--wrap") + 1] if "--wrap" in words else open(words[-1]).read()
ids = range(int(array[1]), int(array[2]) + 1) if array else [0]
log = open(os.environ["FAKE_LOG"], "a")
started = []
for number in ids:
    environment = dict(os.environ, SLURM_ARRAY_TASK_ID=str(number))
    started.append(
        subprocess.Popen(["bash", "-c", command], env=environment, stdout=log, stderr=log, start_new_session=True)
    )
print("Submitted batch job", started[-1].pid)
for process in started if array else ():  # the real one returns at once
    process.wait()
"""
SCANCEL = "#!/bin/sh\nfor id; do kill -- -$id 2>/dev/null || true; done\n"


@pytest.fixture
def slurm(tmp_path, monkeypatch):
    """A folder of commands in front of the path; what the jobs print is in log."""
    folder = tmp_path / "bin"
    folder.mkdir()
    tactile = f'#!/bin/sh\nexec {sys.executable} -m tactile_core "$@"\n'
    for name, text in (("sbatch", SBATCH.format(python=sys.executable)), ("scancel", SCANCEL), ("tactile", tactile)):
        (folder / name).write_text(text)
        (folder / name).chmod(stat.S_IRWXU)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("FAKE_LOG", str(tmp_path / "log"))
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path


@pytest.fixture(scope="module")
def calm(shared_recordings, tmp_path_factory):
    """A job by one local process, and how to begin it again in another folder."""
    recipe = recipes.Translate(["latent"], translate.load_translator().sha256, shard_frames=50)

    def begin(folder):
        job = jobs.make(inputs.hashed(shared_recordings, lambda done, total: None), recipe, None)
        jobs.write(folder, job)
        return folder, job

    folder, job = begin(tmp_path_factory.mktemp("calm") / "job")
    with runs.opened(folder, None):
        runs.run(folder, job, local.Local(folder, 1), None, lambda done, total: None)
    return folder, begin


@pytest.fixture
def real_slurm(slurm, monkeypatch):
    """The stand-ins' folder, with SLURM's own commands in their place; ours is found beside this Python."""
    if absent := one_node_slurm.missing():
        pytest.skip(absent)
    for name in ("sbatch", "scancel"):
        (slurm / "bin" / name).unlink()
    with one_node_slurm.slurm(slurm / "slurm") as environment:
        for name in ("SLURM_CONF", "PATH"):
            monkeypatch.setenv(name, environment[name])
        yield slurm


def the_page_s(command, other):
    """The very command of docs/batch.md, but for the folder and 4 parts in place of 100."""
    page = (ROOT / "docs" / "batch.md").read_text(encoding="utf-8")
    command = next(line for line in page.splitlines() if line.startswith(command))
    return command.replace("0-99", "0-3").replace("/100", "/4").replace("/shared/job", str(other))


def queue_is_empty():
    said = subprocess.run(["squeue", "-h"], capture_output=True, text=True, check=True, timeout=60)
    return not said.stdout.strip()


def test_an_array_of_a_real_slurm(real_slurm, calm, tmp_path, content, monkeypatch):
    """Cancelled once on its way, and submitted again."""
    folder, begin = calm
    other, job = begin(tmp_path / "array")
    monkeypatch.chdir(real_slurm)
    for shards in (1, 5):
        subprocess.run(["bash", "-c", the_page_s("sbatch ", other)], check=True, timeout=300, capture_output=True)
        wait(lambda shards=shards: len(list((other / "shards").rglob("*.h5"))) >= shards or queue_is_empty())
        if shards == 1:
            subprocess.run(["scancel", "--user=root"], check=True, timeout=60)
        wait(queue_is_empty)
    with runs.opened(other, None):
        done = runs.run(other, job, local.Local(other, 1), None, lambda done, total: None)
    said = [path.read_text() for path in real_slurm.glob("slurm-*.out")]
    assert (done.kept, done.made) == (5, 0), said
    assert content(folder) == content(other)


def test_workers_of_a_real_slurm(real_slurm, calm, tmp_path, content, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is absent: pip install tactile-core[batch]")
    folder, begin = calm
    other, job = begin(tmp_path / "queue")
    monkeypatch.chdir(real_slurm)
    toml = real_slurm / "slurm.toml"
    toml.write_text(
        'queue = "slurm"\njobs = 1\n[options]\ncores = 1\nmemory = "2GB"\nwalltime = "00:10:00"\nqueue = "cpu"\n'
    )
    with runs.opened(other, None):
        done = runs.run(other, job, Cluster(other, str(toml)), None, lambda done, total: None)
    assert done.made == 5 and content(folder) == content(other)
    wait(queue_is_empty)


def test_the_page_s_array(slurm, calm, tmp_path, content):
    folder, begin = calm
    other, job = begin(tmp_path / "array")
    command = the_page_s("sbatch ", other)
    subprocess.run(["bash", "-c", command], check=True, timeout=300, capture_output=True)
    with runs.opened(other, None):
        done = runs.run(other, job, local.Local(other, 1), None, lambda done, total: None)
    assert content(folder) == content(other)
    assert done.kept + done.made == 5, (slurm / "log").read_text()


def test_workers_that_a_queue_starts(slurm, calm, tmp_path, content):
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is absent: pip install tactile-core[batch]")
    folder, begin = calm
    other, job = begin(tmp_path / "queue")
    toml = slurm / "slurm.toml"
    toml.write_text(
        'queue = "slurm"\njobs = 1\n[options]\ncores = 1\nmemory = "2GB"\nwalltime = "00:10:00"\ninterface = "lo"\n'
        f'local_directory = "{slurm}"\nlog_directory = "{slurm}"\nscheduler_options = {{ dashboard_address = ":0" }}\n'
    )
    with runs.opened(other, None):
        done = runs.run(other, job, Cluster(other, str(toml)), None, lambda done, total: None)
    assert done.made == 5 and content(folder) == content(other)
