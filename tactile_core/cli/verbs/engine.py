"""Arguments and helpers of the verbs that run jobs in several processes."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from ...errors import TactileError
from ..terminal import next_step, say, tell

if TYPE_CHECKING:
    from ...jobs.engine.job import Job
    from ...jobs.engine.run import Place


ASSEMBLES = "the command that planned it, without --plan, which makes the result"


def place_arguments(verb: argparse.ArgumentParser) -> None:
    """Add ``--workers``, ``--cluster`` and ``--insecure``, which say where tasks run."""
    where = verb.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, metavar="N", help="processes on this machine; bytes do not depend on N")
    where.add_argument("--cluster", metavar="tcp://…|FILE.toml", help="a Dask scheduler, or a file that starts one")
    verb.add_argument(
        "--insecure",
        action="store_true",
        help="with --cluster: use no TLS; only in a network that is yours alone, since Dask's messages can run code",
    )


def parts_arguments(verb: argparse.ArgumentParser, plan: str) -> None:
    """Add ``--plan`` and those of `place_arguments`, for a verb whose job is in a folder beside its result.
    plan : what --plan does"""
    place_arguments(verb)
    verb.add_argument(
        "--plan",
        action="store_true",
        help=f"{plan}. That job is for `tactile batch --out OUT.parts` with --array I/N, --status or --verify; the same"
        " command without --plan then finishes it and makes OUT",
    )


def check_place(options: argparse.Namespace, *names: str) -> None:
    """Check where tasks run: raise TactileError for ``--insecure`` without ``--cluster``, and for a number below 1.
    names : attributes of options that hold these numbers, or None"""
    if options.insecure and options.cluster is None:
        raise TactileError("--insecure", "no --cluster", "one beside it", "Leave --insecure out")
    for name in names:
        value = getattr(options, name)
        if value is not None and value < 1:
            raise TactileError("--" + name.replace("_", "-"), str(value), "1 or more")


def part(text: str | None) -> tuple[int, int] | None:
    """Parse ``"3/8"`` to (3, 8); None stays None. Raises TactileError for any other text."""
    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    if not found or not int(found[1]) < int(found[2]):
        raise TactileError("--array", repr(text), "I/N with I from 0 to N - 1", "Such as 0/8")
    return int(found[1]), int(found[2])


def place(folder: Path, options: argparse.Namespace) -> Place:
    """Return the executor of the job in `folder`: the cluster of the options, or else local workers."""
    if options.cluster is not None:
        from ...jobs.engine.dask_cluster import Cluster

        return Cluster(folder, options.cluster, say, options.insecure)
    from ...jobs.engine.local import Local

    return Local(folder.resolve(), options.workers or 1)


def place_of(options: argparse.Namespace) -> Callable[[Path], Place]:
    """Return a function from a job's folder to the executor that the options ask for, by default this process."""
    if options.cluster is None and (options.workers or 1) == 1:
        from ...jobs.engine.local import InProcess

        return InProcess
    return lambda folder: place(folder, options)


def tell_plan(planned: Path, folder: Path, after: str) -> None:
    """Print the path of a plan, and how to run the parts of the job in `folder`; after : what to run after the parts"""
    tell(str(planned))
    parts = f"tactile batch --out {quote(str(folder))} --array I/N"
    next_step(f"{parts}, for each I from 0 to N - 1, on any machines; then {after}")


def plan_parts(out: str, job: Job) -> int:
    """Write a job whose parts are merged into one result, and print how to run them; returns the exit status."""
    from ...jobs.engine import run as runs

    folder = runs.write(out, job)
    tell_plan(folder, folder, ASSEMBLES)
    return 0
