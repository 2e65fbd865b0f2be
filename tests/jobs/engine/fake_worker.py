"""A worker, or the command ``tactile batch``, with the tools of ``fake_tools``: no weights, one dent.

``python fake_worker.py FOLDER`` serves tasks; FAKE_KILL names a shard that kills its worker (FAKE_KILL_ONCE: a file
that is made first, so that it happens once); FAKE_CUT: a process ends at this fsync or rename of its own, as by a power
cut. ``python fake_worker.py batch ...`` is the command, with such workers.
"""

import os
import signal
import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(TESTS / "helpers"), str(TESTS.parent)]

import fake_tools  # noqa: E402

from tactile_core.cli.main import main  # noqa: E402
from tactile_core.jobs import convert, translate_shards  # noqa: E402
from tactile_core.jobs.engine import local, task_worker  # noqa: E402

COMMAND = (sys.executable, str(Path(__file__).resolve()))


def killing(make):
    """`make`, but for the shard that FAKE_KILL names: the worker dies over it."""

    def made(folder, job, index, number):
        once = os.environ.get("FAKE_KILL_ONCE")
        if f"{job.inputs[index].name}-{number:06d}" == os.environ.get("FAKE_KILL") and not (
            once and Path(once).exists()
        ):
            if once:
                Path(once).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return make(folder, job, index, number)

    return made


def cutting(write):
    """`write`, until the process has written as often as FAKE_CUT says."""

    def written(*words):
        global left
        left -= 1
        if left == 0:
            os._exit(77)
        return write(*words)

    return written


left = int(os.environ.get("FAKE_CUT", 0))

if __name__ == "__main__":
    os.fsync, os.replace = cutting(os.fsync), cutting(os.replace)
    convert.load_tools = lambda *words: fake_tools.tools()
    convert.load_translator = lambda *words: fake_tools.Networks()
    translate_shards.make = killing(translate_shards.make)
    local.WORKER_COMMAND = COMMAND
    if sys.argv[1] == "batch":
        sys.exit(main())
    task_worker.main()
