"""Paired contacts: same bytes for any number of workers, resumable, honest errors."""

import errno
import json
import shutil

import numpy as np
import pytest
from msgspec import structs

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.files import hdf5_writer
from tactile_core.geometry.indenters import Sphere
from tactile_core.jobs import pairs
from tactile_core.jobs.engine import run as runs
from tactile_core.jobs.engine.local import InProcess, Local
from tactile_core.jobs.pairs import make_pairs, plan, wanted
from tactile_core.mechanics.node_areas import node_areas
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import solve
from tactile_core.simulation import pairs_file, pairs_writer
from tactile_core.simulation.pair_sampling import pair_row, press_rows
from tactile_core.simulation.pairs_writer import card, card_path
from tactile_core.simulation.scene import load_scene

SCENE = "scenes/press_sphere"
COUNT = 40  # contacts


@pytest.fixture
def single(monkeypatch):
    """Blocks hold one press, a dozen contacts, and not four: for what asks no more."""
    monkeypatch.setattr(pairs, "BLOCK", 1)


@pytest.fixture(scope="module")
def scene(request):
    return request.config.rootpath / SCENE


@pytest.fixture(scope="module")
def made(scene, tmp_path_factory):
    out = tmp_path_factory.mktemp("pairs") / "pairs.h5"
    make_pairs(scene, COUNT, 7, out)
    return out


def test_file_holds_what_it_says(made):
    import h5py

    with h5py.File(made) as file:
        assert file.attrs["format"] == pairs_file.FORMAT
        assert file.attrs["biotac_nodes_sha256"] == sensors.biotac_surface().sha256
        assert json.loads(file.attrs["indenters"]) == ["sphere_7mm", "sphere_14mm"]
        assert set(file) == set(pairs_writer.units())
        assert all(len(file[name]) == COUNT and file[name].attrs["unit"] for name in file)
        biotac, digit = file["force"][()], file["force_digit"][()]
        depth, press = file["depth_biotac"][()], file["press"][()]
        moved = file["displacement_digit"][()] * file["displacement_digit"].attrs["scale"]
        patch = file["contact_patch_digit"][()]
    same = press[1:] == press[:-1]
    assert same.any() and (np.diff(depth)[same] > 0).all()  # a press is a path of growing depth
    # the same axial force on both; the lateral parts differ with the shape of the surface
    np.testing.assert_allclose(np.linalg.norm(biotac, axis=1), np.linalg.norm(digit, axis=1), rtol=0.05)
    assert patch.any(axis=1).all()
    for contact in range(COUNT):
        deepest = np.argmax(np.linalg.norm(moved[contact], axis=1))
        touched = sensors.digit_surface().rest[patch[contact]]
        apart = np.linalg.norm(touched - sensors.digit_surface().rest[deepest], axis=1).min()
        assert apart < 1e-3  # the gel moves most where it is touched, to about two nodes


def test_the_card_lies_beside_the_file(made):
    beside = json.loads(card_path(made).read_text(encoding="utf-8"))
    assert beside == card(made) and beside["contacts"] == COUNT


def parts_of(out):
    return out.with_name(out.name + ".parts")


@pytest.fixture(scope="module")
def begun(scene, tmp_path_factory):
    """Pairs that were stopped after the first block."""
    out = tmp_path_factory.mktemp("begun") / "pairs.h5"

    def stop(done, known):
        if list(parts_of(out).glob("shards/*.h5")):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_pairs(scene, COUNT, 7, out, progress=stop)
    return out


@pytest.fixture
def interrupted(begun, tmp_path):
    """Where a run of one's own was stopped after its first block."""
    shutil.copytree(parts_of(begun), parts_of(tmp_path / begun.name))
    return tmp_path / begun.name


def test_two_workers_and_a_resumed_run_make_the_same_bytes(made, scene, interrupted):
    assert not interrupted.exists() and parts_of(interrupted).exists()
    make_pairs(scene, COUNT, 7, interrupted, place=lambda folder: Local(folder, 2))
    assert interrupted.read_bytes() == made.read_bytes()
    assert not parts_of(interrupted).exists()


def test_parts_of_an_array_make_the_same_bytes(made, scene, tmp_path):
    """Two runners share the job of a plan, and a third puts together what they made."""
    out = tmp_path / "pairs.h5"
    job, _, _ = plan(scene, COUNT, 7, out)
    with runs.begun(out, job) as folder:
        pass
    shards = []
    for part in ((1, 2), (0, 2)):
        with runs.opened(folder, part):
            shards.append(runs.run(folder, job, InProcess(folder), part, lambda done, known: None).made)
    assert min(shards) >= 1
    before = len(list(folder.glob("shards/*.h5")))
    make_pairs(scene, COUNT, 7, out, progress=lambda done, known: before <= known)
    assert out.read_bytes() == made.read_bytes() and not folder.exists()


@pytest.mark.parametrize(
    ("counts", "count", "expected"),
    [
        ({}, 40, 1), ({0: 10}, 40, 4), ({0: 10}, 400, 9), ({0: 0}, 40, 9), ({0: 30, 1: 30}, 40, 2),
        ({1: 10, 2: 10}, 40, 4), ({0: 50}, 40, 1),
    ],
)  # fmt: skip
def test_as_many_blocks_are_wanted_as_the_count_asks_for(counts, count, expected):
    assert wanted(counts, count, "here") == expected


def test_a_scene_that_touches_nothing_is_given_up():
    with pytest.raises(TactileError, match="84 presses made no contact"):
        wanted(dict.fromkeys(range(21), 0), 40, "here")


def test_another_seed_makes_other_contacts(made, scene, tmp_path, single):
    import h5py

    other = tmp_path / "other.h5"
    make_pairs(scene, 5, 8, other)
    with h5py.File(made) as a, h5py.File(other) as b:
        assert not np.array_equal(a["signal"][:5], b["signal"][:5])


def test_a_press_may_be_paired_by_depth(scene):
    spec = structs.replace(load_scene(scene)[0].pairs, depth_steps=4, depth_max_mm=0.85)
    rows = press_rows(structs.replace(load_scene(scene)[0], pairs=spec), 0, 0)
    biotac, digit = (np.array([row[f"depth_{name}"] for row in rows]) for name in ("biotac", "digit"))
    assert len(rows) == 4 and 0.05e-3 <= biotac[0] <= 0.25e-3  # a random start within the first of four steps
    np.testing.assert_allclose(np.diff(biotac), 0.2e-3, rtol=1e-5)  # float32
    np.testing.assert_allclose(digit, biotac, rtol=1e-5)
    along = [np.linalg.norm(row["force"]) / np.linalg.norm(row["force_digit"]) for row in rows]
    stiffer = sensors.describe("biotac").material.youngs / sensors.describe("digit").material.youngs
    assert max(along) < 0.4 * stiffer  # the same depth takes less force on the thicker, filled BioTac than skin alone


def test_a_press_may_end_with_a_slide_at_constant_force(scene, tmp_path):
    import h5py

    text = (scene / "scene.toml").read_text(encoding="utf-8").replace("friction = 0.0", "friction = 0.78")
    sliding = tmp_path / "scene.toml"
    sliding.write_text(text.rstrip() + "\nslide_share = 1.0\nslide_max_mm = 1.0\n", encoding="utf-8")
    make_pairs(sliding, 30, 7, tmp_path / "pairs.h5")
    with h5py.File(tmp_path / "pairs.h5") as file:
        far = np.linalg.norm(file["slide"][()], axis=1)
        force, press = (file[name][()] for name in ("force", "press"))
    slid = np.flatnonzero(far > 0)
    assert len(slid) > 3 and far.max() <= 1e-3
    before = slid[np.r_[True, np.diff(press[slid]) > 0]] - 1
    assert (press[before] == press[before + 1]).all() and (far[before] == 0).all()
    # Sticking skin answers 0.2 mm of sliding with shear; the force along the motion is held, so the whole force turns.
    held = dict(zip(press[before], force[before], strict=True))
    turned = [np.linalg.norm(force[i] - held[press[i]]) / np.linalg.norm(force[i]) for i in slid if far[i] > 0.2e-3]
    assert turned and min(turned) > 0.05


@pytest.mark.parametrize(("z", "beyond"), [(0.0, False), (8.1e-3, True)])
def test_a_contact_that_reaches_beside_the_gel_is_marked(z, beyond):
    """A 14 mm ball 0.8 mm deep touches the BioTac some 2 mm around; the gel ends at 9.17 mm."""
    ball, place = Sphere(7e-3), Placement(-8e-3, z)
    pressed = [
        solve(sensor, ball, place, depth=depth, friction=0.0)
        for sensor, depth in (("biotac", 0.8e-3), ("digit", 0.2e-3))
    ]
    assert pair_row(*pressed)["beyond_digit"] == beyond


def test_an_existing_file_is_kept(made, scene):
    before = made.read_bytes()
    with pytest.raises(TactileError, match="exists already"):
        make_pairs(scene, 5, 7, made)
    assert made.read_bytes() == before


def test_parts_of_another_seed_are_refused(scene, begun):
    with pytest.raises(TactileError, match="another scene, seed"):
        make_pairs(scene, COUNT, 8, begun)


def test_scene_without_pairs_and_bad_count(request, tmp_path):
    with pytest.raises(TactileError, match="pairs"):
        make_pairs(request.config.rootpath / "scenes/press_roll_slide", 5, 0, tmp_path / "x.h5")
    for count in (0, 10**13):
        with pytest.raises(TactileError, match="1 to 100,000,000"):
            make_pairs(request.config.rootpath / SCENE, count, 0, tmp_path / "x.h5")


def test_an_impossible_indenter_is_refused_before_anything_is_written_also_by_workers(scene, tmp_path):
    text = (scene / "scene.toml").read_text(encoding="utf-8").replace("radius_mm = 3.5", "radius_mm = 1e9")
    bad = tmp_path / "scene.toml"
    bad.write_text(text, encoding="utf-8")
    for place in (InProcess, lambda folder: Local(folder, 2)):
        with pytest.raises(TactileError, match="radius"):
            make_pairs(bad, 5, 0, tmp_path / "x.h5", place=place)
    assert list(tmp_path.iterdir()) == [bad]


def test_a_block_cut_short_is_made_again(scene, made, interrupted, monkeypatch):
    monkeypatch.setattr(pairs, "GROWTH", 1)  # a block without contacts asks for one more, not for eight
    block = next(parts_of(interrupted).glob("shards/*.h5"))
    block.write_bytes(block.read_bytes()[:1000])
    make_pairs(scene, COUNT, 7, interrupted)
    assert interrupted.read_bytes() == made.read_bytes()


def test_a_disk_that_fills_while_merging_is_told(scene, tmp_path, single):
    out = tmp_path / "pairs.h5"
    full = OSError(errno.ENOSPC, "No space left on device")
    with pytest.MonkeyPatch.context() as patch, pytest.raises(TactileError, match="No space left"):
        patch.setattr(hdf5_writer.Disk, "check", lambda disk: (_ for _ in ()).throw(full))
        make_pairs(scene, 5, 7, out)
    assert not out.exists()
    make_pairs(scene, 5, 7, out)  # goes on from the blocks that are there
    assert out.exists()


def test_a_slide_to_where_the_sensor_falls_away_stays_finite(request):
    """Press 590 is a light touch whose slide ends at a negative depth; its factor of force was once no number."""
    scene, _ = load_scene(request.config.rootpath / "scenes/training")
    rows = press_rows(scene, 3, 590)
    assert any(row["slide"].any() for row in rows)
    assert all(np.isfinite(row[name]).all() for row in rows for name in ("force", "force_digit", "depth_digit"))


def test_a_gel_of_ones_own_is_one_folder(request, scene, tmp_path, monkeypatch, single):
    """As docs/extend.md says: TACTILE_SENSORS names the folder; the example, with a coarser lattice and traction."""
    import h5py

    example = request.config.rootpath / "scenes/sensors/flat_gel/sensor.toml"
    text = example.read_text(encoding="utf-8").replace("window_nodes = [49, 37]", "window_nodes = [17, 13]")
    (tmp_path / "coarse_gel").mkdir()
    (tmp_path / "coarse_gel/sensor.toml").write_text(text, encoding="utf-8")
    monkeypatch.setenv("TACTILE_SENSORS", str(tmp_path))
    out = tmp_path / "pairs.h5"
    make_pairs(scene, 5, 7, out, pair=("biotac", "coarse_gel"), keep=["traction"])
    with h5py.File(out) as file:
        assert set(file) == {*pairs_writer.units("biotac", "coarse_gel"), "traction_biotac", "traction_coarse_gel"}
        for sensor, force in (("biotac", file["force"][:]), ("coarse_gel", file["force_coarse_gel"][:])):
            assert file[f"traction_{sensor}"].attrs["unit"] == "Pa"
            total = np.einsum("tnk,n->tk", file[f"traction_{sensor}"][:], node_areas(sensor))
            np.testing.assert_allclose(total, force, atol=1e-5 * np.abs(force).max())  # float32 of thousands of nodes
        assert file.attrs["coarse_gel_nodes_sha256"] == sensors.sensor_surface("coarse_gel").sha256
        moved, depth = file["displacement_coarse_gel"][()], file["depth_coarse_gel"][()]
    # quadratic nodes 1 mm apart need not touch where a ball's apex does: a part of the depth is seen, never more
    seen = pairs_file.SCALE * moved[:, :, 1].max(axis=1)
    assert (seen > 0).all() and (seen < depth).all()
    assert "depth_coarse_gel_mm" in json.loads(card_path(out).read_text())
    read = pairs_file.read_pairs(out)
    assert read.pair == ("biotac", "coarse_gel")
    np.testing.assert_array_equal(read.displacement_digit, moved)


@pytest.mark.parametrize("pair", [("biotac", "gelsight"), ("biotac", "biotac"), ("digit", "digit")])
def test_sensors_that_are_none_or_of_the_wrong_kind_are_refused(scene, tmp_path, pair):
    with pytest.raises(TactileError, match=r"'(gelsight|biotac|digit)'"):
        make_pairs(scene, 5, 7, tmp_path / "pairs.h5", pair=pair)
