"""Compiled loops are kept on disk for the next process, whatever its name of the package, and give numpy's numbers."""

import ast
import signal
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

from tactile_core import sensors
from tactile_core.files import compiled
from tactile_core.geometry.indenters import Box, LyingCylinder, Ring, Sphere
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import Step, solve_path
from tactile_core.pictures.height_map import folds_counted, gel_mapper
from tactile_core.pictures.renderer import Renderer

INTERPOLATE = """
import os, sys, types
sys.path.insert(0, os.getcwd())
import numpy as np
sys.modules["bl_ext"] = types.ModuleType("bl_ext")
sys.modules["bl_ext"].__path__ = sys.path[:1]
if {package!r} == "tactile_core":
    del sys.modules["bl_ext"]
from {package}.geometry.cubic_spline import on_grid
nodes = np.stack(np.meshgrid(np.arange(4.0), np.arange(5.0), [0.0], indexing="ij"))[..., 0]
print(on_grid(nodes, np.array([[1.5], [2.25]]), closed=False).round(6).tolist())
"""


def interpolated(package):
    """What a process prints that knows the package by this name."""
    command = [sys.executable, "-c", INTERPOLATE.format(package=package)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_what_blender_compiles_under_its_own_name_does_not_break_other_processes(tmp_path, monkeypatch):
    """There the package is bl_ext.user_default.tactile.tactile_core, and its worker calls it tactile_core."""
    pytest.importorskip("numba")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv(compiled.SWITCH, "1")
    for package in ("bl_ext.tactile_core", "tactile_core", "bl_ext.tactile_core"):
        assert interpolated(package) == "[[1.5, 2.25, 0.0]]\n"
    assert list(tmp_path.rglob("*.nbi"))


FEW_AND_MANY = """
import os, pathlib
import numpy as np
from tactile_core.geometry.indenters import Sphere
on_disk = lambda: len(list(pathlib.Path(os.environ["NUMBA_CACHE_DIR"]).rglob("*.nbi")))
points, before = np.random.default_rng(0).normal(size=(10_000, 3)), on_disk()
few = Sphere(0.5).distance(points[:50])
between, many = on_disk(), Sphere(0.5).distance(points)
print(before, between, on_disk(), all(np.array_equal(a, b[:50]) for a, b in zip(few, many)))
"""


def test_few_points_are_not_compiled_for_and_get_the_same_bits(tmp_path, monkeypatch):
    pytest.importorskip("numba")
    if np.lib.NumpyVersion(np.__version__) < "2.0.0":
        pytest.skip("numpy 1 rounds otherwise: there every loop is compiled at its first call")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv(compiled.SWITCH, raising=False)
    for counts in ("0 0 1", "1 1 1"):  # first process, and the next, which finds it on disk
        done = subprocess.run(
            [sys.executable, "-c", FEW_AND_MANY], cwd=ROOT, capture_output=True, text=True, timeout=300
        )
        assert done.stdout == f"{counts} True\n", done.stderr


@pytest.mark.parametrize(
    ("owner", "name", "failure"),
    [
        ("CacheImpl", "_locator_classes", None),  # no folder that this user may write
        ("IndexDataCacheFile", "save", OSError(28, "No space left on device")),
        ("IndexDataCacheFile", "load", EOFError("Ran out of input")),  # emptied, as by a power cut
    ],
)
def test_loops_are_compiled_where_they_cannot_be_kept(owner, name, failure, tmp_path, monkeypatch, compiled_loops):
    caching = pytest.importorskip("numba.core.caching")

    def fails(*_):
        raise failure

    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(getattr(caching, owner), name, fails if failure else [])
    compiled_loops(True)

    @compiled.Loop
    def doubled(values):
        return 2 * values.sum()

    assert [doubled(np.ones(30_000)), doubled(np.ones((2, 3)))] == [60_000, 12]


def test_a_loop_that_fails_is_not_run_again(compiled_loops, monkeypatch):
    if np.lib.NumpyVersion(np.__version__) < "2.0.0":
        pytest.skip("numpy 1 rounds otherwise: there every loop is compiled at its first call")
    compiled_loops(True)
    monkeypatch.delenv(compiled.SWITCH, raising=False)
    runs = []

    @compiled.Loop
    def failing(values):
        runs.append(1)
        raise TimeoutError("as an alarm's handler raises")

    with pytest.raises(TimeoutError):
        failing(np.ones(3))
    assert len(runs) == 1


def test_a_stop_during_a_compiled_loop_is_itself(tmp_path, monkeypatch, compiled_loops):
    pytest.importorskip("numba")
    if not hasattr(signal, "setitimer"):
        pytest.skip("Windows has no timer that signals")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    compiled_loops(True)

    @compiled.Loop
    def counted(values):  # half a second in compiled code
        total = 0.0
        for _ in range(25_000_000):
            for j in range(len(values)):
                total += values[j]
        return total, values.copy()  # a tuple: for it numba calls Python, which hears the signal

    counted(np.ones(0))
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            signal.setitimer(signal.ITIMER_REAL, 0.05)
            counted(np.ones(20))
    finally:
        signal.signal(signal.SIGALRM, before)


def test_a_stop_is_itself_however_often_numba_wraps_it(compiled_loops):
    compiled_loops(False)

    @compiled.Loop
    def stopped():
        try:
            try:
                raise KeyboardInterrupt
            except KeyboardInterrupt as stop:
                raise SystemError("_numba_unpickle returned a result with an exception set") from stop
        except SystemError as error:
            raise SystemError("counted returned a result with an exception set") from error

    with pytest.raises(KeyboardInterrupt):
        stopped()


SHAPES = {
    "ball": Sphere(1.5e-3),
    "box": Box((2e-3, 2e-3, 2e-3), 0.3e-3),
    "side": LyingCylinder(1e-3, 0.5e-3, 3e-3),
    "ring": Ring(1.5e-3, 0.5e-3),
}
# arcsinh, cosine and sine of numpy and of the C library differ in their last bits. Before version 2 numpy multiplies a
# single float32 by a Python float in float64, numba in float32, as a matrix is stored: 6e-8 an operation.
ROUNDING = 1e-10 if np.lib.NumpyVersion(np.__version__) >= "2.0.0" else 1e-6
PATH = [Step(depth=0.1e-3), Step(depth=0.1e-3, slide=(0.1e-3, 0.0)), Step(force=0.05)]


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize(("sensor", "friction"), [("digit", 0.0), ("biotac", 0.78)])
def test_contacts_do_not_depend_on_what_is_installed(name, sensor, friction, compiled_loops):
    place, found = Placement(-6e-3, 1e-3, 0.1, 1.0), []
    for on in (True, False):
        compiled_loops(on)
        assert compiled.available() == on
        found.append(list(solve_path(sensor, SHAPES[name], place, PATH, friction=friction)))
    for fast, plain in zip(*found, strict=True):
        assert fast.converged and fast.iterations == plain.iterations
        np.testing.assert_array_equal(fast.contact_patch, plain.contact_patch)
        for one, other in ((fast.displacement, plain.displacement), (fast.force, plain.force)):
            np.testing.assert_allclose(one, other, rtol=0, atol=ROUNDING * np.abs(other).max())


def dents(count: int) -> np.ndarray:
    """Smooth displacements (count, n, 3) m at random places: dents that also move sideways."""
    random, rest = np.random.default_rng(5), sensors.digit_surface().rest
    moved = np.zeros((count, *rest.shape))
    for each in moved:
        x, z = random.uniform(-13e-3, -2e-3), random.uniform(-4e-3, 4e-3)
        shape = np.exp(-((rest[:, 0] - x) ** 2 + (rest[:, 2] - z) ** 2) / random.uniform(1e-3, 3e-3) ** 2)
        each[:] = shape[:, None] * random.uniform([-0.2e-3, 0.1e-3, -0.2e-3], [0.2e-3, 0.9e-3, 0.2e-3])
    return moved


def test_heights_and_pictures_are_numpys(compiled_loops):
    renderer, mapper, found = Renderer(preset="fast"), gel_mapper(), {}
    for on in (False, True):
        compiled_loops(on)
        heights = mapper(dents(12))
        found[on] = heights, [renderer(height) for height in heights]
    assert np.abs(found[True][0] - found[False][0]).max() < 1e-9  # m, float32's rounding of a height
    compiled_loops(True)
    for height, picture in zip(*found[False], strict=True):
        np.testing.assert_array_equal(renderer(height), picture)  # light, shadows and levels, to the bit
    assert np.ptp(found[True][1][0].astype(int) - found[True][1][1]) > 20  # grey levels: something is seen


def test_a_gel_that_folds_over_itself_is_counted_as_numpy_counts_it(compiled_loops):
    rest, folding = sensors.digit_surface().rest, np.zeros((1, *sensors.digit_surface().rest.shape))
    # m, pushed along the finger farther than its places lie apart
    folding[0, :, 0] = 1e-3 * np.sin(rest[:, 0] / 0.4e-3)
    found = {}
    for on in (False, True):
        compiled_loops(on)
        with folds_counted() as folds:
            found[on] = gel_mapper()(folding), folds
    assert found[True][1] == found[False][1] and found[True][1][0] > 100
    assert np.isfinite(found[True][0]).all()


def test_no_loop_takes_powers_which_compiled_code_rounds_otherwise():
    for file in sorted((ROOT / "tactile_core").rglob("*.py")):
        text = file.read_text(encoding="utf-8")
        for function in ast.walk(ast.parse(text)) if "Loop" in text else ():
            if isinstance(function, ast.FunctionDef) and any("Loop" in ast.unparse(d) for d in function.decorator_list):
                assert not any(isinstance(node, ast.Pow) for node in ast.walk(function)), (file.name, function.name)
