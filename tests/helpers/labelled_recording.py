"""A labelled recording of a made-up sensor, in the layout of Narang et al., from contacts of the test set."""

from pathlib import Path

import numpy as np

from tactile_core.sensors import unrolling
from tactile_core.simulation.pairs_file import read_pairs

PAIRS = Path(__file__).resolve().parents[2] / "scenes" / "training" / "test_contacts.h5"
HELD, PAUSE = 6, 4  # frames a contact is held, and without contact before it
BALANCED = 200  # presses from here on are of box and ring alone, in a part of the pad
MM = 1e3


def labelled_arrays() -> dict[str, np.ndarray]:
    """Readings of a sensor whose gains differ by 40 %, with places (mm, SynTouch's frame) and forces."""
    pairs = read_pairs(PAIRS)
    pairs = pairs.select_rows(np.flatnonzero(pairs.press < BALANCED))
    random = np.random.default_rng(5)
    gain = np.exp(0.4 * random.standard_normal(19))
    skin = np.array([unrolling.roll_up(center)[0] for center in pairs.contact_center])
    place = np.column_stack([-MM * skin[:, 0] - 13.97, MM * skin[:, 2], MM * skin[:, 1]])
    held = np.r_[np.zeros(PAUSE), np.ones(HELD)]
    frames = len(pairs.press) * len(held)
    change = (held[None, :, None] * (gain * pairs.signal)[:, None]).reshape(frames, 19)
    return {
        "electrode_vals": np.round(3300 + change + 1.5 * random.standard_normal(change.shape)),
        "contact_loc": np.repeat(place, len(held), 0),
        "force_vec": (held[None, :, None] * pairs.force[:, None]).reshape(frames, 3),
    }


def write_labelled(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    """Write them as ``<name>/data`` of an HDF5 file; returns its path."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[f"{name}/data"] = values
    return path
