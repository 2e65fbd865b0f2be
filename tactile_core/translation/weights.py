"""Read and write network weights: safetensors files, without the safetensors library, and their model card. Format:
https://github.com/huggingface/safetensors#format. Reading executes nothing."""

from __future__ import annotations

import hashlib
import json
import math
import os
import struct
from pathlib import Path

import numpy as np

from ..errors import TactileError
from ..files import atomic, outside
from ..sensors.fluid_sensor import FALLS

CARD_NAME = "card.json"
CARD_FORMAT = "tactile-weights-4"
DTYPES: dict[str, np.dtype] = {"F32": np.dtype("<f4"), "F16": np.dtype("<f2")}
MAX_HEADER_BYTES = 1_000_000  # our headers are about 3 kB; the limit keeps a damaged length from asking for gigabytes
MAX_FILE_BYTES = 500_000_000  # shipped files are a few MB
ADVICE = "Take the file from a fresh copy of the weights, or train again with `tactile train`"


def write_bytes(path: str | os.PathLike, data: bytes) -> None:
    """Write a whole file or nothing; raises TactileError if the folder cannot be written."""
    with atomic.writing(path, advice="Choose a folder you can write to"):
        atomic.write_bytes(path, data)


def sha256(data: bytes) -> str:
    """Return the hexadecimal SHA-256 of some bytes."""
    return hashlib.sha256(data).hexdigest()


def to_safetensors(tensors: dict[str, np.ndarray]) -> bytes:
    """Encode tensors, float32 and float16 arrays by name, as a safetensors file, in the order of their names."""
    names = {dtype: name for name, dtype in DTYPES.items()}
    header, offset = {}, 0
    arrays = [(name, np.asarray(array, order="C")) for name, array in sorted(tensors.items())]
    for name, array in arrays:
        dtype = names.get(array.dtype.newbyteorder("<"))
        if dtype is None:
            raise TactileError(name, f"dtype {array.dtype}", "float32 or float16")
        end = offset + array.nbytes
        header[name] = {"dtype": dtype, "shape": list(array.shape), "data_offsets": [offset, end]}
        offset = end
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)  # the format asks for data aligned to 8 bytes
    body = b"".join(array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes() for _, array in arrays)
    return struct.pack("<Q", len(text)) + text + body


def from_safetensors(data: bytes, where: str | os.PathLike) -> dict[str, np.ndarray]:
    """Decode arrays by name, in the dtype of the file, from the bytes of a safetensors file.
    where : name of the file for the message. Raises TactileError for bytes that break the format."""
    header, body = _split(data, where)
    arrays: dict[str, np.ndarray] = {}
    spans = []
    for name, entry in header.items():
        if name == "__metadata__":
            continue
        dtype, shape, (begin, end) = _entry(name, entry, len(body), where)
        spans.append((begin, end, name))
        arrays[name] = np.frombuffer(body[begin:end], dtype).reshape(shape)
        if not np.isfinite(arrays[name]).all():
            raise TactileError(
                f"{os.fspath(where)}, tensor {name}", "values that are not finite", "finite numbers", ADVICE
            )
    _check_spans(sorted(spans), len(body), where)
    return arrays


def _split(data: bytes, where: str | os.PathLike) -> tuple[dict, bytes]:
    """Split the file into header (JSON object) and body."""
    if len(data) < 8:
        raise TactileError(where, f"{len(data)} bytes", "a safetensors file", ADVICE)
    length = struct.unpack("<Q", data[:8])[0]
    if length > min(MAX_HEADER_BYTES, len(data) - 8):
        raise TactileError(
            where, f"header of {length} bytes in a file of {len(data)}", "a whole safetensors file", ADVICE
        )
    try:
        header = json.loads(data[8 : 8 + length], object_pairs_hook=_unique)
    except (ValueError, RecursionError) as error:
        raise TactileError(where, "header is not JSON", "a safetensors file", ADVICE) from error
    if not isinstance(header, dict):
        raise TactileError(where, "header is not a JSON object", "a safetensors file", ADVICE)
    return header, data[8 + length :]


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return a JSON object's pairs as a dict. Raises ValueError for a repeated key."""
    if len({key for key, _ in pairs}) != len(pairs):
        raise ValueError("a name is given twice")
    return dict(pairs)


def _entry(
    name: str, entry: object, body: int, where: str | os.PathLike
) -> tuple[np.dtype, tuple[int, ...], tuple[int, int]]:
    """Return one tensor's dtype, shape and byte range. Raises TactileError if these or the body's size do not agree."""
    place = f"{os.fspath(where)}, tensor {name}"
    if not isinstance(entry, dict) or set(entry) != {"dtype", "shape", "data_offsets"}:
        raise TactileError(place, f"header entry {str(entry)[:80]}", "dtype, shape and data_offsets", ADVICE)
    if not isinstance(entry["dtype"], str) or entry["dtype"] not in DTYPES:
        raise TactileError(place, f"dtype {str(entry['dtype'])[:20]}", "F32 or F16", ADVICE)
    dtype, shape, offsets = DTYPES[entry["dtype"]], entry["shape"], entry["data_offsets"]
    if not _counts(shape) or not _counts(offsets) or len(offsets) != 2:
        raise TactileError(
            place, f"shape {str(shape)[:60]}, data_offsets {str(offsets)[:60]}", "whole numbers from 0", ADVICE
        )
    begin, end = offsets
    if not begin <= end <= body:
        raise TactileError(place, f"bytes {begin}..{end}", f"a range inside the {body} bytes of data", ADVICE)
    if math.prod(shape) * dtype.itemsize != end - begin:
        raise TactileError(
            place, f"{end - begin} bytes", f"{math.prod(shape) * dtype.itemsize} bytes for shape {tuple(shape)}", ADVICE
        )
    return dtype, tuple(shape), (begin, end)


def _counts(values: object) -> bool:
    """Return true for a list of whole numbers from 0 (JSON's true is not one)."""
    return isinstance(values, list) and all(type(value) is int and value >= 0 for value in values)


def _check_spans(spans: list[tuple[int, int, str]], body: int, where: str | os.PathLike) -> None:
    """Raise TactileError unless rising spans (begin, end, name) of tensors fill `body` bytes, no hole, no overlap."""
    position = 0
    for begin, end, name in spans:
        if begin != position:
            raise TactileError(
                f"{os.fspath(where)}, tensor {name}", f"data from byte {begin}", f"from byte {position}", ADVICE
            )
        position = end
    if position != body:
        raise TactileError(where, f"{body} bytes of data", f"{position} bytes", ADVICE)


def read_bytes(path: str | os.PathLike) -> bytes:
    """Read the bytes of a weights file. Raises TactileError if it is missing, cannot be read or is far too large."""
    try:
        path = outside.inside(Path(path).parent, Path(path).name, "a weights file")
        return outside.read(path, MAX_FILE_BYTES, "a weights file")
    except OSError as error:
        raise TactileError(path, f"cannot be read ({error.strerror})", "a weights file", ADVICE) from error


def read_verified(
    path: str | os.PathLike, expected_sha256: str, shapes: dict[str, tuple[int, ...]]
) -> dict[str, np.ndarray]:
    """Read the arrays of a safetensors file. Raises TactileError for another hash or other tensor shapes than expected;
    for an intact file of other shapes it names the shapes, which say more than the hash."""
    data = read_bytes(path)
    found = sha256(data)
    if found == expected_sha256:
        return check_shapes(from_safetensors(data, path), shapes, path)
    try:
        tensors = from_safetensors(data, path)
    except TactileError:
        pass  # the file is damaged: the hash below says so
    else:
        check_shapes(tensors, shapes, path)
    raise TactileError(path, f"sha256 {found}", f"sha256 {expected_sha256}", ADVICE)


def check_shapes(
    tensors: dict[str, np.ndarray], shapes: dict[str, tuple[int, ...]], where: str | os.PathLike
) -> dict[str, np.ndarray]:
    """Return the tensors if names and shapes are as expected. Raises TactileError that names the first that is not."""
    for name in sorted(tensors.keys() | shapes.keys()):
        found = f"shape {tensors[name].shape}" if name in tensors else "nothing"
        expected = f"shape {tuple(shapes[name])}" if name in shapes else "no such tensor"
        if name not in tensors or name not in shapes or tensors[name].shape != tuple(shapes[name]):
            raise TactileError(f"{os.fspath(where)}, tensor {name}", found, expected, ADVICE)
    return tensors


def card_bytes(card: dict) -> bytes:
    """Encode the card as written: readable JSON, sorted, no NaN."""
    return (json.dumps(card, indent=1, sort_keys=True, allow_nan=False) + "\n").encode()


def read_card(folder: str | os.PathLike) -> tuple[dict, str]:
    """Read a weights folder's model card and the SHA-256 of its bytes, which identifies the weights: the card holds the
    hash of every file. Raises TactileError if it is missing, not JSON, or of another format or polarity."""
    path = Path(folder) / CARD_NAME
    data = read_bytes(path)
    try:
        card = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise TactileError(path, "not JSON", "a model card", ADVICE) from error
    if not isinstance(card, dict) or card.get("format") != CARD_FORMAT:
        found = card.get("format") if isinstance(card, dict) else type(card).__name__
        raise TactileError(path, f"format {found!r}", f"format {CARD_FORMAT!r}", ADVICE)
    if card.get("polarity") != FALLS:
        old = "missing: trained on counts that rise where films thin"
        stated = repr(card["polarity"]) if "polarity" in card else old
        expected = f"{FALLS!r}, as raw counts do"
        raise TactileError(f"{path}, polarity", stated, expected, "Train them again with this version")
    return card, sha256(data)
