"""Write ``<recording>/%06d.exr``, numbered by the frame's index in the recording: float32 channels ``height``, m, and
``R``, ``G``, ``B``, grey levels 0..255, if the job kept them. Needs OpenEXR, of the extra [render]."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ....errors import TactileError
from ....files.exr_file import write_exr
from ..finished_job import Finished

BRIEF = "a folder of OpenEXR files a recording: heights, pictures"


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write a folder for each recording. Raises TactileError for a job that kept neither heights nor pictures."""
    if not {"height_map", "image"} & set(source.recordings[0].arrays()):
        found, advice = "holds neither heights nor pictures", "Make the job with --keep height or image"
        raise TactileError(source.folder, found, "a job that kept one of them", advice)
    done = 0
    for one in source.recordings:
        (folder / one.name).mkdir()
        for block in one.blocks():
            for row, frame in enumerate(block["frame"]):
                about = {"recording": one.name, "frame": str(frame)}
                write_exr(folder / one.name / f"{frame:06d}.exr", dict(_channels(block, row)), about)
            done += len(block["frame"])
            progress(done, source.frames)


def _channels(block: dict[str, np.ndarray], row: int) -> Iterator[tuple[str, np.ndarray]]:
    """Yield (name, (H, W) values) of the channels of frame number `row` in a block, array's name -> (n, ...)."""
    if "height_map" in block:
        yield "height", block["height_map"][row]
    if "image" in block:
        for channel, name in enumerate("RGB"):
            yield name, block["image"][row, ..., channel]
