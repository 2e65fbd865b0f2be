"""Random contacts that the reference tier has solved once, as truth for the cheaper tiers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tactile_core.files import atomic
from tactile_core.simulation.pairs_file import SCALE, quantise

from .contact_tiers import drawn
from .random_contacts import RandomContact


@dataclass(frozen=True)
class Truth:
    """A contact in the reference tier, from rest and without friction.

    number, contact : of the random contacts of the file's seed; share : depth over the thickness
    displacement : (n, 3) m; force : N; seconds : CPU, that it took
    """

    number: int
    contact: RandomContact
    share: float
    displacement: np.ndarray
    force: float
    seconds: float


def write_truth(file: Path, found: dict[str, Sequence[dict[str, np.ndarray]]], seed: int) -> None:
    """Contacts by sensor, each with number, share, displacement m, force N and seconds, as one file."""
    arrays = {"seed": np.int64(seed)}
    for sensor, contacts in found.items():
        for name in ("number", "share", "force", "seconds"):
            arrays[f"{sensor}_{name}"] = np.array([each[name] for each in contacts])
        arrays[f"{sensor}_displacement"] = quantise(np.array([each["displacement"] for each in contacts]))
    with atomic.new_file(file) as partial, open(partial, "wb") as content:
        np.savez_compressed(content, **arrays)


def read_truth(file: Path, sensor: str) -> list[Truth]:
    """The contacts on one sensor."""
    with np.load(file, allow_pickle=False) as arrays:
        columns = {name: arrays[f"{sensor}_{name}"] for name in ("number", "share", "displacement", "force", "seconds")}
        contacts = drawn(int(columns["number"].max()) + 1, int(arrays["seed"]))
    return [
        Truth(int(number), contacts[number], float(share), moved * SCALE, float(force), float(seconds))
        for number, share, moved, force, seconds in zip(*columns.values(), strict=True)
    ]
