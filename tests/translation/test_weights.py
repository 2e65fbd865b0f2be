"""The safetensors reader and writer: round trip, agreement with the library, and every kind of damage refused."""

import json
import struct

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.translation import weights

TENSORS = {
    "b": np.arange(6, dtype=np.float32).reshape(2, 3),
    "a": np.array([1.5], np.float16),
    "none": np.zeros((0, 4), np.float32),
    "one": np.float32(3.0),
}


def packed(header: object, body: bytes = b"", length: int | None = None) -> bytes:
    """A file with this header, right or wrong."""
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(text) if length is None else length) + text + body


def entry(dtype: object = "F32", shape: object = (1,), offsets: object = (0, 4)) -> dict:
    """A header entry."""
    return {"dtype": dtype, "shape": shape, "data_offsets": offsets}


def test_round_trip():
    found = weights.from_safetensors(weights.to_safetensors(TENSORS), "net")
    assert found.keys() == TENSORS.keys()
    for name, array in TENSORS.items():
        assert found[name].dtype == array.dtype
        assert found[name].shape == array.shape
        np.testing.assert_array_equal(found[name], array)


def test_the_library_reads_our_files_and_we_read_its():
    library = pytest.importorskip("safetensors.numpy", reason="safetensors comes with the training extra")
    found = library.load(weights.to_safetensors(TENSORS))
    for name, array in TENSORS.items():
        np.testing.assert_array_equal(found[name], array)
    theirs = library.save({"x": TENSORS["b"], "y": TENSORS["a"]}, metadata={"made": "there"})
    np.testing.assert_array_equal(weights.from_safetensors(theirs, "net")["x"], TENSORS["b"])


def test_order_of_names_does_not_change_the_bytes():
    assert weights.to_safetensors(TENSORS) == weights.to_safetensors(dict(reversed(TENSORS.items())))


def test_other_dtypes_are_not_written():
    with pytest.raises(TactileError, match="float64"):
        weights.to_safetensors({"x": np.zeros(2)})


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "0 bytes"),
        (b"1234567", "7 bytes"),
        (packed({}, length=2**63), "header of"),
        (packed({}, length=3), "header of"),
        (packed(b"{nonsense"), "not JSON"),
        (packed(b"[" * 100_000), "not JSON"),
        (packed([1]), "not a JSON object"),
        (packed(b'{"x": 1, "x": 2}'), "not JSON"),
        (packed({"x": 5}), "header entry"),
        (packed({"x": {"dtype": "F32", "shape": [1]}}), "header entry"),
        (packed({"x": entry(dtype="I64")}, bytes(4)), "dtype I64"),
        (packed({"x": entry(dtype=["F32"])}, bytes(4)), "dtype"),
        (packed({"x": entry(shape=[-1])}, bytes(4)), "whole numbers"),
        (packed({"x": entry(shape=[True])}, bytes(4)), "whole numbers"),
        (packed({"x": entry(shape=[1.0])}, bytes(4)), "whole numbers"),
        (packed({"x": entry(offsets=[0])}, bytes(4)), "whole numbers"),
        (packed({"x": entry(offsets=[0, 8], shape=[2])}, bytes(4)), "a range inside"),
        (packed({"x": entry(offsets=[4, 0])}, bytes(4)), "a range inside"),
        (packed({"x": entry(shape=[2])}, bytes(4)), "8 bytes for shape"),
        (packed({"x": entry(), "y": entry()}, bytes(4)), "from byte 4"),
        (packed({"x": entry(), "y": entry(offsets=[8, 12])}, bytes(12)), "from byte 4"),
        (packed({"x": entry()}, bytes(5)), "5 bytes of data"),
        (packed({"x": entry()}, bytes(4))[:-1], "a range inside"),
        (packed({"x": entry()}, b"\xff" * 4), "tensor x: values that are not finite"),
    ],
)
def test_damaged_files_are_refused(data, message):
    with pytest.raises(TactileError, match=message) as caught:
        weights.from_safetensors(data, "net.safetensors")
    assert "net.safetensors" in str(caught.value)


def write(tmp_path, tensors=TENSORS):
    """A weights file, its hash and its shapes."""
    data = weights.to_safetensors(tensors)
    weights.write_bytes(tmp_path / "net.safetensors", data)
    return weights.sha256(data), {name: array.shape for name, array in tensors.items()}


def test_verified_file_is_read(tmp_path):
    digest, shapes = write(tmp_path)
    assert weights.read_verified(tmp_path / "net.safetensors", digest, shapes).keys() == shapes.keys()


@pytest.mark.parametrize("place", [3, 20, -1])  # length, header, data
def test_flipped_byte_names_file_and_hashes(tmp_path, place):
    digest, shapes = write(tmp_path)
    path = tmp_path / "net.safetensors"
    data = bytearray(path.read_bytes())
    data[place] ^= 1
    path.write_bytes(data)
    with pytest.raises(TactileError) as caught:
        weights.read_verified(path, digest, shapes)
    message = str(caught.value)
    assert str(path) in message
    assert caught.value.advice
    if place != 20:  # in the header a flip may change a name, which says more than the hash
        assert digest in message
        assert weights.sha256(bytes(data)) in message


def test_other_shape_names_the_tensor(tmp_path):
    digest, shapes = write(tmp_path)
    write(tmp_path, TENSORS | {"b": np.zeros((3, 3), np.float32)})
    with pytest.raises(TactileError, match=r"tensor b: shape \(3, 3\); expected shape \(2, 3\)"):
        weights.read_verified(tmp_path / "net.safetensors", digest, shapes)


def test_missing_and_unknown_tensors_are_named(tmp_path):
    digest, shapes = write(tmp_path)
    with pytest.raises(TactileError, match="tensor more: nothing"):
        weights.read_verified(tmp_path / "net.safetensors", digest, shapes | {"more": (1,)})
    shapes.pop("a")
    with pytest.raises(TactileError, match="no such tensor"):
        weights.read_verified(tmp_path / "net.safetensors", digest, shapes)


def test_missing_file(tmp_path):
    with pytest.raises(TactileError, match="cannot be read"):
        weights.read_verified(tmp_path / "net.safetensors", "", {})


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "net"
    weights.write_bytes(path, b"old")
    with pytest.raises(TypeError):
        weights.write_bytes(path, "text")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(TactileError, match="cannot be written"):
        weights.write_bytes(path / "net", b"")


@pytest.mark.parametrize(("text", "message"), [("", "not JSON"), ("[]", "format"), ('{"format": "other"}', "'other'")])
def test_wrong_cards(tmp_path, text, message):
    (tmp_path / weights.CARD_NAME).write_text(text)
    with pytest.raises(TactileError, match=message):
        weights.read_card(tmp_path)


def test_card_round_trip(tmp_path):
    card = {"format": weights.CARD_FORMAT, "polarity": "falls", "x": [1, 2.5, None]}
    weights.write_bytes(tmp_path / weights.CARD_NAME, weights.card_bytes(card))
    assert weights.read_card(tmp_path) == (card, weights.sha256(weights.card_bytes(card)))
    with pytest.raises(ValueError, match="Out of range"):
        weights.card_bytes({"x": float("nan")})
