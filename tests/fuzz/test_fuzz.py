"""Whatever the bytes, a loader ends well or in a TactileError."""

import os
import random
import resource

import hostile
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

NAMES = [
    *("csv", "npz", "hdf5", "growing", "ros1", "mcap", "sqlite3", "metadata"),
    *("scene", "calibration", "photograph", "sensor", "gel", "dome", "list", "queue", "heights", "exr"),
    *("obj", "stl", "ply", "off"),
    *("safetensors", "weights_card", "job", "pairs", "prepared", "seal"),
]
FEW = settings(
    max_examples=int(os.environ.get("SPOILED", 40)),
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
GROWTH = 512  # MB that all these files together may add to the process: 100 times the largest good one


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return hostile.loaders(tmp_path_factory.mktemp("good"))


@pytest.mark.parametrize("name", NAMES)
@FEW
@given(seed=st.integers(0, 2**32 - 1))
def test_a_spoiled_file_is_refused_in_words(name, seed, table, tmp_path):
    if name not in table:
        pytest.skip("rosbags or OpenEXR is absent: pip install tactile-core[ros,render]")
    data, load = table[name]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    hostile.survives(tmp_path / "spoiled", hostile.spoil(data, random.Random(seed)), load)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < GROWTH * 1024


@pytest.mark.parametrize("name", NAMES)
def test_the_good_file_is_read(name, table, tmp_path):
    if name not in table:
        pytest.skip("rosbags or OpenEXR is absent: pip install tactile-core[ros,render]")
    data, load = table[name]
    path = tmp_path / "good"
    path.write_bytes(data)
    load(path)


def test_every_loader_is_here(table):
    assert set(table) | {"ros1", "mcap", "sqlite3", "metadata", "exr"} == set(NAMES)
