"""Every loader that meets files of strangers, a good file for each, and ways to spoil it, for test_fuzz.

SPOILED=5000 in the environment spoils so many files of each kind in place of a few.
"""

import importlib.util
import io
import json
import random
import shutil
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bounded_child import prepare
from conftest import ROOT, write_counts
from PIL import Image
from small_pairs import write_pairs

from tactile_core.errors import TactileError
from tactile_core.files import checksummed, exr_file
from tactile_core.geometry.indenters import mesh_file
from tactile_core.jobs import gel_frames, prepared_signals
from tactile_core.jobs.engine import dask_cluster, inputs
from tactile_core.jobs.engine import job as jobs
from tactile_core.jobs.live import Growing
from tactile_core.pictures import background
from tactile_core.recordings import electrode_gains
from tactile_core.sensors import calibration_file, descriptor, gel_shape
from tactile_core.simulation import pairs_file, scene
from tactile_core.translation import networks, translate, weights

WORDS = [b"nan", b"-1", b"1e308", b"99999999999999999999", b"../../x", b"\n", b",", b'"', b"[", b"{", b"\0", b"null"]
NUMBERS = [0, 1, 2**16, 2**31 - 1, 2**32 - 1, 2**40, 2**63 - 1, 2**64 - 1]
Loader = Callable[[Path], object]


def spoil(data: bytes, chance: random.Random) -> bytes:
    """One to six changes: bits, numbers, cuts, words, repeats."""
    spoiled = bytearray(data)
    for _ in range(chance.randint(1, 6)):
        # Formats keep what decides in their first kilobytes.
        place = chance.randrange(min(len(spoiled), chance.choice([64, 2048, 10**9])) or 1)
        how = chance.randrange(7)
        if how == 0 and spoiled:
            spoiled[min(place, len(spoiled) - 1)] ^= 1 << chance.randrange(8)
        elif how == 1:
            spoiled[place : place + 1] = bytes([chance.choice([0, 1, 127, 128, 255, chance.randrange(256)])])
        elif how == 2:
            kind = chance.choice(["<I", "<Q", ">I", ">Q", "<H"])
            value = chance.choice(NUMBERS) & (2 ** (8 * struct.calcsize(kind)) - 1)
            spoiled[place : place + struct.calcsize(kind)] = struct.pack(kind, value)
        elif how == 3:
            del spoiled[place : place + chance.choice([1, 4, 100, 10**6])]
        elif how == 4:
            spoiled[place : place + chance.choice([0, 0, 4])] = chance.choice(WORDS)
        elif how == 5:
            spoiled[place:place] = spoiled[place : place + chance.choice([1, 16, 200])] * chance.choice([1, 2, 50])
        else:
            del spoiled[place:]
    return bytes(spoiled)


def good_recordings(folder: Path) -> dict[str, tuple[bytes, Loader]]:
    """A recording in each container."""
    frames = np.rint(3000 + np.random.default_rng(0).normal(0, 1, (60, 19)))
    write_counts(folder / "good.csv", frames)
    text = (folder / "good.csv").read_bytes()
    archive = io.BytesIO()
    np.savez_compressed(archive, electrodes=frames, time=np.arange(60) / 100)
    found: dict[str, tuple[bytes, Loader]] = {
        "csv": (text, prepare),
        "npz": (archive.getvalue(), prepare),
        "hdf5": (hdf5({"electrode_vals/data": frames, "force_vec/data": np.zeros((60, 3))}), prepare),
        "growing": (text, lambda path: Growing(path).poll()),
    }
    try:
        import bags
        import rosbags  # noqa: F401 - the extra [ros] may be absent
    except ModuleNotFoundError:
        return found
    from types import SimpleNamespace

    press = SimpleNamespace(
        time=np.arange(60) / 100, electrodes=frames, **dict.fromkeys(("pdc", "tac", "tdc"), [2000] * 60)
    )
    for container in ("ros1", "mcap", "sqlite3"):
        bags.write_bag(folder / container, press, container, "hand")
        path = folder / container
        path = path if path.is_file() else next(file for file in path.iterdir() if file.suffix != ".yaml")
        found[container] = (path.read_bytes(), prepare)
    mark = folder / "sqlite3" / "metadata.yaml"
    found["metadata"] = (mark.read_bytes(), read_bag_with(mark))
    return found


def read_bag_with(mark: Path) -> Loader:
    """Reads the ROS 2 bag of a folder with other metadata."""

    def read(path: Path) -> None:
        shutil.copy(path, mark)
        prepare(mark.parent)

    return read


def hdf5(arrays: dict[str, np.ndarray], packing: str | None = "gzip") -> bytes:
    import h5py

    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        for name, values in arrays.items():
            file.create_dataset(name, data=values, compression=packing if values.ndim else None)
    return memory.getvalue()


def good_others(folder: Path) -> dict[str, tuple[bytes, Loader]]:
    """Scenes, meshes, weights, sensor files, jobs, simulations of others."""
    faces = b"v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nv 0 0 0.01\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    header = {"a": {"dtype": "F32", "shape": [2, 2], "data_offsets": [0, 16]},
              "b": {"dtype": "F16", "shape": [4], "data_offsets": [16, 24]}}  # fmt: skip
    text = json.dumps(header).encode()
    safetensors = struct.pack("<Q", len(text)) + text + bytes(24)
    job = jobs.make([jobs.Input("00000_a", "/a", "0" * 64, 1)], jobs.Translate(["latent"], "0" * 64), None)
    (folder / "job").mkdir()
    jobs.write(folder / "job", job)
    unit = electrode_gains.ElectrodeGains("made up", [1.0] * 19, [0.0] * 19)
    electrode_gains.write(folder / "sensor.toml", electrode_gains.SensorFile(electrode_gains.FORMAT, unit=unit))
    scenes, unit = ROOT / "scenes" / "press_sphere" / "scene.toml", calibration_file.SHIPPED
    queue = b'queue = "slurm"\njobs = 10\n[options]\ncores = 1\nmemory = "4GB"\nwalltime = "01:00:00"\n'
    photograph = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (12, 16, 3), np.uint8)).save(photograph, "PNG")
    found: dict[str, tuple[bytes, Loader]] = {}
    if importlib.util.find_spec("OpenEXR"):  # the extra [render] may be absent
        exr_file.write_exr(folder / "height.exr", {"height": np.zeros((8, 6), np.float32)}, {"made": "up"})
        found["exr"] = ((folder / "height.exr").read_bytes(), exr_file.read_height)
    heights = io.BytesIO()
    np.savez_compressed(heights, height_map=np.full((2, 8, 6), 1.5e-3, np.float32))
    return found | {
        "photograph": (photograph.getvalue(), background.read_photograph),
        "scene": (scenes.read_bytes(), scene.load_scene),
        "calibration": (unit.read_bytes(), calibration_file.load_calibration),
        "list": (b"# two\na.csv\n\n./b.csv\n", read_list),
        "queue": (queue, lambda path: dask_cluster._read(str(path))),
        "weights_card": ((networks.WEIGHTS_FOLDER / weights.CARD_NAME).read_bytes(), read_weights),
        "heights": (heights.getvalue(), read_heights),
        "sensor": ((folder / "sensor.toml").read_bytes(), electrode_gains.read),
        "gel": ((descriptor.FOLDER / "gelsight_mini" / descriptor.FILE).read_bytes(), read_gel),
        "dome": ((descriptor.FOLDER / "gelsight_mini" / "profile.csv").read_bytes(), read_dome),
        "obj": (faces, read_mesh(".obj")),
        "stl": (bytes(80) + struct.pack("<I", 4) + triangles(), read_mesh(".stl")),
        "ply": (PLY, read_mesh(".ply")),
        "off": (OFF, read_mesh(".off")),
        "safetensors": (safetensors, lambda path: weights.from_safetensors(weights.read_bytes(path), path)),
        "job": ((folder / "job" / jobs.FILE).read_bytes(), read_job),
        "pairs": (write_pairs(folder / "pairs.h5", presses=2, steps=2).read_bytes(), pairs_file.read_pairs),
        "prepared": (good_prepared(), read_prepared),
        "seal": (checksummed.MAGIC + b"0" * 64 + b"\n" + bytes(500), checksummed.verified_checksum),
    }


PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    b"0 0 0\n0.01 0 0\n0 0.01 0\n0 0 0.01\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
)
OFF = b"OFF\n4 4 6\n0 0 0\n.01 0 0\n0 .01 0\n0 0 .01\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"


def read_gel(path: Path, table: str = "profile.csv") -> None:
    """Reads the descriptor of a gel, and makes its surface of the table beside it."""
    with tempfile.TemporaryDirectory() as other:
        for name in (descriptor.FILE, "profile.csv"):
            good = descriptor.FOLDER / "gelsight_mini" / name
            shutil.copyfile(good if name == table else path, Path(other) / name)
        gel_shape.GelShape(descriptor.read(Path(other))).surface()


def read_dome(path: Path) -> None:
    """Reads the table of a gel's heights, beside a good descriptor."""
    read_gel(path, descriptor.FILE)


def triangles() -> bytes:
    """The body of an STL file: the faces of a tetrahedron, 10 mm wide."""
    corners = 1e-2 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4")
    found = [corners[list(face)] for face in ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))]
    return b"".join(struct.pack("<3f", 0, 0, 0) + face.astype("<f4").tobytes() + b"\0\0" for face in found)


def read_mesh(suffix: str) -> Loader:
    """Reads a mesh of the kind that the suffix names."""

    def read(path: Path) -> object:
        named = path.with_suffix(suffix)
        shutil.copy(path, named)
        return mesh_file.solid(mesh_file.read_bytes(named), named, 1.0, "y")

    return read


def read_list(path: Path) -> None:
    """The paths of a list: they are looked up, none is opened."""
    for name in ("a.csv", "b.csv"):
        (path.parent / name).touch()
    inputs.find([f"@{path}"], path.parent / "out")


def read_weights(path: Path) -> None:
    """The shipped networks with another card."""
    folder = path.parent / "weights"
    if not folder.exists():
        shutil.copytree(networks.WEIGHTS_FOLDER, folder)
    shutil.copy(path, folder / weights.CARD_NAME)
    translate.load_translator(folder)


def read_heights(path: Path) -> None:
    named = path.with_suffix(".npz")
    shutil.copy(path, named)
    gel_frames.read_frames(named)


def read_job(path: Path) -> None:
    shutil.copy(path, path.with_name(jobs.FILE))
    jobs.read(path.parent)


def good_prepared() -> bytes:
    about = {"recording": "a", "layout": "csv", "simulated": False, "start_time": 0.0, "kind": "raw", "warnings": [],
             "prepared": [], "sha256": "0" * 64, "frames": 8}  # fmt: skip
    sizes = {"time": (), "pdc": (), "quiet": (), "flags": ()}
    arrays = {name: np.zeros((8, *sizes.get(name, (19,))), kind) for name, kind in prepared_signals.COLUMNS.items()}
    parts = {"part": np.zeros(1, np.int64), "rest": np.zeros((1, 19))}
    return hdf5(arrays | parts | {"about": np.frombuffer(json.dumps(about).encode(), np.uint8)}, packing=None)


def read_prepared(path: Path) -> None:
    found = prepared_signals.Prepared(path)
    len(found), found.read(np.arange(4))


def loaders(folder: Path) -> dict[str, tuple[bytes, Loader]]:
    """Name -> a good file's bytes and what reads it."""
    return good_recordings(folder) | good_others(folder)


def survives(path: Path, data: bytes, load: Loader) -> None:
    """Reading ends well or in a TactileError; anything else goes through."""
    path.write_bytes(data)
    try:
        load(path)
    except TactileError as error:
        if len(str(error)) > 2000:
            raise AssertionError(f"a message of {len(str(error))} characters") from error
