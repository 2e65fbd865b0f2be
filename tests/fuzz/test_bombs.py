"""Files that ask for far more than they hold: each loader says no, within the memory of ``bounded_child``."""

import io
import json
import struct
import zipfile
import zlib

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.files.outside import MOST_TEXT
from tactile_core.geometry.indenters import mesh_file
from tactile_core.jobs.engine import dask_cluster, inputs
from tactile_core.jobs.gel_frames import read_frames
from tactile_core.pictures.background import read_photograph
from tactile_core.pictures.renderer import Renderer
from tactile_core.recordings import electrode_gains
from tactile_core.sensors.calibration_file import SHIPPED, load_calibration
from tactile_core.simulation import scene
from tactile_core.translation import weights

pytest.importorskip("resource", reason="Windows limits no process's memory")
from bounded_child import prepare, refused, report_of

MANY = 10_000_000


def npy(shape, header=None) -> bytes:
    text = (header or f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}").encode()
    return b"\x93NUMPY\x02\x00" + struct.pack("<I", len(text)) + text


def archive(path, content, method=zipfile.ZIP_DEFLATED, name="electrodes.npy"):
    with zipfile.ZipFile(path, "w", method) as file, file.open(name, "w", force_zip64=True) as out:
        for part in content:
            out.write(part)


def zeros(megabytes):
    return (bytes(2**20) for _ in range(megabytes))


def long_header():
    yield b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**31)
    yield from zeros(4)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ([npy("(100000000, 19)")], "GB in memory"),
        ([npy("(-5, 19)")], "electrodes"),
        ([npy("(60, 19)"), *[bytes(2**20)] * 2], None),  # more than declared: what is declared is read
        ([npy("(60, 99999999999999999999)")], "electrodes"),
        (long_header(), "header of"),
        ([npy("", "{'descr': __import__('os').system('x')}")], "damaged"),
        ([npy("", "(" * 9000)], "damaged"),
    ],
)
def test_npz(content, words, tmp_path):
    archive(tmp_path / "a.npz", content)
    if words is None:
        assert report_of(prepare, tmp_path / "a.npz") == "read"
        return
    for load in (prepare, read_frames):
        refused(load, tmp_path / "a.npz", words if load is prepare else "")


@pytest.mark.parametrize(
    ("start", "stretch", "words"),
    [(b"timestamp", b",a" * 2**19, "a line of over 1 MB"), (b"timestamp,", b"a" * 2**20, "a line of over 1 MB"),
     (b"timestamp" + b",a" * 2000 + b"\n", b"1\n" * 2**19, "2,001 columns")],
)  # fmt: skip
def test_wide_texts(start, stretch, words, tmp_path):
    """A header of 10^8 cells, a cell of 200 MB, and many columns."""
    with open(tmp_path / "a.csv", "wb") as file:
        file.write(start)
        for _ in range(200):
            file.write(stretch)
    for load in (prepare, recordings.read):
        refused(load, tmp_path / "a.csv", words)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_npz_packed_in_other_ways(method, tmp_path):
    archive(tmp_path / "a.npz", [npy("(60, 19)"), *zeros(64)], method)
    refused(prepare, tmp_path / "a.npz", "packed by method")


def test_npz_with_names_that_leave_the_folder(tmp_path):
    """Nothing is ever unpacked to disk; the name is one like any other."""
    good = io.BytesIO()
    np.save(good, np.full((60, 19), 3000.0))
    archive(tmp_path / "a.npz", [good.getvalue()], name="../../electrodes.npy")
    refused(prepare, tmp_path / "a.npz", "no known recording")
    assert [file.name for file in tmp_path.iterdir()] == ["a.npz"]


def safetensors(header, body=b"") -> bytes:
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + body


def tensor(begin, end, shape, dtype="F32"):
    return {"dtype": dtype, "shape": shape, "data_offsets": [begin, end]}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (safetensors({"a": tensor(0, 2**62, [2**60])}, bytes(24)), "a range inside"),
        (safetensors({"a": tensor(0, 8, [2**60, 2**60])}, bytes(8)), "for shape"),
        (safetensors({"a": tensor(-8, 0, [2])}, bytes(8)), "whole numbers"),
        (struct.pack("<Q", 2**63) + b"{}", "header of"),
        (struct.pack("<Q", 900_000) + b"[" * 900_000, "not JSON"),
    ],
)
def test_safetensors(data, words, tmp_path):
    (tmp_path / "a").write_bytes(data)
    refused(lambda path: weights.from_safetensors(weights.read_bytes(path), path), tmp_path / "a", words)


def test_weights_larger_than_any(tmp_path):
    with open(tmp_path / "a", "wb") as file:
        file.truncate(2 * weights.MAX_FILE_BYTES)
    refused(weights.read_bytes, tmp_path / "a", "at most")


def binary_ply(count):
    return (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode() + bytes(1000)


MESHES = {
    "declared.stl": lambda: bytes(80) + struct.pack("<I", MANY) + bytes(5000),
    "all.stl": lambda: bytes(80) + struct.pack("<I", 1_900_000) + bytes(50 * 1_900_000),
    "declared.ply": lambda: binary_ply(MANY),
    "negative.ply": lambda: binary_ply(-5),
    "text.ply": lambda: binary_ply(MANY).replace(b"binary_little_endian", b"ascii"),
    "declared.off": lambda: f"OFF\n{MANY} {MANY} 0\n0 0 0\n".encode(),
    "negative.off": lambda: b"OFF\n-4 -4 0\n0 0 0\n",
    "all.off": lambda: b"OFF\n3 5000000 0\n0 0 0\n1 0 0\n0 1 0\n" + b"3 0 1 2\n" * 5_000_000,
    "all.obj": lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\n" * 10_000_000,
    "vertices.obj": lambda: b"v 0 0 0\n" * 11_000_000,
    "far.obj": lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999\n",
    "polygon.obj": lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf" + b" 1 2 3" * 1_000_000 + b"\n",
}


@pytest.mark.parametrize("name", MESHES)
def test_meshes(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(MESHES[name]())
    refused(lambda path: mesh_file.solid(mesh_file.read_bytes(path), path, 1e-3, "z"), path, str(path))


LONG_TOML = {
    "brackets": b"a = " + b"[" * 10**6,  # a thousand times as deep as Python goes
    "comment": b"#" * (2 * MOST_TEXT),
    "key": b"a" + b".a" * 10**6 + b" = 1",
    "number": b"a = " + b"9" * 5000,  # Python reads whole numbers of up to 4,300 digits
}


@pytest.mark.parametrize("content", LONG_TOML.values(), ids=LONG_TOML)
def test_long_toml_files(content, tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(content)
    for load in (scene.load_scene, load_calibration, electrode_gains.read, lambda path: dask_cluster._read(str(path))):
        refused(load, path, str(path))


def test_a_calibrations_photograph_is_bounded(tmp_path):
    declared = bytearray(plain_png(1, 1))
    declared[12:33] = header = b"IHDR" + struct.pack(">II", 60_000, 60_000) + bytes(declared[24:29])
    declared[29:33] = struct.pack(">I", zlib.crc32(header))
    for content in (bytes(declared), plain_png(9_000, 9_000)):
        (tmp_path / "bomb.png").write_bytes(content)
        for name in ("../bomb.png", "bomb.png"):
            text = SHIPPED.read_text().replace('photograph = ""', f'photograph = "{name}"')
            (tmp_path / "a.toml").write_text(text)
            refused(lambda path: Renderer(load_calibration(path), "fast"), tmp_path / "a.toml", "bomb.png")


def plain_png(width: int, height: int) -> bytes:
    """A black one, small whatever its size."""
    from PIL import Image

    content = io.BytesIO()
    Image.new("1", (width, height)).save(content, "PNG")
    return content.getvalue()


def test_a_photograph_starts_no_program(tmp_path, monkeypatch):
    """Pillow opens EPS by Ghostscript, whatever the file is called."""
    monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "gs").write_text(f"#!/bin/sh\n: > {tmp_path}/started\n")
    (tmp_path / "gs").chmod(0o755)
    (tmp_path / "a.png").write_bytes(
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n%%EOF\n"
    )
    refused(read_photograph, tmp_path / "a.png", "a.png")
    assert not (tmp_path / "started").exists()


@pytest.mark.parametrize(("width", "said"), [(10**7, "610 MB of pixels"), (2 * 10**8, "12207 MB"), (100, "damaged")])
def test_a_wide_exr_picture(width, said, tmp_path):
    pytest.importorskip("OpenEXR", reason="OpenEXR is absent: pip install tactile-core[render]")
    from tactile_core.files.exr_file import read_height, write_exr

    write_exr(tmp_path / "a.exr", {"height": np.zeros((16, 8), np.float32)}, {})
    content = bytearray((tmp_path / "a.exr").read_bytes())
    window = content.index(b"dataWindow\0box2i\0") + 21
    assert struct.unpack_from("<4i", content, window) == (0, 0, 7, 15)
    struct.pack_into("<4i", content, window, 0, 0, width, 15)
    (tmp_path / "a.exr").write_bytes(content)
    refused(read_height, tmp_path / "a.exr", said)


def test_lists_of_inputs(tmp_path):
    (tmp_path / "list.txt").write_bytes(b"\xff\xfe" * 1000)
    refused(lambda path: inputs.find([f"@{path}"], tmp_path / "out"), tmp_path / "list.txt", "list.txt")
    with open(tmp_path / "list.txt", "wb") as file:
        file.truncate(2 * MOST_TEXT)
    refused(lambda path: inputs.find([f"@{path}"], tmp_path / "out"), tmp_path / "list.txt", "list.txt")
