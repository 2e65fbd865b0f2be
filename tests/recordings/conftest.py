"""A made-up press in the style of a BioTac, and files that hold it."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import SLIDE_HEADER

VECTORS = [f"{word}_{axis}" for word in ("position", "force") for axis in "xyz"]
# Counts of a simulated contact at full press: raw ones, which fall where the film thins.
CONTACT = np.array([
    253.0, 106.0, 118.0, 256.0, 115.0, 204.0, 78.0, 37.0, -6.0, -18.0,
    116.0, -20.0, -38.0, 276.0, -70.0, 209.0, -115.0, -300.0, -156.0,
])  # fmt: skip
HEADER_31 = ["time", *VECTORS, "pac0", "pac1", "pdc", "tac", "tdc", *(f"electrodes{i}" for i in range(19))]


def make_press(frames: int = 700, seed: int = 0, slope: float = 0.2, rise: float = 0.1) -> SimpleNamespace:
    """Rest, a press that is held and trembles, rest again: raw whole counts with drift and noise of 1.2 counts.

    frames at 100 Hz; slope: drift in counts/s; rise: s from rest to full press, down to -300 counts.
    """
    random = np.random.default_rng(seed)
    time = np.arange(frames) / 100.0
    up, down = 0.25 * time[-1], 0.75 * time[-1]
    ramp = np.clip((time - up) / rise, 0, 1) * np.clip((down - time) / rise, 0, 1)
    strength = ramp**2 * (3 - 2 * ramp) * (1 + 0.15 * np.sin(2 * np.pi * 3 * time))
    rest = np.linspace(3150, 3550, 19)
    drift = slope * np.linspace(0.5, 1, 19)
    change = strength[:, None] * CONTACT
    electrodes = np.rint(rest + drift * time[:, None] + change + random.normal(0, 1.2, (frames, 19)))
    pdc = np.rint(1500 + 200 * strength + random.normal(0, 0.7, frames))
    return SimpleNamespace(
        time=time, electrodes=electrodes, change=change, rest=rest, drift=drift, pdc=pdc, contact=strength > 0,
        tac=np.full(frames, 2000.0), tdc=2100 + np.arange(frames) % 3,
    )  # fmt: skip


def slide_rows(press: SimpleNamespace, start: float = 1.58e9) -> list[str]:
    """Lines of the slide layout, header first, each data row closed by a comma."""
    lines = [",".join(SLIDE_HEADER)]
    for i, stamp in enumerate(press.time):
        cells = [press.tdc[i], press.tac[i], press.pdc[i], *([2000] * 22), *press.electrodes[i]]
        lines.append(f"{start + stamp:.9f}," + ",".join(f"{cell:g}" for cell in cells) + ",")
    return lines


def rows_31(press: SimpleNamespace) -> list[str]:
    lines = [",".join(HEADER_31)]
    for i, stamp in enumerate(press.time):
        slow = press.pdc[i], press.tac[i], press.tdc[i]
        cells = [stamp, 1, 2, 3, 0.1, 0.2, 0.3, 2000, 2001, *slow, *press.electrodes[i]]
        lines.append(",".join(f"{cell:g}" for cell in cells))
    return lines


@pytest.fixture
def press() -> SimpleNamespace:
    return make_press()


@pytest.fixture
def make():
    return make_press


@pytest.fixture
def slide_lines(press: SimpleNamespace) -> list[str]:
    return slide_rows(press)


@pytest.fixture
def write(tmp_path: Path):
    """write(lines) -> path of a text file with these lines, each ended by a newline."""

    def write_lines(lines: list[str], name: str = "touch.csv", end: str = "\n") -> str:
        path = tmp_path / name
        path.write_bytes(("\n".join(lines) + end).encode())
        return str(path)

    return write_lines


def write_container(layout: str, folder: Path, press: SimpleNamespace) -> Path:
    """The press in one of the known layouts."""
    import h5py

    from tactile_core import recordings

    path = folder / f"{layout}.dat"  # the name tells nothing: layouts are said from the content
    count = len(press.time)
    if layout == "csv_slide":
        path.write_text("\n".join(slide_rows(press)) + "\n")
    elif layout == "csv_31":
        path.write_text("\n".join(rows_31(press)) + "\n")
    elif layout == "npz_electrodes":
        with open(path, "wb") as file:
            np.savez(file, electrodes=press.electrodes, time=press.time, pdc=press.pdc, pac=np.zeros((count, 22)))
    elif layout == "hdf5_electrode_vals":
        with h5py.File(path, "w") as file:
            file["electrode_vals/data"] = press.electrodes
            file["contact_loc/data"] = np.ones((count, 3))
            file["force_vec/data"] = np.zeros((count, 3))
            file["indenter_type/data"] = np.full((count, 1), 2.0)
    elif layout == "hdf5_simulated":
        recordings.write_simulated(path, **simulated_arrays(press))
    elif layout == "bag_biotac_all":
        pytest.importorskip("rosbags", reason="rosbags is absent: pip install tactile-core[ros]")
        from bags import write_bag

        write_bag(path, press, "ros1", "all")
    elif layout == "bag_biotac_hand":
        pytest.importorskip("rosbags", reason="rosbags is absent: pip install tactile-core[ros]")
        from bags import write_bag

        write_bag(path, press, "mcap", "hand")
    elif layout == "mat_phac":
        scipy_io = pytest.importorskip("scipy.io", reason="scipy is absent: pip install tactile-core[matlab]")
        fingers = {"F0Electrodes": press.electrodes.T, "F0pdc": press.pdc[None], "F1Electrodes": press.electrodes.T + 1}
        scipy_io.savemat(path, fingers, appendmat=False)
    else:
        raise ValueError(layout)
    return path


def simulated_arrays(press: SimpleNamespace) -> dict:
    from tactile_core.recordings import Truth

    count = len(press.time)
    random = np.random.default_rng(1)
    center = np.where(press.contact[:, None], 0.001, np.nan) * np.ones((count, 2))
    truth = Truth(
        random.uniform(-2e-3, 2e-3, (count, 12, 3)).astype(np.float32),
        random.uniform(-1e-3, 1e-3, (count, 9, 3)),
        np.tile([0.0, 1.0, 0.0], (count, 1)),
        center,
    )
    held = {name: getattr(press, name) for name in ("time", "electrodes", "pdc", "tac", "tdc")}
    about = {"scene": "title = 'a press'\n", "seed": 7, "made_by": "test", "note": "a made-up press", "start_time": 0.0}
    return held | about | {"truth": truth}


@pytest.fixture
def in_layout(tmp_path: Path):
    return lambda layout, press: str(write_container(layout, tmp_path, press))


@pytest.fixture
def simulated():
    return simulated_arrays
