"""Paired contacts: the same force, angle and unrolled place on BioTac and DIGIT, as training data.

Presses are numbered; press i draws all it needs from (seed, i), so any number of workers makes the same file, and
an interrupted run goes on from the blocks of presses that are already on disk.
"""

from __future__ import annotations

import dataclasses
import io
import json
import logging
import os
import pathlib
import zipfile
from collections.abc import Callable, Iterable

import numpy as np

from .. import __version__, atomic, sensors
from ..errors import TactileError
from ..scene import load_scene
from .compliance import biotac_compliance, digit_compliance
from .pair_card import card, card_path
from .pair_file import merge, no_room
from .pair_rows import press_rows

log = logging.getLogger(__name__)

BLOCK = 4  # presses a block: a few seconds of work
_MOST_BLOCKS = 256  # made between two looks at how many contacts there are


@dataclasses.dataclass(frozen=True)
class _Job:
    scene_file: str
    seed: int
    block: int
    folder: str


def make_pairs(
    scene_path: str | os.PathLike,
    count: int,
    seed: int,
    out: str | os.PathLike,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Simulate ``count`` paired contacts of a scene into the HDF5 file ``out``.

    progress : called with (contacts so far, count). Blocks wait in ``<out>.parts`` and are removed at the end; the
        file's card (``pair_card``) is written beside it.
    Raises TactileError for a bad scene, count, or for parts of another scene or seed.
    """
    scene, text = load_scene(scene_path)
    out = pathlib.Path(out)
    if scene.pairs is None:
        raise TactileError(f"{scene_path}, pairs", "missing", "a [pairs] table", "See scenes/press_sphere/scene.toml")
    if count < 1:
        raise TactileError("--count", str(count), "at least 1")
    for spec in scene.indenters:
        spec.build()  # an impossible one is refused before anything is written
    atomic.claim(out)
    digit_compliance(), biotac_compliance()  # built once here, not by every worker at the same time
    folder = _parts_folder(out, text, seed)
    files = _run_blocks(str(scene_path), seed, folder, count, workers, progress)
    merge(files, count, out, text, seed, [spec.name for spec in scene.indenters])
    atomic.write_json(card_path(out), card(out))
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()


def _parts_folder(out: pathlib.Path, text: str, seed: int) -> pathlib.Path:
    folder = out.with_name(out.name + ".parts")
    recipe = json.dumps(
        {
            "scene": text,
            "seed": seed,
            "version": __version__,
            "biotac": sensors.biotac_surface().sha256,
            "digit": sensors.digit_surface().sha256,
        }
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        mark = folder / "recipe.json"
        if mark.exists() and mark.read_text(encoding="utf-8") != recipe:
            raise TactileError(
                folder,
                "holds parts of another scene, seed or version",
                "none or the same",
                "Remove the folder to start anew",
            )
        mark.write_text(recipe, encoding="utf-8")
    except OSError as error:
        raise TactileError(folder, f"cannot be written ({error.strerror})", "a folder that can be written") from error
    return folder


def _run_blocks(scene_file, seed, folder, count, workers, progress) -> list[pathlib.Path]:  # noqa: ANN001
    """Make blocks in order until they hold ``count`` contacts; several at a time with workers."""
    files: list[pathlib.Path] = []
    have = 0
    pool = _Pool(workers)
    try:
        while have < count:
            size = _batch(have, len(files), count, workers)
            batch = [_Job(scene_file, seed, len(files) + i, str(folder)) for i in range(size)]
            for file, contacts in pool.map(_make_block, batch):
                files.append(pathlib.Path(file))
                have += contacts
                if progress:
                    progress(min(have, count), count)
            if not have and len(files) > 20:
                found = f"{len(files) * BLOCK} presses made no contact"
                raise TactileError(scene_file, found, "a scene whose indenter can press the pad")
    finally:
        pool.close()
    return files


def _batch(have: int, blocks: int, count: int, workers: int) -> int:
    """How many blocks to make before looking whether they suffice: about those still missing, within reason."""
    missing = (count - have) / max(have / blocks, 1) if have else 1
    return int(np.clip(np.ceil(missing), max(workers, 1), _MOST_BLOCKS))


class _Pool:
    """Processes that use one thread each, or this process when there is one worker."""

    def __init__(self, workers: int) -> None:
        self.pool = None
        if workers > 1:
            import multiprocessing

            for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
                os.environ.setdefault(name, "1")
            self.pool = multiprocessing.get_context("spawn").Pool(workers)

    def map(self, function: Callable[[_Job], tuple[str, int]], jobs: list[_Job]) -> Iterable[tuple[str, int]]:
        """Results in the order of the jobs."""
        return self.pool.imap(function, jobs) if self.pool else map(function, jobs)

    def close(self) -> None:
        """End the processes, whatever they do."""
        if self.pool:
            self.pool.terminate()


def _make_block(job: _Job) -> tuple[str, int]:
    """One block of presses as a file of its own; an existing whole file is taken as it is."""
    file = pathlib.Path(job.folder) / f"block_{job.block:06d}.npz"
    try:
        with np.load(file, allow_pickle=False) as block:
            return str(file), int(block["count"])
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        pass  # not made yet, or cut short: made now
    scene, _ = load_scene(job.scene_file)
    rows = [row for i in range(BLOCK) for row in press_rows(scene, job.seed, job.block * BLOCK + i)]
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]} if rows else {}
    content = io.BytesIO()
    np.savez(content, count=len(rows), **columns)
    try:
        atomic.write_bytes(file, content.getvalue())
    except OSError as error:
        raise no_room(file, error) from error
    return str(file), len(rows)
