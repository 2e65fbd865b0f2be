"""A small data set: two objects in six sessions, made of the shipped recording with noise, and its recipe."""

from pathlib import Path

import numpy as np
import pytest
from conftest import SHIPPED

from tactile_core import recordings

OBJECTS = {"ball": slice(30, 70), "rolled": slice(110, 150)}  # a press, and a roll beside it
SESSIONS = 6
RECIPE = """\
format = "tactile-dataset-1"
files = ["{object}_{session}.npz"]
tasks = ["object"]
every = 10
notes = ["Simulated."]

[source]
title = "Two <objects>"

[prepare]
polarity = "falls"

[unit]
found = "rest"
rest = "rest.npz"

[split]
by = "session"
test = ["4", "5"]
"""


def write_recordings(folder: Path) -> None:
    """Write a recording of the untouched finger, and of each object in each session: 20 frames at rest, a touch."""
    electrodes = np.asarray(recordings.read(SHIPPED).electrodes)
    rng = np.random.default_rng(0)
    still = np.rint(electrodes[:1] + rng.normal(0, 1.5, (60, electrodes.shape[1])))
    np.savez(folder / "rest.npz", electrodes=still, time=np.arange(60) / 100)
    for name, part in OBJECTS.items():
        for session in range(SESSIONS):
            counts = np.concatenate([np.repeat(electrodes[:1], 20, axis=0), electrodes[part]])
            counts = np.rint(counts + rng.normal(0, 1.5, counts.shape))
            np.savez(folder / f"{name}_{session}.npz", electrodes=counts, time=np.arange(len(counts)) / 100)


@pytest.fixture(scope="session")
def recipe(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("recipe") / "two.toml"
    file.write_text(RECIPE)
    return file


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    place = tmp_path_factory.mktemp("recordings")
    write_recordings(place)
    (place / "notes.txt").write_text("not a recording")
    return place
