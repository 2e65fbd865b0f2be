"""A disk that fills while an HDF5 file is written gives its own error, early or at the very end."""

import os

import h5py
import numpy as np
import pytest

from tactile_core.files.hdf5_writer import new_hdf5

resource = pytest.importorskip("resource")  # Windows has no limit on the size of a process's files


@pytest.fixture
def small_disk():
    """No file may grow beyond 20 kB; Python ignores the signal, so writing gives OSError, as a full disk does."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("count", [1000, 10**6])  # held back until the file is closed, and not
def test_a_full_disk_is_the_error_that_is_raised(count, tmp_path, small_disk):
    with pytest.raises(OSError, match="File too large") as raised, new_hdf5(tmp_path / "a.h5", {}) as (file, _):
        file.create_dataset("x", data=np.random.default_rng(0).random((count, 8)), chunks=(count, 8))
    assert raised.value.filename == os.fspath(tmp_path / "a.h5")


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_what_the_block_raises_is_not_hidden_by_a_close_that_fails(error, tmp_path, monkeypatch):
    close = h5py.File.close

    def failing(file):
        close(file)
        raise RuntimeError("closed badly")

    monkeypatch.setattr(h5py.File, "close", failing)
    with pytest.raises(error), new_hdf5(tmp_path / "a.h5", {"format": "b"}):
        raise error
