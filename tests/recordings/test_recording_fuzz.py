"""Whatever the bytes, reading ends in a Recording or in a TactileError."""

import numpy as np
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
