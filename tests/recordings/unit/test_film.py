"""A unit's fluid film: found from its recording and taken off; made-up units, and real ones beside a force sensor."""

import dataclasses
import re

import numpy as np
import pytest

from tactile_core.cli.main import main
from tactile_core.recordings import PrepareOptions, electrode_gains, prepare
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.polarity import contact_signals
from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.rest_level import Baseline, Changes
from tactile_core.recordings.signals import Rest
from tactile_core.recordings.unit import film
from tactile_core.sensors import REST_COUNTS, contact_pressures_of, divider
from tactile_core.translation.translate import translate

SAID = r"second half ([\d.]+) N with this scale, ([\d.]+) N without, ([\d.]+) N of a constant"
CONTACTS, EACH = 60, 40  # different contacts of a made-up recording, and frames of each, at 10 Hz


def made_up(thickness, conductivity, seconds_of_drift=0.0, drift=0.0):
    """Changes (T, 19), rest (19,) and times (T,) of a unit whose film and fluid are so; the fluid may drift."""
    random = np.random.default_rng(0)
    typical = contact_signals()[random.permutation(len(contact_signals()))[:CONTACTS]] * np.exp(
        0.1 * random.standard_normal(19)
    )
    still = divider.film_impedance(REST_COUNTS)
    thinned = 1 - still / divider.film_impedance(REST_COUNTS + np.repeat(typical, EACH, axis=0))
    time = np.arange(len(thinned)) / 10
    now = conductivity * np.exp(drift * np.minimum(time / max(seconds_of_drift, 1e-9), 1))[:, None]
    rest = counts(still / thickness / conductivity)
    readings = counts(still / thickness / now / np.maximum(1 - thinned / thickness, 0.02))
    return readings - rest + 1.5 * random.standard_normal(readings.shape), rest, time


def counts(impedance):
    """Readings (..., 19) of impedances (..., 19) of the film, the inverse of `divider.film_impedance`."""
    series = 4095 / REST_COUNTS - 1 - divider.film_impedance(REST_COUNTS)
    return 4095 / (1 + series + impedance)


def found(change, rest, time, pressure=None, **options):
    here = Changes(len(change), change.__getitem__)
    level = Changes(len(change), Baseline.constant(rest).at)
    return film.find(here, level, time, pressure, "biotac", own_rest=True, **options)


@pytest.mark.parametrize(("thickness", "conductivity"), [(0.4, 1.0), (0.5, 0.9)])
def test_a_thin_film_is_found_by_rest_and_contacts(thickness, conductivity):
    one = found(*made_up(thickness, conductivity))
    assert one.thickness == pytest.approx(thickness, rel=0.3)  # two of the tried ones off, 1.15 apart
    assert not one.conductivity.any() and "different contacts" in one.evidence


@pytest.mark.parametrize("conductivity", [0.7, 1.0, 1.2])
def test_another_fluid_alone_is_no_other_film(conductivity):
    assert found(*made_up(1.0, conductivity)).thickness == 1.0


def test_a_body_softer_than_simulated_ones_shows_no_thick_film():
    simulated = contact_pressures_of("biotac")[np.random.default_rng(0).permutation(len(contact_signals()))[:CONTACTS]]
    assert found(*made_up(1.0, 1.2), pressure=2.5 * np.repeat(simulated, EACH)).thickness == 1.0


def test_drift_of_the_fluid_is_followed_through_contacts_and_a_steady_fluid_stays():
    one = found(*made_up(1.0, 1.0, seconds_of_drift=240, drift=0.2), thickness=1.0)
    assert one.conductivity[-4:] == pytest.approx(0.2, abs=0.04)  # of gains 10 % off, and of a walk that lags
    assert not found(*made_up(1.0, 1.0)).conductivity.any()


def test_a_typical_unit_is_left_as_it_is():
    change, rest, _ = made_up(1.0, 1.0)
    same = film.Film(1.0, "", np.zeros(1), np.zeros(1))
    whole = Changes(len(change), change.__getitem__)
    assert same.changes(whole, Baseline.constant(rest)) is whole


def test_what_a_drift_leaves_is_no_contact():
    """One conductivity leaves a tenth of an idle finger's drift here, in a pattern of its own; a contact stays."""
    warm = divider.of_typical_film(np.zeros(19), REST_COUNTS, 1.0, 1 / 1.2)  # counts that the warmer fluid adds
    uneven = 1 + 0.1 * np.random.default_rng(0).standard_normal(19)
    touched = warm + 3 * contact_signals()[0] / np.linalg.norm(contact_signals()[0]) * np.linalg.norm(warm)
    light = warm + 0.1 * (touched - warm)  # smaller than what drift leaves, but of a contact's pattern
    change = np.array([warm * uneven, touched, light])
    found = film.Film(1.0, "", np.zeros(1), np.full(1, np.log(1.2)))
    whole, rest = Changes(3, change.__getitem__), Baseline.constant(REST_COUNTS)
    idle, pressed, touching = found.changes(whole, rest)[np.arange(3)]
    assert not idle.any() and touching.any() and np.linalg.norm(pressed) > np.linalg.norm(warm)
    assert not dataclasses.replace(found, idle=True).changes(whole, rest)[np.array([0, 2])].any()


@pytest.mark.parametrize("factor", [1 / 27.4, 36.5, -1.0])
def test_a_pressure_of_another_unit_shows_no_other_film(factor, shipped):
    other = dataclasses.replace(shipped, pdc=np.rint(factor * (shipped.pdc - shipped.pdc[0])))
    assert prepare(other).report["film"]["thickness"] == 1.0


def test_later_parts_of_a_long_recording_have_the_film_of_the_first():
    change, rest, _ = made_up(0.4, 1.0)
    readings = np.concatenate([np.tile(rest, (200, 1)), rest + change])
    parts = [
        assemble("a.npz", "NPZ", electrodes=np.clip(one, 0, 4095), stamps=np.arange(len(one)) / 10)
        for one in np.split(readings, [1400])
    ]
    whole = assemble("a.npz", "NPZ", electrodes=np.clip(readings, 0, 4095), stamps=np.arange(len(readings)) / 10)
    options = PrepareOptions(tare=slice(0, 200), repair=False)
    prepare_next = Preparer(options)
    first, second = (prepare_next(part) for part in parts)
    thickness = first.report["film"]["thickness"]
    together = prepare(whole, PrepareOptions(tare=slice(0, 200), repair=False, film=thickness))
    off = np.concatenate([first.change, second.change]) - together.change
    assert thickness < 0.6 and np.abs(off).max() < 0.02 * np.abs(together.change).max()  # the fluid's course may differ


@pytest.fixture(scope="module")
def forced(outside_data):
    """Recordings of a pressed finger and of an idle one beside it, from their own rest; and the true force (T,) N."""
    folder = outside_data("biotac_force")
    read = {name: np.loadtxt(folder / f"{name}.txt") for name in (
        "finger1_rest", "finger1_counts", "finger2_rest", "idle_finger2_counts", "finger1_force")}  # fmt: skip
    force = np.linalg.norm(read.pop("finger1_force"), axis=1)

    def joined(rest, rows):
        every = np.concatenate([read[rest], read[rows]])
        return assemble(f"{rows}.txt", "text", electrodes=every, stamps=np.arange(len(every)) / 100), len(read[rest])

    return joined("finger1_rest", "finger1_counts"), joined("finger2_rest", "idle_finger2_counts"), force


def force_of(recording, rest, step=50):
    """Translated force (n,) N of every so many frames after the rest."""
    touch = translate(recording, prepare=PrepareOptions(tare=slice(0, rest)), frames=slice(rest, None, step))
    return np.linalg.norm(touch.force, axis=1)


def test_force_of_a_real_finger_is_of_the_right_size(forced):
    """Rest from the file and nothing else given; typical films make it 2.7 times too high."""
    (pressed, rest), _, true = forced
    found = force_of(pressed, rest)
    true = true[::50]  # which the counts follow by two rows, a fiftieth of a second
    assert 0.8 < np.median(found / true) < 1.25
    assert np.abs(found - true).mean() < 1.0


def test_one_scale_by_half_of_a_measured_force_is_written_where_it_helps_the_other_half(outside_data, tmp_path, capsys):
    """`adapt --rest --force` on every thirtieth row; a constant force leaves .6 N."""
    folder, unit = outside_data("biotac_force"), tmp_path / "unit.toml"
    names = ", ".join(f'"column{k}"' for k in range(1, 20))
    (tmp_path / "map.toml").write_text(f'format = "tactile-columns-1"\nrate = 3.3333\nelectrodes = [{names}]\n')
    for name in ("counts", "force"):
        np.savetxt(tmp_path / f"{name}.txt", np.loadtxt(folder / f"finger1_{name}.txt")[::30], fmt="%.7g")
    rest, force = str(folder / "finger1_rest.txt"), str(tmp_path / "force.txt")
    words = ["--columns", str(tmp_path / "map.toml"), "--rest", rest, "--force", force, "--out", str(unit)]
    assert main(["adapt", str(tmp_path / "counts.txt"), *words]) == 0
    scaled, without, constant = map(float, re.search(SAID, capsys.readouterr().err).groups())
    assert min(scaled, without) < 0.8 * constant
    known = electrode_gains.read(unit).sections()["unit"].stiffness
    assert 0.5 < known < 2 if scaled < without else known is None  # weights may leave nothing to a scale


def test_an_idle_finger_whose_fluid_warms_is_hardly_touched(forced):
    """It drifts by 16 to 220 counts; its rest, taken before, is 30 off, which no conductivity explains."""
    _, (idle, rest), _ = forced
    force = force_of(idle, rest)
    assert (force > 0).mean() < 0.05


def of_unit(recording, rest):
    """Touched frames (n,) bool, every 100th, where rest is another recording's: that of the first rows."""
    counts = recording.electrodes[:rest]
    known = Rest(tuple(np.median(counts, axis=0)), tuple(np.ptp(counts, axis=0) / 2))
    later = recording.at(np.arange(rest, len(recording)))
    touch = translate(later, prepare=PrepareOptions(rest=known), frames=slice(0, None, 100))
    return np.linalg.norm(touch.force, axis=1) > 0


def test_a_unit_s_rest_leaves_an_idle_finger_silent_and_a_pressed_one_in_contact(forced):
    pressed, idle, _ = forced
    assert of_unit(*idle).mean() < 0.05 and of_unit(*pressed).mean() > 0.99


@pytest.mark.parametrize("thickness", [0.5, 1.0])
def test_what_a_rest_of_another_recording_is_off_by_is_no_contact_unless_something_shows_one(thickness):
    shape = contact_signals()[0] / np.linalg.norm(contact_signals()[0])
    change = np.outer([12.0, 12.0, 200.0], shape)
    found, whole = film.Film(thickness, "", np.zeros(1), np.zeros(1)), Changes(3, change.__getitem__)
    own, other = (
        found.changes(whole, Baseline.constant(REST_COUNTS), idle)[np.arange(3)].any(axis=1).tolist()
        for idle in (None, np.array([True, False, True]))
    )
    assert own == [True, True, True] and other == [False, True, True]
