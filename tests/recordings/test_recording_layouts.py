"""Every layout gives the same Recording; a new layout is one more row here."""

import numpy as np
import pytest
from conftest import SLIDE_HEADER

from tactile_core import recordings
from tactile_core.errors import TactileError
from tactile_core.recordings.formats import csv_31

# layout, has a time of its own, channels besides the electrodes
LAYOUTS = [
    ("csv_slide", True, {"pdc", "tac", "tdc", "pac"}),
    ("csv_31", True, {"pdc", "tac", "tdc", "pac", "position", "force"}),
    ("npz_electrodes", True, {"pdc", "pac"}),
    ("hdf5_electrode_vals", False, {"position", "force"}),
    ("hdf5_simulated", True, {"pdc", "tac", "tdc"}),
    ("mat_phac", False, {"pdc"}),
    ("bag_biotac_all", True, {"pdc", "tac", "tdc", "pac"}),
    ("bag_biotac_hand", True, {"pdc", "tac", "tdc", "pac"}),
]


@pytest.mark.parametrize(("layout", "timed", "channels"), LAYOUTS)
def test_layout_is_told_from_the_content_and_read_whole(layout, timed, channels, press, in_layout):
    recording = recordings.read(in_layout(layout, press))
    np.testing.assert_array_equal(recording.electrodes, press.electrodes)
    held = {name for name in ("pdc", "tac", "tdc", "pac", "position", "force") if getattr(recording, name) is not None}
    assert held == channels
    assert (recording.warnings == ()) == timed
    assert not recording.flags.any() and recording.flags.dtype == np.uint16
    np.testing.assert_allclose(recording.time, press.time, atol=1e-6)  # unix stamps hold 2.4e-7 s in a float64
    assert recording.rate == pytest.approx(100, rel=1e-4)
    if "pdc" in channels:
        np.testing.assert_array_equal(recording.pdc, press.pdc)


@pytest.mark.parametrize("layout", [row[0] for row in LAYOUTS])
def test_one_frame_reads_and_prepares(layout, make, in_layout):
    one = make(frames=2)
    one = type(one)(
        **{key: value[:1] if np.ndim(value) and len(value) == 2 else value for key, value in vars(one).items()}
    )
    recording = recordings.read(in_layout(layout, one))
    assert len(recording) == 1 and recording.time.tolist() == [0.0] and recording.rate == 100
    assert recordings.prepare(recording).change.shape == (1, 19)


def test_every_layout_has_a_row_here():
    names = {layout.__name__.rsplit(".", 1)[1] for layout in recordings.layouts()}
    assert names == {row[0] for row in LAYOUTS if not row[0].startswith("bag_")} | {"csv_sp_slip", "csv_sp_grasps"}


@pytest.mark.parametrize(
    "header",
    [
        "object,slipped," + ",".join(f"{f}_biotac_{i}" for f in ("ff", "mf", "th") for i in range(1, 25)),
        ",".join([*SLIDE_HEADER, *(f"ele{i}" for i in range(20, 25))]),
        "time," + ",".join(f"electrodes{i}" for i in range(24)),
    ],
)
def test_a_biotac_sp_is_recognised_and_refused(header, write):
    path = write([header, ",".join("1" * (header.count(",") + 1))])
    with pytest.raises(TactileError, match="24 electrodes: a BioTac SP; expected the 19"):
        recordings.read(path)


@pytest.mark.parametrize("count", [24, 18])
def test_arrays_of_another_sensor_are_refused(count, tmp_path):
    np.savez(tmp_path / "a.npz", electrodes=np.zeros((5, count)))
    with pytest.raises(TactileError, match=f"electrodes: {count} electrodes"):
        recordings.read(tmp_path / "a.npz")


@pytest.mark.parametrize(
    "name", ["position.x", "position_x", "position0", "positionx", "position[0]", "field.wrench.position.x"]
)
def test_vector_columns_may_be_written_in_several_ways(name):
    assert csv_31.canonical([name]) == ["position_x"]


def test_ros_prefixes_are_cut_off():
    names = csv_31.canonical(["field.tactiles0.electrodes3", "field.tactiles0.pac1", "header.time"])
    assert names == ["electrodes3", "pac1", "time"]


def test_units_of_unix_stamps_are_told(slide_lines, write):
    cells = [line.split(",", 1) for line in slide_lines[1:]]
    nanoseconds = [slide_lines[0], *(f"{int(float(stamp) * 1e9)},{rest}" for stamp, rest in cells)]
    recording = recordings.read(write(nanoseconds))
    assert recording.rate == pytest.approx(100, rel=1e-3)  # stamps of 1.6e18 ns hold 256 ns in a float64
    assert recording.start_time == pytest.approx(1.58e9) and "nanoseconds" in recording.warnings[0]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace(",", ";"),
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.replace("timestamp", '"Timestamp"'),
        lambda text: text + "\n\n",
    ],
)
def test_dialects_of_csv_read_the_same(change, press, slide_lines, tmp_path):
    path = tmp_path / "dialect.csv"
    path.write_bytes(change("\n".join(slide_lines) + "\n").encode())
    recording = recordings.read(path)
    np.testing.assert_array_equal(recording.electrodes, press.electrodes)
    assert recording.warnings == ()
