"""LeRobot's dataset layout v2.1: a Parquet file and a video per episode, lists in JSON lines; see ``lerobot_set``.

meta/info.json, meta/stats.json, meta/episodes.jsonl, meta/episodes_stats.jsonl, meta/tasks.jsonl, meta/modality.json,
data/chunk-CCC/episode_EEEEEE.parquet, videos/chunk-CCC/observation.images.digit/episode_EEEEEE.mp4

GR00T reads it: modality.json and stats.json are its own. Videos are MPEG-4, which OpenCV of the extra [camera] writes;
on contacts of the recording that ships they differ from the pictures by 2.3 grey levels on average.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from ....errors import TactileError
from ....files import atomic
from .. import lerobot_set
from ..finished_job import Finished
from ..lerobot_set import ACTION, CHUNK, CONTACT, PICTURE, STATE, TASK, Features, Rows, Stats

BRIEF = "LeRobot v2.1, which GR00T reads too: a Parquet file and a video an episode, meta/info.json"
DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
VIDEO = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"


def write(source: Finished, folder: Path, progress: Callable[[int, int], None]) -> None:
    """Write the data set. Raises TactileError for recordings of different rates, and if OpenCV cannot write videos."""
    lerobot_set.write_set(source, folder, progress, _Apart(folder))


class _Apart:
    """Writer of a data file and a video for each episode."""

    version = "v2.1"
    picture: Literal["image", "video"] = "video"

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._data: Any = None
        self._video: Any = None

    def write(self, episode: int, rows: Rows, features: Features, rate: int) -> None:
        """Add rows, feature -> column, to the episode's files. features : name -> dtype and shape; rate : Hz"""
        import pyarrow.parquet as pq

        added = lerobot_set.table(rows, features)
        if self._data is None:
            self._data = pq.ParquetWriter(self._path(DATA, episode), added.schema, compression="snappy")
        self._data.write_table(added)
        if PICTURE in rows:
            if self._video is None:
                self._video = _open_video(self._path(VIDEO, episode), features[PICTURE]["shape"], rate)
            for picture in rows[PICTURE]:
                self._video.write(picture[..., ::-1].copy())  # OpenCV has blue first

    def end_episode(self) -> dict[str, Any]:
        """Close the episode's files; return {}, as its place follows from its number."""
        self._data.close()
        if self._video is not None:
            self._video.release()
        self._data = self._video = None
        return {}

    def finish(self, episodes: list[dict[str, Any]], stats: list[Stats]) -> dict[str, Any]:
        """Write the lists of episodes, statistics and tasks, and GR00T's files; return entries of info.json."""
        meta, drawn = self._folder / "meta", PICTURE in stats[0]
        whole = lerobot_set.listed(lerobot_set.aggregate(stats))
        _write_lines(meta / "episodes.jsonl", episodes)
        found = [{"episode_index": index, "stats": lerobot_set.listed(one)} for index, one in enumerate(stats)]
        _write_lines(meta / "episodes_stats.jsonl", found)
        _write_lines(meta / "tasks.jsonl", [{"task_index": 0, "task": TASK}])
        atomic.write_json(meta / "modality.json", _modality(drawn))
        for one in whole.values():
            del one["count"]  # GR00T cuts every statistic into the parts of the state
        atomic.write_json(meta / "stats.json", whole)
        chunks, videos = -(-len(episodes) // CHUNK), len(episodes) * drawn
        paths = {"data_path": DATA, "video_path": VIDEO if drawn else None}
        return {"total_chunks": chunks, "total_videos": videos, **paths}

    def _path(self, pattern: str, episode: int) -> Path:
        name = pattern.format(episode_chunk=episode // CHUNK, episode_index=episode, video_key=PICTURE)
        (self._folder / name).parent.mkdir(parents=True, exist_ok=True)
        return self._folder / name


def _open_video(path: Path, shape: list[int], rate: int) -> Any:
    import cv2

    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), rate, (shape[1], shape[0]))
    if not video.isOpened():
        raise TactileError(path, "OpenCV writes no MPEG-4 here", "opencv-python-headless, of the extra [camera]")
    return video


def _write_lines(path: Path, rows: list[dict[str, Any]]) -> None:
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), "utf-8")


def _modality(drawn: bool) -> dict[str, Any]:
    """Return, as GR00T requires, what the numbers of state and action mean, and, if `drawn`, the picture."""
    ends = list(itertools.accumulate(len(parts) for parts in CONTACT.values()))
    spans = {name: {"start": end - len(CONTACT[name]), "end": end} for name, end in zip(CONTACT, ends, strict=True)}
    found: dict[str, Any] = {
        key: {name: span | {"original_key": column} for name, span in spans.items()}
        for key, column in (("state", STATE), ("action", ACTION))
    }
    found["video"] = {"digit": {"original_key": PICTURE}} if drawn else {}
    found["annotation"] = {"human.task_description": {"original_key": "task_index"}}
    return found
