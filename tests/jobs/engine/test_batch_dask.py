"""Dask as one more place, over TLS too; test_same_bytes has its bytes. Workers are threads."""

import asyncio
import gc
import shutil
import subprocess
import threading
from contextlib import nullcontext
from types import SimpleNamespace

import fake_tools
import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.jobs import convert
from tactile_core.jobs.engine import dask_cluster
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs
from tactile_core.jobs.engine.dask_cluster import CONFIGURED, Cluster, QueueFile, _read, loop
from tactile_core.jobs.render import Options, render
from tactile_core.jobs.render_shards import render_in_parts

distributed = pytest.importorskip("distributed", reason="distributed is absent: pip install tactile-core[batch]")


@pytest.fixture(autouse=True)
def tools(monkeypatch):
    monkeypatch.setattr(convert, "load_tools", lambda *words, answer=None: fake_tools.tools())


def run_on(folder, job, address):
    with runs.opened(folder, None):
        return runs.run(folder, job, Cluster(folder, address), None, lambda done, total: None)


def workers(**more):
    few = {"n_workers": 1, "threads_per_worker": 1, "processes": False, "dashboard_address": None, "host": "127.0.0.1"}
    return distributed.LocalCluster(**few, loop=loop(), **more)


def test_dask_renders(tmp_path):
    random = np.random.default_rng(1)
    np.savez(tmp_path / "heights.npz", height_map=1.5e-3 + 1e-4 * random.random((60, 8, 6)))
    asked = Options(preset="fast")
    one = render(tmp_path / "heights.npz", tmp_path / "one", asked, lambda word: nullcontext(lambda done, total: None))
    with workers(protocol="tcp://") as cluster:
        address = cluster.scheduler_address
        other = render_in_parts(
            tmp_path / "heights.npz", tmp_path / "dask", asked, lambda folder: Cluster(folder, address), print
        )
    names = [*(f"images/{frame:05d}.png" for frame in range(60)), "note.json"]
    assert [(one / name).read_bytes() for name in names] == [(other / name).read_bytes() for name in names]


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make certificates with")
def test_tls_needs_the_certificate(new_job, tmp_path):
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=tactile",
         "-keyout", key, "-out", certificate],
        check=True, capture_output=True,
    )  # fmt: skip
    files = {f"tls_{role}_{what}": str(path) for role in ("scheduler", "worker", "client")
             for what, path in (("key", key), ("cert", certificate))}  # fmt: skip
    security = distributed.Security(tls_ca_file=str(certificate), require_encryption=True, **files)
    folder, job = new_job()
    tls = {f"distributed.comm.tls.{role}.{what}": str(path) for role in ("scheduler", "worker", "client")
           for what, path in (("key", key), ("cert", certificate))}  # fmt: skip
    import dask

    with workers(protocol="tls://", security=security) as cluster:
        address = cluster.scheduler_address
        assert address.startswith("tls://")
        with pytest.raises(TactileError, match="no scheduler answers"):
            run_on(folder, job, address)
        with dask.config.set({"distributed.comm.tls.ca-file": str(certificate), **tls}):
            assert run_on(folder, job, address).made == 5


def test_a_client_that_found_no_scheduler_is_gone_before_the_next(tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "wait", lambda: 1.0)
    gc.disable()  # collected later, by chance within the next client's start, it would wait there for ever
    try:
        with pytest.raises(TactileError, match="no scheduler answers"), Cluster(tmp_path, "tcp://127.0.0.1:9"):
            pass
        left = [each for each in gc.get_objects() if type(each) is distributed.Client]
    finally:
        gc.enable()
    assert not left


def test_a_queue_without_workers_is_told(new_job, monkeypatch):
    monkeypatch.setattr(dask_cluster, "PATIENCE", 0.5)
    folder, job = new_job()
    with workers(protocol="tcp://") as cluster:
        cluster.sync(cluster.scale_down, list(cluster.workers))
        said = []

        def joined(text):
            said.append(text)
            cluster.scale(1)

        place = Cluster(folder, cluster.scheduler_address, joined)
        with runs.opened(folder, None):
            assert runs.run(folder, job, place, None, lambda done, total: None).made == 5
        assert said == [f"{cluster.scheduler_address}: no worker has come yet; 2 tasks wait for one"]


def test_a_task_that_kills_its_workers_is_set_aside(tmp_path):
    killed = distributed.KilledWorker("task", SimpleNamespace(address="tcp://one:1"), 3)
    reply = Cluster(tmp_path, "tls://all:2")._reply(SimpleNamespace(status="error", exception=lambda: killed))
    assert "killed its worker" in reply.failure.found and "tcp://one:1" in reply.failure.found


def test_a_scheduler_that_dies_is_told_in_a_sentence(new_job, capfd):
    folder, job = new_job()
    with workers(protocol="tcp://") as cluster, runs.opened(folder, None):
        place = Cluster(folder, cluster.scheduler_address)
        with pytest.raises(TactileError, match=r"a task was lost .* expected a working scheduler"):
            runs.run(folder, job, place, None, lambda done, total: cluster.close())
    assert "Traceback" not in capfd.readouterr().err
    assert jobs.exists(folder)  # and the same command goes on


@pytest.mark.parametrize(("patience", "starts"), [("600s", True), ("100ms", False)])
def test_a_loop_that_starts_late_is_waited_for_as_long_as_configured(patience, starts, monkeypatch):
    """As on a busy machine, where Dask's own loop gives up after 10 s."""
    import dask

    may_start, run = threading.Event(), asyncio.run
    monkeypatch.setattr(asyncio, "run", lambda coroutine: (may_start.wait(), run(coroutine)))
    with dask.config.set({CONFIGURED: patience}):
        if starts:
            threading.Timer(0.5, may_start.set).start()
            assert loop.__wrapped__().asyncio_loop.is_running()
        else:
            with pytest.raises(TactileError, match="loop has not started"):
                loop.__wrapped__()
            may_start.set()


def test_a_queue_file_is_checked(tmp_path):
    file = tmp_path / "slurm.toml"
    file.write_text('queue = "slurm"\njobs = 10\n[options]\ncores = 1\nmemory = "4GB"\nwalltime = "01:00:00"\n')
    assert _read(str(file)) == QueueFile("slurm", 10, {"cores": 1, "memory": "4GB", "walltime": "01:00:00"})
    file.write_text('queue = "abacus"\njobs = 10\n[options]\n')
    with pytest.raises(TactileError, match="queue"):
        _read(str(file))
    with pytest.raises(TactileError, match="tls://HOST:PORT"):
        _read("here:8786")


@pytest.mark.parametrize("address", ["tcp://10.0.0.1:8786", "tcp://head:8786", "tcp://127.0.0.1.evil.example:8786"])
def test_a_scheduler_elsewhere_without_tls_has_to_be_asked_for(address, tmp_path):
    with pytest.raises(TactileError, match="--insecure"):
        Cluster(tmp_path, address)
    said = []
    Cluster(tmp_path, address, said.append, insecure=True)
    assert len(said) == 1 and "run code" in said[0]
    for fine in ("tcp://127.0.0.1:1", "tcp://localhost:1", "tcp://[::1]:1", "tls://head:8786"):
        Cluster(tmp_path, fine)


@pytest.mark.parametrize("address", ["tcp://10.0.0.1:8786", "tls://127.0.0.1:1"], ids=["without TLS", "no answer"])
def test_a_refused_cluster_leaves_no_job(address, tmp_path, monkeypatch):
    monkeypatch.setattr(dask_cluster, "wait", lambda: 0.1)
    np.savez(tmp_path / "heights.npz", height_map=np.full((60, 8, 6), 1.5e-3))
    asked = Options(preset="fast")
    with pytest.raises(TactileError, match=address):
        render_in_parts(
            tmp_path / "heights.npz", tmp_path / "out", asked, lambda folder: Cluster(folder, address), print
        )
    assert [each.name for each in tmp_path.iterdir()] == ["heights.npz"]


@pytest.mark.parametrize("insecure", [False, True])
def test_a_queue_s_scheduler_speaks_tls_and_keeps_its_dashboard_to_itself(insecure, tmp_path, monkeypatch):
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is absent: pip install tactile-core[batch]")
    file, said, seen = tmp_path / "slurm.toml", [], []
    file.write_text('queue = "slurm"\njobs = 0\n[options]\ncores = 1\nmemory = "1GB"\n')
    monkeypatch.setattr(Cluster, "_connected", lambda self, place: seen.append(place) or nullcontext())
    with Cluster(tmp_path, str(file), said.append, insecure):
        (cluster,) = seen
        assert cluster.scheduler_address.startswith("tcp://" if insecure else "tls://")
        listening = cluster.scheduler.http_server
        ports = {one.getsockname()[0] for one in listening._sockets.values()}
        assert ports == {"127.0.0.1"} and "--no-dashboard" in cluster.job_script()
        keys = list(tmp_path.glob(".tls-*/*"))
        assert bool(keys) != insecure and all(key.stat().st_mode & 0o077 == 0 for key in keys)
    assert bool(said) == insecure and not list(tmp_path.glob(".tls-*"))
