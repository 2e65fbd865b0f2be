"""Each verb loads the libraries it needs and no others, and help loads none; the cases are those that are profiled."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tactile_core.verbs import VERBS

ROOT = Path(__file__).parent.parent
SPEC = importlib.util.spec_from_file_location("profile_verbs", ROOT / "scripts" / "profile_verbs.py")
profile = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(profile)
CASES = {case.name: case for case in profile.CASES}
READS = {"render_fast": "convert", "render_standard": "convert", "export": "batch"}
NEEDS = {"render_standard": "mitsuba", "train": "torch", "mesh_full": "pypardiso"}  # beyond what all tests have


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lean")
    profile.write_inputs(folder)
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
    # Torch and Mitsuba choose for themselves which of their helpers they load.
    assert cost.loaded - {"tqdm"} == set(case.loads.split()) - {"tqdm"}


def test_every_verb_is_among_the_cases():
    assert {case.words.split()[0] for case in CASES.values()} >= set(VERBS) - {"calibrate"}


def test_help_is_quick():
    """0.15 s of CPU (issue 8) where Python alone takes 0.02; five times that for a machine as slow as it gets."""
    code = "import resource, sys, tactile_core.cli as c\ntry: c.main(['--help'])\nexcept SystemExit: pass\n" \
           "print(); print(sum(resource.getrusage(resource.RUSAGE_SELF)[:2]))"  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)
    assert float(done.stdout.splitlines()[-1]) < 0.75


def test_the_table_in_the_documentation_names_every_case():
    text = (ROOT / "docs" / "lean.md").read_text(encoding="utf-8")
    assert {name for name in CASES if not re.search(rf"^\| `{name}` ", text, re.MULTILINE)} == set()
