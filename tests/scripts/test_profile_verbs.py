"""Each verb loads the libraries it needs and no others, and help loads none; the cases are those that are profiled."""

import importlib.util
import json
import re

import pytest
from benchmarks import measure_costs
from benchmarks import profile_verbs as profile
from conftest import ROOT

from tactile_core.cli.verbs import VERBS

CASES = {case.name: case for case in profile.CASES}
READS = {"render_fast": "convert", "render_standard": "convert", "export": "batch"}
NEEDS = {"render_standard": "mitsuba", "train": "torch", "mesh_full": "pypardiso"}  # beyond what all tests have


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lean")
    profile.write_inputs(folder)
    profile.write_scene(folder, (0.0, -8.0, 0.0, 0.0), (0.01, -8.0, 0.0, 0.3))  # two frames load what many do
    return folder


@pytest.fixture(scope="module")
def cost_of(scratch):
    """``cost_of("export")``: what the case costs, after those that write what it reads."""
    found = {}

    def cost(name):
        if name in READS:
            cost(READS[name])
        if name not in found:
            found[name] = profile.run(CASES[name], scratch)
        return found[name]

    return cost


# The doctor looks at libraries in other processes.
@pytest.mark.parametrize("name", [name for name in CASES if name != "doctor"])
def test_a_verb_loads_what_it_needs_and_nothing_else(name, cost_of):
    needed = NEEDS.get(name)
    if needed and importlib.util.find_spec(needed) is None:
        pytest.skip(f"{needed} is not installed")
    case = CASES[name]
    cost = cost_of(name)
    assert cost.status == case.status
    # Torch, Mitsuba and numba choose for themselves which helpers they load; cholespy makes what is then in the cache.
    helpers = {"tqdm", "cholespy", *(["scipy"] if importlib.util.find_spec("numba") else [])}
    assert cost.loaded - helpers == set(case.loads.split()) - helpers


def test_every_verb_is_among_the_cases():
    assert {case.words.split()[0] for case in CASES.values()} >= set(VERBS) - {"calibrate"}


def test_the_table_in_the_documentation_names_every_case():
    text = (ROOT / "docs" / "lean.md").read_text(encoding="utf-8")
    assert {name for name in CASES if not re.search(rf"^\| `{name}` ", text, re.MULTILINE)} == set()


def test_what_plans_are_read_from_is_measured(tmp_path, monkeypatch):
    """A short run leaves the table that ships as it is."""
    tables = sorted((ROOT / "tactile_core" / "data").glob("*.json"))
    before = [table.read_bytes() for table in tables]
    out = tmp_path / "costs.json"
    monkeypatch.setattr(measure_costs, "MANY", 70)
    assert measure_costs.main(["--quick", "--json", str(out)]) == 0
    (cost,) = json.loads(out.read_text(encoding="utf-8"))["parts"].values()
    assert [table.read_bytes() for table in tables] == before
    assert cost["ms"] > 0 and 50 < cost["mb"] < 1000
