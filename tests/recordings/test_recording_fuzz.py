"""Whatever the bytes, reading ends in a Recording or in a TactileError."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings.info import describe

FEW = settings(
    max_examples=150,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
SPICE = [
    "",
    "x",
    "nan",
    "-inf",
    "1e308",
    "-1",
    "4096",
    "0",
    ",",
    ",,",
    "\n",
    "\r",
    '"',
    ";",
    "\ufeff",
    "\0",
    "é",
    "1e18",
    "99999",
]


def survives(path, content):
    path.write_bytes(content)
    try:
        text = describe(path)
    except TactileError:
        return
    recording = recordings.read(path)
    signals = recordings.prepare(recording)
    assert len(signals.change) == len(recording) and np.isfinite(signals.change).all() and text


@FEW
@given(
    start=st.sampled_from([b"", b"PK\x03\x04", b"\x89HDF\r\n\x1a\n", b"timestamp,tdc,"]), rest=st.binary(max_size=400)
)
def test_random_bytes(start, rest, tmp_path):
    survives(tmp_path / "thing", start + rest)


@FEW
@given(
    edits=st.lists(
        st.tuples(st.integers(0, 10**6), st.integers(0, 40), st.sampled_from(SPICE)), min_size=1, max_size=6
    ),
    rows=st.integers(1, 60),
)
def test_mutated_csv(edits, rows, slide_lines, tmp_path):
    text = "\n".join(slide_lines[: rows + 1]) + "\n"
    for place, cut, spice in edits:
        place %= len(text) + 1
        text = text[:place] + spice + text[place + cut :]
    survives(tmp_path / "thing.csv", text.encode())


@FEW
@given(
    cells=st.lists(st.tuples(st.integers(1, 60), st.integers(0, 44), st.sampled_from(SPICE)), min_size=1, max_size=20)
)
def test_mutated_cells(cells, slide_lines, tmp_path):
    table = [line.split(",") for line in slide_lines[:61]]
    for row, column, spice in cells:
        table[row][column] = spice
    survives(tmp_path / "thing.csv", "\n".join(",".join(row) for row in table).encode())


@pytest.mark.parametrize("layout", ["npz_electrodes", "hdf5_electrode_vals", "hdf5_simulated"])
@settings(FEW, max_examples=60)
@given(
    flips=st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=8),
    keep=st.floats(0.05, 1),
)
def test_damaged_containers(layout, flips, keep, make, in_layout, tmp_path):
    from pathlib import Path

    data = bytearray(Path(in_layout(layout, make(frames=60))).read_bytes())
    for place, value in flips:
        data[place % min(len(data), 3000)] = value  # headers lie at the start
    survives(tmp_path / "thing", bytes(data[: max(1, int(keep * len(data)))] if flips[0][1] % 2 else data))
