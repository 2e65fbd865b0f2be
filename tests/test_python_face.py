"""Public names of the package: listed by dir and help, imported at first use; from a CSV to pictures in five lines."""

import dataclasses
import json
import os
import pydoc
import subprocess
import sys
import tomllib
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import trimesh

import tactile_core as tactile
from tactile_core.files.installed import advice
from tactile_core.geometry.indenters import Pose
from tactile_core.recordings import PrepareOptions
from tactile_core.recordings.recording import Recording, Truth

ROOT = Path(__file__).parent.parent
NO_PLACE = np.full((2, 2), np.nan)


def test_dir_lists_the_public_names_alone():
    assert [name for name in dir(tactile) if not name.startswith("__")] == sorted(tactile.__all__)


def test_every_public_name_is_there_and_teaches():
    for name in tactile.__all__:
        assert getattr(tactile, name).__doc__, name
    for name in ("read", "translate", "load_calibration", "Renderer", "solve", "Placement", "Gel"):
        text = pydoc.render_doc(getattr(tactile, name))
        assert ">>>" in text and " m" in text, f"help(tactile.{name}) needs an example and units"


def test_results_print_a_line_for_each_field(slide_csv):
    recording = tactile.read(slide_csv())
    ball = tactile.indenters.Sphere(radius=3e-3)
    contact = tactile.solve("digit", ball, tactile.Placement(x=-6e-3, z=0.0), force=2.0)
    lines = repr(contact).splitlines()
    assert lines[0] == "Solution" and "  tier           'fast'" in lines
    assert f"  depth          {contact.depth:.6g}" in lines
    touching, place = np.count_nonzero(contact.contact_patch), f"{contact.displacement.min():.4g} to "
    assert f"  contact_patch  (2867,) bool, {touching} true" in lines
    assert any(line.startswith(f"  displacement   (2867, 3) float64, {place}") for line in lines)
    assert not any("on_demand" in line or "between" in line for line in lines)  # hidden; None
    for result in (recording, tactile.translate(recording)):
        assert all(len(line) < 200 for line in repr(result).splitlines()), repr(result)
    assert "electrodes  (150, 19) float64, " in repr(recording) and "  about       {}" in repr(recording)
    assert repr(tactile.Renderer(preset="fast")) == "<Renderer of a digit, preset fast, pictures (320, 240, 3)>"
    assert "under Sphere(radius=0.003)>" in repr(tactile.Gel("digit", ball))


def test_missing_numbers_are_counted():
    truth = Truth(displacement_biotac=None, displacement_digit=None, force=np.zeros(3), contact_center=NO_PLACE)
    assert repr(truth).splitlines()[1:3] == [
        "  force           [0. 0. 0.]",
        "  contact_center  (2, 2) float64, all NaN",
    ]
    half = dataclasses.replace(truth, contact_center=np.array([[1.0, np.nan]]), force=np.zeros((0, 3)))
    assert repr(half).splitlines()[1:3] == [
        "  force           (0, 3) float64",
        "  contact_center  (1, 2) float64, 1 to 1, 1 NaN",
    ]


def test_solve_presses_a_trimesh_and_refuses_what_is_no_body():
    ball = trimesh.creation.icosphere(2, 1e-3)  # m
    place = tactile.Placement(x=-6e-3, z=0.0)
    force = tactile.solve("digit", ball, place, depth=0.3e-3).force
    assert force[1] > 0.01  # N
    body = tactile.indenters.MeshIndenter.from_trimesh(ball)
    np.testing.assert_array_equal(force, tactile.solve("digit", body, place, depth=0.3e-3).force)
    with pytest.raises(tactile.TactileError, match=r"a int; expected .* trimesh\.Trimesh in metres"):
        tactile.solve("digit", 3, place, force=1.0)


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(AttributeError, match=r"'convert'; its public names: .*translate"):
        _ = tactile.convert


def test_types_ship_with_the_package():
    assert (ROOT / "tactile_core" / "py.typed").exists()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "py.typed" in project["tool"]["setuptools"]["package-data"]["tactile_core"]


WITHOUT_EXTRAS = """
import json, sys, types

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {extras!r}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)

sys.meta_path.insert(0, Blocker())
import numpy as np, tactile_core as tactile
from tactile_core.jobs.gel_observation import observation_space

ball, place = tactile.indenters.Sphere(3e-3), tactile.Placement(-6e-3, 0.0)
body = types.SimpleNamespace(vertices=4e-3 * np.eye(4)[:, :3], faces=[[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]])
notes = {{}}
for extra, call in (
    ("fem", lambda: tactile.solve("digit", ball, place, force=1.0)),
    ("fem", lambda: tactile.Gel("digit", ball)),
    ("fem", lambda: tactile.indenters.MeshIndenter.from_trimesh(body)),
    ("fem", lambda: tactile.indenters.MeshIndenter.from_file({mesh!r})),
    ("render", lambda: tactile.Renderer()),
    ("render", lambda: tactile.Renderer(preset="quality")),
    ("ros", lambda: tactile.read({bag!r})),
    ("mujoco", lambda: observation_space(np.zeros((2, 2)))),
):
    try:
        call()
        notes.setdefault(extra, []).append("no error")
    except ModuleNotFoundError as error:
        notes.setdefault(extra, []).append(" ".join(getattr(error, "__notes__", ["no note"])))
print(json.dumps(notes))
"""


def test_without_extras_each_public_name_says_how_to_install_its_own(tmp_path):
    bag = tmp_path / "touch.bag"
    bag.write_text("#ROSBAG V2.0\n", encoding="utf-8")
    extras = {"scipy", "trimesh", "mitsuba", "drjit", "rosbags", "mujoco", "gymnasium"}
    mesh = str(ROOT / "scenes" / "user_mesh" / "star.stl")
    code = WITHOUT_EXTRAS.format(extras=extras, bag=str(bag), mesh=mesh)
    environment = {**os.environ, "TACTILE_CACHE": str(tmp_path / "cache")}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    for extra, notes in json.loads(done.stdout).items():
        assert set(notes) == {f"Install it: {advice(extra)}"}, extra


def test_an_unknown_preset_is_refused_before_mitsuba_is_looked_for(monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    with pytest.raises(tactile.TactileError, match="'best'; expected one of fast, standard"):
        tactile.Renderer(preset="best")


def test_a_calibration_may_be_named_by_its_file():
    file = ROOT / "scenes" / "calibrations" / "gelsight_mini_dots.toml"
    assert tactile.Renderer(str(file), "fast").calibration == tactile.load_calibration(file)
    ball = tactile.indenters.Sphere(3e-3)
    assert tactile.Gel("gelsight_mini", ball, calibration=file).picture().shape == (240, 320, 3)
    for made in (
        lambda given: tactile.Renderer(given, "fast"),
        lambda given: tactile.Gel("digit", ball, calibration=given),
    ):
        with pytest.raises(tactile.TactileError, match=r"calibration: 3; expected a Calibration, or its file"):
            made(3)
        with pytest.raises(tactile.TactileError, match=r"no.toml: cannot be read"):
            made("no.toml")


@pytest.mark.parametrize("given", [["a.csv", "b.csv"], None, np.zeros((4, 19))])
def test_what_is_no_name_of_a_file_is_refused(given):
    with pytest.raises(tactile.TactileError, match=r"read, path: a .*; expected a file's name"):
        tactile.read(given)
    with pytest.raises(tactile.TactileError, match=r"load_calibration, path: a .*; expected a file's name"):
        tactile.load_calibration(given if given is not None else 3)


@pytest.mark.parametrize(
    ("argument", "expected"), [("weights", "a folder's name"), ("sensor", "the name of a unit's file")]
)
def test_what_is_no_name_of_weights_or_a_unit_is_refused(argument, expected, slide_csv):
    with pytest.raises(tactile.TactileError, match=f"translate, {argument}: a list; expected {expected}"):
        tactile.translate(tactile.read(slide_csv()), **{argument: ["a"]})


def pulled():
    """Return a displacement (2867, 3) m of one node that is pulled out of the gel."""
    return np.where(np.arange(2867)[:, None] == 1400, [0, -0.2e-3, 0], 0)


def spoilt(**fields):
    """Return a recording of 60 still frames with other fields, as of one changed by hand."""
    zeros = np.zeros(60, np.uint16)
    still = Recording("touch", "touch", "", np.arange(60) / 100, 0.0, np.full((60, 19), 3000.0), zeros, zeros)
    return dataclasses.replace(still, **fields)


def from_behind():
    """Return a pose whose push goes out of the gel."""
    return Pose(np.array([-6e-3, 0, 0]), np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([0, -1.0, 0]))


BALL, PLACE = tactile.indenters.Sphere(3e-3), tactile.Placement(x=-6e-3, z=0.0)


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: tactile.Gel("digit", BALL, friction=50), "Gel, friction: 50; expected Coulomb's .* 0 to 5. Divide"),
        (lambda: tactile.solve("digit", BALL, PLACE, force=1.0, friction=78), "solve, friction: 78; expected"),
        (lambda: tactile.Placement(x=Decimal("0.001"), z=0.0), r"Placement, x: Decimal\('0.001'\); expected"),
        (lambda: tactile.indenters.Sphere(Fraction(3, 1000)), r"sphere, radius: Fraction\(3, 1000\); expected"),
        (lambda: tactile.indenters.Edge("90", 1e-3), "edge, angle: '90'; expected 0.17 to 2.97 rad"),
        (lambda: tactile.indenters.Box(3e-3, 1e-4), "box, sizes: 0.003; expected three lengths in m"),
        (lambda: tactile.Gel(["digit"], BALL), "sensor: .*digit.*; expected biotac"),
        (lambda: tactile.solve("digit", BALL, PLACE, depth=np.full(2, 1e-4)), r"solve, depth: array\(\[.*; expected m"),
        (lambda: tactile.solve("digit", BALL, Pose(np.zeros(3), 2 * np.eye(3)), depth=0), "solve, place: axes .*unit"),
        (lambda: Pose([0, 0, 0], np.eye(4)), r"pose: apex \[0, 0, 0\] m, axes .*; expected arrays \(3,\) and \(3, 3\)"),
        (lambda: tactile.indenters.Several([BALL]), "several, parts: .*; expected one indenter or more, each with its"),
        (lambda: tactile.indenters.MeshIndenter.from_file(3), "from_file, path: a int; expected a file's name"),
        (lambda: tactile.load_calibration(sensor=["digit"]), "sensor: .*digit.*; expected biotac"),
        (lambda: list(tactile.Gel("digit", BALL).follow(3)), "Gel, follow: 3, None; expected a series of poses"),
        (lambda: tactile.Renderer(preset=[]), r"preset: \[\]; expected one of fast"),
        (lambda: tactile.Renderer(preset="fast", seed="abc"), "Renderer, seed: 'abc'; expected a whole number"),
        (lambda: tactile.Renderer(preset="fast").render([[1, 2], [3]]), "displacement: .*; expected an array of real"),
        (lambda: tactile.Renderer(preset="fast").render(pulled()), "0.20 mm out of the gel, 0.00 mm into it.*sign"),
        (lambda: tactile.Renderer(preset="fast").picture(3), r"radiance: shape \(\); expected \(320, 240, 3\)"),
        (lambda: tactile.Renderer(preset="fast").picture(np.full((320, 240, 3), np.nan)), "radiance: .*not finite"),
        (lambda: tactile.Renderer(preset="fast").picture(np.zeros((320, 240, 3)), 1), "noise: 1; expected a generator"),
        (lambda: tactile.Renderer(preset="fast").render(np.ma.masked_less(pulled(), 0)), "displacement: masked values"),
        (lambda: tactile.solve("digit", BALL, from_behind(), depth=1e-4), "solve, place: .* from inside the sensor"),
        (lambda: tactile.translate(spoilt(electrodes=None)), "electrodes: a NoneType; expected a plain numpy array"),
        (lambda: tactile.translate(spoilt(about=None)), "about: a NoneType; expected"),
        (lambda: tactile.translate(spoilt(warnings=None)), "warnings: a NoneType; expected"),
        (lambda: PrepareOptions(repair="no").check(), "option repair: 'no'; expected True or False"),
    ],
)  # fmt: skip
def test_numbers_and_names_of_another_kind_are_refused(made, message):
    with pytest.raises(tactile.TactileError, match=message):
        made()
