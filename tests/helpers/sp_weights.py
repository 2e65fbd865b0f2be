"""Weights and a table of electrodes for a BioTac SP, to try the ways of a second sensor: they translate nothing real.

The networks are those that ship, deaf to the electrodes beyond the nineteenth; places lie on a line under the pad.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import shutil
from pathlib import Path

import numpy as np

SP, FEWER, COUNT = "biotac_sp", 19, 24


def write_places(folder: Path) -> None:
    """Write ``locations.csv`` of the SP as the add-on looks for it: FOLDER/biotac_sp/."""
    (folder / SP).mkdir()
    rows = [f"E{k + 1},{x:.2f},0,-5,3000" for k, x in enumerate(np.linspace(-6, 6, COUNT))]
    text = "\n".join(["name,x_mm,y_mm,z_mm,rest_counts", *rows, "X1,0,0,-4,"]) + "\n"
    (folder / SP / "locations.csv").write_text(text, encoding="utf-8")


def write_weights(folder: Path, package: str) -> None:
    """Write the networks with more inputs; the surfaces of both fingers have equally many nodes.

    package : ``tactile_core`` as the extension under test has it, which a real Blender finds nowhere else
    """
    names = ("sensors", "translation.networks", "translation.weights")
    sensors, networks, weights = (importlib.import_module(f"{package}.{name}") for name in names)
    shutil.copytree(networks.WEIGHTS_FOLDER, folder)
    card = json.loads((folder / "card.json").read_text(encoding="utf-8"))
    card[f"{SP}_nodes_sha256"] = sensors.sensor_surface(SP).sha256
    del card["biotac_nodes_sha256"]
    entries = {**card["nets"], "signals": card["signals"]}
    for name in ("SVB", "pressure", "signals"):
        file = folder / f"{name}.safetensors"
        wider = {key: _wider(key, values) for key, values in weights.from_safetensors(file.read_bytes(), file).items()}
        file.write_bytes(weights.to_safetensors(wider))
        entries[name]["sha256"] = hashlib.sha256(file.read_bytes()).hexdigest()
        sizes = entries[name].get("sizes", {})
        sizes |= {"inputs": COUNT} if sizes.get("inputs") == FEWER else {}
    (folder / "card.json").write_text(json.dumps(card), encoding="utf-8")


def _wider(key: str, values: np.ndarray) -> np.ndarray:
    """Widen a tensor where it has a row or a column an electrode; a rectified signal's mark stays the last input."""
    before_mark = key == "encoder.0.weight"
    for axis, size in enumerate(values.shape):
        if size == FEWER or (before_mark and size == FEWER + 1):
            fill = 1.0 if key == "distance.residual" else 0.0
            values = np.insert(values, [FEWER] * (COUNT - FEWER), np.float32(fill), axis=axis)
    return values
