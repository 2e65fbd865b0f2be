"""Recordings of a BioTac SP: read and described, never taken for those of a BioTac, nor the reverse."""

import re
from pathlib import Path

import fake_tools
import h5py
import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs import convert, prepared_signals, translate_shards
from tactile_core.jobs.engine import inputs
from tactile_core.jobs.engine import job as jobs
from tactile_core.recordings import PrepareOptions, electrode_gains, info
from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.readers import each_finger, sensor_of
from tactile_core.recordings.tables.column_map import ColumnMap
from tactile_core.sensors import divider
from tactile_core.translation import networks, reference_signals
from tactile_core.translation.answer import Answer
from tactile_core.translation.card import REST
from tactile_core.translation.translate import translate
from tactile_core.translation.unit_rest import Simulated, find_rest_sp
from tactile_core.translation.weights import read_card

pytestmark = pytest.mark.usefixtures("no_sheet")

SLIP = [f"ff_e{number}" for number in range(1, 25)]
GRASP = [
    "object",
    "slipped",
    *(f"{finger}_biotac_{number}" for finger in ("ff", "mf", "th") for number in range(1, 25)),
]


@pytest.fixture
def counts():
    return np.random.default_rng(0).integers(2600, 3700, (30, 24))


def written(write, header, rows):
    return write([",".join(header), *(",".join(map(str, row)) for row in rows)])


def read_sp(path):
    return recordings.read(path, sensor="biotac_sp")


def test_a_slip_recording_is_told_and_prepared(counts, write, capsys):
    path = written(write, SLIP, counts)
    assert sensor_of(path) == "biotac_sp" and each_finger(path) == [path]
    recording = read_sp(path)
    np.testing.assert_array_equal(recording.electrodes, counts)
    assert (
        recording.sensor == "biotac_sp"
        and recording.rate == pytest.approx(100)
        and recording.duration == pytest.approx(0.29)
    )
    signals = recordings.prepare(recording)
    assert signals.sensor == "biotac_sp" and signals.report["polarity_evidence"] == "raw counts of a BioTac SP"
    np.testing.assert_array_equal(signals.typical, signals.change)  # of no unit but this one anything is known
    np.testing.assert_allclose(signals.relative_to(signals.rest), signals.change, atol=1e-6)
    assert main(["info", path]) == 0
    text = capsys.readouterr().out
    for part in (
        "BioTac SP, 24 electrodes, first finger (ff)", "30 in lines 2 to 31", "0.30 s", "100 Hz (assumed)",
        "raw: whole numbers", "convert RECORDING --sensor FILE", "rest       not known",
    ):  # fmt: skip
        assert part in text, part
    largest = next(line for line in text.splitlines() if "largest" in line).split()[1:]
    assert largest == [str(value) for value in counts.max(axis=0)]


def test_a_slip_recording_s_own_stamps_are_read(counts, write):
    stamped = [[f"{1e9 + row / 50:.2f}", *each] for row, each in enumerate(counts)]
    recording = read_sp(written(write, ["stamp", *SLIP], stamped))
    np.testing.assert_array_equal(recording.electrodes, counts)
    assert recording.rate == pytest.approx(50) and recording.start_time == 1e9
    assert not recording.not_taken and not recording.labels
    gappy = [[row[0] * (number % 2), *row[1:]] for number, row in enumerate(stamped)]
    assert read_sp(written(write, ["stamp", *SLIP], gappy)).rate == pytest.approx(100)  # as without them


def test_snapshots_of_a_grasp_are_a_recording_a_finger(counts, write):
    path = written(write, GRASP, [["ball", 1, *row, *row, *(row - 100)] for row in counts])
    assert each_finger(path) == [f"{path}#{finger}" for finger in (0, 1, 4)]
    thumb = read_sp(f"{path}#4")
    np.testing.assert_array_equal(thumb.electrodes, counts - 100)
    assert np.isnan(thumb.time).all() and thumb.about["labels"] == ["object", "slipped"] and not thumb.warnings
    text = info.describe(f"{path}#4")
    assert "thumb (th)" in text and "snapshots, one a line" in text and "electrodes, object, slipped" in text
    with pytest.raises(TactileError, match="finger 2; expected one that it holds: 0, 1, 4"):
        read_sp(f"{path}#2")


def test_a_lost_cell_is_told_and_a_lost_column_refused(counts, write):
    rows = [[*map(str, row)] for row in counts]
    rows[4][7] = "?"
    path = written(write, SLIP, rows)
    assert np.isnan(read_sp(path).electrodes[4, 7]) and "line 6, ff_e8" in info.describe(path)
    with pytest.raises(TactileError, match="'ff_e24' is missing"):
        read_sp(written(write, SLIP[:23], [row[:23] for row in rows]))
    dead = [[*row[:7], "", *row[8:]] for row in rows]
    with pytest.raises(TactileError, match=r"ff_e8: .*rows are bad"):
        read_sp(written(write, SLIP, dead))


@pytest.mark.parametrize("stem", ["ff_e", "my_sensor_", "ele"])
def test_nineteen_of_its_columns_are_no_biotac(stem, counts, write):
    names = [f"{stem}{number}" for number in range(1, 25)]
    path = written(write, names, counts)
    columns = ColumnMap(electrodes=tuple(names[:19]))
    with pytest.raises(TactileError, match="24 electrodes: a BioTac SP; expected the 19") as refused:
        recordings.read(path, columns)
    for command in ("pairs scenes/training .* --from biotac_sp", "train", "adapt", "convert .* --sensor"):
        assert re.search(f"`tactile {command} ", str(refused.value))
    with pytest.raises(TactileError, match="24 electrodes: a BioTac SP; expected the 19"):
        info.describe(path, PrepareOptions(columns=columns))


def test_a_biotac_is_no_biotac_sp(press, in_layout):
    for layout in ("csv_slide", "npz_electrodes"):
        with pytest.raises(TactileError, match=r"19 electrodes: a BioTac; expected the 24 electrodes of a BioTac SP"):
            read_sp(in_layout(layout, press))
    with pytest.raises(TactileError, match="sensor 'digit': of kind gel; expected a sensor of kind fluid"):
        recordings.read(in_layout("npz_electrodes", press), sensor="digit")


@pytest.mark.parametrize("film", [1.0, 0.5])
def test_rest_and_film_are_found_in_recordings_that_begin_in_contact(film, write, tmp_path, capsys):
    folder, random = networks.shipped_folder("biotac_sp"), np.random.default_rng(1)
    typical, at = reference_signals.read(folder).typical, np.array(read_card(folder)[0][REST])
    firm = typical[np.linalg.norm(typical, axis=1) > 60]
    rest, gains = at + random.normal(0, 40, 24), np.exp(random.normal(0, 0.1, 24))
    for number in range(6):
        contacts = firm[random.choice(len(firm), 3)] * random.uniform(0.7, 1.4, (3, 1))
        own = gains * divider.of_typical_film(divider.of_unit(contacts, rest, at), rest, 1 / film)
        noisy = np.round(rest + own.repeat(30, axis=0) + random.normal(0, 1.5, (90, 24))).astype(int)
        np.savetxt(tmp_path / f"{number}.csv", noisy, fmt="%d", delimiter=",", header=",".join(SLIP), comments="")
    paths, out = [str(tmp_path / f"{number}.csv") for number in range(6)], str(tmp_path / "rest.toml")
    assert main(["adapt", *paths, "--out", out]) == 0
    unit = electrode_gains.read(out)
    assert unit.sensor == "biotac_sp" and unit.unit is not None and unit.unit.film == film
    counts = np.concatenate([read_sp(path).electrodes for path in paths])
    off = np.abs(np.quantile(counts, 0.95, axis=0) - rest)  # of what reads highest: bulged
    found = np.array(unit.unit.rest_counts)
    np.testing.assert_allclose(found, rest, atol=off.max() / 5)
    signals = Preparer(unit=unit.unit)(read_sp(paths[0]))
    change = divider.of_typical_film(read_sp(paths[0]).electrodes - found, found, film)
    assert signals.film == film
    np.testing.assert_allclose(signals.change, change, atol=1e-6)
    capsys.readouterr()
    assert main(["info", paths[0], "--sensor", out]) == 0
    table = {line.split()[0]: line.split()[1:] for line in capsys.readouterr().out.splitlines() if line.split()}
    assert [int(value) for value in table["least"]] == pytest.approx(
        (read_sp(paths[0]).electrodes - found).min(axis=0), abs=0.5
    )
    simulated = Simulated(typical, at)
    with pytest.raises(TactileError, match="2 recordings; expected at least 3"):
        find_rest_sp([read_sp(path) for path in paths[:2]], simulated)
    assert len(find_rest_sp([read_sp(path) for path in paths[:3]], simulated).counts) == 24


def test_of_real_slips_left_out_the_rest_explains_more_than_the_nearest_contact_did(outside_data, tmp_path):
    paths = [str(path) for path in sorted(outside_data("biotac_sp").glob("direction_of_slip/*/*.csv"))]
    out = str(tmp_path / "rest.toml")
    assert main(["adapt", *paths[::2], "--out", out]) == 0
    explained = [
        np.nanmean(translate(read_sp(path), sensor=out, frames=slice(0, None, 60)).explained) for path in paths[1::2]
    ]
    assert np.mean(explained) > 0.49  # measured .56; with each electrode's highest tenth for rest .05


def test_a_rest_serves_its_own_sensor_alone(counts, write, tmp_path, press, in_layout, capsys):
    path, out = written(write, GRASP, [["ball", 1, *row, *row, *row] for row in counts]), str(tmp_path / "rest.toml")
    assert main(["adapt", path, "--out", out]) == 0
    assert list(electrode_gains.read(out).sections()) == ["finger0", "finger1", "finger4"]
    touch = in_layout("npz_electrodes", press)
    assert main(["convert", touch, "--out", str(tmp_path / "o"), "--sensor", out]) == 2
    assert "24 electrodes, 'biotac_sp'; expected one of 19" in capsys.readouterr().err
    assert main(["adapt", path, touch, "--out", str(tmp_path / "both.toml")]) == 2
    assert "biotac and biotac_sp together" in capsys.readouterr().err
    assert main(["adapt", path, "--rest", path, "--out", str(tmp_path / "given.toml")]) == 2
    assert "--rest: given for 3 units; expected one" in capsys.readouterr().err
    assert main(["adapt", f"{path}#0", "--rest", path, "--out", str(tmp_path / "given.toml")]) == 2
    assert "Leave --rest out: recordings of contacts give a BioTac SP's rest" in capsys.readouterr().err
    assert main(["adapt", touch, "--rest", f"{path}#0", "--out", str(tmp_path / "given.toml")]) == 2
    assert "a recording of a BioTac SP; expected of a BioTac, as the others" in capsys.readouterr().err
    text = (tmp_path / "rest.toml").read_text()
    (tmp_path / "other.toml").write_text(text.replace('sensor = "biotac_sp"\n', ""))
    with pytest.raises(TactileError, match=r"finger0\.gain: 24 numbers; expected 19"):
        electrode_gains.read(tmp_path / "other.toml")


def test_public_recordings_are_described(outside_data):
    paths = sorted(outside_data("biotac_sp").glob("*/**/*.csv"))
    assert len(paths) > 30
    for path in paths:
        for finger in each_finger(path):
            text = info.describe(finger)
            assert "raw: whole numbers" in text and "convert RECORDING --sensor FILE" in text


def test_tools_of_it_convert_its_recordings_alone(counts, write, press, in_layout, tmp_path):
    tools = fake_tools.tools("biotac_sp")
    followed = fake_tools.tools("biotac_sp", Answer())
    slip = written(write, SLIP, counts)
    rows = [["ball", 1, *row, *row, *row] for row in counts]
    grasp = written(lambda lines: write(lines, "grasp.csv"), GRASP, rows)
    done = convert.convert(slip, tmp_path / "slip", convert.Options(keep=("displacement",)), tools)
    with h5py.File(done.folder / "frames.h5") as file:
        assert file["electrodes"].shape == (30, 24) and "E1..E24" in file["electrodes"].attrs["description"]
        assert "displacement_biotac_sp" in file and "displacement_biotac" not in file
        assert "sensor_surface('biotac_sp')" in file["displacement_biotac_sp"].attrs["description"]
    with pytest.raises(TactileError, match=r"snapshots, which do not follow each other.*--frames-apart"):
        convert.convert(f"{grasp}#0", tmp_path / "grasp", convert.Options(), followed)
    convert.convert(f"{grasp}#0", tmp_path / "grasp", convert.Options(keep=()), tools)
    with pytest.raises(TactileError, match="19 electrodes: a BioTac; expected the 24 electrodes of a BioTac SP"):
        convert.convert(in_layout("csv_slide", press), tmp_path / "biotac", convert.Options(), tools)
    with pytest.raises(TactileError, match="24 electrodes: a BioTac SP; expected the 19 electrodes of a BioTac"):
        convert.convert(slip, tmp_path / "other", convert.Options(), fake_tools.tools())


def test_a_job_and_a_live_view_take_its_recordings(counts, write, tmp_path, monkeypatch, capsys):
    tools = fake_tools.tools("biotac_sp")
    slip = written(write, SLIP, [*counts[:1]] * 40 + [*(counts[:10] - 200)])
    recipe = jobs.Translate(["displacement"], "0" * 64, source="biotac_sp")
    job = jobs.make(inputs.hashed([Path(slip)], lambda done, total: None), recipe, None)
    jobs.write(tmp_path / "job", job)
    for folder in (jobs.PREPARED, jobs.SHARDS):
        (tmp_path / "job" / folder).mkdir(exist_ok=True)
    assert prepared_signals.make(tmp_path / "job", job, 0) == (50, True)
    monkeypatch.setattr(translate_shards, "_tools", lambda *words: tools)
    assert translate_shards.make(tmp_path / "job", job, 0, 0)
    done = convert.convert(slip, tmp_path / "slip", convert.Options(keep=("displacement",)), tools)
    file = jobs.shard_file(tmp_path / "job", job.inputs[0].name, 0)
    with h5py.File(file) as shard, h5py.File(done.folder / "frames.h5") as whole:
        for name in ("electrodes", "displacement_biotac_sp", "flags"):
            np.testing.assert_array_equal(shard[name][:], whole[name][:], err_msg=name)
    grasp = written(lambda lines: write(lines, "grasp.csv"), GRASP, [["ball", 1, *row, *row, *row] for row in counts])
    other = jobs.make(inputs.hashed([Path(grasp)], lambda done, total: None), recipe, None)
    with pytest.raises(TactileError, match="snapshots, which do not follow each other"):
        prepared_signals.make(tmp_path / "job", other, 0)
    monkeypatch.setattr(convert, "load_tools", lambda *files, **options: tools)
    words = ["--play", "--speed", "0", "--out", str(tmp_path / "now.png")]
    assert main(["watch", slip, *words]) == 0
    said = capsys.readouterr()
    assert "50 frames: " in said.out and "falls: raw counts of a BioTac SP" in said.err.replace("fall: ", "falls: ")
    assert main(["watch", slip, "--idle", "0.1", "--out", str(tmp_path / "now.png")]) == 0
