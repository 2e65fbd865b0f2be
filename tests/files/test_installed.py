"""Advice on extras names no package of the index that is not ours, and what it names is required."""

from importlib import metadata

import pytest

from tactile_core.files import installed
from tactile_core.mechanics import solve

REQUIRED = [
    "numpy>=1.26", 'scipy; extra == "fem"', 'trimesh; extra == "fem"', 'tactile-core[fem]; extra == "mkl"',
    "pypardiso; (sys_platform != 'darwin') and extra == 'mkl'", 'torch==2.13.0; extra == "train"',
]  # fmt: skip


def test_a_checkout_is_installed_from():
    said = installed.advice("fem")
    assert said.startswith('python -m pip install -c constraints.txt -e ".[fem]"')
    assert installed.PACKAGE not in said


@pytest.fixture
def no_checkout(monkeypatch, tmp_path):
    monkeypatch.setattr(installed, "__file__", str(tmp_path / "a" / "b" / "c.py"))


def test_a_wheel_s_libraries_are_named_one_by_one(no_checkout, monkeypatch):
    monkeypatch.setattr(metadata, "requires", lambda package: REQUIRED)
    assert installed.advice("fem") == "python -m pip install scipy trimesh"
    assert installed.advice("mkl") == "python -m pip install scipy trimesh pypardiso"
    said = installed.advice("train")
    assert said.startswith('python -m pip install "torch==2.13.0" (') and "CUDA" in said


def test_without_metadata_the_extra_is_named(no_checkout, monkeypatch):
    monkeypatch.setattr(installed, "PACKAGE", "no-such-package")
    assert "[fem]" in installed.advice("fem")


def test_a_missing_library_says_from_python_too_how_to_install_it(monkeypatch):
    def missing(*_):
        raise ModuleNotFoundError("No module named 'scipy'", name="scipy")

    monkeypatch.setattr(solve, "solve_path", missing)
    with pytest.raises(ModuleNotFoundError) as raised:
        solve.solve("digit", None, None, force=1.0)
    assert raised.value.__notes__ == [f"Install it: {installed.advice('fem')}"]
