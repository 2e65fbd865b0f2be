"""Files of other programs, a row a kind: read as the same recording, by their map or without, or refused in words."""

import bz2
import gzip
import json
import re
import zipfile
from datetime import UTC, datetime, timedelta

import h5py
import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.opened_file import opened
from tactile_core.recordings.tables import column_map
from tactile_core.recordings.tables.mapped import guess_map
from tactile_core.sensors import REST_COUNTS

NAMES = ["pdc_raw", *(f"E{i}" for i in range(1, 20))]
START = 1_352_394_723.123


def table(press, header=True, separator=",", stamp="{:.3f}", top="", end="\n", extra=None):
    """Rows of time, PDC and the electrodes as text."""
    lines = [separator.join(["time", *NAMES, *([extra[0]] if extra else [])])] if header else []
    for i, time in enumerate(press.time):
        cells = [stamp.format(START + time), f"{press.pdc[i]:g}", *(f"{each:g}" for each in press.electrodes[i])]
        lines.append(separator.join([*cells, *([extra[1][i]] if extra else [])]))
    return top + end.join([*lines, ""])


def stamped(stamp):
    """Rows whose stamp is written by a function of the seconds since the first."""

    def write(press):
        lines = [",".join(["when_stamp", *NAMES])]
        for time, pdc, row in zip(press.time, press.pdc, press.electrodes, strict=True):
            lines.append(",".join([stamp(float(time)), f"{pdc:g}", *(f"{each:g}" for each in row)]))
        return "\n".join([*lines, ""])

    return write


def clock(form):
    """Rows with times of day."""
    return stamped(lambda time: (datetime.fromtimestamp(START, UTC) + timedelta(seconds=time)).strftime(form))


def units(unit, start):
    """Rows with whole stamps of a unit."""
    return stamped(lambda time: f"{round((start + time) * unit):d}")


def records(press):
    """Records of a driver's messages."""
    return [
        {
            "header": {"seq": i, "stamp": {"secs": int(START + t), "nsecs": round((START + t) % 1 * 1e9)}},
            "hand": "left", "bt": [{"pdc": float(p), "electrodes": row.tolist(), "pac": [2000] * 22}],
        }
        for i, (t, p, row) in enumerate(zip(press.time, press.pdc, press.electrodes, strict=True))
    ]  # fmt: skip


def long(press, by_channel=False, stamped=True):
    """A row for each value of a channel."""
    rows = [
        (f"{t:.2f}" if stamped else "0.00", name, f"{value:g}")
        for t, p, row in zip(press.time, press.pdc, press.electrodes, strict=True)
        for name, value in zip(NAMES, [p, *row], strict=True)
    ]
    if by_channel:
        rows.sort(key=lambda row: NAMES.index(row[1]))
    return "\n".join(["time,channel,value", *(",".join(row) for row in rows), ""])


def continued(press):
    """Rows with a comment and the header again among them."""
    head, *lines = table(press).splitlines()
    return "\n".join([head, *lines[:9], "# on", head, *lines[9:]])


TEXTS = {
    "plain.csv": table,
    "tabs.txt": lambda press: table(press, separator="\t"),
    "spaces.txt": lambda press: table(press, separator="  "),
    "no_header.csv": lambda press: table(press, header=False),
    "no_header_spaces.txt": lambda press: table(press, header=False, separator=" "),
    "comments.csv": lambda press: table(press, top="# recorded 2012\n% by hand, in a hurry\n"),
    "title.csv": lambda press: table(press, top="Logger 3 of Bob\nrate,100\n"),
    "header_in_comment.csv": lambda press: table(press, top="# "),
    "decimal_commas.csv": lambda press: table(press).replace(",", ";").replace(".", ","),
    "continued.csv": continued,
    "windows.csv": lambda press: table(press, end="\r\n"),
    "quoted.csv": lambda press: table(press, extra=("object", ['"a, b"'] * len(press.time))),
    "iso.csv": clock("%Y-%m-%d %H:%M:%S.%f"),
    "iso_t.csv": clock("%Y-%m-%dT%H:%M:%S.%fZ"),
    "postgres.csv": clock("%Y-%m-%d %H:%M:%S.%f+00"),
    "iso_zone.csv": clock("%Y/%m/%d %H:%M:%S.%f+00:00"),
    "day_first.csv": clock("%d.%m.%Y %H:%M:%S.%f"),
    "two_columns.csv": lambda press: re.sub(r"(?m)^(\d+)\.(\d+)", r"\1,\g<2>000000", table(press)).replace(
        "time", "stamp.sec,stamp.nanosec", 1
    ),
    "time_of_day.csv": clock("%H:%M:%S.%f"),
    "ms.csv": units(1e3, 0), "us.csv": units(1e6, 0), "ns.csv": units(1e9, 0),
    "unix_ms.csv": units(1e3, START), "unix_ns.csv": units(1e9, START),
    "coarse.csv": stamped(lambda time: f"{np.floor(10 * time + 0.3) / 10:.1f}"),  # a program that reads a buffer
    "long.csv": long,
    "long_by_channel.csv": lambda press: long(press, by_channel=True),
    "records.json": lambda press: json.dumps(records(press)),
    "records_lines.jsonl": lambda press: "\n".join(map(json.dumps, records(press))) + "\n",
    "arrays.json": lambda press: json.dumps({
        "t": press.time.tolist(), "pdc": press.pdc.tolist(), "elec": press.electrodes.tolist(), "object": "foam",
    }),
    "frames.json": lambda press: json.dumps({"subject": "a", "frames": records(press)}),
}  # fmt: skip


def write_arrays(path, press):
    """The press in an HDF5, NPZ, NPY or MATLAB file of other names."""
    stamps = np.rint(1e9 * (START + press.time)).astype(np.int64)
    if path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            for trial, frames in (("trial_2", slice(0, 400)), ("trial_1", slice(None))):
                for finger in (0, 1):
                    file[f"{trial}/finger_{finger}/electrode_data"] = press.electrodes[frames] + finger
                    file[f"{trial}/finger_{finger}/pdc_data"] = press.pdc[frames]
                file[f"{trial}/stamps"] = stamps[frames]
            file["trial_1/object"] = ["foam"] * len(stamps)
            file["trial_1/labels/grasp"] = np.arange(len(stamps)) // 100
    elif path.suffix == ".npz":
        np.savez(path, hand=np.stack([press.electrodes, press.electrodes + 1], axis=1), t_ns=stamps, pdc=press.pdc)
    elif path.suffix == ".npy":
        np.save(path, press.electrodes)
    elif path.name == "own_73.mat":
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in {
                "elec": press.electrodes.T,
                "time_s": press.time[None],
                "pdc": press.pdc[None],
            }.items():
                file[f"hand/{name}"] = values
        with open(path, "r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM")
    else:
        scipy_io = pytest.importorskip("scipy.io", reason="scipy is absent: pip install tactile-core[matlab]")
        scipy_io.savemat(path, {"elec": press.electrodes.T, "time_s": press.time[None], "pdc": press.pdc[None]})


def read_by_guess(path):
    with opened(str(path)) as (container, where, _, file):
        guessed, held = guess_map(where, container, file)
    map_file = path.parent / "map.toml"
    column_map.write(map_file, guessed, held)
    return recordings.read(path, column_map.read(map_file))


@pytest.mark.parametrize("name", [*TEXTS, "plain.csv.gz", "two.h5", "hand.npz", "plain.npy", "own.mat", "own_73.mat"])
def test_a_guessed_map_reads_the_recording(name, press, tmp_path):
    path = tmp_path / name
    if name.endswith(".gz"):
        path.write_bytes(gzip.compress(table(press).encode()))
    elif name in TEXTS:
        path.write_text(TEXTS[name](press), encoding="utf-8", newline="")
    else:
        write_arrays(path, press)
    found = read_by_guess(path)
    np.testing.assert_array_equal(found.electrodes, press.electrodes)
    assert not (found.flags & Flag.REPAIRED).any()
    if "npy" not in name and "no_header" not in name:
        np.testing.assert_array_equal(found.pdc, press.pdc)
    if name == "two.h5":
        # no stamps and pressures of the group trial_1
        assert list(found.labels) == ["trial_1_labels_grasp", "trial_1_object"]
    if name == "coarse.csv":
        np.testing.assert_allclose(found.time, press.time, atol=0.01)  # a step of the finer clock
        assert any("spread evenly" in text for text in found.warnings)
    else:
        np.testing.assert_allclose(found.time, press.time, atol=1e-5)
    assert not (found.flags & Flag.TIME_JUMP).any()


@pytest.mark.parametrize("shape", [(), (0, 19), (30, 0)])
def test_arrays_without_rows_are_refused_by_a_map(shape, tmp_path):
    np.savez(tmp_path / "empty.npz", held=np.zeros(shape))
    with pytest.raises(TactileError, match=r"held: shape \(.*\); expected 1 to"):
        recordings.read(tmp_path / "empty.npz", column_map.ColumnMap(electrodes=("held",)))


@pytest.mark.parametrize("attribute", ["scale_factor", "add_offset"])
def test_arrays_packed_as_netcdf_does_are_refused(attribute, press, tmp_path):
    mapped = column_map.ColumnMap(electrodes=("electrodes",))
    with h5py.File(tmp_path / "packed.h5", "w") as file:
        file["electrodes"] = press.electrodes
        file["electrodes"].attrs["scale_factor"], file["electrodes"].attrs["add_offset"] = 1.0, 0.0
    assert len(recordings.read(tmp_path / "packed.h5", mapped)) == len(press.electrodes)
    with h5py.File(tmp_path / "packed.h5", "a") as file:
        file["electrodes"].attrs[attribute] = 0.5
    with pytest.raises(TactileError, match=rf"electrodes: packed values \({attribute}\); expected plain"):
        recordings.read(tmp_path / "packed.h5", mapped)


def in_turns(press, by_value):
    """Rows of two fingers, one after the other."""
    head, *lines = (long(press) if by_value else table(press)).splitlines()
    return "\n".join([f"{head},finger", *(f"{line},{finger}" for line in lines for finger in ("left", "right"))])


@pytest.mark.parametrize("by_value", [False, True])
def test_fingers_that_take_turns_are_not_mixed(by_value, press, tmp_path):
    (tmp_path / "a.csv").write_text(in_turns(press, by_value), encoding="utf-8")
    with pytest.raises(
        TactileError, match=r"rows of 2 series take turns, told apart by column 'finger'.*Split the fil"
    ):
        read_by_guess(tmp_path / "a.csv")


@pytest.mark.parametrize("fingers", [2, 5])
def test_fingers_that_take_turns_are_found_by_their_readings(fingers, press, tmp_path):
    apart = np.outer(np.arange(fingers), np.linspace(10, 100, 19))  # counts; units rest 52 and more apart
    rows = (press.electrodes[:, None] + apart).reshape(-1, 19)
    np.savez(tmp_path / "a.npz", electrodes=rows, time=np.arange(len(rows)) / (100 * fingers))
    with pytest.raises(TactileError, match=rf"rows of {fingers} fingers take turns.*Split the file: a file for each"):
        recordings.read(tmp_path / "a.npz")


def test_grasps_that_alternate_are_no_turns_of_fingers(press):
    rows = press.electrodes + np.outer(np.arange(len(press.time)) % 2, np.linspace(10, 100, 19))
    assert len(assemble("a.csv", "grasps", electrodes=rows, stamps=None, snapshots=True)) == len(rows)
    with pytest.raises(TactileError, match="2 fingers take turns"):
        assemble("a.csv", "frames", electrodes=rows, stamps=None)


@pytest.mark.parametrize("tared", [False, True])
@pytest.mark.parametrize("hertz", [50, 60])
def test_hum_of_the_mains_is_no_second_finger(hertz, tared, press, tmp_path):
    hum = 60 * np.sin(2 * np.pi * hertz * press.time + 1)  # counts
    rest = press.electrodes[0] if tared else 0
    hum = np.outer(hum, 1 + 0.1 * np.cos(np.arange(19)))  # electrodes differ a little
    np.savez(tmp_path / "a.npz", electrodes=press.electrodes - rest + hum, time=press.time)
    assert len(recordings.read(tmp_path / "a.npz")) == len(press.time)


def test_counts_that_are_mirrored_are_refused(press, tmp_path):
    counts = REST_COUNTS + press.electrodes - press.electrodes[0]
    np.savez(tmp_path / "a.npz", electrodes=4095 - counts, time=press.time)
    with pytest.raises(TactileError, match=r"a.npz, electrodes: levels .* minus readings: .* 3300 mV"):
        recordings.read(tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", electrodes=np.column_stack([4095 - counts[:, :18], np.full(len(counts), np.nan)]))
    with pytest.raises(TactileError, match="minus readings"):
        recordings.read(tmp_path / "a.npz")
    odd = np.roll(counts, 5, axis=1)  # of another pattern; counts of 10 bit lie there too, changes from rest below
    for kept in (counts / 4, odd / 2, 2 * REST_COUNTS.mean() - counts, 150 - (counts - REST_COUNTS.min()) / 10):
        np.savez(tmp_path / "a.npz", electrodes=kept, time=press.time)
        assert len(recordings.read(tmp_path / "a.npz")) == len(press.time)


@pytest.mark.parametrize("names", ["E{}_tared", "filtered_E{}", "delta/E{}"])
def test_raw_electrodes_are_taken_before_processed_ones(names, press, tmp_path):
    processed = [names.format(i) for i in range(1, 20)]
    rows = np.column_stack([press.time, press.electrodes - press.electrodes[0], press.electrodes])
    header = ",".join(["time", *processed, *NAMES[1:]])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=header, comments="", fmt="%g")
    np.testing.assert_array_equal(read_by_guess(tmp_path / "a.csv").electrodes, press.electrodes)


@pytest.mark.parametrize(
    ("names", "time", "pdc", "tac"),
    [
        ("section time pdc_offset pdc contact", "time", "pdc", ""),
        ("elapsed x y biotac_pdc tac", "elapsed", "biotac_pdc", "tac"),
        ("section x y pdc tac", "", "pdc", "tac"),
        ("second_touch x_centimeters x pdc tac", "", "pdc", "tac"),
    ],
)
def test_columns_whose_names_hold_another_s_are_not_taken_for_it(names, time, pdc, tac, press, tmp_path):
    rows = np.column_stack([press.time, press.time, press.pdc, press.pdc, press.pdc, press.electrodes])
    header = ",".join([*names.split(), *(f"biotac_e{i}" for i in range(1, 20))])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=header, comments="", fmt="%g")
    with opened(str(tmp_path / "a.csv")) as (container, where, _, file):
        (found,), _ = guess_map(where, container, file)
    assert (found.time, found.pdc, found.tac) == (time, pdc, tac)


@pytest.mark.parametrize("name", ["timestamps", "t", "stamp_ms"])
def test_a_time_that_is_not_taken_is_named(name, press, tmp_path):
    np.savez(tmp_path / "a.npz", electrodes=press.electrodes, **{name: press.time})
    assert f"array {name!r} is not taken for time" in " ".join(recordings.read(tmp_path / "a.npz").warnings)
    np.savez(tmp_path / "b.npz", electrodes=press.electrodes, time=press.time, **{name: press.time})
    assert not recordings.read(tmp_path / "b.npz").warnings


def test_arrays_of_electrodes_first_are_refused_with_the_way_to_read_them(press, tmp_path):
    np.savez(tmp_path / "a.npz", electrodes=press.electrodes.T, time=press.time)
    with pytest.raises(TactileError, match=r"shape \(19, 700\); expected \(frames, 19\). Transpose it, or give a map"):
        recordings.read(tmp_path / "a.npz")
    np.testing.assert_array_equal(read_by_guess(tmp_path / "a.npz").electrodes, press.electrodes)
    np.savez(tmp_path / "b.npz", electrodes=press.electrodes[:19])
    np.testing.assert_array_equal(recordings.read(tmp_path / "b.npz").electrodes, press.electrodes[:19])


def test_a_time_of_another_form_and_a_packed_file_are_refused_in_words(press, tmp_path):
    (tmp_path / "a.csv").write_text(clock("%m/%d/%Y %I:%M:%S.%f %p")(press), encoding="utf-8")
    with pytest.raises(TactileError, match=r"'11/08/2012 05:12:03.123000 PM' is not a number; expected .* or times as"):
        read_by_guess(tmp_path / "a.csv")
    (tmp_path / "a.csv.bz2").write_bytes(bz2.compress(table(press).encode()))
    with pytest.raises(TactileError, match=r"a packed file; .*Unpack it: bunzip2"):
        recordings.read(tmp_path / "a.csv.bz2")
    with zipfile.ZipFile(tmp_path / "a.xlsx", "w") as packed:
        packed.writestr("xl/workbook.xml", "")
    with pytest.raises(TactileError, match=r"a packed file; .*Unpack it: unzip; of a spreadsheet save"):
        recordings.read(tmp_path / "a.xlsx")
    np.savez(tmp_path / "a.npz", electrodes=press.electrodes)
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as notes, zipfile.ZipFile(tmp_path / "a.npz") as arrays:
        notes.writestr("notes.txt", "n" * 3000)
        notes.writestr("electrodes.npy", arrays.read("electrodes.npy"))
    assert len(recordings.read(tmp_path / "b.npz")) == len(press.time)


def test_texts_are_kept_as_labels_through_a_conversion(press, tmp_path, write, slide_lines, no_sheet):
    objects = ["foam" if i < 300 else "steel, polished" for i in range(len(press.time))]
    lines = [slide_lines[0] + ",object,trial,note"]
    lines += [f'{line}"{each}",7,' for line, each in zip(slide_lines[1:], objects, strict=True)]
    path = write(lines)
    found = recordings.read(path)
    assert not found.flags.any() and not found.warnings
    assert {name: column.tolist() for name, column in found.labels.items()} == {"object": objects, "trial": ["7"] * 700}
    assert main(["convert", path, "--out", str(tmp_path / "out"), "--frames", "290:310", "--keep", "latent"]) == 0
    with h5py.File(tmp_path / "out" / "touch" / "frames.h5") as file:
        assert file["labels/object"].asstr()[()].tolist() == objects[290:310]
        assert not (file["flags"][()] & Flag.REPAIRED).any()
    note = json.loads((tmp_path / "out" / "touch" / "note.json").read_text(encoding="utf-8"))
    assert set(note["recording"]["labels"]["object"]) == {"foam", "steel, polished"}


@pytest.mark.parametrize("absent", ["missing", "empty"])
def test_an_electrode_that_is_not_there_is_a_dead_channel(absent, press, slide_lines, write):
    place = slide_lines[0].split(",").index("ele7")
    lines = [line.split(",") for line in slide_lines]
    for row in lines[(absent == "empty") :]:
        if absent == "missing":
            del row[place]
        else:
            row[place] = ""
    found = recordings.read(write([",".join(row) for row in lines]))
    np.testing.assert_array_equal(np.delete(found.electrodes, 6, axis=1), np.delete(press.electrodes, 6, axis=1))
    signals = recordings.prepare(found)
    assert (signals.flags & Flag.DEAD_CHANNEL > 0).all() and not signals.change[:, 6].any()
    assert any("no readings of E7" in text for text in signals.warnings)


@pytest.mark.parametrize(
    ("top", "words"),
    [(1.0, "shares"), (3.3, "volts of 3.3 V"), (5.0, "volts of 5 V"), (100.0, "percent"), (255.0, "8 bit"),
     (1023.0, "10 bit"), (65535.0, "16 bit"), (3.0, "")],
)  # fmt: skip
def test_readings_in_other_units_are_counts(top, words, press, tmp_path):
    np.savez(tmp_path / "a.npz", electrodes=press.electrodes * top / 4095, time=press.time, pdc=press.pdc)
    options = recordings.PrepareOptions(counts_per_unit=None if words else 4095 / top)
    found = recordings.prepare(recordings.read(tmp_path / "a.npz"), options)
    np.savez(tmp_path / "b.npz", electrodes=press.electrodes, time=press.time, pdc=press.pdc)
    counts = recordings.prepare(recordings.read(tmp_path / "b.npz"))
    assert found.kind == "raw" and (not words or any(words in text for text in found.warnings))
    np.testing.assert_allclose(found.change, counts.change, atol=1e-6)
    np.testing.assert_allclose(found.pdc, counts.pdc)


def test_millivolts_are_told_by_their_names(press, tmp_path):
    text = table(press).replace(",E", ",mV_E")
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    assert "electrodes are called mV ('mv_e1')" in " ".join(read_by_guess(tmp_path / "a.csv").warnings)


SILENT = {
    "zeros": lambda counts: np.zeros_like(counts), "full": lambda counts: np.full_like(counts, 4095),
    "one value": lambda counts: np.full_like(counts, 2048),
    "constant": lambda counts: np.tile(counts[0], (len(counts), 1)),
    "zeros until it starts": lambda counts: np.where(np.arange(len(counts))[:, None] < 120, 0, counts),
    "ends in the contact": lambda counts: np.where(np.arange(len(counts))[:, None] > 350, 0, counts),
    "hangs in the contact": lambda counts: counts[np.minimum(np.arange(len(counts)), 350)],
}  # fmt: skip


@pytest.mark.parametrize("how", SILENT)
def test_a_finger_that_does_not_answer_touches_nothing(how, press, tmp_path):
    silent = SILENT[how](press.electrodes)
    np.savez(tmp_path / "a.npz", electrodes=silent, time=press.time, pdc=press.pdc)
    found = recordings.prepare(recordings.read(tmp_path / "a.npz"))
    dead = found.flags & Flag.DEAD_CHANNEL > 0
    expected = np.ones(700, bool)
    if how == "zeros until it starts":
        expected = np.arange(700) < 120
    elif "contact" in how:
        expected = np.arange(700) > 350
    np.testing.assert_array_equal(dead, expected)
    assert not found.change[dead].any() and any("does not answer" in text for text in found.warnings)
    if how == "zeros until it starts":
        np.testing.assert_allclose(found.change[180:520].min(), press.change.min(), rtol=0.2)  # trembles, with noise


MAPPED = [
    "ns.csv",
    "wallclock.csv",
    "pandas_E.csv",
    "biotac_pub.csv",
    "biotac_log.hdf5",
    "logger.npz",
    "trial_001.json",
]
KNOWN = ["label.csv", "no_ele7.csv", "norm.csv", "volts.csv", "ms.csv", "space.csv", "comment.csv", "plain.csv.gz"]


@pytest.mark.parametrize("name", [*MAPPED, *KNOWN, "output.txt", "electrodes.npy", "trial_001.json"])
def test_files_of_other_programs_are_read(name, outside_data, tmp_path):
    path = outside_data("outside") / name
    if name in KNOWN:
        found = recordings.read(path)
    else:
        link = tmp_path / name
        link.symlink_to(path)
        found = read_by_guess(link)
    signals = recordings.prepare(found)
    assert signals.kind == "raw" and found.rate == pytest.approx(100, rel=1e-3)
    assert not (found.flags & (Flag.REPAIRED | Flag.TIME_JUMP)).any()
    assert np.abs(signals.change).max() < 100  # of steady grips and untouched fingers; rest is 3,000 counts away


def test_a_live_view_knows_a_finger_that_does_not_answer(press):
    from tactile_core.jobs.live.live_view import LiveSignals

    def rows(electrodes):
        return assemble("touch.csv", "CSV", electrodes=electrodes, stamps=np.arange(len(electrodes)) / 100)

    live = LiveSignals()
    zeros = np.zeros((120, 19))
    assert not live.learn(rows(zeros)) and live.silent
    assert live.learn(rows(press.electrodes[:150])) and not live.silent
    # nothing was learnt from zeros
    np.testing.assert_allclose(live.known.rest, press.electrodes[:150].mean(axis=0), atol=2)
    signals = live.signals(np.stack([press.electrodes[350], zeros[0]]), np.full(2, np.nan))
    assert signals.change[0].any() and not signals.change[1].any()
    assert (signals.flags & Flag.DEAD_CHANNEL > 0).tolist() == [False, True]


def test_a_map_without_electrodes_is_written_and_said(tmp_path, capsys):
    np.savez(tmp_path / "a.npz", sp=np.zeros((50, 24)))
    assert main(["info", str(tmp_path / "a.npz"), "--columns", str(tmp_path / "map.toml")]) == 2
    assert "written, no 19 electrodes found: name them there" in capsys.readouterr().err
