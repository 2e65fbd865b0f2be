"""The cache of compliance matrices: damage is repaired, a folder that cannot be written is said before the work."""

import pathlib
import threading
import time

import numpy as np
import pytest
from slab import slab_mesh

from tactile_core.errors import TactileError
from tactile_core.files import array_cache, lock
from tactile_core.mechanics.fast import compliance
from tactile_core.mechanics.fast.compliance_rows import ComplianceRows
from tactile_core.sensors import Material


@pytest.fixture
def tiny(tmp_path, monkeypatch):
    """Load the compliance of a small block through the cache in a folder of its own."""
    monkeypatch.setenv("TACTILE_CACHE", str(tmp_path / "cache"))
    x = np.linspace(-2e-3, 2e-3, 5)
    mesh, lattice = slab_mesh(x, x, np.linspace(0, -1e-3, 3))
    touchable = np.arange(len(lattice.rest))

    def load(youngs=1e6):
        return compliance._cached(compliance.Solid("tiny", lattice, touchable, mesh, Material(youngs, 0.45)))

    return load


def test_second_load_reads_the_first_ones_files(tiny, tmp_path, monkeypatch):
    first = np.array(tiny().move)
    monkeypatch.setattr(compliance, "condensed", lambda *arguments: pytest.fail("built again"))
    np.testing.assert_array_equal(tiny().move, first)


def test_softer_material_has_matrices_of_its_own(tiny):
    np.testing.assert_allclose(tiny(0.5e6).move, 2 * np.array(tiny().move), atol=1e-7)  # single precision of 0.03


def cut(file):
    file.write_bytes(file.read_bytes()[:100])


def scaled_in_part(file):
    values = np.load(file)
    values[: len(values) // 2] *= 1.1
    np.save(file, values)


@pytest.mark.parametrize("spoil", [cut, scaled_in_part, pathlib.Path.unlink])
@pytest.mark.parametrize("name", compliance.ARRAYS)
def test_a_damaged_file_is_built_again_and_told(tiny, tmp_path, caplog, spoil, name):
    first = np.array(tiny().move)
    (file,) = (tmp_path / "cache").glob(f"*/{name}.npy")
    whole = file.read_bytes()
    if spoil is scaled_in_part and not np.load(file).any():
        pytest.skip("nothing in it to scale: a solid without fluid")
    spoil(file)
    np.testing.assert_array_equal(tiny().move, first)
    assert file.read_bytes() == whole
    assert name in caplog.text and "built again" in caplog.text


def test_an_entry_without_hashes_is_not_trusted(tiny, tmp_path, monkeypatch):
    tiny()
    next((tmp_path / "cache").glob(f"*/{array_cache.HASHES}")).unlink()
    monkeypatch.setattr(compliance, "condensed", lambda *arguments: pytest.fail("built again"))
    with pytest.raises(pytest.fail.Exception):
        tiny()


def test_two_that_ask_at_once_build_once(tiny, monkeypatch):
    """Two threads: their locks are of two open files, as two processes' are."""
    built, real = [], compliance.condensed

    def slow(*arguments):
        built.append(1)
        second.start()
        while not waiting:
            time.sleep(0.001)
        return real(*arguments)

    waiting, real_wait = [], lock._wait
    monkeypatch.setattr(lock, "_wait", lambda descriptor: (waiting.append(1) if built else None, real_wait(descriptor)))
    monkeypatch.setattr(compliance, "condensed", slow)
    second = threading.Thread(target=tiny)
    tiny()
    second.join()
    assert len(built) == 1


def test_a_cache_that_cannot_be_written_is_told_before_the_work(tiny, tmp_path, monkeypatch):
    (tmp_path / "cache").write_text("a file in the way")
    monkeypatch.setattr(compliance, "condensed", lambda *arguments: pytest.fail("worked first"))
    with pytest.raises(TactileError, match="TACTILE_CACHE"):
        tiny()


def test_too_little_memory_is_told_in_words(tiny, monkeypatch):
    def full(*arguments):
        raise MemoryError

    monkeypatch.setattr(compliance, "condense", full)
    with pytest.raises(TactileError, match="memory"):
        tiny()


def test_a_full_disk_is_told_and_leaves_nothing_half_written(tiny, tmp_path, monkeypatch):
    def no_room(*arguments, **named):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "save", no_room)
    with pytest.raises(TactileError, match="No space left"):
        tiny()
    assert not list((tmp_path / "cache").rglob("*.npy"))


def test_response_between_two_nodes_is_mutual(tiny):
    """Maxwell and Betti, on the mirror plane too."""
    block = ComplianceRows(tiny(), np.arange(25)).block(np.arange(25))
    np.testing.assert_array_equal(block, block.T)
