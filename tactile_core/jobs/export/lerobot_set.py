"""Write what LeRobot's layouts 2.1 and 3.0 share: features, rows, statistics, and the pass over a job's recordings.

One recording is one episode. LeRobot trains on what a robot sees, its state, and the action asked of it. A touch has
no command, so the state is the contact on the DIGIT, and the action the next frame's state: a policy learns the touch
to come. Time steps are even, as LeRobot requires; ``time`` is the recording's own clock. An unknown number is 0, as
training on NaN ends in NaN; ``contact`` is 1 if there is a place."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

from ...errors import TactileError
from ...files import atomic
from ...sensors import SAMPLE_RATE
from .finished_job import Finished, Recorded

if TYPE_CHECKING:
    import pyarrow as pa


Stats = dict[str, dict[str, np.ndarray]]
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}  # LeRobot's
LEVELS = 256  # of a picture's channel
Rows = dict[str, np.ndarray]
Features = dict[str, dict[str, Any]]  # name -> type, shape and names, as info.json has them
CHUNK = 1000  # files per folder
SAME_RATE = 0.1  # that recordings may differ by: clocks and lost frames do, 100 Hz and 50 Hz do not (assumed)
TASK = "touch, BioTac to DIGIT"
PICTURE, STATE, ACTION = "observation.images.digit", "observation.state", "action"
LABEL = "labels."  # before a label's name; strings under "observation." end LeRobot's training
CONTACT = {  # that the state is made of, in this order
    "force": ("force_x", "force_y", "force_z"), "contact_center": ("place_x", "place_z"), "contact": ("contact",)
}  # fmt: skip
NUMBERS = ("electrodes", *CONTACT, "confidence", "latent_digit")
PLAIN = {
    "time": "float64", "timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64",
    "task_index": "int64",
}  # fmt: skip


class EpisodeStats:
    """Statistics of an episode's rows: of all numbers, and of the levels in each channel of its pictures."""

    def __init__(self) -> None:
        self._numbers: dict[str, list[np.ndarray]] = defaultdict(list)
        self._levels: dict[str, np.ndarray] = {}
        self._pictures = 0

    def add(self, rows: dict[str, np.ndarray]) -> None:
        """Add rows, feature -> column: numbers (n, ...), pictures (n, H, W, 3) uint8, or words (no statistics)."""
        for name, values in rows.items():
            if values.dtype.kind in "fiu" and values.ndim < 4:
                self._numbers[name].append(values.reshape(len(values), -1))
            elif values.ndim == 4:
                counts = [np.bincount(values[..., channel].ravel(), minlength=LEVELS) for channel in range(3)]
                self._levels[name] = self._levels.get(name, 0) + np.array(counts)
                self._pictures += len(values)

    def summarise(self) -> Stats:
        """Return, for each feature, over all frames: min, max, mean, std, q01, q10, q50, q90, q99, each (k,) for
        k values a frame or (3, 1, 1) for pictures, and count (1,)."""
        return {
            **{name: _of_numbers(np.concatenate(parts)) for name, parts in self._numbers.items()},
            **{name: _of_levels(counts, self._pictures) for name, counts in self._levels.items()},
        }


def _of_numbers(values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the statistics (k,) of values (n, k), under LeRobot's names."""
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0)
    return {
        "min": values.min(axis=0), "max": values.max(axis=0), "mean": values.mean(axis=0, dtype=np.float64),
        "std": values.std(axis=0, dtype=np.float64), "count": np.array([len(values)]),
        **dict(zip(QUANTILES, quantiles, strict=True)),
    }  # fmt: skip


def _of_levels(counts: np.ndarray, pictures: int) -> dict[str, np.ndarray]:
    """Return the statistics (3, 1, 1) of pixels, given as histograms counts (3, LEVELS); pictures : their number"""
    levels, shares = np.linspace(0, 1, LEVELS), counts / counts.sum(axis=1, keepdims=True)
    mean = shares @ levels
    below = np.cumsum(counts, axis=1) / counts.sum(axis=1, keepdims=True)
    found = {name: [np.searchsorted(channel, share) for channel in below] for name, share in QUANTILES.items()}
    found |= {"min": (counts > 0).argmax(axis=1), "max": LEVELS - 1 - (counts[:, ::-1] > 0).argmax(axis=1)}
    stats = {name: levels[np.array(place)] for name, place in found.items()}
    stats |= {"mean": mean, "std": np.sqrt(np.sum(shares * (levels - mean[:, None]) ** 2, axis=1))}
    return {**{name: value.reshape(3, 1, 1) for name, value in stats.items()}, "count": np.array([pictures])}


def aggregate(episodes: list[Stats]) -> Stats:
    """Return the statistics of all episodes together; quantiles are the means of the episodes', as in LeRobot."""
    return {name: _together([episode[name] for episode in episodes]) for name in episodes[0]}


def _together(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    stack = {name: np.stack([part[name] for part in parts]) for name in parts[0]}
    count = stack["count"].sum(axis=0)
    weights = (stack["count"][:, 0] / count).reshape(-1, *[1] * (stack["mean"].ndim - 1))
    means = {name: np.sum(weights * stack[name], axis=0) for name in ("mean", *QUANTILES)}
    spread = np.sum(weights * (stack["std"] ** 2 + (stack["mean"] - means["mean"]) ** 2), axis=0)
    ends = {"min": stack["min"].min(axis=0), "max": stack["max"].max(axis=0)}
    return {**ends, **means, "std": np.sqrt(spread), "count": count}


def listed(stats: Stats) -> dict[str, dict[str, Any]]:
    """Return statistics, feature -> name -> value, with lists in place of arrays, for JSON."""
    return {name: {key: value.tolist() for key, value in one.items()} for name, one in stats.items()}


class Layout(Protocol):
    """Writer of the files of one version of LeRobot's layout, which ``write_set`` calls for each episode.
    version : as info.json names it; picture : "image" if pictures are in the rows, "video" for a file per episode"""

    version: str
    picture: Literal["image", "video"]

    def write(self, episode: int, rows: Rows, features: Features, rate: int) -> None:
        """Add rows, feature -> column, of an episode (its number). features : name -> dtype and shape; rate : Hz"""

    def end_episode(self) -> dict[str, Any]:
        """Close an episode's files; return which chunk and file hold it, for the list of episodes."""

    def finish(self, episodes: list[dict[str, Any]], stats: list[Stats]) -> dict[str, Any]:
        """Close all files and write the lists of episodes and statistics; return the layout's entries of info.json."""


def write_set(source: Finished, folder: Path, progress: Callable[[int, int], None], layout: Layout) -> None:
    """Write all recordings in a layout; progress : called with (frames done, in all). Needs pyarrow (extra [batch]).
    Raises TactileError for a numpy that does not fit pyarrow, and for recordings of different rates."""
    try:
        import pyarrow  # noqa: F401
    except ModuleNotFoundError:
        raise
    except ImportError as error:
        raise TactileError("pyarrow", str(error), "one that this numpy works with") from error
    rate = _one_rate(source)
    features = _features(source, layout.picture, rate)
    episodes: list[dict[str, Any]] = []
    stats: list[Stats] = []
    done = 0
    for index, one in enumerate(source.recordings):
        start, gathered = done, EpisodeStats()
        for rows in _rows(one, index, start, features, rate):
            gathered.add(rows)
            layout.write(index, rows, features, rate)
            done += len(rows["index"])
            progress(done, source.frames)
        about = {"episode_index": index, "tasks": [TASK], "length": one.frames, "recording": one.name}
        episodes.append(about | {"dataset_from_index": start, "dataset_to_index": done} | layout.end_episode())
        stats.append(gathered.summarise())
    (folder / "meta").mkdir()
    info = {
        "codebase_version": layout.version, "robot_type": "biotac_to_digit", "total_episodes": len(episodes),
        "total_frames": done, "total_tasks": 1, "chunks_size": CHUNK, "fps": rate,
        "splits": _splits(source), **layout.finish(episodes, stats), "features": features,
    }  # fmt: skip
    atomic.write_json(folder / "meta" / "info.json", info)


def _splits(source: Finished) -> dict[str, str]:
    """Return, for info.json, each part's range of episodes, such as {"train": "0:8"}."""
    first = 0
    found: dict[str, str] = {}
    for name, same in groupby(source.recordings, lambda one: one.split):
        count = len(list(same))
        found[name] = f"{first}:{first + count}"
        first += count
    return found


def _features(source: Finished, picture: Literal["image", "video"], rate: int) -> Features:
    """Return the columns of a frame, name -> dtype, shape and names. rate : frames per second"""
    arrays = source.recordings[0].arrays()
    shapes = {name: list(shape) or [1] for name, (shape, _) in arrays.items()} | {"contact": [1]}
    found: Features = {}
    if "image" in arrays:
        found[PICTURE] = {"dtype": picture, "shape": shapes["image"], "names": ["height", "width", "channels"]}
        if picture == "video":
            found[PICTURE]["info"] = _about_video(shapes["image"], rate)
    names = [part for parts in CONTACT.values() for part in parts]
    for name in (STATE, ACTION):
        found[name] = {"dtype": "float32", "shape": [len(names)], "names": names}
    for name in NUMBERS:
        if name in shapes:
            found[f"observation.{name}"] = {"dtype": "float32", "shape": shapes[name], "names": None}
    labels = sorted({name for one in source.recordings for name in one.labels})
    kinds = {LABEL + name: "string" for name in labels} | PLAIN
    return found | {name: {"dtype": kind, "shape": [1], "names": None} for name, kind in kinds.items()}


def _about_video(shape: list[int], rate: int) -> dict[str, Any]:
    about: dict[str, Any] = dict(zip(("height", "width", "channels"), shape, strict=True))
    about |= {"fps": rate, "codec": "mpeg4", "pix_fmt": "yuv420p", "is_depth_map": False}
    return {f"video.{name}": value for name, value in about.items()} | {"has_audio": False}


def _rows(one: Recorded, episode: int, start: int, features: Features, rate: int) -> Iterator[Rows]:
    """Yield some rows of an episode at a time, feature -> column. start : its first row in the data set; rate : Hz"""
    for block, following in _followed(one):
        frame = block["frame"].astype(np.int64) // one.every
        own = {f"observation.{name}": block[name] for name in (*NUMBERS, "state") if name in block} | {
            "timestamp": frame / rate, "frame_index": frame, "index": frame + start, "time": block["time"],
            "episode_index": np.full(len(frame), episode), "task_index": np.zeros(len(frame)),
            ACTION: np.concatenate([block["state"][1:], following]),
        }  # fmt: skip
        rows: Rows = {}
        for name, feature in features.items():
            if name == PICTURE:
                rows[name] = block["image"]
            elif name.startswith(LABEL):
                words = one.labels.get(name.removeprefix(LABEL))
                rows[name] = np.full(len(frame), "") if words is None else words[frame].astype(str)
            else:
                rows[name] = _finite(own[name]).astype(feature["dtype"])
        yield rows


def _followed(one: Recorded) -> Iterator[tuple[Rows, np.ndarray]]:
    """Yield pairs: some frames with their states, and the state (1, k) that follows; the last state follows itself."""
    held: Rows = {}
    for block in one.blocks():
        block["contact"] = np.isfinite(block["contact_center"]).all(axis=1)
        parts = [_finite(block[name]).reshape(len(block["frame"]), -1) for name in CONTACT]
        block["state"] = np.concatenate(parts, axis=1)
        if held:
            yield held, block["state"][:1]
        held = block
    yield held, held["state"][-1:]


def _finite(values: np.ndarray) -> np.ndarray:
    return np.nan_to_num(values, nan=0, posinf=0, neginf=0)  # what is not known


def _one_rate(source: Finished) -> int:
    """Return the recordings' rate, whole frames per second. Raises TactileError for different ones, or below 1."""
    first = _rate(source.recordings[0])
    for one in source.recordings:
        rate = _rate(one)
        if round(first) < 1 or abs(rate / first - 1) > SAME_RATE:
            expected = f"{first:g} frames/s, as the first: the layout has one rate" if round(first) else "1 or more"
            advice = "Export it on its own, from a job of recordings of one rate"
            raise TactileError(one.name, f"{rate:g} frames/s", expected, advice)
    return round(first)


def _rate(one: Recorded) -> float:
    """Return a recording's frames per second, by its first frames; the nominal rate for a single frame."""
    steps = np.diff(next(one.blocks())["time"])
    steps = steps[steps > 0]
    return float(1 / np.median(steps)) if len(steps) else SAMPLE_RATE


def table(rows: dict[str, Any], features: Features) -> pa.Table:
    """Return rows, feature -> column, as an Arrow table without videos; features : name -> dtype and shape"""
    import pyarrow as pa

    fields: list[Any] = []
    described: dict[str, dict[str, Any]] = {}
    for name, feature in features.items():
        kind, length = feature["dtype"], feature["shape"][0]
        if kind == "video":
            continue
        if kind == "image":
            fields.append(pa.field(name, pa.struct([("bytes", pa.binary()), ("path", pa.string())])))
            described[name] = {"_type": "Image"}
        elif length == 1:
            fields.append(pa.field(name, pa.type_for_alias(kind)))
            described[name] = {"dtype": kind, "_type": "Value"}
        else:
            fields.append(pa.field(name, pa.list_(pa.type_for_alias(kind), length)))
            described[name] = {"feature": {"dtype": kind, "_type": "Value"}, "length": length, "_type": "Sequence"}
    schema = pa.schema(fields, metadata={"huggingface": json.dumps({"info": {"features": described}})})
    columns = [pa.array(list(rows[field.name]), field.type) for field in schema]
    return pa.Table.from_arrays(columns, schema=schema)
