"""A long recording, prepared part by part, gives the signals that `convert` prepares of the whole."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import write_counts

from tactile_core import recordings
from tactile_core.jobs import prepared_signals
from tactile_core.jobs.engine import inputs
from tactile_core.jobs.engine import job as jobs
from tactile_core.recordings import PrepareOptions, chunks, polarity
from tactile_core.recordings.electrode_gains import ElectrodeGains, units_file
from tactile_core.recordings.flags import Flag


@pytest.fixture
def write(tmp_path):
    """write(sign) -> a CSV of 20 s: rest, a contact from 5 s on, held to the end; sign -1: rest minus reading."""

    def make(sign):
        contact = polarity.contact_signals()[7]
        strength = np.clip((np.arange(2000) - 500) / 300, 0, 1)
        noise = np.random.default_rng(0).normal(0, 1, (2000, 19))
        electrodes = np.rint(3300 + sign * strength[:, None] * contact + noise)
        path = tmp_path / "long.csv"
        write_counts(path, electrodes, pdc=1000 + np.rint(100 * strength))
        return path

    return make


def prepared(path, **words):
    """Change (T, 19), PDC (T,) and flags (T,) of all parts, how many there were, and their films."""
    recipe = jobs.Translate(["latent"], "0" * 64, prepare=jobs.Prepare(**words))
    parts = list(prepared_signals._signals(str(path), SimpleNamespace(recipe=recipe)))
    arrays = [
        np.concatenate([getattr(signals, name)[repeated:] for _, signals, repeated in parts])
        for name in ("change", "pdc", "flags")
    ]
    return *arrays, len(parts), {signals.film for _, signals, _ in parts}


@pytest.mark.parametrize("words", [{}, {"polarity": "falls"}])
@pytest.mark.parametrize("sign", [1, -1])
def test_parts_have_one_rest_one_pressure_and_one_polarity(sign, words, write, monkeypatch):
    path = write(sign)
    monkeypatch.setattr(chunks, "TEXT_BYTES", path.stat().st_size // 5)
    change, pdc, flags, count, films = prepared(path, **words)
    whole = recordings.prepare(recordings.read(path), PrepareOptions(**words))
    assert count > 3 and len(change) == 2000
    np.testing.assert_allclose(change, whole.change, atol=2)  # of rest, by the quiet frames of the first part alone
    np.testing.assert_allclose(pdc, whole.pdc, atol=1)
    assert films == {whole.film}
    doubts = Flag.POLARITY_ASSUMED | Flag.POLARITY_DOUBTED
    assert len(np.unique(flags & doubts)) == 1
    if not words:  # the first part holds no contact: a later one shows the polarity
        assert not (flags & doubts).any() and change[-1] @ (sign * whole.electrodes[-1] - sign * 3300) > 0


def test_shards_know_the_unit_s_film_and_stiffness(write, tmp_path):
    unit = ElectrodeGains("made up", [1.0] * 19, [0.0] * 19, [3300.0] * 19, film=0.5, stiffness=2.0)
    recipe = jobs.Translate(["latent"], "0" * 64, sensor=units_file({"unit": unit}))
    job = jobs.make(inputs.hashed([Path(write(1))], lambda done, total: None), recipe, None)
    (tmp_path / "job" / jobs.PREPARED).mkdir(parents=True)
    prepared_signals.make(tmp_path / "job", job, 0)
    held = prepared_signals.Prepared(jobs.prepared_file(tmp_path / "job", job.inputs[0].name))
    signals = held.read(np.arange(1000, 1010))[1]
    assert (signals.film, signals.stiffness) == (0.5, 2.0)
