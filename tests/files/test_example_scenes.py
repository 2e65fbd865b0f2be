"""The example scenes are copied, whole, from a checkout and from a wheel, which has all of them."""

import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

from tactile_core.cli import main as command
from tactile_core.errors import TactileError
from tactile_core.files import example_scenes


def test_scenes_are_listed_and_copied(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert command.main(["scenes"]) == 0
    assert "press " in capsys.readouterr().out
    assert command.main(["scenes", "list", "press"]) == 2
    assert command.main(["scenes", "copy", "press", "user_mesh"]) == 0
    assert f"next: tactile simulate {Path('scenes', 'press')} --out scene.h5 --plan" in capsys.readouterr().err
    assert {file.name for file in (tmp_path / "scenes" / "user_mesh").iterdir()} >= {"scene.toml", "star.stl"}
    assert sorted(each.name for each in (tmp_path / "scenes").iterdir()) == ["press", "user_mesh"]


def test_nothing_is_written_over(tmp_path):
    (tmp_path / "ring").mkdir()
    with pytest.raises(TactileError, match=r"ring: exists already \(a folder\).* another place: .*--out") as refused:
        example_scenes.copy(["press", "ring"], tmp_path)
    assert "Remove" not in str(refused.value)  # it may hold the user's own changes
    assert [each.name for each in tmp_path.iterdir()] == ["ring"]
    with pytest.raises(TactileError, match="no scene"):
        example_scenes.copy(["../press"], tmp_path)


def test_a_full_disk_is_told(tmp_path, monkeypatch):
    def full(*places, **options):
        raise shutil.Error([("a", "b", "[Errno 28] No space left on device")])

    monkeypatch.setattr(example_scenes.shutil, "copytree", full)
    with pytest.raises(TactileError, match=r"press: cannot be written .*No space left on device"):
        example_scenes.copy(["press"], tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.fixture
def elsewhere(monkeypatch, tmp_path):
    """The package as in site-packages: no scenes beside it."""
    monkeypatch.setattr(example_scenes, "__file__", str(tmp_path / "site" / "tactile_core" / "files" / "a.py"))


def test_a_wheel_s_scenes_are_found_by_its_list_of_files(elsewhere, tmp_path, monkeypatch):
    file = tmp_path / "share/tactile/scenes/press/scene.toml"
    file.parent.mkdir(parents=True)
    file.write_text('description = "A ball."')
    script = tmp_path / "share/tactile/scenes/grasp/grasp.py"
    for each in (script, script.parent / "__pycache__" / "grasp.pyc"):  # as pip leaves them
        each.parent.mkdir(parents=True)
        each.touch()
    monkeypatch.setattr(example_scenes, "_installed_files", lambda: [tmp_path / "x" / "scene.toml", file])
    assert example_scenes.described() == ["grasp  grasp.py", "press  A ball."]


def test_an_installation_without_scenes_says_so(elsewhere, monkeypatch):
    monkeypatch.setattr(example_scenes, "PACKAGE", "no-such-package")
    with pytest.raises(TactileError, match="none in this installation"):
        example_scenes.copy([], "a")


def test_the_wheel_takes_every_scene(pytestconfig):
    root = pytestconfig.rootpath
    listed = subprocess.run(["git", "ls-files", "scenes"], cwd=root, capture_output=True, text=True, timeout=60)
    if listed.returncode:
        pytest.skip("no git checkout")
    taken = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["data-files"]
    files = {str(path.relative_to(root)) for globs in taken.values() for one in globs for path in root.glob(one)}
    missing = set(listed.stdout.split()) - files
    assert {name for name in missing if not name.startswith("scenes/training/")} == {"scenes/README.md"}
    assert "scenes/training/scene.toml" in files
