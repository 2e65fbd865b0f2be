"""Describe a job whose disk is full: the folder, the space that is free there, and the space still needed."""

from __future__ import annotations

import errno
import shutil
from pathlib import Path

from ...errors import TactileError
from . import job as jobs
from . import manifest
from .job import Job

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}  # disk, quota, the system's limit on a file


def refused(folder: Path, job: Job, error: OSError) -> TactileError:
    """Return the error for what the system refused to write in a job's folder.

    A full disk is the folder's affair, not that of the file which happened to be the next, and so is its removal.
    """
    if not jobs.exists(folder):
        return TactileError(folder, "was removed while the job ran", "the job's folder", "Begin it again")
    reason = error.strerror or str(error)
    if error.errno not in FULL:
        where = error.filename2 or error.filename or folder
        return TactileError(where, f"cannot be written ({reason})", "a job folder of ours that can be written")
    found = f"cannot be written ({reason}; {_megabytes(shutil.disk_usage(folder).free)} free)"
    return TactileError(f"--out {folder}", found, _needed(folder, job), "Make room and give the same command again")


def _needed(folder: Path, job: Job) -> str:
    """Say how much space is still needed: by the size of the shards made so far, or as their kind of job expects."""
    state = manifest.status(folder, job)
    sizes = [file.stat().st_size for file in (folder / jobs.SHARDS).glob("*.h5")]
    left, unseen = state.shards - state.there, state.recordings - state.prepared
    one = sum(sizes) / len(sizes) if sizes else state.bytes / max(state.shards, 1)
    parts = [f"some {_megabytes(left * one)} for the {left} shards that are left"] if left and one else []
    if unseen:
        parts.append(f"room for {unseen} of {state.recordings} inputs that were not begun, and their shards")
    return " and ".join(parts) or "room for what is left"


def _megabytes(count: float) -> str:
    return f"{count / 1e6:.1f} MB"
