"""The set-up script, as far as it goes without installing anything; `.ci/run` does the rest on a fresh environment."""

import ast
import os
import re
import subprocess
import sys
import tomllib

import pytest
from by_path import module_at
from conftest import ROOT

SCRIPT = ROOT / "scripts" / "dev.py"


@pytest.fixture
def dev():
    return module_at(SCRIPT)


@pytest.fixture
def pip(dev, monkeypatch):
    """A pip that does nothing but note what it was asked for; set ``pip.works`` false to make it fail."""

    class Pip(list):
        works = True

        def __call__(self, python, folder, what, numpy):
            self.append((what[-1], numpy))
            return self.works

    pip = Pip()
    monkeypatch.setattr(dev, "run_pip", pip)
    return pip


@pytest.fixture
def venv(dev, monkeypatch, tmp_path):
    """Environments are made without pip, which takes seconds; they count as usable when their Python exists."""
    create = dev.venv.create
    monkeypatch.setattr(dev.venv, "create", lambda folder, **more: create(folder, **(more | {"with_pip": False})))
    usable = dev.why_unusable

    def without_pip(python, have):
        why = usable(python, have)
        return None if why == "it is half made" and python.exists() else why

    monkeypatch.setattr(dev, "why_unusable", without_pip)
    return tmp_path / "énv with space"


def test_a_second_call_installs_nothing(dev, pip, venv):
    dev.install(venv, ("dev",))
    dev.install(venv, ("dev",))
    dev.install(venv, ())
    assert pip == [(".[dev]", None)]
    dev.install(venv, ("dev", "train"))
    dev.install(venv, ("dev",))
    assert pip[1:] == [(".[dev,train]", None)]


@pytest.mark.parametrize("change", ["numpy", "sources_hash", "python_version"])
def test_other_versions_install_again(change, dev, pip, venv, monkeypatch):
    dev.install(venv, ())
    if change != "numpy":
        monkeypatch.setattr(dev, change, lambda: "3.13.99")
    dev.install(venv, (), "1.26.4" if change == "numpy" else None)
    assert len(pip) == 2


def test_a_failed_installation_is_told_and_tried_again(dev, pip, venv):
    pip.works = False
    with pytest.raises(dev.SetupError, match="pip could not install"):
        dev.install(venv, ())
    pip.works = True
    dev.install(venv, ())
    dev.install(venv, ())
    assert len(pip) == 2


def test_an_interrupted_installation_is_made_anew(dev, venv, monkeypatch, capsys):
    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(dev, "run_pip", interrupted)
    with pytest.raises(KeyboardInterrupt):
        dev.install(venv, ())
    (venv / "debris").write_text("x")
    monkeypatch.setattr(dev, "run_pip", lambda *arguments: True)
    dev.install(venv, ())
    assert "again: its installation was interrupted" in capsys.readouterr().out
    assert not (venv / "debris").exists()


def test_a_half_made_environment_is_made_anew(dev, pip, venv, capsys):
    venv.mkdir()
    (venv / "pyvenv.cfg").write_text("home = nowhere\n")
    assert dev.install(venv, ()).exists()
    assert "again: it is half made" in capsys.readouterr().out


def test_a_folder_with_other_things_is_never_cleared(dev, pip, tmp_path):
    (tmp_path / "thesis.tex").write_text("x")
    for folder in (tmp_path, tmp_path / "thesis.tex"):
        with pytest.raises(dev.SetupError, match="holds something else"):
            dev.install(folder, ())
    assert (tmp_path / "thesis.tex").read_text() == "x"


@pytest.mark.parametrize("version", [(3, 8), (3, 10), (3, 14)])
def test_other_pythons_are_told_what_is_needed(version, dev):
    with pytest.raises(dev.SetupError, match=rf"Python {version[0]}\.{version[1]}; the project needs 3\.11 to 3\.13"):
        dev.check_python(version)


def test_old_pythons_can_read_the_script_far_enough_to_be_told():
    ast.parse(SCRIPT.read_text(encoding="utf-8"), feature_version=(3, 7))


def test_pip_without_a_network_is_told(dev, tmp_path, monkeypatch):
    """The real pip, on an index that nobody serves."""
    for name in [name for name in os.environ if name.startswith("PIP_")]:
        monkeypatch.delenv(name)
    for name, value in {"INDEX_URL": "http://127.0.0.1:9/simple", "CONFIG_FILE": os.devnull, "RETRIES": "0"}.items():
        monkeypatch.setenv(f"PIP_{name}", value)
    with pytest.raises(dev.SetupError, match="reaches no package index, check the network"):
        dev.install(tmp_path / "venv", ())


def test_every_dependency_is_pinned():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].values()
    wanted = [*project["dependencies"], *(line for extra in extras for line in extra)]
    named = {re.split(r"[\[<>=~!; ]", line)[0] for line in wanted} - {project["name"]}
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pinned = {line.partition("==")[0] for line in lines if line and not line.startswith("#")}
    assert named <= pinned
    assert all(re.fullmatch(r"[\w.-]+==[\w.+]+", line) for line in lines if line and not line.startswith("#"))


def test_the_commit_hook_checks_with_the_pinned_ruff():
    pinned = re.search(r"(?m)^ruff==(.+)$", (ROOT / "constraints.txt").read_text(encoding="utf-8")).group(1)
    assert f"rev: v{pinned} " in (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("command", ["check", "docs"])
def test_tools_run_after_one_another_and_the_first_failure_counts(command, dev, pip, venv, monkeypatch):
    ran = []
    monkeypatch.setattr(dev.subprocess, "call", lambda command, **more: ran.append(command[2]) or len(ran) + 4)
    assert dev.main([command, "--venv", str(venv)]) == 5
    assert ran == [tool[0] for tool in dev.TOOLS[command]]
    assert pip == [(f".[{command}]", None)]


@pytest.mark.parametrize(
    ("asked", "cores", "added"),
    [
        ([], 2, ["-n", "2", "--dist", "worksteal"]),
        (["-q"], 64, ["-n", "4", "--dist", "worksteal"]),
        ([], 1, []),
        (["tests/cli", "-x"], 2, []),
    ],
)
def test_the_whole_suite_runs_on_every_core(asked, cores, added, dev, pip, venv, monkeypatch):
    ran = []
    monkeypatch.setattr(dev.os, "cpu_count", lambda: cores)
    monkeypatch.setattr(dev.subprocess, "call", lambda command, **more: ran.append((command[2:], more["env"])) or 0)
    assert dev.main(["test", "--venv", str(venv), *asked]) == 0
    command, variables = ran[-1]
    assert command == ["pytest", *asked, *added]
    assert variables.get("OMP_NUM_THREADS") == "1" or not added


def test_the_root_file_of_the_blender_extension_does_not_disturb_pytest(tmp_path):
    (tmp_path / "pyproject.toml").write_bytes((ROOT / "pyproject.toml").read_bytes())
    (tmp_path / "__init__.py").write_text("from .addon import register, unregister\n")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_one.py").write_text("def test_one():\n    assert True\n")
    command = [sys.executable, "-m", "pytest", "-q"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout


def test_the_demo_recording_ships(dev):
    assert dev.DEMO_RECORDING.exists()
