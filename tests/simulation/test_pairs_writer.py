"""A card counts what is in a file of pairs."""

import hashlib
import json

import numpy as np
import pytest

from tactile_core.simulation.pairs_writer import card, card_path

h5py = pytest.importorskip("h5py", reason="pairs files need h5py")


def test_a_card_counts_every_contact_once(tmp_path):
    path, random, count = tmp_path / "pairs.h5", np.random.default_rng(0), 50
    press = np.sort(random.integers(0, 9, count))
    columns = {
        "force": random.uniform(0, 3, (count, 3)), "place": random.uniform(0, 4e-3, (count, 4)),
        "slide": np.where(np.arange(count)[:, None] < 7, 1e-4, 0.0) * np.ones(2), "press": press,
        "indenter": random.integers(0, 2, count), "depth_biotac": random.uniform(0, 3e-3, count),
        "depth_digit": random.uniform(0, 2e-3, count), "beyond_digit": np.arange(count) < 3,
    }  # fmt: skip
    with h5py.File(path, "w") as file:
        said = {"scene": "text", "seed": 4, "version": "0", "electrodes": "sheet"}
        file.attrs.update(said | {"indenters": json.dumps(["ball", "box"])})
        for name, values in columns.items():
            file[name] = values
    made = card(path)
    assert made["contacts"] == count and made["presses"] == len(np.unique(press))
    assert made["contacts_by_indenter"]["box"] == (columns["indenter"] == 1).sum()
    assert made["contacts_sliding"] == 7 and made["contacts_beyond_digit"] == 3
    for name in ("depth_biotac_mm", "depth_digit_mm", "force_n", "tilt_deg"):
        assert sum(made[name]["counts"]) == count  # depths beyond 2.4 mm count in the last bin
    assert np.sum(made["place_mm"]["counts"]) == count
    assert made["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert json.loads(json.dumps(made)) == made and card_path(path).name == "pairs.h5.card.json"
