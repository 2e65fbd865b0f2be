"""LeRobot's dataset layout v3.0: one recording is one episode; rows in Parquet, pictures inside as PNG.

meta/info.json, meta/stats.json, meta/tasks.parquet, meta/episodes/chunk-000/file-000.parquet,
data/chunk-CCC/file-FFF.parquet. Features: observation.electrodes (19), .force (3), .contact_center (2, NaN without
contact), .confidence and, where the job kept them, .images.digit and .latent_digit. No action: the data are
observations alone.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ....errors import TactileError
from ....files import atomic
from ....files.png_writer import write_png
from ....sensors import SAMPLE_RATE
from ..finished_job import Finished, Recorded

if TYPE_CHECKING:
    import pyarrow as pa

BRIEF = "LeRobot v3.0: Parquet with pictures, meta/info.json"
VERSION = "v3.0"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
CHUNK = 1000  # files a folder
FILE_MB = 100  # a data file is closed at the end of the episode that takes it beyond
SAME_RATE = 0.1  # that recordings may differ by: clocks and lost frames do, 100 Hz and 50 Hz do not (assumed)
TASK = "touch, BioTac to DIGIT"
NUMBERS = ("electrodes", "force", "contact_center", "confidence", "latent_digit")
PICTURE = "observation.images.digit"
PLAIN = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write the data set; needs pyarrow of the extra [batch]. Raises TactileError where numpy does not fit it."""
    try:
        import pyarrow  # noqa: F401
    except ModuleNotFoundError:
        raise
    except ImportError as error:
        raise TactileError("pyarrow", str(error), "one that this numpy works with") from error
    features = _features(source.recordings[0])
    stats = {name: _Stats() for name in features if name != PICTURE}
    episodes: list[dict[str, Any]] = []
    place, rate, done = _Place(folder, features), 0.0, 0
    for index, one in enumerate(source.recordings):
        start = done
        for rows in _rows(one, index, start, features):
            for name, found in stats.items():
                found.add(np.asarray(rows[name], np.float64))
            place.write(rows)
            done += len(rows["index"])
            progress(done, source.frames)
        rate = rate or _rate(one)
        _check_rate(one, rate)
        episodes.append({
            "episode_index": index, "tasks": [TASK], "length": one.frames,
            "dataset_from_index": start, "dataset_to_index": done,
            "data/chunk_index": place.number // CHUNK, "data/file_index": place.number % CHUNK,
            "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0, "recording": one.name,
        })  # fmt: skip
        place.end_episode()
    place.close()
    _write_meta(folder, episodes, features, {name: found.summarise() for name, found in stats.items()}, rate, done)


def _features(one: Recorded) -> dict[str, dict[str, Any]]:
    """Name -> type, shape and names of a feature, as info.json has them."""
    arrays = one.arrays()
    found: dict[str, dict[str, Any]] = {}
    if "image" in arrays:
        shape, names = list(arrays["image"][0]), ["height", "width", "channels"]
        found[PICTURE] = {"dtype": "image", "shape": shape, "names": names}
    for name in NUMBERS:
        if name in arrays:
            shape = list(arrays[name][0]) or [1]
            found[f"observation.{name}"] = {"dtype": "float32", "shape": shape, "names": None}
    return found | {name: {"dtype": kind, "shape": [1], "names": None} for name, kind in PLAIN.items()}


def _rows(one: Recorded, episode: int, start: int, features: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Columns of some rows of an episode; `start` is its first row in the whole data set."""
    for block in one.blocks():
        frame = block["frame"].astype(np.int64)
        columns: dict[str, Any] = {
            "timestamp": block["time"].astype(np.float32), "frame_index": frame, "index": frame + start,
            "episode_index": np.full(len(frame), episode), "task_index": np.zeros(len(frame), np.int64),
        }  # fmt: skip
        for name in features:
            if name == PICTURE:
                columns[name] = [{"bytes": _png(one), "path": None} for one in block["image"]]
            elif name.startswith("observation."):
                columns[name] = block[name.removeprefix("observation.")]
        yield columns


def _png(picture: np.ndarray) -> bytes:
    out = io.BytesIO()
    write_png(out, picture)
    return out.getvalue()


def _rate(one: Recorded) -> float:
    """Hz, over the first frames; the nominal rate for a single one."""
    steps = np.diff(next(one.blocks())["time"])
    steps = steps[steps > 0]
    return float(1 / np.median(steps)) if len(steps) else SAMPLE_RATE


def _check_rate(one: Recorded, first: float) -> None:
    """Raise TactileError for a recording of another rate than the first one's, and for less than a frame a second."""
    rate = _rate(one)
    if round(first) < 1 or abs(rate / first - 1) > SAME_RATE:
        expected = f"{first:g} frames/s, as the first: the layout has one rate" if round(first) else "1 or more"
        advice = "Export it on its own, from a job of recordings of one rate"
        raise TactileError(one.name, f"{rate:g} frames/s", expected, advice)


class _Place:
    """The data files, one after another. number : of the one that is being written."""

    def __init__(self, folder: Path, features: dict[str, Any]) -> None:
        self.number = 0
        self._folder, self._schema, self._features = folder, _schema(features), features
        self._writer: Any = None

    def write(self, rows: dict[str, Any]) -> None:
        """Add rows to the file that is open."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        if self._writer is None:
            self._path = self._folder / DATA.format(chunk_index=self.number // CHUNK, file_index=self.number % CHUNK)
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = pq.ParquetWriter(self._path, self._schema, compression="snappy")
        columns = [pa.array(_listed(rows[field.name]), field.type) for field in self._schema]
        self._writer.write_table(pa.Table.from_arrays(columns, schema=self._schema))

    def end_episode(self) -> None:
        """Begin a new file where the last has become large."""
        if self._path.stat().st_size > FILE_MB * 1e6:
            self.close()
            self.number += 1

    def close(self) -> None:
        """Finish the file that is open."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def _listed(values: Any) -> list:
    return values if isinstance(values, list) else values.tolist()


def _schema(features: dict[str, Any]) -> pa.Schema:
    """Arrow's types of the columns, with the features as Hugging Face's datasets library reads them."""
    import pyarrow as pa

    fields, described = [], {}
    for name, feature in features.items():
        kind, length = feature["dtype"], feature["shape"][0]
        if kind == "image":
            fields.append(pa.field(name, pa.struct([("bytes", pa.binary()), ("path", pa.string())])))
            described[name] = {"_type": "Image"}
        elif length == 1:
            fields.append(pa.field(name, pa.type_for_alias(kind)))
            described[name] = {"dtype": kind, "_type": "Value"}
        else:
            fields.append(pa.field(name, pa.list_(pa.type_for_alias(kind), length)))
            described[name] = {"feature": {"dtype": kind, "_type": "Value"}, "length": length, "_type": "Sequence"}
    return pa.schema(fields, metadata={"huggingface": json.dumps({"info": {"features": described}})})


class _Stats:
    """Smallest, largest, mean and deviation of a feature's finite numbers, row by row."""

    def __init__(self) -> None:
        self._count: Any = 0
        self._sum: Any = 0.0
        self._squares: Any = 0.0
        self._low: Any = np.inf
        self._high: Any = -np.inf

    def add(self, values: np.ndarray) -> None:
        """Add values (n,) or (n, k)."""
        values = values.reshape(len(values), -1)
        good = np.isfinite(values)
        self._count = self._count + good.sum(axis=0)
        self._sum = self._sum + np.where(good, values, 0).sum(axis=0)
        self._squares = self._squares + np.where(good, values**2, 0).sum(axis=0)
        self._low = np.minimum(self._low, np.where(good, values, np.inf).min(axis=0))
        self._high = np.maximum(self._high, np.where(good, values, -np.inf).max(axis=0))

    def summarise(self) -> dict[str, list[float]]:
        """Return the statistics as in stats.json; 0 where no number was finite."""
        count = np.maximum(self._count, 1)
        mean = self._sum / count
        std = np.sqrt(np.maximum(self._squares / count - mean**2, 0))
        ends = [np.where(self._count > 0, end, 0) for end in (self._low, self._high)]
        return {
            "min": ends[0].tolist(), "max": ends[1].tolist(), "mean": mean.tolist(), "std": std.tolist(),
            "count": [int(np.max(self._count))],
        }  # fmt: skip


def _write_meta(folder: Path, episodes: list[dict], features: dict, stats: dict, rate: float, frames: int) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    info = {
        "codebase_version": VERSION, "robot_type": "biotac_to_digit", "total_episodes": len(episodes),
        "total_frames": frames, "total_tasks": 1, "chunks_size": CHUNK, "data_files_size_in_mb": FILE_MB,
        "video_files_size_in_mb": 0, "fps": round(rate), "splits": {"train": f"0:{len(episodes)}"},
        "data_path": DATA, "video_path": None, "features": features,
    }  # fmt: skip
    (folder / EPISODES).parent.mkdir(parents=True)
    atomic.write_json(folder / "meta" / "info.json", info)
    atomic.write_json(folder / "meta" / "stats.json", stats)
    # LeRobot looks tasks up by the index of this table, as pandas writes it.
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
    pq.write_table(table.replace_schema_metadata({"pandas": json.dumps(pandas)}), folder / "meta" / "tasks.parquet")
    pq.write_table(pa.Table.from_pylist(episodes), folder / EPISODES)
