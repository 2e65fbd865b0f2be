"""``<recording>/%06d.png``: the pictures, numbered by the frame's index in the recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ..finished import Finished
from ..writers import needed

BRIEF = "a folder of PNG pictures a recording"
PNG_LEVEL = 4  # of zlib, as for the pictures of `tactile convert`


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """One folder a recording."""
    from PIL import Image

    needed(source, "image", "image")
    done = 0
    for one in source.recordings:
        (folder / one.name).mkdir()
        for block in one.blocks():
            for frame, picture in zip(block["frame"], block["image"], strict=True):
                Image.fromarray(picture).save(folder / one.name / f"{frame:06d}.png", compress_level=PNG_LEVEL)
            done += len(block["frame"])
            progress(done, source.frames)
