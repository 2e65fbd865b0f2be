"""A growing recording: every row once, none half, and the newest shown."""

import dataclasses
import os
from types import SimpleNamespace

import fake_tools
import numpy as np
import pytest
from PIL import Image

from tactile_core import recordings
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs import convert, live
from tactile_core.jobs.live import playback
from tactile_core.recordings import PrepareOptions, chunks, electrode_gains, polarity
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.electrode_gains import ElectrodeGains, SensorFile
from tactile_core.recordings.flags import Flag


def rows_of(electrodes: np.ndarray, pdc: np.ndarray | None = None) -> recordings.Recording:
    """Rows as they come from a file at 100 Hz."""
    return assemble("touch.csv", "CSV", electrodes=electrodes, stamps=np.arange(len(electrodes)) / 100, pdc=pdc)


@pytest.fixture(autouse=True)
def tools(monkeypatch):
    """Networks and drawer that are made up, where a verb asks for them."""
    monkeypatch.setattr(convert, "load_tools", lambda *files, **options: fake_tools.tools())


class Clock:
    """Stands in for the module `time`: only sleeping makes it go on. slept : s"""

    def __init__(self) -> None:
        self.slept = 0.0

    def perf_counter(self) -> float:
        return self.slept

    def sleep(self, seconds: float) -> None:
        self.slept += seconds


def test_rows_come_once_and_whole_however_the_file_grows(slide_csv, tmp_path):
    path = slide_csv(frames=120)
    data, whole = path.read_bytes(), recordings.read(path).electrodes
    path.write_bytes(b"")
    growing, found, place = live.Growing(path), [], 0
    for size in np.random.default_rng(5).integers(1, 900, 1000):
        with open(path, "ab") as file:
            file.write(data[place : place + size])
        place += size
        rows = growing.poll()
        if rows is not None:
            found.append(rows.electrodes)
    np.testing.assert_array_equal(np.concatenate(found), whole)
    assert growing.poll() is None and len(found) > 20


def test_a_file_that_becomes_shorter_and_one_that_is_no_recording_are_told(slide_csv, tmp_path):
    path = slide_csv(frames=5)
    growing = live.Growing(path)
    growing.poll()
    path.write_bytes(b"")
    with pytest.raises(TactileError, match="became shorter"):
        growing.poll()
    path = slide_csv(frames=5)
    growing = live.Growing(path)
    growing.poll()
    slide_csv("other", frames=90)
    path.write_bytes((tmp_path / "other.csv").read_bytes().replace(b"3", b"4"))
    with pytest.raises(TactileError, match="written anew"):
        growing.poll()
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(TactileError, match="no known recording"):
        live.Growing(tmp_path / "other.csv").poll()
    with pytest.raises(TactileError, match="no such file"):
        live.Growing(tmp_path / "none.csv")


def test_a_bad_row_is_passed_over_and_many_are_not(slide_csv):
    path = slide_csv(frames=30)
    growing = live.Growing(path)
    assert len(growing.poll()) == 30
    good = path.read_bytes().splitlines(keepends=True)[-1]
    bad = good.replace(good.split(b",")[-1], b"nan\n")
    for row in (bad, good[:40] + b"\n"):
        with open(path, "ab") as file:
            file.write(row)
        assert growing.poll() is None
        with open(path, "ab") as file:
            file.write(good)
        assert len(growing.poll()) == 1
    assert (growing.rows, growing.bad) == (34, 2)
    with pytest.raises(TactileError, match="rows are bad"):
        for _ in range(30):
            with open(path, "ab") as file:
                file.write(bad)
            growing.poll()


@pytest.mark.skipif(os.name == "nt", reason="Windows replaces no open file")
def test_another_file_of_the_same_name_is_told(slide_csv, tmp_path):
    path, other = slide_csv(frames=5), slide_csv("other", frames=90)
    growing = live.Growing(path)
    growing.poll()
    os.replace(other, path)
    with pytest.raises(TactileError, match="replaced by another file"):
        growing.poll()


def test_what_is_played_comes_at_its_own_rate(slide_csv, tmp_path):
    electrodes = recordings.read(slide_csv(frames=40)).electrodes
    np.savez(tmp_path / "fast.npz", electrodes=electrodes, time=np.arange(40) / 200)
    words = ["watch", str(tmp_path / "fast.npz"), "--play", "--speed", "0", "--out", str(tmp_path / "now.png")]
    assert main([*words, "--tare", "1200:1500"]) == 0  # of the first 10 s, which are 2,000 frames
    assert main([*words, "--tare", "1200:1500", "--rate", "100"]) == 2


def test_a_few_rows_are_shown_once_no_more_come(slide_csv, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(playback, "time", clock := Clock())
    words = ["watch", str(slide_csv(frames=20)), "--idle", "0.2", "--tare", "0:10", "--out", str(tmp_path / "now.png")]
    assert main(words) == 0 and capsys.readouterr().out.startswith("20 frames: ")
    assert (tmp_path / "now.png").exists()
    clock.slept = 0.0
    came = [(len(rows), clock.slept) for rows, _ in playback.followed(words[1], 6.0, print) if rows is not None]
    assert came == [(20, pytest.approx(playback.PATIENCE, abs=0.01))]


def test_slow_rows_that_are_held_do_not_count_as_idle(slide_csv, monkeypatch):
    path = slide_csv(frames=40)
    head, *lines = path.read_text().splitlines(keepends=True)
    path.write_text(head)
    monkeypatch.setattr(playback, "time", clock := Clock())
    found, due = [], 8.0  # s, of the first row: long after the header
    for rows, _ in playback.followed(str(path), 1.0 + due, print):
        found += [] if rows is None else [len(rows)]
        if lines and clock.slept >= due:
            with open(path, "a") as file:
                file.write(lines.pop(0))
            due += 0.5
    assert sum(found) == 40 and 9 <= found[0] <= 11 and set(found[1:]) == {1}


@pytest.mark.parametrize(
    ("stamp", "rate"),
    [
        (lambda number: number / 25, 25.0),
        (lambda number: number // 10 / 10 + number % 10 * 2e-5, 100.0),  # buffered, ten at a time: as without stamps
        (lambda number: number * 1e-6, 1e4),
    ],
)
def test_a_growing_file_s_first_stamps_tell_its_rate(slide_csv, stamp, rate):
    path = slide_csv(frames=90)
    head, *lines = path.read_text().splitlines(keepends=True)
    path.write_text(head)
    growing, signals, found = live.Growing(path), live.LiveSignals(None), []
    for number, line in enumerate(lines):
        with open(path, "a") as file:
            file.write(f"{stamp(number):.6f},{line.split(',', 1)[1]}")
        rows = growing.poll()
        if rows is not None:
            signals.learn(rows)
            found.append(len(rows))
    assert signals.rate == pytest.approx(rate) and sum(found) == 90 and found[1:] == [1] * (len(found) - 1)


@pytest.mark.parametrize(
    ("rows", "step"),
    [(slice(30, 90), -5.0), (slice(30, 60), 3600.0), (slice(0, 90, 2), 0.015), (slice(0, 90, 2), 0.045)],
)
def test_a_clock_that_is_set_or_read_late_leaves_no_frame_out(slide_csv, tmp_path, monkeypatch, capsys, rows, step):
    electrodes = recordings.read(slide_csv(frames=90)).electrodes
    stamps = np.arange(90) / 100
    stamps[rows] += step
    np.savez(tmp_path / "set.npz", electrodes=electrodes, time=stamps)
    monkeypatch.setattr(playback, "time", clock := Clock())
    assert main(["watch", str(tmp_path / "set.npz"), "--play", "--out", str(tmp_path / "now.png")]) == 0
    assert ", 0 frames passed over" in capsys.readouterr().out
    assert 0.8 < clock.slept < 1.0


def test_parts_of_a_recording_are_played_one_after_the_other(slide_csv, tmp_path, monkeypatch, capsys):
    path = slide_csv(frames=600)
    monkeypatch.setattr(chunks, "TEXT_BYTES", path.stat().st_size // 2)
    assert len(list(chunks.read_parts(path))) > 1
    monkeypatch.setattr(playback, "time", clock := Clock())
    assert main(["watch", str(path), "--play", "--out", str(tmp_path / "now.png")]) == 0
    assert clock.slept == pytest.approx(recordings.read(path).duration, abs=0.05)


def test_snapshots_are_not_played(tmp_path, capsys):
    names = [f"{finger}_biotac_{k}" for finger in ("ff", "mf", "th") for k in range(1, 25)]
    rows = np.random.default_rng(0).integers(2900, 3100, (3, 72))
    np.savetxt(tmp_path / "grasps.csv", rows, fmt="%d", delimiter=",", header=",".join(names), comments="")
    assert main(["watch", str(tmp_path / "grasps.csv"), "--play", "--out", str(tmp_path / "now.png")]) == 2
    assert "snapshots" in capsys.readouterr().err


def test_a_long_gap_is_not_waited_for(slide_csv, tmp_path, monkeypatch, capsys):
    electrodes = recordings.read(slide_csv(frames=40)).electrodes
    np.savez(tmp_path / "gap.npz", electrodes=electrodes, time=np.r_[0.0, 1e6 + np.arange(39) / 100])
    monkeypatch.setattr(playback, "time", clock := Clock())
    assert main(["watch", str(tmp_path / "gap.npz"), "--play", "--out", str(tmp_path / "now.png")]) == 0
    said = capsys.readouterr()
    assert "before frame 1: skipped" in said.err and said.out.startswith("40 frames: ")
    assert clock.slept < 1.0  # s that were waited for, of a million


def test_live_signals_are_those_of_the_whole_recording(slide_csv):
    recording = recordings.read(slide_csv(frames=150))
    signals = live.LiveSignals()
    known = [signals.learn(recording.at(np.arange(i, i + 10))) for i in range(0, 150, 10)]
    assert known.index(True) == 2  # 30 frames are the tare's window
    change = signals.signals(recording.electrodes, np.full(len(recording), np.nan)).change
    # Rest from 30 frames with noise of 1 count has an error of 0.2; the whole recording's quiet part is longer.
    np.testing.assert_allclose(change, recordings.prepare(recording).change, atol=1.0)


def test_rows_that_come_again_are_flagged_where_noise_keeps_others_apart():
    random, nothing = np.random.default_rng(0), np.full(1, np.nan)
    for noise in (1.2, 0.0):
        frames = np.rint(3300 + noise * random.standard_normal((120, 19)))
        frames[100:] = frames[99]
        signals, flagged = live.LiveSignals(), []
        for i in range(0, 120, 2):
            if signals.learn(rows_of(frames[i : i + 2])):
                flagged.append(bool(signals.signals(frames[[i + 1]], nothing).flags[0] & Flag.DEAD_CHANNEL))
        assert sum(flagged) == (10 if noise else 0) and all(flagged[-10:]) == (noise > 0)


def test_without_a_quiet_part_rest_is_guessed_in_the_end():
    signals = live.LiveSignals()
    frames = 3000 + 500 * np.sin(np.arange(1200)[:, None] / 3) * np.ones(19)
    assert not signals.learn(rows_of(frames[:900]))
    assert signals.learn(rows_of(frames[900:])) and "guess" in signals.found


def test_watch_shows_the_last_picture_and_tells_the_latency(slide_csv, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(playback, "time", Clock())
    for more in (["--idle", "0.2"], ["--play"], ["--play", "--speed", "4"], ["--play", "--speed", "0"]):
        out = tmp_path / "now.png"
        path = str(slide_csv(frames=90))
        assert main(["watch", path, "--out", str(out), *more]) == 0
        said = capsys.readouterr().out
        assert said.startswith("90 frames: ") and "ms from frame to picture" in said
        if "0" in more:
            assert ", 0 frames passed over" in said  # every frame has its picture
        grey = np.asarray(Image.open(out))[0, -1, 0]
        assert 50 < grey < 70  # the last frame is pressed by 29 counts times 1 to 3, a grey level a count
        out.unlink()


def test_rest_is_from_the_frames_given_or_the_file_s_own_zero():
    frames = np.where(np.arange(100)[:, None] < 40, 3100.0, 3000.0) * np.ones(19)  # begins in contact
    signals = live.LiveSignals(options=PrepareOptions(tare="50:80"))
    assert not signals.learn(rows_of(frames[:79])) and signals.learn(rows_of(frames[79:]))
    np.testing.assert_array_equal(signals.known.rest, np.full(19, 3000.0))
    zero = live.LiveSignals(options=PrepareOptions(tare="none"))
    assert (
        zero.learn(rows_of(frames - 3000 + np.random.default_rng(1).normal(0, 1, (100, 19))))
        and not zero.known.rest.any()
        and "own zero" in zero.found
    )
    with pytest.raises(TactileError, match="has no zero of its own"):
        live.LiveSignals(options=PrepareOptions(tare="none")).learn(rows_of(frames))
    with pytest.raises(TactileError, match="tare"):
        live.LiveSignals(options=PrepareOptions(tare="50:2000"))


def test_a_known_unit_gives_the_rest_of_a_recording_that_begins_in_contact():
    gain = [2.0] + [1.0] * 18
    unit = ElectrodeGains("a unit", gain, [0.0] * 19, [3200.0] * 19, [5.0] * 19, film=1.0)
    noise = np.random.default_rng(3).normal(0, 0.5, (40, 19))
    held, free = (live.LiveSignals(unit=unit) for _ in range(2))
    assert held.learn(rows_of(2900 + noise)) and "unit's own" in held.found  # 300 counts away, however calm
    np.testing.assert_array_equal(held.known.rest, np.full(19, 3200.0))
    assert free.learn(rows_of(3210 + noise)) and free.found.startswith("frames")
    change = free.signals(3110 + noise, np.full(40, np.nan)).change
    # noise of half a count, twice
    np.testing.assert_allclose(change, np.tile(-100 / np.array(gain), (40, 1)), atol=3.0)


def test_watch_takes_a_map_a_tare_and_a_sensor(slide_csv, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(playback, "time", Clock())
    own, columns, sensor = tmp_path / "own.csv", tmp_path / "map.toml", tmp_path / "sensor.toml"
    own.write_text(slide_csv(frames=90).read_text(encoding="utf-8").replace("ele", "taxel "), encoding="utf-8")
    assert main(["info", str(own), "--columns", str(columns)]) == 0
    electrode_gains.write(sensor, SensorFile(electrode_gains.FORMAT, ElectrodeGains("a unit", [1.0] * 19, [0.0] * 19)))
    words = ["watch", str(own), "--columns", str(columns), "--tare", "0:30", "--sensor", str(sensor)]
    for more in (["--play"], ["--idle", "0.2"]):
        capsys.readouterr()
        assert main([*words, "--out", str(tmp_path / "now.png"), *more]) == 0
        said = capsys.readouterr()
        assert said.out.startswith("90 frames: ") and "frames 0:30, as given" in said.err


def test_watch_without_a_display_says_what_to_do(slide_csv, monkeypatch, capsys):
    monkeypatch.setenv("MPLBACKEND", "agg")
    import matplotlib

    matplotlib.use("agg")
    assert main(["watch", str(slide_csv(frames=5))]) == 2
    assert "--out now.png" in capsys.readouterr().err


def test_a_window_that_is_closed_ends_the_watch(slide_csv, monkeypatch, capsys):
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    shown, drawn, exists = [], [], pyplot.fignum_exists

    def look(window):
        if shown:
            drawn.append(window)
        if len(drawn) == 3:
            pyplot.close(window)
        return exists(window)

    monkeypatch.setattr(pyplot, "get_backend", lambda: "a window's")
    monkeypatch.setattr(pyplot, "show", lambda block: shown.append(block))
    monkeypatch.setattr(pyplot, "fignum_exists", look)
    assert main(["watch", str(slide_csv(frames=90)), "--play", "--speed", "0"]) == 0
    frames = int(capsys.readouterr().out.split(" frames: ")[0])
    assert shown == [False] and len(drawn) == 3 and frames < 90  # not waited for, and three pictures in it


def test_a_bag_is_played_by_each_of_its_fingers(tmp_path, monkeypatch, capsys):
    pytest.importorskip("rosbags", reason="rosbags is absent: pip install tactile-core[ros]")
    import bags

    electrodes = 3000 + np.random.default_rng(2).normal(0, 1, (60, 19))
    still = np.full(60, 2000.0)
    press = SimpleNamespace(time=np.arange(60) / 100, electrodes=electrodes, pdc=still, tac=still, tdc=still)
    bags.write_bag(tmp_path / "touch.bag", press, "ros1", "hand")
    words = ["watch", "--rosbag-play", str(tmp_path / "touch.bag"), "--out", str(tmp_path / "now.png")]
    monkeypatch.setattr(playback, "time", clock := Clock())
    assert main(words) == 0
    assert clock.slept > 0.5  # s: at its own pace, 60 frames of 10 ms
    assert capsys.readouterr().out.startswith("60 frames: ")
    assert main([*words, "--speed", "0"]) == 0 and (tmp_path / "now.png").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "no recording, or two"),
        (["a.csv", "--rosbag-play", "b.bag"], "no recording, or two"),
        (["a.csv", "--speed", "2"], "--play or --rosbag-play beside it"),
        (["a.csv", "--play", "--speed", "-1"], "0 to 1000"),
        (["a.csv", "--play", "--speed", "nan"], "0 to 1000"),
        (["a.csv", "--serve", "70000"], "0 to 65535"),
        (["a.csv", "--idle", "nan"], "--idle: nan; expected seconds, 0 or more"),
        (["a.csv", "--idle", "-1"], "--idle: -1; expected seconds, 0 or more"),
        (["a.csv", "--play", "--idle", "2"], "--idle: given with a finished recording"),
        (["--rosbag-play", "none.bag"], "there is no such file"),
        (["--rosbag-play", ""], "there is no such file"),
        (["--rosbag-play", __file__], "no bag"),
    ],
)
def test_words_that_do_not_go_together_are_told(words, said, capsys):
    assert main(["watch", *words]) == 2
    assert said in capsys.readouterr().err


def test_a_picture_takes_no_other_file_s_place(slide_csv, tmp_path, capsys):
    """The recording itself would be lost when its first picture is drawn."""
    path = slide_csv(frames=90)
    before = path.read_bytes()
    for out, said in ((path, "a file that is no PNG picture"), (tmp_path, "a folder"), (path / "now.png", "written")):
        assert main(["watch", str(path), "--play", "--speed", "0", "--out", str(out)]) == 2
        assert said in capsys.readouterr().err
    assert path.read_bytes() == before


@pytest.mark.parametrize("sign", [1, -1])
def test_the_polarity_is_found_by_pressure_and_assumed_until_then(sign):
    contact = polarity.contact_signals()[7]
    strength = np.r_[np.zeros(60), np.clip(np.sin(np.linspace(0, 9, 200)), 0, 1)]
    noise = np.random.default_rng(0).normal(0, 1, (260, 19))
    electrodes, pdc = 3400 + sign * strength[:, None] * contact + noise, 1000 + 100 * strength
    signals = live.LiveSignals()
    for start in range(0, 260, 10):
        signals.learn(rows_of(electrodes[start : start + 10], pdc[start : start + 10]))
        if start == 40:
            assert signals.polarity == "falls" and not signals.sure
    assert signals.sure and signals.polarity == {1: "falls", -1: "rises"}[sign]
    change = signals.signals(electrodes, np.full(len(electrodes), np.nan)).change
    np.testing.assert_allclose(change[60:], strength[60:, None] * contact, atol=8)
    assert live.LiveSignals(options=PrepareOptions(polarity="rises")).sure


def test_a_pressure_that_denies_or_shows_a_contact_counts():
    """PDC is taken from the same rows as rest, and a faint change from a unit's rest is a contact where it says so."""
    unit = ElectrodeGains("a unit", [1.0] * 19, [0.0] * 19, [3200.0] * 19, [5.0] * 19, 1000.0, film=1.0)
    noise = np.random.default_rng(3).normal(0, 0.5, (40, 19))
    held = live.LiveSignals(unit=unit)
    seen = dataclasses.replace(rows_of(2900 + noise), pdc=np.full(40, 1100.0))
    assert held.learn(seen) and "unit's own" in held.found
    faint = held.signals(np.full((2, 19), 3194.0), np.array([1000.0, 1050.0]))
    assert faint.pdc.tolist() == [0.0, 50.0] and faint.change.any(axis=1).tolist() == [False, True]


def test_a_cell_that_cannot_be_read_keeps_its_last_count_and_is_flagged():
    """Finished recordings are played a row at a time; a missing count is no 0: a touch of 3200 counts."""
    view = live.View(fake_tools.tools(), 100.0)
    calm = 3200 + np.random.default_rng(3).normal(0, 0.5, (61, 19))
    view.show(rows_of(calm[:60]), 0.0)
    lost = rows_of(np.tile(calm[60], (8, 1)))
    lost.electrodes[-1, 4] = np.nan
    shown = view.show(lost.at(np.array([7])), 0.0)
    assert shown.newtons < 0.1 and shown.flags == Flag.REPAIRED
