"""Write LeRobot's dataset layout v3.0: rows in Parquet, many episodes per file, pictures inside as PNG.
meta/info.json, meta/stats.json, meta/tasks.parquet, meta/episodes/chunk-000/file-000.parquet,
data/chunk-CCC/file-FFF.parquet"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from ....files import atomic
from ....files.png_writer import pack_png
from ..finished_job import Finished
from ..lerobot_set import CHUNK, PICTURE, TASK, Features, Rows, Stats, aggregate, listed, table, write_set

BRIEF = "LeRobot v3.0: Parquet with pictures, meta/info.json"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
FILE_MB = 100  # a data file is closed at the end of the episode that takes it beyond


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write the data set. Raises TactileError for recordings of different rates, or a numpy unfit for pyarrow."""
    write_set(source, folder, progress, _Together(folder))


class _Together:
    """Writer of data files of many episodes each."""

    version = "v3.0"
    picture: Literal["image", "video"] = "image"

    def __init__(self, folder: Path) -> None:
        self._folder, self._number = folder, 0
        self._writer: Any = None

    def write(self, episode: int, rows: Rows, features: Features, rate: int) -> None:
        """Add rows, feature -> column, of an episode to the open file. features : name -> dtype and shape; rate : Hz"""
        import pyarrow.parquet as pq

        columns: dict[str, Any] = dict(rows)
        if PICTURE in rows:
            columns[PICTURE] = [{"bytes": pack_png(picture), "path": None} for picture in rows[PICTURE]]
        added = table(columns, features)
        if self._writer is None:
            self._path = self._folder / DATA.format(**self._place())
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = pq.ParquetWriter(self._path, added.schema, compression="snappy")
        self._writer.write_table(added)

    def end_episode(self) -> dict[str, Any]:
        """Close the file if it has become large; return chunk_index and file_index of the episode's data and meta."""
        place = {f"data/{name}": number for name, number in self._place().items()}
        if self._path.stat().st_size > FILE_MB * 1e6:
            self._close()
            self._number += 1
        return place | {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}

    def finish(self, episodes: list[dict[str, Any]], stats: list[Stats]) -> dict[str, Any]:
        """Write the lists of episodes, with statistics, and of tasks; return this layout's entries of info.json."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        self._close()
        for about, found in zip(episodes, stats, strict=True):
            about |= {f"stats/{name}/{key}": value for name, one in listed(found).items() for key, value in one.items()}
        (self._folder / EPISODES).parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(episodes), self._folder / EPISODES)
        atomic.write_json(self._folder / "meta" / "stats.json", listed(aggregate(stats)))
        _write_tasks(self._folder / "meta" / "tasks.parquet")
        sizes = {"data_files_size_in_mb": FILE_MB, "video_files_size_in_mb": FILE_MB}  # LeRobot 0.6 takes no 0
        return {"data_path": DATA, "video_path": None, **sizes}

    def _place(self) -> dict[str, int]:
        return {"chunk_index": self._number // CHUNK, "file_index": self._number % CHUNK}

    def _close(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def _write_tasks(path: Path) -> None:
    """Write the list of tasks, a single one; LeRobot finds it by the table's index, as pandas writes it."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({"task_index": pa.array([0], pa.int64()), "__index_level_0__": [TASK]})
    columns = [{"name": None, "field_name": "__index_level_0__", "pandas_type": "unicode", "numpy_type": "object",
                "metadata": None}, {"name": "task_index", "field_name": "task_index", "pandas_type": "int64",
                                    "numpy_type": "int64", "metadata": None}]  # fmt: skip
    pandas = {
        "index_columns": ["__index_level_0__"],
        "column_indexes": [],
        "columns": columns,
        "pandas_version": "2.0.0",
    }
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(pandas)}), path)
