"""Training on pairs of another sensor: as many electrodes as its descriptor says, its name in the card."""

import shutil

import numpy as np
import pytest
from small_pairs import SHAPES, SMALL, bodies, frame, write_pairs

torch = pytest.importorskip("torch", reason="training needs torch")
h5py = pytest.importorskip("h5py")

from tactile_core import sensors  # noqa: E402
from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.sensors import descriptor  # noqa: E402
from tactile_core.simulation.pairs_file import read_pairs  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.train import train  # noqa: E402
from tactile_core.translation import networks, reference_signals  # noqa: E402

NAME, COUNT = "finger_of_17", 17


@pytest.fixture
def pairs(tmp_path, monkeypatch):
    """Pairs of a BioTac without its last two electrodes, and a DIGIT."""
    own = tmp_path / "own" / NAME
    shutil.copytree(descriptor.FOLDER / "biotac", own, ignore=shutil.ignore_patterns("*.py*"))
    text = (own / "sensor.toml").read_text(encoding="utf-8")
    (own / "sensor.toml").write_text(text.replace("count = 19", f"count = {COUNT}"), encoding="utf-8")
    table = (own / "electrodes.csv").read_text(encoding="utf-8").splitlines()
    kept = [line for line in table if not line.startswith(("E18,", "E19,"))]
    assert len(table) - len(kept) == 2
    (own / "electrodes.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")
    monkeypatch.setenv(descriptor.OWN, str(tmp_path / "own"))
    path = write_pairs(tmp_path / "pairs.h5", presses=20)
    with h5py.File(path, "a") as file:
        for name in ("displacement", "depth"):
            file.move(f"{name}_biotac", f"{name}_{NAME}")
        file.attrs[f"{NAME}_nodes_sha256"] = file.attrs.pop("biotac_nodes_sha256")
        signal = file["signal"][()]
        del file["signal"]
        file["signal"] = signal[:, :COUNT]
    return path


def test_networks_are_as_wide_as_the_sensor_has_electrodes(pairs, tmp_path, monkeypatch):
    monkeypatch.setattr("tactile_core.training.train.draw_losses", lambda path, history: None)  # test_train has it
    read = read_pairs(pairs)
    assert read.pair == (NAME, "digit") and read.signal.shape[1] == COUNT == sensors.electrode_count(NAME)
    out = tmp_path / "out"
    card = train(
        pairs, out, 0, Options(**SMALL, effort=0.02), bodies=bodies(),
        frame=lambda sensor, half: frame("biotac" if sensor == NAME else sensor, half),
    )  # fmt: skip
    assert f"{NAME}_nodes_sha256" in card and "biotac_nodes_sha256" not in card
    assert "rest_counts" not in card  # the sensor's own table has them
    nets = networks.load(out / "weights")
    assert nets.source == NAME and nets.electrodes == COUNT
    latent = nets.encode_signal(np.zeros((3, COUNT), np.float32))
    biotac, _ = nets.likely_latents(latent)
    assert nets.decode_source(biotac).shape == (3, np.prod(SHAPES["biotac"]), 3)
    assert reference_signals.read(out / "weights").typical.shape[1] == COUNT
    with pytest.raises(TactileError, match=r"encode_signal: array of shape \(3, 19\); expected \(T, 17\)"):
        nets.encode_signal(np.zeros((3, 19), np.float32))


def test_signals_of_another_number_are_refused(pairs):
    with h5py.File(pairs, "a") as file:
        signal = file["signal"][()]
        del file["signal"]
        file["signal"] = np.concatenate([signal, signal[:, :1]], axis=1)
    with pytest.raises(TactileError, match=rf"signal: shape .*18\); expected \(C, {COUNT}\)"):
        read_pairs(pairs)
