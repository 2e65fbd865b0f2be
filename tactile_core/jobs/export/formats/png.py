"""Write ``<recording>/%06d.png``: the pictures, numbered by the frame's index in the recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ....files.png_writer import write_png
from ..finished_job import Finished

BRIEF = "a folder of PNG pictures a recording"


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write a folder for each recording. Raises TactileError for a job that kept no pictures."""
    source.check_kept("image", "image")
    done = 0
    for one in source.recordings:
        (folder / one.name).mkdir()
        for block in one.blocks():
            for frame, picture in zip(block["frame"], block["image"], strict=True):
                write_png(folder / one.name / f"{frame:06d}.png", picture)
            done += len(block["frame"])
            progress(done, source.frames)
