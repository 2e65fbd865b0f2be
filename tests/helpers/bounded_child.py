"""Loaders run in a child process that may take BOUND more memory than it has; what it says comes back by a pipe."""

import os
import resource
from pathlib import Path

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings import chunks

BOUND = 512 * 2**20  # bytes beyond what the process has: two unpacked chunks of HDF5 of the largest size that is taken
SECONDS = 200  # of CPU time. The longest take 3, more with what the process before has freed: that is filled as well


def prepare(path):
    """All that a batch does with a recording before the networks, part by part."""
    for part in chunks.read_parts(path):
        recordings.prepare(part.recording)


def report_of(load, path) -> str:
    """Return what a loader says of a file under BOUND: ``read``, ``refused:`` and a TactileError, or another error."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        said = "no word"
        try:
            size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (size + BOUND, resource.RLIM_INFINITY))
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
            load(path)
            said = "read"
        except TactileError as error:
            said = f"refused: {error}"
        except BaseException as error:
            said = f"{type(error).__name__}: {error}"
        finally:
            os.write(writer, said.encode(errors="replace")[:60_000])
            os._exit(0)
    os.close(writer)
    with open(reader, "rb") as pipe:
        said = pipe.read().decode()
    status = os.waitpid(child, 0)[1]
    assert status == 0, f"ended by {status}"
    return said


def refused(load, path, words):
    """Assert that a loader refuses a file with a TactileError that holds ``words``, before memory ends."""
    said = report_of(load, path)
    assert said.startswith("refused: ") and words in said and len(said) < 1000, said
    assert "MemoryError" not in said and "machine's memory" not in said, f"only the limit stopped it: {said}"
