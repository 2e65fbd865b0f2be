"""`tactile dataset`: a folder of recordings to labelled pictures, a card and a page."""

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs.dataset import build_set, collected, survival
from tactile_core.jobs.dataset import recipe as recipes
from tactile_core.jobs.dataset.survival import ALWAYS, ARRAYS, PICTURE, RAW, Summary, rows
from tactile_core.jobs.export.finished_job import Recorded

try:
    import pyarrow  # noqa: F401
except ImportError:  # absent, or newer than this numpy
    LAYOUTS = "imagefolder"
else:
    LAYOUTS = "imagefolder,lerobot"
OBJECTS, SESSIONS = ("ball", "rolled"), 6
FRAMES = 6  # of a recording: every tenth of 60


@pytest.fixture(scope="module", autouse=True)
def few_fits():
    """Two folds and two random maps: what tells the labels apart is told by any number of them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(survival, "FOLDS", 2)
        patch.setattr(survival, "MAPS", 2)
        yield


@pytest.fixture(scope="module")
def made(recipe, folder, tmp_path_factory) -> Path:
    """The data set of the small folder, one recording of which cannot be read."""
    place = tmp_path_factory.mktemp("made")
    shutil.copytree(folder, place / "in")
    (place / "in" / "ball_broken.npz").write_bytes(b"no recording")
    assert main(command(recipe, place / "in", place / "out")) == 2
    return place / "out"


def command(recipe: Path, folder: Path, out: Path) -> list[str]:
    return ["dataset", str(recipe), str(folder), "--out", str(out), "--to", LAYOUTS]


def metadata(folder: Path) -> list[dict[str, str]]:
    with open(folder / "metadata.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_pictures_carry_labels_splits_and_numbers(made):
    held = {split: metadata(made / "imagefolder" / split) for split in ("train", "test")}
    assert {split: len(found) for split, found in held.items()} == {"train": 8 * FRAMES, "test": 4 * FRAMES}
    assert {row["session"] for row in held["test"]} == {"4", "5"}
    assert {row["object"] for row in held["train"]} == {"ball", "rolled"}
    for split, found in held.items():
        assert all((made / "imagefolder" / split / row["file_name"]).is_file() for row in found)
    pressed = [row for row in held["train"] if row["object"] == "ball" and int(row["frame"]) > 44]
    assert all(float(row["force_y_n"]) > 0.1 and 0 <= float(row["confidence"]) <= 1 for row in pressed)


def test_lerobot_keeps_splits_and_even_steps(made):
    reason = "pyarrow is absent, or newer than this numpy"
    pq = pytest.importorskip("pyarrow.parquet", reason=reason, exc_type=ImportError)
    info = json.loads((made / "lerobot" / "meta" / "info.json").read_text())
    assert info["splits"] == {"train": "0:8", "test": "8:12"}
    assert info["fps"] == 10  # every tenth frame of 100 Hz
    table = pq.read_table(made / "lerobot" / "data" / "chunk-000" / "file-000.parquet")
    assert table["frame_index"].to_pylist()[:FRAMES] == list(range(FRAMES))


def test_the_card_says_what_was_made_what_failed_and_whose_it_is(made):
    text = (made / "README.md").read_text()
    assert text.index("> Simulated.") < text.index("## What is here")
    assert "train: 8 recordings, 48 frames" in text and "1 other files of the folder were left alone" in text
    assert "ball_broken" in text and "Two &lt;objects>" in text and "not stated" in text
    assert re.search(r"\| object \(2\) \| electrodes \| 1\.00 \|", text)  # a press and a roll are easily told


def test_the_same_command_goes_on_with_the_same_bytes(made, recipe):
    before = {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in made.rglob("*.png")}
    card = (made / "README.md").read_bytes()
    assert main(command(recipe, made.parent / "in", made)) == 2
    assert (made / "README.md").read_bytes() == card
    assert {path: (path.stat().st_mtime_ns, path.read_bytes()) for path in made.rglob("*.png")} == before


def test_a_changed_recipe_does_not_overwrite(made, recipe, tmp_path, capsys):
    other = tmp_path / "other.toml"
    other.write_text(recipe.read_text().replace("every = 10", "every = 3"))
    assert main(["dataset", str(other), str(made.parent / "in"), "--out", str(made)]) == 2
    assert "holds another job" in capsys.readouterr().err


def test_the_page_shows_every_recording_in_a_browser(made):
    page = (made / "index.html").read_text("utf-8")
    assert "http" not in page and "Two &lt;objects&gt;" in page
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium here")
    shown = subprocess.run(
        [browser, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", (made / "index.html").as_uri()],
        capture_output=True, text=True, timeout=120, check=True,
    ).stdout  # fmt: skip
    assert "12 of 12 recordings" in shown


def test_the_example_learns_from_the_pictures(made):
    script = Path(__file__).parents[3] / "docs" / "learn_from_pictures.py"
    done = subprocess.run(
        [sys.executable, str(script), str(made / "imagefolder"), "object"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert float(re.search(r"right: ([\d.]+)", done.stdout)[1]) > 0.9


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"{object}_{session}.npz"', '"../{object}.npz"'), "a path inside the data set's folder"),
        (('"{object}_{session}.npz"', '"/tmp/{object}.npz"'), "a path inside the data set's folder"),
        (('"{object}_{session}.npz"', '"{object}_{object}.npz"'), "different labels"),
        (('"{object}_{session}.npz"', '"{frame}_{session}.npz"'), "different labels"),
        (('by = "session"', 'by = "sesion"'), "a label of files: object, session"),
        (("every = 10", "every = 0"), "every"),
        (("every = 10", "evry = 2"), "evry"),
        (('"tactile-dataset-1"', '"tactile-dataset-9"'), "tactile-dataset-1"),
        (('"{object}_{session}.npz"', '"{object}_{session}.mat"'), "expected {object}_{session}.mat"),
        (('"rest.npz"', '"away.npz"'), "away.npz: missing"),
        (('"rest.npz"', '"{session}_rest.npz"'), "unit.by"),
        (('"{object}_{session}.npz"', '"{confidence}_{session}.npz"'), "none of"),
        (('"{object}_{session}.npz"', '"{1}_{session}.npz"'), "named as in Python"),
        (("every = 10", 'every = 10\nsensor = "biotac_sp"'), "a recording of a BioTac; expected one of a BioTac SP"),
        (('rest = "rest.npz"\n', ""), "both or none"),
    ],
)
def test_bad_recipes_and_other_folders_are_named(recipe, folder, tmp_path, capsys, change, words):
    file = tmp_path / "bad.toml"
    file.write_text(recipe.read_text().replace(*change))
    assert main(["dataset", str(file), str(folder), "--out", str(tmp_path / "out")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out" / "README.md").exists()


def test_an_unknown_name_lists_the_known_ones(tmp_path, capsys):
    assert main(["dataset", "phac3", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert "phac2" in capsys.readouterr().err


def test_links_out_of_the_folder_are_no_rest(recipe, tmp_path):
    outside = tmp_path / "rest.npz"
    outside.write_bytes(b"")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "rest.npz").symlink_to(outside)
    file = collected.File(tmp_path / "in" / "ball_0.npz", "", {}, "train")
    with pytest.raises(TactileError, match="outside"):
        collected.beside(tmp_path / "in", "rest.npz", file)


def test_a_guessed_recipe_finds_the_recordings_it_was_guessed_from(folder, tmp_path):
    recipes.write(tmp_path / "new.toml", folder)
    recipe = recipes.read(str(tmp_path / "new.toml"))
    assert recipe.files[0] == "{label1}_{label2}.npz"
    found = collected.collect(recipe, folder, tmp_path / "out")
    expected = {(name, str(session)) for name in OBJECTS for session in range(SESSIONS)}
    assert {tuple(file.labels.values()) for file in found.files if file.labels} == expected


def test_a_recording_that_is_there_twice_is_told(monkeypatch):
    """A copy in train of what is tested makes the test worthless; two fingers of one file are no copies."""
    files = [collected.File(Path(f"/in/{part}.npz"), "", {}, part) for part in ("train", "test")]
    hand, copy = [("test.npz#0", "y"), ("test.npz#1", "y")], [("test.npz", "x")]
    said = "warning: /in/train.npz (train), /in/test.npz (test) are one recording: take the copies out of the folder"
    for others, expected in ((hand, []), (copy, [said])):
        listed = [SimpleNamespace(path=f"/in/{name}", sha256=sha) for name, sha in [("train.npz", "x"), *others]]
        monkeypatch.setattr(build_set.jobs, "read", lambda folder, listed=listed: SimpleNamespace(inputs=listed))
        told: list[str] = []
        build_set._tell_copies([("", files, SimpleNamespace(folder=None))], told.append)
        assert told == expected


def test_labels_that_differ_in_case_or_accents_alone_are_named(recipe, tmp_path, capsys):
    for name in ("Ball_1", "ball_2", "rolled_1", "T\u00fcr_1", "Tu\u0308r_1"):
        (tmp_path / "in").mkdir(exist_ok=True)
        (tmp_path / "in" / f"{name}.npz").touch()
    assert main(command(recipe, tmp_path / "in", tmp_path / "out")) == 2
    said = capsys.readouterr().err
    assert "warning: object Ball, ball are taken for different ones: rename the files" in said
    assert "warning: object Tu\u0308r, T\u00fcr are taken for different ones" in said


@pytest.mark.parametrize(
    ("sessions", "said"),
    [("14", ["no recording has the session 5, which"]), ("45", ["nothing is left to train on"]), ("145", [])],
)
def test_a_split_that_holds_out_less_than_it_names_or_all_is_told(sessions, said, recipe, tmp_path, capsys):
    (tmp_path / "in").mkdir()
    for session in sessions:
        (tmp_path / "in" / f"ball_{session}.npz").touch()
    assert main(command(recipe, tmp_path / "in", tmp_path / "out")) == 2
    warned = [line for line in capsys.readouterr().err.splitlines() if "session 5" in line or "left to train" in line]
    assert len(warned) == len(said) and all(words in line for words, line in zip(said, warned, strict=True))


@pytest.mark.parametrize(("name", "numbers"), [
    ("angle_1.5.csv", ["1.5"]), ("x_-10_y_0.6.csv", ["-10", "0.6"]), ("run.1.2.csv", ["1", "2"]),
    ("2024.01.05_a.csv", ["2024", "01", "05"]),
])  # fmt: skip
def test_dots_between_numbers_are_no_decimal_points(name, numbers):
    assert [piece for piece in recipes.PIECE.findall(name) if piece[-1].isdigit()] == numbers


def test_a_guessed_recipe_takes_a_number_as_one_label(folder, tmp_path):
    for number, force in enumerate(("-1.5", "2", "10")):
        shutil.copy(folder / "ball_0.npz", tmp_path / f"{number}_force_n-{force}.npz")
    recipes.write(tmp_path / "new.toml", tmp_path)
    assert recipes.read(str(tmp_path / "new.toml")).files == ["{label1}_force_n-{label2}.npz"]


def small(folder: Path, recipe: Path, tmp_path: Path, *changes: tuple[str, str]) -> tuple[Path, Path, Path]:
    """Two recordings and the rest, a recipe changed so, and where the result goes."""
    (tmp_path / "in").mkdir()
    for name in ("ball_0", "rolled_4", "rest"):
        shutil.copy(folder / f"{name}.npz", tmp_path / "in")
    text = recipe.read_text().replace("every = 10", "every = 20")
    for change in changes:
        text = text.replace(*change)
    (tmp_path / "own.toml").write_text(text)
    return tmp_path / "own.toml", tmp_path / "in", tmp_path / "out"


def run(recipe: Path, folder: Path, out: Path, *more: str) -> int:
    return main(["dataset", str(recipe), str(folder), "--out", str(out), *more])


def test_files_of_others_are_never_replaced(folder, recipe, tmp_path, capsys):
    own = small(folder, recipe, tmp_path)
    for name in ("README.md", "imagefolder/mine.txt"):
        shutil.rmtree(own[2], ignore_errors=True)
        (own[2] / name).parent.mkdir(parents=True)
        (own[2] / name).write_text("mine")
        assert run(*own) == 2
        assert (own[2] / name).read_text() == "mine"
        assert "expected" in capsys.readouterr().err


def test_other_labels_force_and_rest_are_never_old_ones(folder, recipe, tmp_path, capsys):
    own = small(folder, recipe, tmp_path, ("tasks =", 'force = "{object}.txt"\ntasks ='))
    np.savetxt(own[1] / "ball.txt", np.linspace(0, 2, 60))
    assert run(*own) == 0
    assert metadata(own[2] / "imagefolder" / "train")[1]["measured_force_n"] == "0.678"
    np.savetxt(own[1] / "ball.txt", np.linspace(0, 4, 60))
    assert run(*own) == 0
    assert metadata(own[2] / "imagefolder" / "train")[1]["measured_force_n"] == "1.356"
    own[0].write_text(own[0].read_text().replace("object", "thing"))
    assert run(*own) == 0
    assert metadata(own[2] / "imagefolder" / "train")[0]["thing"] == "ball"
    (own[1] / "ball.txt").write_text("no force")  # told, and the rest is done
    assert run(*own) == 0
    assert "measured_force_n" not in metadata(own[2] / "imagefolder" / "train")[0]
    assert "ball.txt" in (own[2] / "README.md").read_text()
    still = np.random.default_rng(1).integers(2990, 3010, (60, 19))
    np.savez(own[1] / "rest.npz", electrodes=still, time=np.arange(60) / 100)
    capsys.readouterr()
    assert run(*own) == 2
    assert "holds another job" in capsys.readouterr().err


def test_a_rest_beside_each_session_is_no_rest_of_all(folder, recipe, tmp_path, capsys):
    own = small(folder, recipe, tmp_path)
    for number, name in enumerate(("ball_0", "rolled_4")):
        (own[1] / str(number)).mkdir()
        shutil.move(own[1] / f"{name}.npz", own[1] / str(number))
        shutil.copy(own[1] / "rest.npz", own[1] / str(number))
    assert run(*own) == 2
    assert "one rest for all recordings of a unit" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_links_to_one_file_keep_labels_of_their_own(folder, recipe, tmp_path, caplog):
    own = small(folder, recipe, tmp_path)
    (own[1] / "linked").symlink_to(own[1])
    (own[1] / ".ball_9.npz").touch()
    (own[1] / "rolled_4.npz").unlink()
    (own[1] / "rolled_4.npz").symlink_to(own[1] / "ball_0.npz")
    (own[1] / "gone_1.npz").symlink_to(own[1] / "nowhere")
    (own[1] / "loop_1.npz").symlink_to(own[1] / "loop_1.npz")
    assert run(*own) == 2  # two files are not there
    assert "linked: a linked folder, passed over" in caplog.text and ".ball_9" not in caplog.text
    held = {row["object"]: split for split in ("train", "test") for row in metadata(own[2] / "imagefolder" / split)}
    assert held == {"ball": "train", "rolled": "test"}


def test_a_broken_file_takes_no_unit_with_it(folder, recipe, tmp_path, capsys):
    own = small(folder, recipe, tmp_path, ('found = "rest"', 'found = "adapt"'))
    (own[1] / "ball_3.npz").write_bytes(b"x")
    assert run(*own) == 2
    assert "ball_3.npz" in capsys.readouterr().err
    assert len(metadata(own[2] / "imagefolder" / "train")) == 3


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")
def test_a_name_that_no_table_can_hold_is_left_out(folder, recipe, tmp_path, capsys):
    own = small(folder, recipe, tmp_path)
    shutil.copy(own[1] / "ball_0.npz", own[1] / os.fsdecode(b"ball_\xff.npz"))
    assert run(*own) == 2
    assert "no UTF-8" in capsys.readouterr().err
    assert len(metadata(own[2] / "imagefolder" / "train")) == 3


def test_another_gel_is_a_target(folder, recipe, tmp_path, coarse_mini):
    pytest.importorskip("scipy", reason="scipy is not installed")
    own = small(folder, recipe, tmp_path, ("every = 20", "every = 55"))
    assert run(*own, "--target", coarse_mini, "--to", "imagefolder,npz") == 0
    with np.load(own[2] / "npz" / "00000_ball_0.npz") as arrays:
        assert f"expected_error_{coarse_mini}" in arrays and f"latent_{coarse_mini}" not in arrays


def test_odd_units_stay_inside_the_result(folder, recipe, tmp_path):
    own = small(folder, recipe, tmp_path, ("[unit]", '[unit]\nby = "object"'))
    shutil.move(own[1] / "rolled_4.npz", own[1] / "a .._4.npz")
    assert run(*own) == 0
    names = {"README.md", "index.html", "dataset.json", "imagefolder", "jobs", "units"}
    assert {path.name for path in own[2].iterdir()} == names


def test_a_folder_inside_the_result_is_refused(folder, recipe, tmp_path, capsys):
    own = small(folder, recipe, tmp_path)
    assert run(own[0], own[1], tmp_path) == 2
    assert "inside --out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "place", "files", "test"),
    [
        ("phac2", "biotac_phac", 30, {"trial"}), ("biotac_slides", "biotac_recordings/slide", 41, {"sample"}),
        ("sp_direction_of_slip", "biotac_sp/direction_of_slip", 35, {"object"}),
        ("sp_stability", "biotac_sp/stability", 2, {"part"}), ("syntouch_contact", "biotac_force", 2, set()),
        ("plate_normal", "biotac_plate", 1, set()),
    ],
)  # fmt: skip
def test_shipped_recipes_find_the_files_of_their_sets(name, place, files, test, outside_data, tmp_path):
    found = recipes.read(name)
    assert found.source.url.startswith("https://")
    held = collected.collect(found, outside_data(place), tmp_path)
    assert len(held.files) == files
    splits = {file.split for file in held.files}
    assert splits == ({"train", "test"} if test else {"train"})
    for label in test:  # no value is on both sides
        sides = [{file.labels.get(label) for file in held.files if file.split == split} for split in ("train", "test")]
        assert not sides[0] & sides[1]


def test_a_set_of_guesses_says_so_first():
    for name in ("sp_stability", "sp_direction_of_slip"):
        assert recipes.read(name).notes[0].startswith("A GUESS")


def examples(told: str, count: int = 40) -> list[Summary]:
    """Recordings of two classes, which the numbers `told` tell and no others."""
    rng = np.random.default_rng(0)
    found = []
    for number in range(count):
        features = {name: rng.normal(size=(1, 6)) for name in (*ARRAYS, PICTURE)}
        features[told] += 4 * (number % 2)
        recording = Recorded(f"r{number}", 1, (), {})
        told_as = {"side": np.array(["ab"[number % 2]], object), "session": np.array([str(number // 4)], object)}
        found.append(Summary(recording, 1.0, 0.0, {}, 1.0, 1.0, 1.0, {}, features, told_as))
    return found


@pytest.mark.parametrize("told", [RAW, PICTURE])
def test_survival_tells_labels_by_what_holds_them_and_by_nothing_else(told):
    pytest.importorskip("sklearn", reason="scikit-learn is not installed")
    by = {row.by: row for row in rows("side", examples(told), "session", lambda done, total: None)}
    assert by[told].right > 0.9 and by[ALWAYS].right == 0.5
    others = [row for name, row in by.items() if name in (*ARRAYS, PICTURE) and name != told]
    assert all(row.right < 0.5 + 4 * row.error for row in others)
