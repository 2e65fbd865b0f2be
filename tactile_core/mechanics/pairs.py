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

from .. import __version__, atomic, digit_shape, sensors
from ..errors import TactileError
from ..hdf5_disk import Disk
from ..indenters import Indenter
from ..scene import PairSpec, Scene, load_scene
from .compliance import biotac_compliance, compliance_of, digit_compliance
from .contact import Contact
from .corrected_press import CorrectedPress, FastContact
from .electrodes import electrode_gaps, signal_of_gaps
from .placement import Placement, on_gel, pose_at
from .thickness import depth_at

log = logging.getLogger(__name__)

FORMAT = "tactile-pairs-1"
SCALE = 1e-7  # m a unit of the int16 displacements: 0.1 um steps, up to 3.2 mm
BLOCK = 16  # presses a block: a few seconds of work


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

    progress : called with (contacts so far, count). Blocks wait in ``<out>.parts`` and are removed at the end.
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
    _merge(files, count, out, text, seed, [spec.name for spec in scene.indenters])
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
            batch = [_Job(scene_file, seed, len(files) + i, str(folder)) for i in range(max(workers, 1))]
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
    rows = [row for i in range(BLOCK) for row in _press_rows(scene, job.seed, job.block * BLOCK + i)]
    columns = {name: np.stack([row[name] for row in rows]) for name in rows[0]} if rows else {}
    content = io.BytesIO()
    np.savez(content, count=len(rows), **columns)
    try:
        atomic.write_bytes(file, content.getvalue())
    except OSError as error:
        raise _no_room(file, error) from error
    return str(file), len(rows)


def _no_room(path: pathlib.Path, error: OSError | RuntimeError) -> TactileError:
    reason = getattr(error, "strerror", None) or str(error).split("\n")[0]
    return TactileError(path, f"cannot be written ({reason})", "room for it", "Make room, then give the command again")


def _press_rows(scene: Scene, seed: int, press: int) -> list[dict[str, np.ndarray]]:
    """The contacts of one press: force grows by the scene's ratio until the first sensor reaches its greatest depth.

    Forces begin log-uniformly within one ratio, so over many presses they are log-uniform.
    """
    spec = scene.pairs
    random = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(press,)))
    which = int(random.integers(len(scene.indenters)))
    indenter = scene.indenters[which].build()
    place = _draw_place(random, spec)
    on_biotac, on_digit = (_press(sensor, indenter, place, spec) for sensor in ("biotac", "digit"))
    force = spec.force_min_n * spec.force_ratio ** random.uniform()
    rows = []
    while True:
        biotac, digit = on_biotac.at_force(force), on_digit.at_force(force)
        if biotac is None or digit is None:
            return rows
        rows.append({"press": np.int32(press), "indenter": np.int16(which), **pair_row(biotac, digit)})
        force *= spec.force_ratio


def _press(sensor: str, indenter: Indenter, place: Placement, spec: PairSpec) -> CorrectedPress:
    pose = pose_at(sensor, indenter, place)
    limit = depth_at(spec.depth_max_percent / 100, sensor, indenter, pose)
    return CorrectedPress(compliance_of(sensor), indenter, pose, limit, spec.friction)


def _draw_place(random: np.random.Generator, spec: PairSpec) -> Placement:
    while True:
        x = random.uniform(digit_shape.X_TIP, digit_shape.X_BASE)
        z = random.uniform(-digit_shape.HALF_WIDTH, digit_shape.HALF_WIDTH)
        if on_gel(x, z, spec.rim_margin_mm * 1e-3):
            break
    lean = np.arccos(random.uniform(np.cos(np.radians(spec.tilt_max_deg)), 1))
    return Placement(x, z, float(lean), float(random.uniform(0, 2 * np.pi)))


def pair_row(biotac: FastContact, digit: FastContact) -> dict[str, np.ndarray]:
    """What one paired contact stores; arrays as in the file, see ``DATASETS``. Electrode gaps are not corrected."""
    skin, gel = biotac_compliance(), digit_compliance()
    gaps = electrode_gaps(skin, biotac.linear)
    return {
        "displacement_biotac": quantise(biotac.corrected.displacement),
        "displacement_digit": quantise(digit.corrected.displacement),
        "signal": signal_of_gaps(gaps).astype(np.float32),
        "gap": gaps.astype(np.float32),
        "force": biotac.force.astype(np.float32),
        "force_digit": digit.force.astype(np.float32),
        "pressure": np.float32(biotac.pressure),
        "depth_biotac": np.float32(biotac.linear.depth),
        "depth_digit": np.float32(digit.linear.depth),
        "contact_center": contact_center(digit.linear).astype(np.float32),
        "contact_patch_biotac": _patch(len(skin.surface.rest), skin.touchable[biotac.linear.nodes]),
        "contact_patch_digit": _patch(len(gel.surface.rest), gel.touchable[digit.linear.nodes]),
    }


def contact_center(digit: Contact) -> np.ndarray:
    """Centre of pressure (2,) = (x, z) m on the resting gel: touching nodes weighted by their force."""
    gel = digit_compliance()
    weight = np.linalg.norm(digit.nodal_force, axis=1)
    return weight @ gel.surface.rest[gel.touchable[digit.nodes]][:, [0, 2]] / weight.sum()


def quantise(displacement: np.ndarray, scale: float = SCALE) -> np.ndarray:
    """Displacement in m as int16 steps of ``scale`` m."""
    return np.round(displacement / scale).astype(np.int16)


def _patch(size: int, nodes: np.ndarray) -> np.ndarray:
    patch = np.zeros(size, bool)
    patch[nodes] = True
    return patch


# Unit of each dataset; the leading axis counts contacts.
DATASETS = {
    "displacement_biotac": "m", "displacement_digit": "m", "signal": "counts", "gap": "m", "force": "N",
    "force_digit": "N", "pressure": "Pa", "depth_biotac": "m", "depth_digit": "m", "contact_center": "m",
    "contact_patch_biotac": "1", "contact_patch_digit": "1", "press": "1", "indenter": "1",
}  # fmt: skip


def _merge(files, count, out, text, seed, names) -> None:  # noqa: ANN001
    """One HDF5 file from the blocks in order, cut to ``count`` contacts; written beside and renamed."""
    try:
        _write_merged(files, count, out, text, seed, names)
    except (OSError, RuntimeError) as error:  # h5py reports a full disk as either
        raise _no_room(out, error) from error


def _write_merged(files, count, out, text, seed, names) -> None:  # noqa: ANN001
    import h5py

    with atomic.new_file(out) as partial, Disk(partial) as disk, h5py.File(disk, "w") as file:
        file.attrs.update({
            "format": FORMAT, "scene": text, "seed": seed, "version": __version__, "indenters": json.dumps(names),
            "biotac_nodes_sha256": sensors.biotac_surface().sha256,
            "digit_nodes_sha256": sensors.digit_surface().sha256,
        })  # fmt: skip
        done = 0
        for path in files:
            with np.load(path, allow_pickle=False) as block:
                take = min(int(block["count"]), count - done)
                for name in DATASETS if take else ():
                    _append(file, name, block[name][:take], count, done)
                done += take
            disk.check()


def _append(file, name: str, values: np.ndarray, count: int, start: int) -> None:  # noqa: ANN001
    if name not in file:
        chunk = (min(32, count), *values.shape[1:])
        dataset = file.create_dataset(
            name,
            (count, *values.shape[1:]),
            values.dtype,
            chunks=chunk,
            compression="gzip",
            compression_opts=1,
            shuffle=True,
            track_times=False,
        )
        dataset.attrs["unit"] = DATASETS[name]
        if values.dtype == np.int16 and name.startswith("displacement"):
            dataset.attrs["scale"] = SCALE
    file[name][start : start + len(values)] = values
