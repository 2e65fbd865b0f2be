"""The tier that a scene gets for a bound: by the measured table, and how deep the scene goes."""

import io
import re
import sys
from types import SimpleNamespace

import pytest

from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.mechanics import error_estimate
from tactile_core.mechanics.fast import compliance
from tactile_core.mechanics.placement import DEPTH_LIMIT
from tactile_core.simulation import scene_recording, tier_choice


def _bins(*errors):
    return [
        {"depth_share_to": to, "shape_95_um": error, "force_95": 0.1}
        for to, error in zip((0.1, 0.3, 0.6), errors, strict=True)
    ]


@pytest.fixture
def table(monkeypatch):
    """Fast 10, 30, 25 um from full; full 2, 3, 4; reference a tenth of that."""
    tiers = {"fast": (10, 30, 25), "full": (2, 3, 4), "reference": (0.2, 0.3, 0.4)}
    sensors = {
        tier: {name: {"ms": 10.0 ** (1 + 2 * k), "bins": _bins(*errors)} for name in ("biotac", "digit")}
        for k, (tier, errors) in enumerate(tiers.items())
    }
    for module in (error_estimate, tier_choice):
        monkeypatch.setattr(module, "measured", lambda: {"tiers": sensors})


@pytest.fixture
def scene(request):
    return request.config.rootpath / "scenes" / "press"


@pytest.mark.parametrize(
    ("share", "bound", "tier", "error"),
    [
        (0.05, 12, "fast", 12), (0.05, 11.9, "full", 2), (0.2, 33, "fast", 33), (0.2, 32, "full", 3),
        (0.5, 33, "full", 4),  # a press to 50 % passes through the worse bin above it
        (0.5, 34, "fast", 34), (0.5, 0.4, "reference", 0.4), (0.2, None, "fast", 33),
    ],
)  # fmt: skip
def test_the_cheapest_tier_within_the_bound(table, share, bound, tier, error):
    found = tier_choice.choose("digit", share, bound)
    assert (found.tier, found.share) == (tier, share) and found.error == pytest.approx(error)


def test_a_bound_that_no_tier_meets_names_the_best(table):
    said = r"0.3 um of shape, BioTac to 50% .* 0.4 or more, which the reference tier has"
    with pytest.raises(TactileError, match=said):
        tier_choice.choose("biotac", 0.5, 0.3)


def test_a_scene_is_as_deep_as_its_deepest_point(scene, table, monkeypatch):
    def loaded(sensor):  # whatever folder other tests have matrices kept in by now
        return SimpleNamespace(bytes=compliance.compliance_of(sensor).move.nbytes)

    monkeypatch.setattr(tier_choice, "stored", loaded)
    found = tier_choice.choose_for_scene(scene, ("biotac", "digit"), 35)
    assert 0.05 < found["digit"].share < found["biotac"].share < DEPTH_LIMIT  # 0.6 N on 7 mm: the skin is softer
    assert found["biotac"].tier == "fast" and "35" not in found["biotac"].describe("biotac")
    assert "fast tier" in found["biotac"].describe("biotac") and "95 of 100" in found["biotac"].describe("biotac")


def test_without_matrices_a_scene_counts_as_deep_as_it_may_be(scene, table, monkeypatch, tmp_path):
    monkeypatch.setenv("TACTILE_CACHE", str(tmp_path))
    monkeypatch.setattr(compliance, "condensed", lambda *given: pytest.fail("matrices were built"))
    assert tier_choice.choose_for_scene(scene, ("digit",), None)["digit"].share == DEPTH_LIMIT


@pytest.fixture
def simulate(scene, tmp_path, monkeypatch, capsys):
    """`tactile simulate` that solves nothing; returns (status, stderr, what would have been solved)."""

    def run(*more):
        asked = {}
        monkeypatch.setattr(scene_recording, "simulate_recording", lambda *given, **named: asked.update(named))
        status = main(["simulate", str(scene), "--out", str(tmp_path / "x.h5"), *more])
        return status, capsys.readouterr().err, asked

    return run


@pytest.mark.parametrize(
    ("bound", "words"),
    [("0.01um", "reference tier has"), ("0.6levels", "tactile render"), ("5", "5um,0.6levels"), ("5mm", "'5mm'")],
)
def test_simulate_refuses_bounds_it_cannot_meet(simulate, table, bound, words):
    status, err, asked = simulate("--error", bound)
    assert status == 2 and words in err and asked == {}


@pytest.mark.parametrize(("bound", "tier"), [("20um", "full"), ("0.4um", "reference")])
def test_a_long_simulation_tells_its_tier_and_cost_first_and_waits_for_a_word(simulate, table, bound, tier):
    status, err, asked = simulate("--error", bound, "--keep", "displacement_digit")
    assert status == 2 and asked == {} and "--yes" in err
    cost = next(line for line in err.splitlines() if "MB of memory" in line)
    assert re.search(r"about [\d.]+ (s|min|h) and \d+ MB", cost)
    status, err, asked = simulate("--error", bound, "--keep", "displacement_digit", "--yes")
    assert status == 0 and asked["tiers"] == {"digit": tier}
    assert f"DIGIT: {tier} tier" in err and "BioTac" not in err and "of the thickness" in err


@pytest.mark.parametrize(("word", "begins"), [("y", True), ("yes", True), ("", False), ("n", False)])
def test_at_a_terminal_it_asks(simulate, table, monkeypatch, word, begins):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr(sys, "stdin", Terminal(word + "\n"))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    status, err, asked = simulate("--error", "20um", "--keep", "displacement_digit")
    assert "begin?" in err and bool(asked) == begins and status == (0 if begins else 2)


def test_a_short_simulation_begins_at_once(simulate, table):
    status, err, asked = simulate("--error", "500um", "--keep", "displacement_digit")
    assert status == 0 and "MB of memory" not in err and asked["tiers"] == {"digit": "fast"}
