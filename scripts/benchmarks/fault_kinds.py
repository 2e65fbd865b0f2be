"""The ways to break a job, for ``fault_test.py``: each returns files lost and blows that struck.

``tests/jobs/engine/test_batch_run.py`` has the others: flipped bits, cut files, a file too large, parts of an array.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from benchmarks.fault_bench import LONG, MOST, TACTILE, Bench, Lost, call, contents, start, workers_of, write_hdf5
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import run as runs
from tactile_core.jobs.engine import tasks
from tactile_core.jobs.engine.local import InProcess


def killed_workers(bench: Bench) -> Lost:
    """SIGKILL to workers at random moments; the run itself goes on and ends well."""
    out = bench.folder / "workers"
    process = start(bench.command(out, "--workers", "2"))
    blows = 0
    while process.poll() is None and blows < bench.blows:
        time.sleep(bench.random.uniform(0, 2) if workers_of(process) else 0.05)
        for worker in workers_of(process)[:1]:
            with suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)
                blows += 1
    process.wait(MOST)
    call(bench.command(out))  # a shard whose worker was killed three times by chance is set aside: made now
    return bench.lost(out), blows


def killed_client(bench: Bench) -> Lost:
    """Kill -9 the command at random moments, then run the same command again."""
    out, blows = bench.folder / "client", 0
    for _ in range(bench.blows):
        process = start(bench.command(out))
        there = len(list(out.glob("*/*.h5")))
        while process.poll() is None and len(list(out.glob("*/*.h5"))) == there:
            time.sleep(0.01)
        time.sleep(bench.random.uniform(0, 0.2))
        blows += process.poll() is None
        process.kill()
        process.wait()
    call(bench.command(out))
    return bench.lost(out), blows


def in_child(folder: Path, cut: int | None) -> bool:
    """Do the job in a child process that ends at its `cut`-th fsync or rename; returns true if it came to its end."""
    child = os.fork()
    if child:
        return os.waitpid(child, 0)[1] == 0
    left = [cut]

    def cutting(function: Callable) -> Callable:
        def called(*words: object) -> object:
            if left[0] is not None:
                left[0] -= 1
                if left[0] == 0:
                    os._exit(77)
            return function(*words)

        return called

    os.fsync, os.replace = cutting(os.fsync), cutting(os.replace)
    try:
        with runs.opened(folder, None):
            runs.run(folder, jobs.read(folder), InProcess(folder), None, lambda done, total: None)
    except BaseException:  # the child of a fork must not go on into its parent's code
        traceback.print_exc()
        os._exit(1)
    os._exit(0)


def power_cuts(bench: Bench) -> Lost:
    """The machine goes off before each fsync and rename of a job in turn (with --quick: each third)."""
    plan = bench.run("plan", "--plan")
    tasks.run(str(bench.calm), {"recording": 0, "shard": 0})
    lost, cut, step = 0, 1, 3 if bench.blows < 5 else 1
    while True:
        out = bench.folder / f"cut{cut}"
        shutil.copytree(plan, out)
        ended = in_child(out, cut)
        if not in_child(out, None):
            raise AssertionError(f"the job did not go on after cut {cut}")
        lost += bench.lost(out)
        shutil.rmtree(out)
        if ended:
            return lost, cut // step
        cut += step


def one_error(said: str) -> bool:
    """Return true if one line of stderr is an error, and none a traceback; lines of progress may stand beside it."""
    return said.count("tactile: error:") == 1 and "Traceback" not in said


def dask_worker_dies(bench: Bench) -> Lost | None:
    """A Dask worker is killed and another joins; None where Dask is absent."""
    if importlib.util.find_spec("distributed") is None:
        return None
    out = bench.run("dask", "--plan")
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0",
            "--no-dashboard", "--scheduler-file", str(bench.folder / "scheduler.json")]  # fmt: skip
    scheduler = start(dask)
    try:
        address = wait_for_address(bench.folder / "scheduler.json")
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard",
                  "--no-nanny", "--local-directory", str(bench.folder)]  # fmt: skip
        first = start(worker)
        client = start([*TACTILE, "--out", str(out), "--cluster", address])
        while client.poll() is None and not list(out.glob("*/*.h5")):
            time.sleep(0.01)
        blows = int(client.poll() is None)
        first.kill()
        first.wait()
        second = start(worker)
        client.wait(MOST)
        second.terminate()
        second.wait(MOST)
    finally:
        scheduler.terminate()
        scheduler.wait(MOST)
    call([*TACTILE, "--out", str(out)])
    return bench.lost(out), blows


def wait_for_address(file: Path) -> str:
    """Wait for the address of the scheduler that writes this file."""
    deadline = time.monotonic() + MOST
    while time.monotonic() < deadline:
        with suppress(OSError, ValueError):
            return json.loads(file.read_text())["address"]
        time.sleep(0.1)
    raise AssertionError("the scheduler did not start")


def small_disk(bench: Bench) -> Lost | None:
    """A disk of 2 MB, then a larger one; None where no disk may be mounted."""
    disk = bench.folder / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2M", "tmpfs", disk], capture_output=True).returncode:
        return None
    try:
        done = call(bench.command(disk / "job"), expected=2)
        said = "No space left" in done.stderr and one_error(done.stderr)
        half = [name for name in contents(disk / "job") if "tactile-partial" in name]
        subprocess.run(["mount", "-o", "remount,size=256M", disk], check=True)
        call(bench.command(disk / "job"))
        return bench.lost(disk / "job") + len(half) + (not said), 1
    finally:
        subprocess.run(["umount", disk], check=True)


def long_recording(bench: Bench) -> Lost:
    """Process one recording of very many frames, latents alone; the command is killed half-way and given again."""
    out, file = bench.folder / "long_job", bench.folder / "long.h5"
    write_hdf5(file, bench.long)
    found = _killed_half_way(out, [*TACTILE, str(file), "--out", str(out), "--keep", "latent"], bench.long // 1000)
    shutil.rmtree(out)
    return found


def _killed_half_way(out: Path, command: list[str], shards: int) -> Lost:
    """Shards that are missing or damaged at the end, leftovers, and whether the blow struck."""
    process = start(command)
    while process.poll() is None and len(list(out.glob("shards/*.h5"))) < shards // 2:
        time.sleep(0.05)
    blows = int(process.poll() is None)
    process.kill()
    process.wait()
    call(command, most=LONG)
    call([*TACTILE, "--out", str(out), "--verify"], most=LONG)
    files = list(out.glob("shards/*"))
    manifest = json.loads((out / "manifest.json").read_text())
    listed = sum(len(one["shards"]) for one in manifest["recordings"])
    left = [file for file in out.rglob(".*") if "lock" not in file.name]
    return abs(shards - len(files)) + abs(shards - listed) + len(manifest["aside"]) + len(left), blows


FAULTS: dict[str, Callable[[Bench], Lost | None]] = {
    "worker_sigkill": killed_workers,
    "client_kill_9": killed_client,
    "power_cut_at_each_write": power_cuts,
    "small_disk": small_disk,
    "dask_worker_dies_another_joins": dask_worker_dies,
    "long_recording": long_recording,
}
ABSENT = {  # why a fault was not tried
    "dask_worker_dies_another_joins": "distributed is absent",
    "small_disk": "no right to mount a disk",
}
