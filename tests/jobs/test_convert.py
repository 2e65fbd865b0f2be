import dataclasses
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import types
from pathlib import Path

import fake_tools
import h5py
import numpy as np
import pytest
from conftest import ROOT, SHIPPED
from PIL import Image
from plain_unit import plain_unit

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs import convert, results
from tactile_core.jobs.frame_pass import CHUNK
from tactile_core.jobs.frames_file import ALWAYS, KEPT
from tactile_core.mechanics.node_areas import node_areas
from tactile_core.pictures import presets, renderer
from tactile_core.pictures.marker_field import MarkerField
from tactile_core.pictures.mitsuba import variant
from tactile_core.pictures.mitsuba.variant import SCALAR, Choice
from tactile_core.recordings.flags import Flag
from tactile_core.sensors.calibration import Markers

FRAMES = 150  # of slide_csv: more than two chunks
FAKE = ROOT / "tests" / "helpers" / "fake_tools.py"


@pytest.fixture(scope="module")
def tools():
    return fake_tools.tools()


@pytest.fixture
def run(tmp_path, tools, no_sheet):
    """Convert one recording with options, without its contact sheet, and return its result folder."""

    def one(path, out="out", **options):
        return converted(path, tmp_path / out, tools, **options)

    return one


@pytest.fixture(scope="module")
def whole(tools, write_slide, tmp_path_factory):
    """A recording of FRAMES frames and its result by default, which no test may change."""
    folder = tmp_path_factory.mktemp("whole")
    path = write_slide("touch", FRAMES, folder)
    return path, converted(path, folder / "out", tools)


def converted(path, out, tools, **options):
    options = convert.Options(**options)
    (folder,) = results.result_folders([path], out, options.overwrite)
    return convert.convert(path, folder, options, tools).folder


def test_a_result_is_complete_and_one_frame_a_row(whole):
    path, folder = whole
    assert sorted(child.name for child in folder.iterdir()) == sorted(
        ["contact_sheet.png", "frames.h5", "images", "note.json", "timings.json"]
    )
    assert [image.name for image in sorted((folder / "images").iterdir())] == [f"{i:05d}.png" for i in range(FRAMES)]
    read = np.loadtxt(path, delimiter=",", skiprows=1)
    with h5py.File(folder / "frames.h5") as file:
        assert set(file) == {*ALWAYS, *KEPT["latent"], *KEPT["displacement"]}
        assert {len(dataset) for dataset in file.values()} == {FRAMES}
        np.testing.assert_allclose(file["time"], read[:, 0] - read[0, 0], atol=1e-6)  # the file's microseconds
        assert file["time"].attrs["start_time"] == pytest.approx(1.6e9)
        assert (file["electrodes"][:] == read[:, 26:]).all()
        depth = file["displacement_digit"][..., 1].max(axis=1)
        told = json.loads((folder / "note.json").read_text())["explained"]
        assert told == pytest.approx(np.nanmean(file["explained"]), abs=1e-4)
        assert {file[name].dtype for name in ("force", "confidence", "displacement_biotac")} == {np.dtype("float32")}
    for frame in (0, FRAMES // 2, FRAMES - 1):
        picture = np.asarray(Image.open(folder / "images" / f"{frame:05d}.png"))
        assert picture.shape == (320, 240, 3)
        assert (picture == fake_tools.shade(np.full(fake_tools.SHAPE, depth[frame]))).all()


def test_chunks_leave_no_seam(run, whole):
    path, folder = whole
    single = run(path, keep=("displacement",))
    with h5py.File(folder / "frames.h5") as file, h5py.File(single / "frames.h5") as other:
        assert (file["displacement_biotac"][:] == other["displacement_biotac"][:]).all()
        depth = file["latent_signal"][:, 0]
    rises = np.diff(depth[60:120])
    assert CHUNK in range(60, 120) and np.abs(rises).max() < 4  # counts: the press adds 2 a frame, noise below 2


def test_keep_and_frames_choose_what_is_written(run, whole):
    path, full = whole
    part = run(path, out="part", keep=("height",), frames=slice(20, 120, 25))
    chosen = np.arange(20, 120, 25)
    assert not (part / "images").exists()
    with h5py.File(part / "frames.h5") as file, h5py.File(full / "frames.h5") as all_frames:
        assert set(file) == {*ALWAYS, "height_map"}
        assert file["height_map"].shape == (len(chosen), 320, 240)
        assert (file["frame"][:] == chosen).all()
        for name in ("time", "electrodes", "force", "flags"):
            assert (file[name][:] == all_frames[name][:][chosen]).all()  # the tare saw the whole recording
    images = run(path, out="images", keep=("image",), frames=slice(-3, None))
    assert [image.name for image in sorted((images / "images").iterdir())] == ["00147.png", "00148.png", "00149.png"]


def test_a_kept_traction_is_zero_without_contact_and_adds_up(run, slide_csv):
    folder = run(slide_csv(frames=80), keep=("traction",), frames=slice(40, 80, 8))
    with h5py.File(folder / "frames.h5") as file:
        assert set(file) == {*ALWAYS, *KEPT["traction"]}
        traction, total = file["traction_digit"][:], file["traction_force"][:]
        touched, force = np.isfinite(file["contact_center"][:, 0]), file["force"][:]
    assert touched.any() and not touched.all()
    np.testing.assert_allclose(np.linalg.norm(total, axis=1), np.linalg.norm(force, axis=1) * touched, rtol=1e-5)
    assert traction.any(axis=(1, 2)).tolist() == touched.tolist() and (total[touched, 1] > 0).all()
    np.testing.assert_allclose(np.einsum("tnk,n->tk", traction, node_areas("digit")), total, rtol=0, atol=1e-6)


def test_marker_motion_needs_a_unit_with_dots_and_has_their_rest(slide_csv, tmp_path, tools, no_sheet):
    unit = dataclasses.replace(plain_unit(), markers=Markers(3, 2, 2e-3, 0.6e-3, 0.1))
    drawer = dataclasses.replace(tools.drawer, dots=MarkerField(unit), shade=lambda height, _: fake_tools.shade(height))
    dotted = dataclasses.replace(tools, drawer=drawer)
    options, path = convert.Options(slice(60, 80, 10), ("marker_motion", "image")), slide_csv(frames=80)
    with pytest.raises(TactileError, match=r"unit without dots.*--calibration"):
        convert.convert(path, tmp_path / "none", options, tools)
    assert not (tmp_path / "none").exists()
    folder = convert.convert(path, tmp_path / "out", options, dotted).folder
    with h5py.File(folder / "frames.h5") as file:
        assert set(file) == {*ALWAYS, "marker_motion"}
        assert file["marker_motion"].shape == (2, 6, 2) and file["marker_motion"].attrs["rest"].shape == (12,)
        assert np.abs(file["marker_motion"][:]).max() > 0.01  # a dent off the camera's axis: perspective alone


def test_the_same_input_gives_the_same_bytes(whole, tools, tmp_path):
    path, first = whole
    second = converted(path, tmp_path / "again", tools)
    files = sorted(p.relative_to(first) for p in first.rglob("*") if p.is_file() and p.name != "timings.json")
    assert len(files) == FRAMES + 3
    for file in files:
        assert (first / file).read_bytes() == (second / file).read_bytes(), file


def test_the_note_tells_what_is_reproducible_and_no_path(run, slide_csv, tmp_path):
    folder = run(slide_csv(frames=80), frames=slice(0, 70))
    text = (folder / "note.json").read_text(encoding="utf-8")
    note = json.loads(text)
    assert str(tmp_path) not in text
    assert note["recording"]["file"] == "touch.csv" and len(note["recording"]["sha256"]) == 64
    assert note["options"]["frames"] == "0:70" and note["frames_converted"] == 70
    assert note["weights"] == {"sha256": "0" * 64}
    assert {"numpy", "h5py", "python", "tactile_core"} <= set(note["versions"])
    timings = json.loads((folder / "timings.json").read_text(encoding="utf-8"))
    stages = {"read", "prepare", "translate", "height_map", "shade", "png", "hdf5", "sheet", "all"}
    assert set(timings["ms_a_frame"]) == set(timings["cpu_ms_a_frame"]) == stages


def test_a_recording_that_goes_while_it_is_converted_costs_nothing(slide_csv, tmp_path, tools, no_sheet):
    """A stick that is pulled, or a file that grows: the note tells what was read, and the calibration given."""
    path, unit = slide_csv(frames=5), tmp_path / "unit.toml"
    unit.write_bytes(b"# a unit's")
    digest, units = (hashlib.sha256(file.read_bytes()).hexdigest() for file in (path, unit))

    def go(done, total):
        path.unlink()
        unit.unlink()

    given = dataclasses.replace(tools, calibration=str(unit))
    folder = convert.convert(path, tmp_path / "out", convert.Options(), given, go).folder
    note = json.loads((folder / "note.json").read_text())
    assert note["recording"]["sha256"] == digest and note["calibration"] == {"file": "unit.toml", "sha256": units}


def test_the_note_of_the_shipped_recording_takes_4_kb(run):
    folder = run(SHIPPED, keep=())
    assert (folder / "note.json").stat().st_size <= 4096


def test_flags_of_recording_and_translation_meet_and_are_told(run, slide_csv):
    path = slide_csv(frames=FRAMES)
    lines = path.read_text().splitlines()
    cells = lines[31].split(",")
    cells[30] = "nan"
    lines[31] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")
    folder = run(path, keep=())
    note = json.loads((folder / "note.json").read_text(encoding="utf-8"))
    with h5py.File(folder / "frames.h5") as file:
        bits = file["flags"][:]
        assert np.isfinite(file["electrodes"][:]).all()
    assert bits[30] & Flag.REPAIRED and not bits[40] & Flag.REPAIRED
    beyond = int(np.count_nonzero(bits & Flag.OUT_OF_RANGE))
    assert beyond == note["flagged_frames"]["out_of_range"] > 0
    assert any("line 32, ele5" in warning for warning in note["warnings"])
    assert any(f"{beyond} of {FRAMES} frames" in warning for warning in note["warnings"])


@pytest.mark.parametrize("denied", [False, True])
def test_frames_that_the_fluid_s_pressure_denies_say_so(denied, request, tmp_path, no_sheet):
    path = shutil.copy(SHIPPED, tmp_path / "touch.h5")
    with h5py.File(path, "r+") as file:
        if denied:
            file["pdc"][...] = 80 + np.arange(len(file["pdc"])) % 2
    tools = convert.load_tools(convert.ToolOptions())
    folder = converted(str(path), tmp_path / "out", tools, frames=slice(100, 120), keep=())
    said = [text for text in json.loads((folder / "note.json").read_text())["warnings"] if "unexplained" in text]
    assert [text.split(": ")[1] for text in said] == ["PDC shows another pressure than that of the contact"] * denied


def test_overwrite_replaces_the_whole_result(run, slide_csv):
    path = slide_csv(frames=80)
    run(path)
    with pytest.raises(TactileError, match="already holds a result"):
        run(path)
    folder = run(path, overwrite=True, keep=(), frames=slice(0, 5))
    assert not (folder / "images").exists()
    with h5py.File(folder / "frames.h5") as file:
        assert len(file["time"]) == 5


def test_a_recording_of_one_frame_converts(run, slide_csv):
    folder = run(slide_csv(frames=1))
    assert [image.name for image in (folder / "images").iterdir()] == ["00000.png"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [(":", slice(None)), ("3:", slice(3, None)), ("::7", slice(None, None, 7)), ("-9:-1:2", slice(-9, -1, 2))],
)
def test_frames_are_read_as_python_reads_them(text, expected):
    assert results.parse_frames(text) == expected
    assert results.parse_frames(results.frames_text(expected).replace("all", ":")) == expected


@pytest.mark.parametrize("text", ["", "5", "1:2:3:4", "a:b", "::0", "::-1", "1.5:", "1 :2", "9999999999:"])
def test_other_selections_are_refused(text):
    with pytest.raises(TactileError, match="--frames"):
        results.parse_frames(text)


def test_a_disk_that_fills_up_ends_in_one_message_and_no_folder(slide_csv, tmp_path, tools, monkeypatch):
    def full(*arguments, **more):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tactile_core.jobs.convert.pack_png", full)
    out = tmp_path / "out"
    (folder,) = results.result_folders([tmp_path / "touch.csv"], out, False)
    with pytest.raises(TactileError, match="No space left on device"):
        convert.convert(slide_csv(frames=80), folder, convert.Options(), tools)
    assert not out.exists()


def interrupt(how: int, path: Path, out: Path) -> subprocess.Popen:
    """Start a conversion that stops at its second chunk, interrupt it when pictures are there, wait for its end."""
    environment = {**os.environ, "FAKE_HOLD": "1", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(FAKE), "convert", str(path), "--out", str(out)]
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
    partial = out / f".{path.stem}.tactile-partial" / "images"
    while process.poll() is None and not (partial.exists() and len(list(partial.iterdir())) > CHUNK // 2):
        time.sleep(0.01)
    assert process.poll() is None, "the conversion ended before it could be interrupted"
    process.send_signal(how)
    process.communicate(timeout=60)
    return process


@pytest.mark.skipif(os.name == "nt", reason="Windows has no limit on the size of a process's files")
@pytest.mark.parametrize("keep", ["displacement", "height"])  # plain and packed in frames.h5
def test_a_full_disk_costs_one_recording_and_no_half_result_is_left(keep, slide_csv, tmp_path):
    paths, out = [slide_csv("long", frames=500), slide_csv("short", frames=5)], tmp_path / "out"
    limited = (  # 500 kB: enough for 5 frames and a sheet. Python ignores SIGXFSZ: writing gives OSError
        "import resource, runpy, sys; sys.argv = sys.argv[1:]; sys.path.insert(0, sys.argv[0].rpartition('/')[0]);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000)); runpy.run_path(sys.argv[0], None, '__main__')"
    )
    done = subprocess.run(
        [sys.executable, "-c", limited, str(FAKE), "convert", *map(str, paths), "--out", str(out), "--keep", keep],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    errors = [line for line in done.stderr.splitlines() if line.startswith("tactile: error:")]
    assert errors[0].startswith(f"tactile: error: {out / 'long'}: frames.h5 cannot be written (File too large)")
    assert errors[1:] == ["tactile: error: 1 of 2 recordings were not converted"]
    assert [child.name for child in out.iterdir()] == ["short"]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT and SIGKILL for one process")
def test_an_interrupted_run_leaves_nothing_and_a_killed_one_is_cleared_by_the_next(slide_csv, tmp_path, run):
    path, out = slide_csv(frames=500), tmp_path / "out"
    assert interrupt(signal.SIGINT, path, out).returncode == 130
    assert not out.exists()
    for how in (signal.SIGTERM, signal.SIGHUP):
        assert interrupt(how, path, out).returncode == 128 + how
        assert not out.exists()
    assert interrupt(signal.SIGKILL, path, out).returncode == -signal.SIGKILL
    assert not (out / "touch").exists()
    assert len(list(out.iterdir())) == 2  # its half result and its lock, both hidden
    run(slide_csv("other", frames=5))
    assert [child.name for child in out.iterdir()] == ["other"]


def test_a_bound_on_pictures_picks_their_preset(monkeypatch):
    drawn = []

    def draw(calibration, preset, variant):
        drawn.append(preset)
        return types.SimpleNamespace(dots=None)

    monkeypatch.setattr(renderer, "Renderer", draw)
    monkeypatch.setattr(variant, "choose_variant", lambda wanted: Choice(SCALAR, ""))
    assert variant.fitting(5) == "fast" and "fast" in presets.describe_choice("fast", 5)
    exact = presets.measured()["presets"]["quality"]["error"]
    assert (preset := variant.fitting(exact)) == "quality" and "quality" in presets.describe_choice(preset, exact)
    assert convert.load_tools(convert.ToolOptions(preset=preset)).drawer.preset == "quality" and drawn == ["quality"]


def test_a_bound_is_one_on_pictures(slide_csv, tmp_path, monkeypatch, capsys, no_sheet):
    monkeypatch.setattr(convert, "load_tools", lambda *files, **options: fake_tools.tools())
    line = ["convert", str(slide_csv()), "--out", str(tmp_path / "out"), "--error"]
    assert main([*line, "5levels"]) == 0 and "pictures: fast" in capsys.readouterr().err
    note = json.loads((tmp_path / "out" / "touch" / "note.json").read_text(encoding="utf-8"))
    assert note["options"]["preset"] == "fast"
    for bound, words in (("1e-6levels", "or more, which"), ("5um", "a bound in levels"), ("much", "5um,0.6levels")):
        assert main([*line, bound, "--overwrite"]) == 2
        assert words in capsys.readouterr().err
