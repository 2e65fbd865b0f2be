"""The commands that README and the pages show are run here, page by page, in a folder with small files to work on.

What a test of its own runs, or what none can run, is listed below with its place or its reason.
"""

import importlib.util
import os
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import ROOT, SHIPPED, write_counts
from labelled_recording import labelled_arrays, write_labelled
from plain_unit import plain_unit
from pressed_unit import PLACES, write_photographs

import tactile_core
from tactile_core.cli.main import main
from tactile_core.jobs import pairs
from tactile_core.jobs.engine import local
from tactile_core.simulation.scene import load_scene

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "scenes" / "README.md"]
FENCED = re.compile(r"^```([\w{}-]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")
TORCH = importlib.util.find_spec("torch") is not None
SECONDS = 900  # for one command; most take one or two

# The same command on less: what a page says, what is run here.
LESS = [
    ("--count 50000", "--count 80"),
    ("--count 20000", "--count 5"),
    ("presses/ --ball-diameter 6", "presses/ --ball-diameter 6 --quick --only press_0.png"),
    ("other_presses/ --json", "other_presses/ --only press_2.png --json"),
    ("tactile train pairs.h5", "tactile train pairs.h5 --effort 0.001"),
    ("source .venv/bin/activate", "true"),
    ("/shared/job", "shared_job"),
    ("seq 0 7 | parallel -j 8", "seq 0 1 | xargs -P 2 -I{}"),
    ("{}/8", "{}/2"),
    ("--workers 8", "--workers 2"),
    ("scenes/press --keep displacement_digit --error 5um", "brief --keep displacement_digit --error 5um"),
    ("simulate scenes/press ", "simulate short "),
    ("--frames 100:104", "--frames 100:101"),
]
# A press of one frame after rest: each of the full tier takes a second or more, and scenes/press has 200.
BRIEF = """\
format = "tactile-scene-1"
name = "brief"
description = "A 7 mm ball presses once."
[[indenters]]
kind = "sphere"
name = "ball"
radius_mm = 3.5
[recording]
indenter = "ball"
friction = 0.0
points = [
    { time_s = 0.0, x_mm = -8.0, z_mm = 0.0, force_n = 0.0 },
    { time_s = %.2f, x_mm = -8.0, z_mm = 0.0, force_n = 0.0 },
    { time_s = %.2f, x_mm = -8.0, z_mm = 0.0, force_n = 0.6 },
]
"""
# What is run by another test -> its file, and the words it is run by.
ELSEWHERE = {
    "tactile simulate scenes/press_roll_slide --grid": ("tests/jobs/engine/test_batch_kinds.py", "--grid"),
    "TACTILE_SENSORS=": ("tests/jobs/test_pairs.py", "TACTILE_SENSORS"),
    "tactile watch --rosbag-play": ("tests/jobs/live/test_live.py", "--rosbag-play"),
    "tactile watch touch.csv --serve": ("tests/jobs/live/test_frame_server.py", "--serve"),
    "tactile render frames.h5": ("tests/jobs/engine/test_batch_kinds.py", "--workers"),
    "python3 scripts/dev.py demo": (".ci/run", "dev.py demo"),
    "python3 scripts/dev.py test": (".ci/run", "dev.py test"),
    "python -m pip install": ("scripts/dev.py", '"install"'),
    "python scenes/mujoco_grasp/grasp.py": ("tests/jobs/test_mujoco_gel.py", "--no-speed"),
    "python3 scripts/build_extension.py": ("tests/blender/test_extension_zip.py", "build_extension"),
    "blender ": ("tests/blender/test_command_line.py", "tactile"),
    "tactile dataset phac2": ("tests/jobs/dataset/test_dataset.py", '"phac2"'),
    "tactile simulate scenes/press --keep electrodes --grid": ("tests/jobs/engine/test_batch_kinds.py", "--grid"),
    "tactile dataset mine.toml": ("tests/jobs/dataset/test_dataset.py", "own.toml"),
    "tactile dataset --new mine.toml": ("tests/jobs/dataset/test_dataset.py", "recipes.write"),
    "python docs/learn_from_pictures.py": ("tests/jobs/dataset/test_dataset.py", "learn_from_pictures.py"),
    "tactile adapt pressed.csv": ("tests/translation/test_force_scale.py", '"--force"'),
    "tactile adapt slips/": ("tests/recordings/test_biotac_sp.py", '["adapt"'),
    "tactile convert slips/": ("tests/translation/test_shipped_biotac_sp.py", '"convert"'),
    "tactile info slips/": ("tests/recordings/test_biotac_sp.py", '["info"'),
    "tactile calibrate presses.mp4": ("tests/pictures/calibrate/test_video_frames.py", "presses.mp4"),
    "tactile doctor": ("tests/cli/test_doctor.py", 'main(["doctor"])'),
    "tactile calibrate small/": ("tests/pictures/calibrate/test_fit.py", '"small"'),
    "python scripts/evaluate_translation.py --weights": (
        "tests/benchmarks/translation/test_evaluation_translation.py", '"--weights"',
    ),
    "sbatch ": ("tests/jobs/engine/test_batch_slurm.py", "sbatch"),
}  # fmt: skip
# What no test runs, and why.
NOT_RUN = {
    "pip download --no-deps taxim": "needs a package index; 27 MB",
    "tactile calibrate fit8/": "needs photographs of that package, which do not ship",
    "tactile calibrate --test unit.toml apart16/": "needs photographs of that package, which do not ship",
}
# The lines of batch.md's TLS recipe: the whole block is run as one below.
RECIPE = "openssl ", "T=", "DASK_DISTRIBUTED__SCHEDULER", "OMP_NUM_THREADS=1 dask worker", "export DASK"
RECIPE_JOB = "tactile batch day1 --out /shared/job --cluster"


def blocks(page: Path) -> list[tuple[str, str]]:
    """(language, text) of the fenced blocks."""
    return FENCED.findall(page.read_text(encoding="utf-8"))


def commands(page: Path) -> list[str]:
    """The lines of blocks without a language, without comments."""
    lines = [line for language, text in blocks(page) if not language for line in text.splitlines()]
    return [found for line in lines if (found := re.sub(r"(^|\s{2,})#.*", "", line).strip())]


def runs_here(command: str) -> bool:
    return not command.startswith((*ELSEWHERE, *NOT_RUN, *RECIPE, RECIPE_JOB))


def shown(pages: list[Path], language: str) -> list[pytest.param]:
    found = [(page, text) for page in pages for kind, text in blocks(page) if kind == language]
    return [pytest.param(text, id=f"{page.name}-{k}") for k, (page, text) in enumerate(found)]


@pytest.fixture(scope="module")
def inputs(tmp_path_factory) -> Path:
    """A folder with what the pages name, small."""
    folder = tmp_path_factory.mktemp("user")
    for name in ("scenes", "scripts", "constraints.txt"):
        (folder / name).symlink_to(ROOT / name)
    for name, frames in (("touch.csv", 80), ("day1/a.csv", 80), ("day2/b.csv", 80), ("touches/1.csv", None)):
        (folder / name).parent.mkdir(exist_ok=True)
        write_touch(folder / name, frames)
    with h5py.File(SHIPPED) as file, h5py.File(folder / "own.h5", "w") as own:
        own["trial_1/finger_0/electrode_data"] = np.rint(file["electrodes"][:80])
        own["trial_1/stamps"] = 10**7 * np.arange(80)  # ns
    (folder / "slips").mkdir()
    for name in ("n1", "n2", "s1"):  # of a BioTac SP
        counts = np.random.default_rng(0).integers(2600, 3700, (30, 24))
        header = ",".join(f"ff_e{number}" for number in range(1, 25))
        np.savetxt(folder / "slips" / f"{name}.csv", counts, fmt="%d", delimiter=",", header=header, comments="")
    (folder / "locations.csv").touch()
    for name, rest in (("brief", 0.01), ("short", 1.03)):
        (folder / name).mkdir()
        (folder / name / "scene.toml").write_text(BRIEF % (rest, rest + 0.01))
    # A fit takes the time of its pixels and presses, and tests of calibrations find a unit's numbers from larger ones.
    write_photographs(folder / "presses", plain_unit().at_size(30, 40), PLACES[:3])
    shutil.copytree(folder / "presses", folder / "other_presses")
    if TORCH:
        write_labelled(folder / "labelled.hdf5", labelled_arrays())
    return folder


@pytest.fixture
def workers_here(monkeypatch) -> None:
    """Jobs run in this process, in blocks of one press: starting workers takes most of a small job's time."""
    monkeypatch.setattr(local, "Local", lambda folder, workers: local.InProcess(folder))
    monkeypatch.setattr(pairs, "BLOCK", 1)


def write_touch(path: Path, frames: int | None) -> None:
    """The first frames of the recording that ships, as raw readings in CSV."""
    with h5py.File(SHIPPED, "r") as file:
        electrodes = file["electrodes"][:frames]
    write_counts(path, electrodes)


@pytest.fixture
def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


@pytest.fixture
def user(inputs, tmp_path) -> Path:
    """That folder's copy for one page."""
    folder = tmp_path / "user"
    shutil.copytree(inputs, folder, symlinks=True)
    return folder


def run(command: str, folder: Path, capsys: pytest.CaptureFixture) -> tuple[int, str]:
    """Exit status and words of a page's line: of our command line in this process, else in bash."""
    for page, here in LESS:
        command = command.replace(page, here)
    if command.startswith("tactile ") and not set(command) & set("|&;$<>"):
        try:
            status = main(in_bash(f"printf '%s\\n' {command}", folder).stdout.splitlines()[1:])
        except SystemExit as end:  # as after --help, and of words that the parser refuses
            status = end.code
        return status, "".join(capsys.readouterr())
    done = in_bash(command, folder)
    return done.returncode, done.stdout + done.stderr


def in_bash(text: str, folder: Path) -> subprocess.CompletedProcess:
    return process(folder, "bash", "-c", text)


def process(folder: Path, *command: str | Path) -> subprocess.CompletedProcess:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=SECONDS)


@pytest.mark.skipif(os.name == "nt", reason="the pages' commands are written for a Unix shell")
@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.name)
@pytest.mark.usefixtures("no_sheet", "coarse_fits", "workers_here")
def test_commands_work(page, user, monkeypatch, capsys):
    monkeypatch.chdir(user)
    every = commands(page)
    if TORCH:
        monkeypatch.setattr("tactile_core.training.fine_tune.EPOCHS", 1)  # of thirty, which take half a minute
    if not TORCH and any(command.startswith("tactile train") for command in every):
        pytest.skip("torch is not installed: dev.py test --train")
    if "tactile scenes copy" in every:
        (user / "scenes").unlink()  # a page that says so works without a checkout's scenes
    for command in every:
        if runs_here(command):
            status, said = run(command, user, capsys)
            assert status == 0, f"{command}\n{said}"


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make certificates with")
def test_the_tls_recipe_works(user, free_port):
    """The page's block as one script: what runs on the head and on each machine runs here, behind it."""
    pytest.importorskip("distributed", reason="distributed is absent: pip install tactile-core[batch]")
    lines = [line for line in commands(ROOT / "docs" / "batch.md") if line.startswith((*RECIPE, RECIPE_JOB))]
    kept = [re.sub(r"^(?=DASK|OMP)", "exec env ", line) for line in lines]
    behind = [f"({line}) 2>>dask.log &" if line.startswith("exec") else line for line in kept]
    text = "\n".join(["trap 'kill $(jobs -p)' EXIT", *behind])
    text = text.replace("head:8786", f"127.0.0.1:{free_port}").replace("8786", f"{free_port} --no-dashboard")
    done = in_bash(text.replace("/shared/job", "tls_job"), user)
    assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}\n{(user / 'dask.log').read_text()}"
    assert len(lines) == 7 and list((user / "tls_job").rglob("*.h5"))
    assert f"tls://127.0.0.1:{free_port}" in (user / "dask.log").read_text()


def test_what_is_not_run_here_is_shown_and_run_there():
    every = [command for page in PAGES for command in commands(page)]
    for start in (*NOT_RUN, *RECIPE, RECIPE_JOB):
        assert any(command.startswith(start) for command in every), f"no page shows {start}"
    for start, (file, word) in ELSEWHERE.items():
        assert any(command.startswith(start) for command in every), f"no page shows {start}"
        assert word in (ROOT / file).read_text(encoding="utf-8"), f"{file} does not run {start}"


# That of Blender's page is run there (tests/blender/test_documented.py).
@pytest.mark.parametrize("text", [each for each in shown(PAGES, "python") if "import bpy" not in each.values[0]])
def test_python_of_a_page_runs(text, user):
    if not TORCH and "tactile_core.training" in text:
        pytest.skip("torch is not installed: dev.py test --train")
    done = process(user, sys.executable, "-c", text)
    assert done.returncode == 0 and done.stdout, done.stderr


EXAMPLES = sorted((ROOT / "docs").glob("*_and_*.py"))


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda script: script.stem)
def test_an_example_script_draws_its_figure(script, tmp_path):
    copied = shutil.copy(script, tmp_path)  # as by a user of a wheel, who has no checkout beside it
    done = process(tmp_path, sys.executable, copied)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / f"{script.stem}.png").stat().st_size > 20_000  # bytes; an empty figure takes 4,000
    assert re.search(r"\d", done.stdout), "it prints what it measured"


@pytest.mark.skipif(importlib.util.find_spec("sphinx") is None, reason="sphinx is absent: dev.py docs")
def test_the_site_builds_without_a_warning(tmp_path):
    done = process(ROOT, sys.executable, "-m", "sphinx", "--fail-on-warning", "-q", "docs", tmp_path / "site")
    assert done.returncode == 0, done.stdout + done.stderr
    reference = (tmp_path / "site" / "api.html").read_text(encoding="utf-8")
    assert all(f'id="tactile_core.{name}' in reference for name in tactile_core.__all__)


@pytest.mark.parametrize("text", [each for each in shown(PAGES, "toml") if "tactile-scene-1" in each.values[0]])
def test_a_scene_of_a_page_loads(text, tmp_path):
    (tmp_path / "scene.toml").write_text(text)
    scene = load_scene(tmp_path)[0]
    assert scene.indenters
    # what converts the recording takes its rest from there: no word of a missing one
    first = scene.recording.points[:2]
    assert [point.force_n for point in first] == [0, 0] and first[1].time_s - first[0].time_s >= 0.5


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    targets = LINK.findall(page.read_text(encoding="utf-8"))
    assert not [target for target in targets if not (page.parent / target).exists()]
