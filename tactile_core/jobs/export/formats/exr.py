"""``<recording>/%06d.exr``: float32, numbered by the frame's index in the recording; of ``height``, m, and ``R``,
``G``, ``B``, grey levels 0..255, what the job kept. Needs OpenEXR, of the extra [render]."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from ....errors import TactileError
from ....files.exr_file import write_exr
from ..finished_job import Finished

BRIEF = "a folder of OpenEXR files a recording: heights, pictures"


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write one folder per recording: see `formats`. TactileError for a job that kept neither heights nor pictures."""
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
    """Yield name and (H, W) values of each channel of frame `row` in block, arrays height_map, image by name."""
    if "height_map" in block:
        yield "height", block["height_map"][row]
    if "image" in block:
        for channel, name in enumerate("RGB"):
            yield name, block["image"][row, ..., channel]
