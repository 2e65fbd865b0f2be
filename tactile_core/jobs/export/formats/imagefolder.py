"""Write ``<split>/<recording>/%06d.png`` and ``<split>/metadata.csv``, as Hugging Face's ``datasets`` loads pictures.
Each row of metadata.csv is a picture: file, recording, frame, time, labels, and numbers of the contact."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from ....files.png_writer import write_png
from ....recordings import flags
from ..finished_job import Finished, Recorded

BRIEF = "a folder of PNG pictures with metadata.csv, as the library `datasets` loads it"
# Column of metadata.csv -> array of the job, and which of its numbers.
NUMBERS: dict[str, tuple[str, int | None]] = {
    "time_s": ("time", None), "force_x_n": ("force", 0), "force_y_n": ("force", 1), "force_z_n": ("force", 2),
    "place_x_m": ("contact_center", 0), "place_z_m": ("contact_center", 1), "pressure_pa": ("pressure", None),
    "confidence": ("confidence", None), "explained": ("explained", None),
    "expected_error_m": ("expected_error_digit", None),
}  # fmt: skip


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write all pictures and the tables. Raises TactileError for a job that kept no pictures."""
    source.check_kept("image", "image")
    labels = sorted({name for one in source.recordings for name in one.labels})
    head, done = ["file_name", "recording", "frame", *labels, *NUMBERS, "flags"], 0
    with ExitStack() as open_files:
        tables: dict[str, Any] = {}
        for one in source.recordings:
            (folder / one.split / one.name).mkdir(parents=True)
            if one.split not in tables:
                path = folder / one.split / "metadata.csv"
                file = open_files.enter_context(open(path, "w", encoding="utf-8", newline=""))
                tables[one.split] = csv.writer(file)
                tables[one.split].writerow(head)
            for rows in _rows(one, labels, folder / one.split):
                tables[one.split].writerows(rows)
                done += len(rows)
                progress(done, source.frames)


def _rows(one: Recorded, labels: list[str], folder: Path) -> Iterator[list[list[Any]]]:
    """Write a recording's pictures; yield rows of the table, some frames at a time. labels : their columns' names"""
    for block in one.blocks():
        rows = []
        for row, frame in enumerate(map(int, block["frame"])):
            name = f"{one.name}/{frame:06d}.png"
            write_png(folder / name, block["image"][row])
            said = [str(one.labels[label][frame // one.every]) if label in one.labels else "" for label in labels]
            numbers = [_number(block[array][row], part) for array, part in NUMBERS.values()]
            bits = int(block["flags"][row])
            words = " ".join(word for word, bit in flags.names().items() if bits & bit)
            rows.append([name, one.name, frame, *said, *numbers, words])
        yield rows


def _number(value: Any, part: int | None) -> str:
    """Return a value, or its number `part` unless that is None, with six digits; "" for NaN."""
    number = float(value if part is None else value[part])
    return f"{number:.6g}" if np.isfinite(number) else ""
