import json
import os
import subprocess
import sys
from pathlib import Path

import fake_tools
import pytest
from conftest import ROOT

from tactile_core.cli.main import main
from tactile_core.cli.verbs import VERBS
from tactile_core.jobs import convert


@pytest.fixture
def tactile(monkeypatch, capsys, no_sheet):
    """Run a command line in this process, without networks and contact sheets; returns (status, stdout, stderr)."""
    monkeypatch.setattr(convert, "load_tools", lambda *files, **options: fake_tools.tools())

    def run(*arguments):
        status = main([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return run


def only_line(text: str) -> str:
    (line,) = text.splitlines()
    return line


def test_no_verb_is_told_which_there_are(capsys):
    with pytest.raises(SystemExit, match="2"):
        main([])
    said = capsys.readouterr().err
    assert "tactile --help" in said and all(verb in said for verb in VERBS)


@pytest.mark.parametrize("verb", ["convert", "info", "render", "simulate", "pairs", "train", "mesh", "adapt"])
def test_each_verb_teaches_with_an_example(verb, capsys):
    with pytest.raises(SystemExit) as leave:
        main([verb, "--help"])
    assert leave.value.code == 0
    assert f"  tactile {verb} " in capsys.readouterr().out


def test_help_names_every_verb_and_the_exit_statuses(capsys):
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    said = capsys.readouterr().out
    assert all(word in said for word in (*VERBS, "Exit status"))


def test_help_costs_no_numpy():
    code = """
import sys
from tactile_core.cli import main as cli, verbs
for verb in ([], *([name] for name in verbs.VERBS)):
    try: cli.main([*verb, "--help"])
    except SystemExit: pass
assert not {"numpy", "scipy", "h5py", "tqdm"} & set(sys.modules), sorted(sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": str(ROOT)},
                          capture_output=True, text=True, timeout=60)  # fmt: skip
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("arguments", [[], ["convert"], ["convert", "a.csv"], ["fly"], ["convert", "a", "--out"]])
def test_a_wrong_command_line_exits_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as leave:
        main(arguments)
    assert leave.value.code == 2
    assert "usage: tactile" in capsys.readouterr().err


def test_one_bad_recording_is_named_and_the_others_go_on(tactile, slide_csv, tmp_path):
    paths = [slide_csv("a"), tmp_path / "absent.csv", slide_csv("b")]
    status, out, err = tactile("convert", *paths, "--out", tmp_path / "out", "--keep", "")
    assert status == 2
    assert [Path(line).name for line in out.splitlines()] == ["a", "b"]
    errors = [line for line in err.splitlines() if line.startswith("tactile: error:")]
    assert "absent.csv: there is no such file" in errors[0]
    assert errors[1] == "tactile: error: 1 of 3 recordings were not converted"
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a", "b"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--frames", "7"], "--frames"),
        (["--keep", "pictures"], "--keep"),
        (["--tare", "soon"], "tare"),
        (["--tare", "100:5000"], "tare"),
        (["--frames", "900:"], "--frames: 900: takes none of the 150 frames; expected indices from 0"),
    ],
)
def test_bad_options_end_in_one_message(arguments, words, tactile, slide_csv, tmp_path):
    status, _, err = tactile("convert", slide_csv(), "--out", tmp_path / "out", *arguments)
    assert status == 2
    assert words in only_line(err)


def test_options_reach_the_note(tactile, slide_csv, tmp_path):
    path, out = slide_csv(), tmp_path / "out"
    given = ("--kind", "raw", "--tare", "0:40", "--no-drift", "--keep", "latent", "--frames", "::3")
    assert tactile("convert", path, "--out", out, *given)[0] == 0
    options = json.loads((out / "touch" / "note.json").read_text(encoding="utf-8"))["options"]
    assert options["keep"] == ["latent"] and options["frames"] == "::3"
    prepare = options["prepare"]
    assert (prepare["kind"], prepare["tare"], prepare["drift"]) == ("raw", "0:40", False)


def test_an_older_result_stops_before_any_work(tactile, slide_csv, tmp_path, monkeypatch):
    path = slide_csv()
    assert tactile("convert", path, "--out", tmp_path / "out", "--keep", "")[0] == 0
    monkeypatch.setattr(convert, "convert", lambda *arguments: pytest.fail("work was done"))
    status, _, err = tactile("convert", slide_csv("new"), path, "--out", tmp_path / "out")
    assert status == 2
    assert "already holds a result" in only_line(err) and "--overwrite" in err


def test_info_describes_and_goes_on_after_a_bad_file(tactile, slide_csv, tmp_path):
    status, out, err = tactile("info", tmp_path / "absent.csv", slide_csv())
    assert status == 2
    assert "19 electrodes" in out and "150" in out
    assert "absent.csv" in only_line(err)


def test_what_the_system_refuses_is_one_line(tactile, slide_csv, tmp_path):
    table, long = slide_csv(), "n" * 300
    for arguments in (("info", table, "--columns", table / "map.toml"), ("batch", table, "--out", long)):
        status, _, said = tactile(*arguments)
        assert status == 2 and str(table if arguments[0] == "info" else long) in only_line(said)


def test_a_notebook_s_backend_is_not_needed(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    with pytest.raises(SystemExit, match="0"):
        main(["--help"])
    subprocess.run([sys.executable, "-c", "import matplotlib"], check=True, timeout=120)


def test_info_may_be_cut_by_its_reader(slide_csv):
    line = f'"{sys.executable}" -m tactile_core info {" ".join([str(slide_csv())] * 40)}'
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {line} | head -n 1"],
        capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)}, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["pairs", "absent.toml", "--count", "4", "--out", "p.h5"], "absent.toml"),
        (["pairs", "absent.toml", "--count", "4", "--out", "p.h5", "--workers", "0"], "--workers"),
        (["pairs", "absent.toml", "--count", "4", "--out", "p.h5", "--seed", "-1"], "--seed"),
        (["pairs", "absent.toml", "--count", "4", "--out", "p.h5", "--insecure"], "--insecure: no --cluster"),
        (["render", "absent.h5", "--out", "r", "--preset", "fast", "--variant", "scalar"], "--variant: given"),
        (["convert", ".", "--reverse", "--out", "r.h5"], ".: a folder; expected frames.h5"),
        (["simulate", "absent.toml", "--out", "r.h5"], "absent.toml"),
        (["simulate", "absent.toml", "--out", "r.h5", "--error", "50um"], "absent.toml"),
        (["simulate", "absent.toml", "--out", "r.h5", "--seed", "-1"], "--seed"),
        (["train", "absent.h5", "--out", "t", "--seed", "-1"], "--seed"),
        (["train", "absent.h5", "--out", "t", "--effort", "nan"], "--effort"),
        (["pairs", "given", "--out", "", "--count", "4"], "tactile: error: --out: an empty name"),
        *(
            ([verb, "given", "--out", ""], "tactile: error: --out: an empty name")
            for verb in ("convert", "simulate", "train")
        ),
    ],
)
def test_bad_jobs_end_in_one_message(arguments, words, tactile, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, _, err = tactile(*arguments)
    assert status == 2
    assert words in only_line(err)
    assert list(tmp_path.iterdir()) == []


def test_a_verb_names_the_extra_it_lacks(tactile, monkeypatch, tmp_path):
    def absent(options):
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    monkeypatch.setattr(VERBS["train"], "run", absent)
    status, _, err = tactile("train", "pairs.h5", "--out", tmp_path)
    assert status == 2
    assert '-e ".[train]"' in only_line(err)


@pytest.mark.parametrize(
    ("verb", "left"), [("pairs", "goes on"), ("train", "goes on"), ("simulate", "half file"), ("convert", "half file")]
)
def test_what_an_interrupted_verb_leaves_is_told(verb, left, tactile, tmp_path, monkeypatch):
    def interrupted(options):
        raise KeyboardInterrupt

    monkeypatch.setattr(VERBS[verb], "run", interrupted)
    count = ["--count", "4"] if verb == "pairs" else []
    status, _, err = tactile(verb, "given", "--out", tmp_path / "out", *count)
    assert status == 130
    assert only_line(err).startswith("tactile: interrupted; ") and left in err


def test_progress_is_silent_without_a_terminal_unless_asked(tactile, slide_csv, tmp_path):
    path = slide_csv(frames=5)
    _, _, quiet = tactile("convert", path, "--out", tmp_path / "a", "--keep", "")
    _, _, said = tactile("convert", path, "--out", tmp_path / "b", "--keep", "", "--progress")
    assert "5/5" in said and "5/5" not in quiet


def test_an_option_is_written_out(tmp_path, capsys):
    """`batch` has no --frames; as an abbreviation of --frames-apart it was taken in silence."""
    with pytest.raises(SystemExit):
        main(["batch", str(tmp_path), "--out", str(tmp_path / "job"), "--frames"])
    said = capsys.readouterr().err
    assert "unrecognized arguments: --frames" in said
    assert said.startswith("usage: tactile batch ")  # its own, which lists the options that it has


def test_a_refused_conversion_leaves_no_folder(slide_csv, tmp_path, capsys):
    (tmp_path / "weights").mkdir()
    words = ["--weights", str(tmp_path / "weights"), "--out", str(tmp_path / "new" / "out")]
    assert main(["convert", str(slide_csv(frames=5)), *words]) == 2
    assert "card.json" in only_line(capsys.readouterr().err)
    assert not (tmp_path / "new").exists()


def test_what_to_open_after_a_conversion_is_told_once(tactile, slide_csv, tmp_path):
    paths = [slide_csv(name, frames=5) for name in ("a", "b c")]
    _, out, err = tactile("convert", *paths, "--out", tmp_path / "out", "--keep", "")
    assert out.split("\n") == [str(tmp_path / "out" / "a"), str(tmp_path / "out" / "b c"), ""]
    (told,) = [line for line in err.splitlines() if line.startswith("tactile: next: ")]
    assert f"open {tmp_path / 'out' / 'a' / 'contact_sheet.png'}" in told


@pytest.mark.skipif(os.name == "nt", reason="Windows allows no line break in a file name")
def test_each_warning_is_one_line(tactile, slide_csv, tmp_path):
    status, _, err = tactile("convert", slide_csv("two\nlines"), "--out", tmp_path / "out", "--keep", "")
    assert status == 0
    assert "out_of_range" in err
    assert all(line.startswith(("tactile: warning: two lines: ", "tactile: next: ")) for line in err.splitlines())
