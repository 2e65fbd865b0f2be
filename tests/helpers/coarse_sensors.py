"""Sensors of the package with nodes farther apart: their matrices, which do not ship, take seconds and not a minute."""

import shutil
from pathlib import Path

SENSORS = Path(__file__).resolve().parents[2] / "tactile_core" / "sensors"
MINI, SP = "coarse_mini", "coarse_sp"
ROWS = {"tip_rows": (18, 8), "trunk_rows": (28, 14), "base_rows": (12, 6), "pad_intervals": (40, 20),
        "back_intervals": (24, 12)}  # fmt: skip


def copy_mini(folder: Path) -> None:
    """Copy the GelSight Mini into a folder of one's own sensors, nodes 1 mm apart."""
    shutil.copytree(SENSORS / "gelsight_mini", folder / MINI)
    _change(folder / MINI / "sensor.toml", "window_nodes = [45, 57]", "window_nodes = [15, 19]")
    _change(folder / MINI / "sensor.toml", '"GelSight Mini"', '"Coarse Mini"')
    _change(folder / MINI / "default.toml", 'sensor = "gelsight_mini"', f'sensor = "{MINI}"')


def copy_sp(folder: Path, table: bytes) -> None:
    """Copy the BioTac SP likewise, with half of the nodes each way and a table of its electrodes."""
    shutil.copytree(SENSORS / "biotac_sp", folder / SP)
    (folder / SP / "locations.csv").write_bytes(table)
    for name, (usual, coarse) in ROWS.items():
        _change(folder / SP / "sensor.toml", f"{name} = {usual}\n", f"{name} = {coarse}\n")


def _change(file: Path, old: str, new: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
