"""The loaders of ``hostile.py`` under coverage-guided fuzzing: what reaches new lines of a reader is spoiled further.

    python tests/fuzz/guided.py NAME --seconds 60 [--seed 0]

Needs atheris (``pip install atheris``, Linux). Exits 0 when the time is spent, 77 at the first failure, whose file is
left here as crash-*; -timeout ends a file that takes over a minute, -rss_limit_mb one that takes 4 GB.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path

import atheris

WATCHED = ["tactile_core", "trimesh", "rosbags", "tomllib", "numpy.lib", "zipfile", "csv", "json"]

sys.path.insert(0, str(Path(__file__).parent))
with atheris.instrument_imports(include=WATCHED, enable_loader_override=False):
    import hostile


def main() -> None:
    """Hand the loader to libFuzzer, which ends the process."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", help="a loader of hostile.py")
    parser.add_argument("--seconds", type=int, default=60, help="of CPU time (default: 60)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    folder = Path(tempfile.mkdtemp())
    good, load = hostile.loaders(folder)[options.name]
    corpus = folder / "corpus"
    corpus.mkdir()
    (corpus / "good").write_bytes(good)
    tried, end = 0, time.process_time() + options.seconds

    def once(data: bytes) -> None:
        nonlocal tried
        if time.process_time() > end:
            print(f"{options.name}: {tried} files in {options.seconds} s of CPU time", flush=True)
            shutil.rmtree(folder)
            os._exit(0)
        tried += 1
        hostile.survives(folder / "spoiled", data, load)

    limits = ["-rss_limit_mb=4096", "-timeout=60", f"-max_len={2 * len(good) + 4096}", f"-seed={options.seed + 1}"]
    atheris.Setup(
        [sys.argv[0], *limits, str(corpus)],
        once,
        custom_mutator=lambda data, most, seed: hostile.spoil(data, random.Random(seed))[:most],
    )
    atheris.Fuzz()


if __name__ == "__main__":
    main()
