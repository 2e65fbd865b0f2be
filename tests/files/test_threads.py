"""Linear algebra stays in one thread: where verbs work frame by frame or contact by contact, and in a block."""

import subprocess
import sys
import threading

import numpy as np  # noqa: F401 - loads a library of linear algebra
import pytest
import threadpoolctl
from conftest import ROOT, SHIPPED

import tactile_core as tactile
from tactile_core.files import threads

SCENE = ROOT / "scenes" / "training"
CODE = """
import os, sys
from tactile_core.files import threads
whole = threads.one_thread
threads.one_thread = lambda: print("numpy" in sys.modules, whole() and os.environ["OPENBLAS_NUM_THREADS"])
from tactile_core.cli.main import main
main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    "words",
    [
        "convert absent.csv --out out",
        f"pairs {SCENE} --count 0 --out pairs.h5",
        "watch absent.csv --out now.png",
        "render absent.npz --out out",
    ],
)
@pytest.mark.parametrize("given", ["", "3"])
def test_numpy_is_told_before_it_is_imported(words, given, tmp_path, monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    if given:  # the bytes would differ from those of workers
        monkeypatch.setenv("OPENBLAS_NUM_THREADS", given)
    command = [sys.executable, "-c", CODE, *words.split()]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.stdout.splitlines()[0] == "False 1"


def test_libraries_that_are_loaded_are_limited_and_have_their_threads_back(monkeypatch):
    for name in threads.ONE:  # restored after the test
        monkeypatch.setenv(name, "2")
    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        before = counts()
        with threads.one_thread():
            assert set(counts()) <= {1}
        assert counts() == before


def test_the_last_of_several_blocks_gives_the_threads_back():
    @threads.in_one_thread
    def inner():
        return own()

    def own():
        """Of numpy's and scipy's libraries; torch or MKL may have been loaded since, which nothing here computes by."""
        return [each.num_threads for each in threads._libraries("scipy.linalg" in sys.modules)]

    with threadpoolctl.threadpool_limits(2, user_api="blas"):
        before = counts()
        with threads.in_one_thread:
            assert set(inner()) == {1}
            assert set(own()) == {1}
            other = threading.Thread(target=inner)
            other.start()
            other.join()
            assert set(own()) == {1}
        assert counts() == before
        with pytest.raises(ZeroDivisionError), threads.in_one_thread:
            1 / 0  # noqa: B018
        assert counts() == before


def test_a_gel_and_a_translation_give_the_same_bytes_at_any_number_of_threads():
    recording, found = tactile.read(SHIPPED), []
    for count in (1, 2):
        with threadpoolctl.threadpool_limits(count, user_api="blas"):
            gel = tactile.Gel("digit", tactile.indenters.Sphere(15e-3))
            contact = gel.press(gel.touching(-7e-3, 0.0), force=2.0)
            touch = tactile.translate(recording, frames=slice(100, 140))
            found.append((contact.displacement.tobytes(), gel.picture().tobytes(), touch.displacement_digit.tobytes()))
    assert found[0] == found[1]


def counts():
    return [each["num_threads"] for each in threadpoolctl.threadpool_info() if each["user_api"] == "blas"]
