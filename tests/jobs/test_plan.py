"""`--plan`: what is built for which outputs, and that its numbers follow the tables."""

import json

import pytest
from conftest import ROOT

from tactile_core.cli.main import main
from tactile_core.jobs import plan
from tactile_core.mechanics.fast import compliance
from tactile_core.pictures import presets
from tactile_core.simulation import tier_choice
from tactile_core.simulation.scene_recording import sensors_of
from tactile_core.simulation.tier_choice import TierChoice

PRESS = ROOT / "scenes" / "press"
PART = {"start": 1.0, "ms": 10.0, "mb": 100.0, "kb": 2.0}
NAMES = (
    "simulate_nothing", "simulate_digit", "simulate_biotac", "simulate_electrodes", "convert_latent",
    "convert_displacement", "convert_height", "convert_image", "render_fast",
)  # fmt: skip


@pytest.fixture(autouse=True)
def tables(monkeypatch):
    """Round numbers: 10 ms a frame of everything, 30 on the BioTac; contacts are not solved."""
    parts = {name: dict(PART) for name in NAMES} | {"simulate_biotac": PART | {"ms": 30.0, "mb": 150.0}}
    full = {"biotac": {"smooth": 2000.0, "rough": 8000.0}, "digit": {"smooth": 1000.0, "rough": 4000.0}}
    monkeypatch.setattr(plan, "costs", lambda: {"parts": parts, "full_ms": full})

    def choose(path, used, bound):
        tier = "fast" if bound is None or bound > 20 else "full"
        return {sensor: TierChoice(tier, 20.0, 1.0, 0.3) for sensor in used}

    monkeypatch.setattr(tier_choice, "choose_for_scene", choose)


def plan_for(path=PRESS, keep="", um=None):
    words = keep.split(",")
    return plan.of_scene(path, words, tier_choice.choose_for_scene(path, sensors_of(words), um))


def built(found):
    return [part.what for part in found.parts]


@pytest.mark.parametrize(
    ("keep", "has", "lacks"),
    [
        ("electrodes", {"BioTac contacts", "electrodes"}, {"DIGIT contacts", "DIGIT matrices"}),
        ("displacement_digit", {"DIGIT contacts"}, {"BioTac contacts", "BioTac matrices", "electrodes"}),
        ("electrodes,displacement_digit", {"BioTac contacts", "DIGIT contacts", "electrodes"}, set()),
    ],
)
def test_only_what_outputs_need_is_built(keep, has, lacks):
    found = built(plan_for(keep=keep))
    assert has <= set(found) and not lacks & set(found)


def test_outputs_add_up(monkeypatch, tmp_path):
    """The press has 201 frames, 147 of them in contact, of which 44 differ; 10 ms and 2 kB each on the DIGIT."""
    monkeypatch.setenv("TACTILE_CACHE", str(tmp_path))  # so that nothing is cached, on every machine
    found = plan_for(keep="displacement_digit")
    contacts = next(part for part in found.parts if part.what == "DIGIT contacts")
    number = int(contacts.extent.split()[0])
    assert number == 44 and contacts.seconds == pytest.approx(0.01 * number)
    assert contacts.disk == pytest.approx(0.002 * 147)
    alone, both = found.seconds, plan_for(keep="displacement_digit,displacement_biotac").seconds
    assert both - alone == pytest.approx(0.03 * number + plan.BUILD_S["biotac"])
    assert plan_for(keep="displacement_biotac").memory == plan.BUILD_MB + 150 and found.memory == plan.BUILD_MB + 100
    assert plan_for(keep="displacement_digit,displacement_biotac").memory == plan.BUILD_MB + 150  # one after the other


def test_an_exact_bound_costs_the_full_tier():
    found, exact = (plan_for(keep="displacement_digit", um=um) for um in (30, 5))
    assert exact.seconds > found.seconds + 30 and "full tier" in "\n".join(exact.lines())


def test_matrices_that_are_not_cached_are_to_be_built(monkeypatch, tmp_path):
    monkeypatch.setenv("TACTILE_CACHE", str(tmp_path))
    monkeypatch.setattr(compliance, "condensed", lambda *given: pytest.fail("matrices were built"))
    found = plan_for(keep="displacement_digit")
    matrices = next(part for part in found.parts if part.what == "DIGIT matrices")
    assert matrices.seconds == plan.BUILD_S["digit"] and matrices.disk == 151 and str(tmp_path) in matrices.extent
    assert list(tmp_path.iterdir()) == []


def test_matrices_that_are_cached_are_told_with_their_size(monkeypatch, tmp_path):
    monkeypatch.setenv("TACTILE_CACHE", str(tmp_path))
    folder = compliance.stored("digit").folder
    folder.mkdir()
    for name in compliance.ARRAYS:
        (folder / f"{name}.npy").write_bytes(bytes(1_000_000))
    matrices = next(part for part in plan_for(keep="displacement_digit").parts if part.what == "DIGIT matrices")
    assert matrices.seconds == 0 and "7 MB, cached" in matrices.extent and "2867 surface nodes" in matrices.extent


def test_pictures_cost_what_their_preset_was_measured_to():
    fast, reference = (plan.of_frames(201, ("image",), name).seconds for name in ("fast", "reference"))
    ms = {name: max(presets.measured()["presets"][name]["ms"].values()) for name in ("fast", "reference")}
    assert reference - fast == pytest.approx(201 * (ms["reference"] - ms["fast"]) / 1e3)


def test_a_recording_is_planned_as_it_is_converted(slide_csv, tmp_path, capsys):
    assert built(plan.of_frames(150, ("latent",))) == ["networks"]
    assert built(plan.of_frames(150, ("latent", "height", "image"))) == ["networks", "height maps", "pictures, fast"]
    assert {"force field", "DIGIT matrices"} <= set(built(plan.of_frames(10, ("traction",))))
    assert {"gel, solved", "DIGIT matrices"} <= set(built(plan.of_frames(10, (), solved=True)))
    words = ["--out", str(tmp_path / "out"), "--keep", "latent", "--frames", ":100", "--plan"]
    assert main(["convert", str(slide_csv()), *words]) == 0 and not (tmp_path / "out").exists()
    said = capsys.readouterr().out
    assert "100 frames" in said and f"in all about {1.0 + 0.01 * 100:g} s" in said
    for verb, frames in (("convert", 100), ("batch", 1000)):  # another gel is solved, at a cost that is not known
        words = [each for each in words if verb == "convert" or each not in ("--frames", ":100")]
        assert main([verb, str(slide_csv()), *words, "--to", "gelsight_mini"]) == 0
        said = capsys.readouterr()
        assert f"{frames} frames, cost not measured" in said.out + said.err and "DIGIT matrices" not in said.out
        assert "MB on disk, and what was not measured" in said.out + said.err


def test_pairs_are_contacts_on_both_sensors():
    assert [part.what for part in plan.of_pairs(20).parts if part.seconds == 0.2] == ["DIGIT contacts"]


def test_a_simulation_is_planned_and_not_run(tmp_path, capsys):
    words = ["--out", str(tmp_path / "press.h5"), "--plan"]
    assert main(["simulate", str(PRESS), "--keep", "electrodes", *words]) == 0
    assert "BioTac contacts" in capsys.readouterr().out and not (tmp_path / "press.h5").exists()
    assert main(["simulate", str(ROOT / "scenes" / "press_sphere"), *words]) == 2  # pairs alone, no recording
    assert "[recording]" in capsys.readouterr().err


def test_friction_costs_the_full_tier_what_was_measured_with_it(tmp_path):
    text = (PRESS / "scene.toml").read_text(encoding="utf-8")
    assert "friction = 0.0" in text
    (tmp_path / "scene.toml").write_text(text.replace("friction = 0.0", "friction = 0.5"), encoding="utf-8")
    smooth, rough = (plan_for(path, "displacement_digit", 5.0) for path in (PRESS, tmp_path))
    assert rough.seconds > 3 * smooth.seconds


def test_the_shipped_table_holds_every_part():
    found = json.loads(plan.COSTS.read_text(encoding="utf-8"))
    for name in NAMES:
        part = found["parts"][name]
        assert all(part[key] >= 0 for key in PART) and part["mb"] > 0
    assert all(each["rough"] > each["smooth"] > 0 for each in found["full_ms"].values())
