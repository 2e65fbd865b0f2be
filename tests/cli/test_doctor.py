"""`tactile doctor` tells, and never fails."""

import pytest

from tactile_core.cli.main import main
from tactile_core.cli.verbs import doctor
from tactile_core.pictures.mitsuba import variant


def test_every_library_is_named(capsys, monkeypatch):
    few = [library for library in doctor.LIBRARIES if library.module in ("numpy", "h5py", "mitsuba")]
    monkeypatch.setattr(doctor, "LIBRARIES", few)  # torch alone takes seconds
    assert main(["doctor"]) == 0
    said = capsys.readouterr().out
    assert all(library.package in said for library in doctor.LIBRARIES)
    assert "pictures: " in said


def test_a_missing_library_is_called_so_once(monkeypatch):
    monkeypatch.setattr(doctor, "LIBRARIES", (doctor.Library("mitsuba", "none", "fem", "nothing"),))
    monkeypatch.setattr(doctor, "try_library", lambda library: (doctor.MISSING, "python -m pip install none"))
    line = next(line for line in doctor.report() if "none" in line)
    assert " ".join(line.split()) == "none missing nothing: python -m pip install none"


@pytest.mark.parametrize(
    ("module", "words"),
    [
        ("no_such_library", "python -m pip install"),
        ("broken_library", "ValueError: torn"),
        ("crashing_library", "exit"),
    ],
)
def test_a_library_that_fails_is_told(module, words, tmp_path, monkeypatch):
    (tmp_path / "broken_library.py").write_text("raise ValueError('torn')")
    (tmp_path / "crashing_library.py").write_text("import os; os._exit(7)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    version, trouble = doctor.try_library(doctor.Library(module, module, "fem", "nothing"))
    assert version in (doctor.MISSING, doctor.BROKEN) and words in trouble


def test_without_llvm_it_says_why_and_how_to_get_it(monkeypatch):
    monkeypatch.setattr(variant, "llvm_trouble", lambda library: "LLVM was not found")
    lines = list(doctor._mitsuba(True))
    assert "scalar_rgb" in lines[0] and "LLVM was not found" in lines[0]
    assert "LLVM 18 or newer" in lines[1]
    monkeypatch.setattr(doctor.sys, "platform", "linux")
    assert "fetch_llvm.py DIR" in doctor._advice()
    monkeypatch.setattr(doctor, "checkout", lambda: None)  # a wheel has no scripts
    assert "libllvm19" in doctor._advice() and "scripts" not in doctor._advice()
    assert "fast alone" in next(doctor._mitsuba(False))


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("LLVM 19 /usr/lib/libLLVM.so.19.1\n", ""),
        ("", ""),
        ("LLVM 16 /usr/lib/libLLVM-16.so\n", "is LLVM 16"),
        ("LLVM 0 /usr/lib/my libLLVM-15.so\n", "my libLLVM-15.so is LLVM before 16"),
    ],
)
def test_an_old_llvm_is_not_trusted(said, words):
    assert words in variant._too_old(said)
    assert bool(variant._too_old(said)) == bool(words)


def test_nothing_is_imported_from_the_current_folder(tmp_path, monkeypatch):
    """A stranger's folder may hold an h5py.py; the probe of Mitsuba's LLVM is started in the same way."""
    (tmp_path / "h5py.py").write_text("open('ran', 'w')\n")
    monkeypatch.chdir(tmp_path)
    version, trouble = doctor.try_library(next(one for one in doctor.LIBRARIES if one.module == "h5py"))
    assert version and not trouble and not (tmp_path / "ran").exists()
