"""A named pipe in place of each file that a verb reads: refused in words, and never opened, which would wait."""

import argparse
import errno
import os
import shutil
import threading

import pytest
from PIL import Image

from tactile_core.cli import main as command
from tactile_core.files.shipped import shipped
from tactile_core.sensors.calibration_file import SHIPPED

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no named pipes in folders")

# Words of a command, by the option or argument that meets the pipe; {x.csv} is a pipe of that name, {folder/x} one in a
# folder, {out} a new name, {csv} a good recording, {scene} a good scene.
CASES = {
    ("convert", "recordings"): ["convert {x.csv} --out {out}", "convert {x.h5} --out {out}",
                                "convert {bag/metadata.yaml} --out {out}", "convert {bag} --out {out}",
                                "convert {x.mat#1} --out {out}"],
    ("convert", "--sensor"): ["convert {csv} --out {out} --sensor {x.toml}"],
    ("convert", "--weights"): ["convert {csv} --out {out} --weights {weights}",
                               "convert {csv} --out {out} --weights {halfweights}"],
    ("watch", "recording"): ["watch {x.csv} --idle 0 --out {out}", "watch {x.npz} --play --out {out}"],
    ("watch", "--rosbag-play"): ["watch --rosbag-play {x.bag} --out {out}"],
    ("watch", "--weights"): ["watch {csv} --play --speed 0 --out {out} --weights {weights}"],
    ("batch", "inputs"): ["batch {x.csv} --out {out}", "batch @{x.txt} --out {out}", "batch {folder} --out {out}"],
    ("batch", "--weights"): ["batch {csv} --out {out} --weights {weights}"],
    ("batch", "--sensor"): ["batch {csv} --out {out} --sensor {x.toml}"],
    ("batch", "--calibration"): ["batch {csv} --out {out} --calibration {x.toml}",
                                 "batch {csv} --out {out} --calibration {unit.toml}"],
    ("batch", "--cluster"): ["batch {csv} --out {out} --cluster {x.toml}"],
    ("convert", "--columns"): ["convert {csv} --out {out} --columns {x.toml}"],
    ("convert", "--calibration"): ["convert {csv} --out {out} --calibration {x.toml}"],
    ("batch", "--columns"): ["batch {csv} --out {out} --columns {x.toml}"],
    ("watch", "--columns"): ["watch {csv} --play --speed 0 --out {out} --columns {x.toml}"],
    ("watch", "--sensor"): ["watch {csv} --play --speed 0 --out {out} --sensor {x.toml}"],
    ("watch", "--calibration"): ["watch {csv} --play --speed 0 --out {out} --calibration {x.toml}"],
    ("watch", "--camera"): ["watch {csv} --play --speed 0 --out {out} --camera {x.mp4}"],
    ("info", "--sensor"): ["info {csv} --sensor {x.toml}"],
    ("info", "--columns"): ["info {csv} --columns {x.toml}"],
    ("adapt", "--columns"): ["adapt {csv} --out {out} --columns {x.toml}"],
    ("dataset", "name"): ["dataset {x.toml} {slides} --out {out}"],
    ("dataset", "folder"): ["dataset plate_normal {plates} --out {out}"],
    ("dataset", "--calibration"): ["dataset biotac_slides {slides} --out {out} --calibration {x.toml}"],
    ("dataset", "--weights"): ["dataset biotac_slides {slides} --out {out} --weights {weights}"],
    ("dataset", "--cluster"): ["dataset biotac_slides {slides} --out {out} --cluster {x.toml}"],
    ("export", "job"): ["export {job} --to npz --out {out}", "export {x} --to npz --out {out}"],
    ("info", "recordings"): ["info {x.csv}", "info {x.mcap}"],
    ("adapt", "recordings"): ["adapt {x.csv} --out {out}"],
    ("adapt", "--rest"): ["adapt {csv} --out {out} --rest {x.csv}"],
    ("adapt", "--force"): ["adapt {csv} --out {out} --force {x.txt}"],
    ("adapt", "--weights"): ["adapt {csv} --out {out} --weights {weights}"],
    ("render", "input"): ["render {x.h5} --out {out}", "render {x.npz} --out {out}", "render {x.exr} --out {out}",
                          "render {scenefolder} --out {out}", "render {meshscene} --out {out}"],
    ("render", "--calibration"): ["render {recording} --out {out} --calibration {x.toml}",
                                  "render {recording} --preset fast --out {out} --calibration {unit.toml}"],
    ("render", "--cluster"): ["render {recording} --out {out} --cluster {x.toml}"],
    ("calibrate", "presses"): ["calibrate {presses} --ball-diameter 6 --out {out}"],
    ("calibrate", "--background"): ["calibrate {nopresses} --ball-diameter 6 --background {x.png} --out {out}"],
    ("calibrate", "--start"): ["calibrate {nopresses} --ball-diameter 6 --start {x.toml} --out {out}"],
    ("calibrate", "--test"): ["calibrate {nopresses} --test {x.toml}"],
    ("simulate", "scene"): ["simulate {x.toml} --out {out}", "simulate {x.toml} --out {out} --plan",
                            "simulate {scenefolder} --out {out}",
                            "simulate {meshscene} --out {out}", "simulate {meshscene} --out {out} --grid x_mm=1,2"],
    ("simulate", "--cluster"): ["simulate {scene} --out {out} --grid x_mm=-6,-5 --cluster {x.toml}"],
    ("pairs", "scene"): ["pairs {x.toml} --count 2 --out {out}", "pairs {meshscene} --count 2 --out {out}"],
    ("pairs", "--cluster"): ["pairs {scenes/training} --count 2 --out {out} --cluster {x.toml}"],
    ("train", "pairs"): ["train {x.h5} --out {out}"],
    ("train", "--real"): ["train s2mpn --real {x.hdf5} --out {out}"],
    ("train", "--weights"): ["train s2mpn --real {recording} --weights {weights} --out {out}"],
    ("mesh", "--frames"): ["mesh biotac --frames {x.h5} --frame 0 --out {out}"],
    ("mesh", "--press"): ["mesh digit --press {x.stl} --depth-mm 0.3 --out {out}.vtu"],
}  # fmt: skip
# Metavars of what is written, and of words that are no files.
NO_FILES = {"WORDS", "A:B:STEP", "auto|none|A:B", "X,Z", "BOUND", "I/N", "WxH", "TEXT", "NAMES", "NAME", "NAME=A:B:N",
            "N", "S", "X", "HZ", "LAYOUTS", "MM", "FILE.xml", "SENSOR", "HOW"}  # fmt: skip
WRITTEN = {"--out", "--json", "--sheet", "--scene-out", "--new"}


def reading_options() -> set[tuple[str, str]]:
    """All options and arguments of all verbs that name what is read."""
    parser = command._parser()
    (verbs,) = (action for action in parser._actions if isinstance(action, argparse._SubParsersAction))
    return {
        (name, (action.option_strings or [action.dest])[-1])
        for name, verb in verbs.choices.items()
        for action in verb._actions
        if action.nargs != 0
        and action.type is None
        and not action.choices
        and action.metavar not in NO_FILES
        and not set(action.option_strings) & WRITTEN
    }


def test_no_option_is_left_out():
    assert reading_options() - set(CASES) == set()


class Pipes:
    """Named pipes that note who opens them to read; whoever does finds them empty instead of waiting."""

    def __init__(self) -> None:
        self.opened, self._paths, self._end = [], [], threading.Event()
        self._thread = threading.Thread(target=self._feed, daemon=True)
        self._thread.start()

    def make(self, path):
        path.parent.mkdir(parents=True, exist_ok=True)
        os.mkfifo(path)
        self._paths.append(path)

    def _feed(self):
        while not self._end.wait(0.005):
            for path in list(self._paths):
                try:
                    os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK))
                    self.opened.append(path)
                except OSError as error:
                    if error.errno != errno.ENXIO:  # nobody reads
                        self._paths.remove(path)

    def close(self):
        self._end.set()
        self._thread.join()


@pytest.fixture
def pipes():
    made = Pipes()
    yield made
    made.close()


def folders(name, tmp_path, pipes, root):
    """A folder of a case, with a pipe in it."""
    folder = tmp_path / name
    if name in ("weights", "halfweights"):
        shutil.copytree(shipped("weights"), folder)
        spoiled = folder / ("card.json" if name == "weights" else "MVD.safetensors")
        spoiled.unlink()
        pipes.make(spoiled)
    elif name == "bag":
        folder.mkdir()
        (folder / "metadata.yaml").write_text("rosbag2_bagfile_information:\n  relative_file_paths: [a.db3]\n")
        pipes.make(folder / "a.db3")
    elif name == "meshscene":
        shutil.copytree(root / "scenes" / "user_mesh", folder)
        (folder / "star.stl").unlink()
        pipes.make(folder / "star.stl")
    elif name == "unit.toml":
        pipes.make(tmp_path / "rest.png")
        text = SHIPPED.read_text(encoding="utf-8")
        folder.write_text(text.replace('photograph = ""', 'photograph = "rest.png"'), encoding="utf-8")
    elif name == "nopresses":
        folder.mkdir()
        for number in range(3):
            Image.new("RGB", (24, 32), (40, 40, 40)).save(folder / f"{number}.png")
    else:
        held = {"scenefolder": "scene.toml", "job": "job.json", "presses": "a.png", "plates": "plate_1.csv"}
        pipes.make(folder / held.get(name, "a.csv"))
    return folder


@pytest.mark.parametrize("line", [line for lines in CASES.values() for line in lines])
def test_a_pipe_is_refused(line, tmp_path, pipes, slide_csv, capsys, request):
    root = request.config.rootpath
    good = {
        "csv": slide_csv, "scene": lambda: root / "scenes/press", "out": lambda: tmp_path / "out",
        "recording": lambda: root / "scenes/press_roll_slide/press_roll_slide.h5",
        "slides": lambda: slide_csv("mat1_1_bio").parent,
        "scenes/training": lambda: root / "scenes/training",
    }  # fmt: skip
    words = []
    for word in line.split():
        start, brace, rest = word.partition("{")
        name, _, end = rest.partition("}")
        if brace and name in good:
            word = f"{start}{good[name]()}{end}"
        elif brace and "x" in name.split(".")[0].split("/"):
            pipes.make(tmp_path / name.split("#")[0])
            word = f"{start}{tmp_path / name}{end}"
        elif brace:
            word = f"{start}{folders(name.split('/')[0], tmp_path, pipes, root)}{end}"
        words.append(word)
    if words[0] == "train":
        pytest.importorskip("torch", reason="torch is absent: pip install tactile-core[train]")
    if words[0] in ("batch", "dataset") and "--cluster" in words:
        pytest.importorskip("distributed", reason="dask is absent: pip install tactile-core[batch]")
    status = command.main(words)
    err = capsys.readouterr().err
    assert pipes.opened == []
    assert status == 2 and "Traceback" not in err, err
    if "--start" not in line and "{bag" not in line:
        assert "pipe" in err or "regular file" in err, err
