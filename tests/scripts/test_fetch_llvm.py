"""scripts/fetch_llvm.py without a network."""

from pathlib import Path

import pytest
from by_path import module_at

SCRIPT = Path(__file__).parents[2] / "scripts" / "fetch_llvm.py"


@pytest.fixture
def fetch():
    return module_at(SCRIPT)


def test_what_is_unpacked_is_found(fetch, tmp_path, capsys):
    folder = tmp_path / "usr" / "lib" / "x86_64-linux-gnu"
    folder.mkdir(parents=True)
    (folder / "libLLVM.so.19.1").write_bytes(b"")
    (folder / "libLLVM-19.so").symlink_to("libLLVM.so.19.1")
    assert fetch.main([str(tmp_path)]) == 0
    assert capsys.readouterr().out == f"{folder / 'libLLVM.so.19.1'}\n"


def test_without_apt_it_says_so(fetch, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(fetch.shutil, "which", lambda tool: None)
    assert fetch.main([str(tmp_path / "llvm")]) == 1
    assert "no apt-get" in capsys.readouterr().err
    assert not (tmp_path / "llvm").exists()
