"""Export a finished job to other programs' layouts; a new layout is one new file in ``formats/``."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from ...errors import TactileError
from ...files import atomic, provenance
from ...files.installed import modules_of
from . import finished_job, formats

NOTE = "note.json"


def layouts() -> dict[str, ModuleType]:
    """Return the modules of ``formats/``, by the layouts' names."""
    return modules_of(formats.__name__)


def export(
    job: str | os.PathLike, layout: str, out: str | os.PathLike, progress: Callable[[int, int], None]
) -> finished_job.Finished:
    """Write the finished job in the folder `job` into the new folder `out`, whole or not at all; return the job.
    layout : a layout's name; progress : called with (frames done, in all)
    Raises TactileError for a job that is not finished, an unknown layout, a folder that exists, and a full disk."""
    if layout not in layouts():
        raise TactileError("--to", repr(layout), " or ".join(layouts()))
    source = finished_job.load(Path(job))
    write(source, layout, out, progress)
    return source


def write(
    source: finished_job.Finished, layout: str, out: str | os.PathLike, progress: Callable[[int, int], None],
    overwrite: bool | None = None,
) -> None:  # fmt: skip
    """Write ``source``, one or more finished jobs, into the new folder `out`. layout : name; progress : see `export`
    overwrite : true replaces an older `out`; false and None refuse it, None without advising an option"""
    with atomic.writing(out), atomic.new_folder(out, overwrite=overwrite) as partial:
        layouts()[layout].write(source, partial, progress)
        note = {"layout": layout, "job": source.id, "left_out": source.aside, "warnings": source.warnings}
        note["versions"] = provenance.versions()
        atomic.write_json(partial / NOTE, note)
