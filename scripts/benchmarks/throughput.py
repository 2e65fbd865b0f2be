"""Measure the cost of `tactile batch`: frames a second by workers, overhead a shard, memory, growth with the frames.

    python scripts/benchmarks/throughput.py --quick --json FILE   1e3 and 1e4 frames
    python scripts/benchmarks/throughput.py --most 1000000 --pictures 20000
                                                          up to a million frames of translation (latents alone)

CPU time is that of all processes together, so that a busy machine changes it little; wall time is of this machine as
it was. Frames a second of more workers than there are cores are not measured: `scaling` says what the overhead allows.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.fault_bench import write_hdf5
from benchmarks.measured_rows import finished, parser_of, printed
from tactile_core.accuracy import Row, row
from tactile_core.files.threads import ONE
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.engine import local

ROOT = Path(__file__).resolve().parents[2]
TACTILE = [sys.executable, "-m", "tactile_core", "batch"]
PICTURES = 300  # frames that the fast picture is measured on first
FLAT = 100_000  # frames that a worker's memory is watched over
MANY = 64  # workers that `scaling` speaks of


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="small counts alone")
    parser.add_argument("--most", type=int, default=100_000, metavar="N", help="frames of the longest recording")
    parser.add_argument("--pictures", type=int, default=3000, metavar="N", help="frames of the most fast pictures")
    options = parser.parse_args(arguments)
    most, seen = (10_000, 300) if options.quick else (options.most, options.pictures)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts = (  # one after another, so that what was measured stands there whatever comes next
            lambda: growth(folder, most), lambda: workers(folder), lambda: memory(folder, most),
            lambda: pictures(folder, seen),
        )  # fmt: skip
        return finished(printed(one for part in parts for one in part()), options.json)


def cost(*words: object) -> tuple[float, float, float]:
    """CPU s, wall s and the largest process's MB of a `tactile batch`."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    environment = {**os.environ, **ONE}
    subprocess.run([*TACTILE, *map(str, words)], cwd=ROOT, env=environment, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, time.monotonic() - began, after.ru_maxrss / 1024


def growth(folder: Path, most: int) -> list[Row]:
    """CPU time of translation alone from a thousand frames on, and what starting costs."""
    found, frames = [], 1000
    while frames <= most:
        write_hdf5(folder / "in.h5", frames)
        out = folder / f"grown{frames}"
        cpu, wall, peak = cost(folder / "in.h5", "--out", out, "--keep", "latent")
        of = f"{frames} frames, latents, 1 worker, {wall:.0f} s on the wall, largest process {peak:.0f} MB"
        found.append(row("batch_translate_cpu", 1e3 * cpu / frames, "ms", of=f"a frame; {of}"))
        frames *= 10
    cpu, _, _ = cost("--out", out)
    shards = len(list(out.glob("shards/*.h5")))
    return [*found, row("batch_resume_cpu", 1e3 * cpu / shards, "ms", of=f"a shard that is there; {shards} shards")]


def pictures(folder: Path, most: int) -> list[Row]:
    """CPU time a frame with the fast picture, from 300 frames on."""
    found, frames = [], PICTURES
    while frames <= most:
        write_hdf5(folder / "pictures.h5", frames)
        out = folder / f"pictures{frames}"
        cpu, wall, peak = cost(folder / "pictures.h5", "--out", out, "--keep", "image", "--shard-frames", PICTURES)
        shutil.rmtree(out)
        of = f"{frames} frames, 1 worker, {wall:.0f} s on the wall, largest process {peak:.0f} MB"
        found.append(row("batch_picture_cpu", 1e3 * cpu / frames, "ms", of=f"a frame with its translation; {of}"))
        frames = min(most, 10 * frames) if frames < most else most + 1
    return found


def workers(folder: Path) -> list[Row]:
    """Frames a second against workers, and what the client takes of it."""
    write_hdf5(folder / "workers.h5", 2000)
    found = []
    for count in (1, 2):
        words = ["--keep", "displacement", "--shard-frames", "100", "--workers", str(count)]
        _, wall, _ = cost(folder / "workers.h5", "--out", folder / f"workers{count}", *words)
        of = f"2,000 frames with displacements, {count} workers, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
        found.append(row(f"batch_{count}_workers", 2000 / wall, "frames/s", of=of))
    each = client_cost(folder)
    of = f"client's CPU a shard; {MANY} workers can be fed if one takes over {MANY * each:.0f} ms for a shard"
    return [*found, row("batch_scheduler_cpu", each, "ms", of=of)]


def client_cost(folder: Path) -> float:
    """CPU time of the client itself a task, ms: the replies come from a process that does nothing."""
    from tactile_core.jobs.engine.tasks import Task

    answer = "import sys\nfor line in sys.stdin:\n    print('{}', flush=True)"
    place, count = local.Local(folder, 1, restart=10**6, command=(sys.executable, "-c", answer)), 2000
    left = [count]
    began = time.process_time()
    with place:
        for number in range(count):
            place.submit(Task(0, number))
        for _ in place.results(lambda: left[0]):
            left[0] -= 1
    return 1e3 * (time.process_time() - began) / count


def memory(folder: Path, most: int) -> list[Row]:
    """A worker's memory after its first shards and after its last ones, without restarts."""
    import json

    out = folder / f"grown{min(FLAT, 10 ** (len(str(most)) - 1))}"
    job = jobs.read(out)
    shards = sorted(out.glob("shards/*.h5"))
    for shard in shards:
        shard.unlink()
    process = subprocess.Popen(
        [*local.WORKER_COMMAND, str(out)], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    sizes = []
    for number in range(len(shards)):
        process.stdin.write(json.dumps({"recording": 0, "shard": number}) + "\n")
        process.stdin.flush()
        reply = json.loads(process.stdout.readline())
        if reply["error"]:
            raise AssertionError(reply["error"])
        sizes.append(resident(process.pid))
    process.stdin.close()
    process.wait()
    first, last = np.median(sizes[: max(1, len(sizes) // 10)]), np.median(sizes[-max(1, len(sizes) // 10) :])
    of = f"{len(shards) * job.recipe.shard_frames} frames through one worker; baseline: after its first tenth"
    return [row("batch_worker_memory", last, "MB", baseline=first, of=of)]


def resident(process: int) -> float:
    """Memory, MB, that a process holds (Linux)."""
    text = Path(f"/proc/{process}/status").read_text()
    return int(text.split("VmRSS:")[1].split()[0]) / 1024


if __name__ == "__main__":
    sys.exit(main())
