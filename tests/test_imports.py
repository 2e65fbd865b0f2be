"""Who may import whom: what a plain import costs, what works without which library, and that the lint rules bite."""

from __future__ import annotations

import ast
import graphlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "tactile_core"
MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    for path in PACKAGE.rglob("*.py")
    if path.name != "__main__.py" and "training" not in path.relative_to(PACKAGE).parts
)
LAZY = (
    "h5py", "scipy", "matplotlib", "PIL", "mitsuba", "OpenEXR", "trimesh", "skfem", "cholespy", "rosbags",
    "distributed",
)  # fmt: skip
HEAVY = (*LAZY, "torch", "bpy", "drjit", "tqdm")

BLOCKER = """
import importlib, sys

class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {blocked!r}:
            raise ModuleNotFoundError("blocked: " + name, name=name)

sys.meta_path.insert(0, Blocker())
for module in {modules!r}:
    importlib.import_module(module)
print(*sys.modules)
"""


def loaded(code: str) -> set[str]:
    """Names of all modules that a fresh Python has loaded after this code."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split())


def third_party(names: set[str]) -> set[str]:
    return {name.partition(".")[0] for name in names} & {"numpy", *HEAVY}


def test_importing_the_package_costs_the_standard_library_alone():
    assert third_party(loaded("import sys, tactile_core; print(*sys.modules)")) == set()


def test_help_imports_no_numpy():
    code = (
        "import sys, tactile_core.cli as c\n"
        "try: c.main(['convert', '--help'])\nexcept SystemExit: pass\nprint(); print(*sys.modules)"
    )
    assert third_party(loaded(code)) == set()


def test_every_module_but_training_imports_with_all_heavy_libraries_out_of_reach():
    names = loaded(BLOCKER.format(blocked=set(HEAVY), modules=MODULES))
    assert names >= set(MODULES)
    assert third_party(names) == {"numpy"}


def imported(path: Path) -> set[str]:
    """Top-level packages that a file imports anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name.partition(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            found.add(node.module.partition(".")[0])
    return found


def test_torch_stays_in_training_and_bpy_out_of_the_core():
    offenders = [
        path
        for path in PACKAGE.rglob("*.py")
        if imported(path) & {"bpy", "pickle", "tactile_core", "addon"}
        or ("torch" in imported(path) and PACKAGE / "training" not in path.parents)
    ]
    assert offenders == []  # tactile_core: only relative imports, because inside Blender it has another name


def room_of(path: Path) -> str:
    """The folder of the package that a file lies in; "" at the top."""
    return path.relative_to(PACKAGE).parts[0] if path.parent != PACKAGE else ""


def rooms_imported(path: Path) -> set[str]:
    """Other rooms that a file imports from, anywhere in it; the top-level modules are everybody's."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            above = path.parents[node.level - 1].relative_to(PACKAGE).parts
            names = [*above, *(node.module or "").split(".")] if node.module else [*above]
            found |= {names[0]} if names else {name.name for name in node.names}
    return {name for name in found if (PACKAGE / name / "__init__.py").exists()} - {room_of(path)}


def test_no_two_rooms_import_each_other():
    """Not even by way of others: data flows one way, so that `batch` knows the mechanics and never the reverse."""
    knows = {}
    for path in PACKAGE.rglob("*.py"):
        if room_of(path):
            knows.setdefault(room_of(path), set()).update(rooms_imported(path))
    order = list(graphlib.TopologicalSorter(knows).static_order())  # raises CycleError, which names the rooms
    assert {"mechanics", "optics"} <= set(order[: order.index("batch")])


def lint(path: str, code: str) -> str:
    """What ruff says of this code, were it in that file of the project."""
    command = [sys.executable, "-m", "ruff", "check", "--output-format=concise", "--stdin-filename", path, "-"]
    return subprocess.run(command, input=code, cwd=ROOT, capture_output=True, text=True, timeout=60).stdout


@pytest.mark.parametrize(
    ("path", "line", "rule", "reason"),
    [
        ("tactile_core/height_map.py", "import bpy", "TID251", "without Blender"),
        ("tactile_core/height_map.py", "import torch.nn", "TID251", "translate with numpy"),
        ("tactile_core/height_map.py", "from pickle import loads", "TID251", "runs code"),
        ("tests/test_height_map.py", "import bpy", "TID251", "belongs to addon/"),
        *[("tactile_core/height_map.py", f"import {name}", "TID253", name) for name in LAZY],
        ("tactile_core/height_map.py", "from scipy.sparse import csr_array", "TID253", "scipy"),
        ("tactile_core/height_map.py", "print('hello')", "T201", "print"),
    ],
)  # fmt: skip
def test_the_rules_bite(path, line, rule, reason):
    found = lint(path, f"{line}\n")
    assert rule in found and reason in found


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("addon/bridge.py", "import bpy\n"),
        ("tactile_core/training/train.py", "import torch\n"),
        ("tactile_core/height_map.py", "def read() -> None:\n    import h5py\n"),
        ("tests/test_height_map.py", "import scipy\n"),
    ],
)
def test_the_rules_let_the_right_rooms_through(path, code):
    assert "TID25" not in lint(path, code)
