"""Verbs that work frame by frame, or contact by contact, keep numpy from using several threads, which only wait."""

import subprocess
import sys

import pytest
from conftest import ROOT

SCENE = ROOT / "scenes" / "training"
CODE = """
import os, sys
from tactile_core.files import threads
whole = threads.one_thread
threads.one_thread = lambda: print("numpy" in sys.modules, whole(), os.environ["OPENBLAS_NUM_THREADS"])
from tactile_core.cli.main import main
main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    "words",
    ["convert absent.csv --out out", f"pairs {SCENE} --count 0 --out pairs.h5", "watch absent.csv --out now.png"],
)
@pytest.mark.parametrize("given", ["", "3"])
def test_numpy_is_told_before_it_is_imported(words, given, tmp_path, monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if given:  # the user's own word stands
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
    command = [sys.executable, "-c", CODE, *words.split()]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[0] == f"False None {given or 1}"
