"""Who may import whom: what a plain import costs, what works without which library, and that the lint rules bite."""

import ast
import functools
import graphlib
import os
import re
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
    "distributed", "numba", "mujoco", "gymnasium",
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


def test_every_module_but_training_imports_with_all_heavy_libraries_out_of_reach():
    names = loaded(BLOCKER.format(blocked=set(HEAVY), modules=MODULES))
    assert names >= set(MODULES)
    assert third_party(names) == {"numpy"}


@functools.cache
def nodes(path: Path) -> tuple[ast.AST, ...]:
    """All nodes of a file's syntax tree, its module first; parsed once for all tests."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


def imported(path: Path) -> set[str]:
    """Top-level packages that a file imports anywhere in it."""
    found = set()
    for node in nodes(path):
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


# Who may import whom: each room knows those below it. The lowest knows only what an error is.
EDGES = {
    "errors": "",
    "files": "errors",
    "accuracy": "errors",
    "geometry": "files errors",
    "recordings": "sensors geometry files errors",
    "sensors": "geometry files errors",
    "mechanics": "sensors geometry files accuracy errors",
    "pictures": "sensors geometry files accuracy errors",
    "translation": "sensors geometry files accuracy errors recordings",
    "simulation": "mechanics sensors geometry recordings files accuracy errors",
    "training": "simulation mechanics translation pictures sensors geometry recordings files accuracy errors",
    "jobs": "simulation mechanics translation pictures sensors geometry recordings files accuracy errors",
    "cli": "jobs training simulation mechanics translation pictures sensors geometry recordings files accuracy errors",
    "__main__": "cli",
    "addon": "jobs simulation mechanics translation pictures sensors geometry recordings files accuracy errors",
}  # fmt: skip
# addon/process/command_line.py is `tactile` inside Blender.
EXCEPTIONS = {("addon/process/command_line.py", "cli")}
# Of the extension's own rooms, which the add-on's __init__ registers.
ADDON_EDGES = {
    "settings": "",
    "process": "settings",
    "objects": "settings",
    "operators": "objects process settings",
    "ui": "operators objects process settings",
}
VERBS = "tactile_core/cli/verbs"
MOST_NAMES, MOST_FILES = 16, 25  # at the top of tactile_core, and in any folder


def room_of(path: Path) -> str:
    """The room that a file belongs to: its first folder in the package, or its own name at the top; "addon"."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return parts[1] if parts[0] == PACKAGE.name else parts[0]


def rooms_imported(path: Path, package: str = PACKAGE.name) -> set[str]:
    """Rooms of tactile_core, or of another package, that a file imports from, anywhere in it, its own left out."""
    found = set()
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom):
            above = path.relative_to(ROOT).parts[: -node.level] if node.level else ()
            names = [*above, *(node.module or "").split(".")] if node.module else [*above]
            if names[:1] == [package]:
                found |= {names[1]} if len(names) > 1 else {alias.name for alias in node.names}
    folder = ROOT / package
    rooms = {path.stem for path in folder.glob("*.py")} | {path.name for path in folder.iterdir() if path.is_dir()}
    own = path.relative_to(folder).parts[0] if path.is_relative_to(folder) else room_of(path)
    return (found & rooms) - {own.removesuffix(".py"), "__init__"}


def sources(*folders: str) -> list[Path]:
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


def names_in(module: Path) -> set[str]:
    """What can be imported from a module, without its suffix, or a package: its modules, and names that stand in it."""
    file = module.with_suffix(".py") if module.with_suffix(".py").is_file() else module / "__init__.py"
    found = {path.stem for path in module.glob("*")}
    for node in nodes(file) if file.is_file() else ():
        if isinstance(node, ast.Name):
            found.add(node.id)
        elif isinstance(node, ast.alias | ast.FunctionDef | ast.ClassDef):
            found.add(getattr(node, "asname", None) or node.name)
    return found


def missing(path: Path) -> list[str]:
    """Modules and names of the project that a file imports, anywhere in it, and that are not there."""
    return [
        f"{path.relative_to(ROOT)}:{node.lineno} imports {alias.name}"
        for node in nodes(path)
        if isinstance(node, ast.ImportFrom) and node.level
        for alias in node.names
        if alias.name not in names_in(path.parents[node.level - 1].joinpath(*(node.module or "").split(".")))
    ]


def test_the_extension_imports_what_is_there():
    """Nothing else tells here, without bpy, that a module was renamed under it."""
    assert [words for path in sources("addon") for words in missing(path)] == []
    assert missing(ROOT / "__init__.py") == []


def test_each_room_imports_only_what_lies_below_it():
    offenders = [
        f"{path.relative_to(ROOT)} imports {room}"
        for path in sources("tactile_core", "addon")
        if path != PACKAGE / "__init__.py"
        for room in sorted(rooms_imported(path) - set(EDGES[room_of(path)].split()))
        if (path.relative_to(ROOT).as_posix(), room) not in EXCEPTIONS
    ]
    assert offenders == []


def test_each_room_of_the_extension_imports_only_what_lies_below_it():
    assert {path.parent.name for path in sources("addon")} - {"addon"} == set(ADDON_EDGES)
    offenders = [
        f"{path.relative_to(ROOT)} imports {room}"
        for name, below in ADDON_EDGES.items()
        for path in sources(f"addon/{name}")
        for room in sorted(rooms_imported(path, "addon") - set(below.split()))
    ]
    assert offenders == []


def members_imported(folder: Path) -> dict[str, set[str]]:
    """What each file and folder in a folder imports of the others there, a folder with all that lies below it."""
    names = {path.stem if path.is_file() else path.name for path in folder.iterdir()} - {"__init__", "__pycache__"}
    found: dict[str, set[str]] = {name: set() for name in names}
    for path in folder.rglob("*.py"):
        own = path.relative_to(folder).with_suffix("").parts[0]
        for node in nodes(path) if own in names else ():
            if isinstance(node, ast.ImportFrom) and node.level:
                base = path.parents[node.level - 1]
                ends = [node.module.replace(".", "/")] if node.module else [alias.name for alias in node.names]
                ways = [base / end for end in ends if base / end != folder and (base / end).is_relative_to(folder)]
                found[own] |= {way.relative_to(folder).parts[0] for way in ways} & names - {own}
    return found


def test_within_each_folder_imports_run_one_way():
    """A folder counts as one with all that lies in it, so that a reader meets it on one floor."""
    circles = {}
    for folder in {path.parent for path in sources("tactile_core", "addon")}:
        try:
            graphlib.TopologicalSorter(members_imported(folder)).prepare()
        except graphlib.CycleError as error:
            circles[str(folder.relative_to(ROOT))] = error.args[1]
    assert circles == {}


def test_no_room_looks_up_to_the_public_face():
    """What all rooms need lies below them, so that the face, which opens into all of them, is their roof."""
    homes = {path.stem for path in PACKAGE.iterdir()}
    offenders = [
        f"{path.relative_to(ROOT)} imports {alias.name} from the face"
        for path in sources("tactile_core")
        for node in nodes(path)
        if isinstance(node, ast.ImportFrom) and node.module is None
        and path.relative_to(ROOT).parts[: -node.level] == (PACKAGE.name,)
        for alias in node.names
        if alias.name not in homes
    ]  # fmt: skip
    assert offenders == []


def test_no_room_is_below_itself():
    order = graphlib.TopologicalSorter({room: set(below.split()) for room, below in EDGES.items()})
    assert next(iter(order.static_order())) == "errors"  # raises CycleError, which names the rooms


def test_nobody_imports_the_addon_or_the_scripts_and_these_not_the_command_line():
    for path in sources("tactile_core"):
        assert not imported(path) & {"addon", "benchmarks", "scripts"}, path
    for path in sources("scripts"):
        assert "cli" not in rooms_imported(path), path


def test_rooms_stay_small_enough_to_look_around_in():
    # By what lies in them: a checkout may hold empty folders of an older layout.
    files = [path for path in PACKAGE.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    names = {path.relative_to(PACKAGE).parts[0] for path in files} - {"py.typed"}
    assert len(names) <= MOST_NAMES, sorted(names)
    folders = {path.parent for path in sources("tactile_core", "addon", "scripts")}
    crowded = {str(one.relative_to(ROOT)): n for one in folders if (n := len(list(one.glob("*.py")))) > MOST_FILES}
    assert crowded == {}


def test_a_file_name_stands_once_but_for_a_verbs():
    """The command, the work behind it and the add-on's operator may share the verb's name, one file each."""
    places: dict[str, list[str]] = {}
    for path in sources("tactile_core", "addon", "scripts"):
        places.setdefault(path.stem, []).append(path.parent.relative_to(ROOT).as_posix())
    del places["__init__"]
    twice = {
        name: found
        for name, found in places.items()
        if len(found) > (1 if VERBS not in found else 2 + ("addon/operators" in found))
    }
    assert twice == {}


def test_a_script_is_whole_before_it_runs():
    """What stands below the guard of ``__main__`` is not there yet when the script runs, but in tests, which import."""
    early = [
        str(path.relative_to(ROOT))
        for path in sources("scripts", "scenes")
        if any(isinstance(node, ast.If) and "__name__" in ast.unparse(node.test) for node in nodes(path)[0].body[:-1])
    ]
    assert early == []


def test_no_function_bears_a_name_that_says_nothing():
    banned = {"told", "some", "of", "first", "seen", "within", "left", "fall", "hidden"}
    found = [
        f"{path.relative_to(ROOT)}:{node.name}"
        for path in sources("tactile_core", "addon", "scripts")
        for node in nodes(path)
        if isinstance(node, ast.FunctionDef) and node.name.lstrip("_") in banned
    ]
    assert found == []


def names_a_sensor(side: ast.AST, names: set[str]) -> bool:
    """Whether a side of a comparison is one of these names of sensors, or `SOURCE`, `TARGET` or `PAIR`."""
    constant = getattr(side, "id", getattr(side, "attr", ""))  # a name, or the last part of a dotted one
    return (isinstance(side, ast.Constant) and side.value in names) or constant in ("SOURCE", "TARGET", "PAIR")


def compared(path: Path) -> list[str]:
    """Lines of a file that compare something with the name of a sensor that ships, or with a constant for one."""
    names = {folder.parent.name for folder in (PACKAGE / "sensors").glob("*/sensor.toml")}
    return [
        f"{path.name}:{node.lineno}"
        for node in nodes(path)
        if isinstance(node, ast.Compare)
        for each in (node.left, *node.comparators)
        if any(names_a_sensor(side, names) for side in getattr(each, "elts", [each]))
    ]


def test_nothing_branches_on_a_sensor_s_name():
    """Whoever needs to know asks the descriptor: ``sensors.is_gel``, ``sensors.describe``."""
    assert [line for path in sources("tactile_core") for line in compared(path)] == []


def test_a_branch_on_a_name_would_be_found(tmp_path):
    lines = {
        'sensor == "digit" or sensor not in ("biotac", "other")': 2,
        "sensor != SOURCE or found != {sensors.TARGET}": 2,
        "sensor != other": 0,
    }
    for number, (line, count) in enumerate(lines.items()):
        path = tmp_path / f"{number}.py"
        path.write_text(line)
        assert len(compared(path)) == count, line


def undocumented(node: ast.AST, where: str) -> list[str]:
    """Names of public classes, functions and methods below a node that have no docstring."""
    found = []
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If | ast.Try | ast.With):
            found += undocumented(child, where)
        if isinstance(child, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and not child.name.startswith("_"):
            found += [] if ast.get_docstring(child) else [where + child.name]
            found += undocumented(child, f"{where}{child.name}.") if isinstance(child, ast.ClassDef) else []
    return found


def test_all_that_is_public_has_a_docstring():
    found = [
        name
        for path in sources("tactile_core", "addon", "scenes")
        for name in undocumented(nodes(path)[0], f"{path.relative_to(ROOT)}:")
    ]
    assert found == []


def test_a_docstring_that_is_missing_is_found():
    code = "class Shown:\n    'A class.'\n    def bare(self): pass\nif True:\n    def also(): pass\ndef _own(): pass"
    assert undocumented(ast.parse(code), "m:") == ["m:Shown.bare", "m:also"]


def unnamed_arrays(function: ast.AST) -> list[str]:
    """Parameters of arrays or floats that a function's docstring neither names nor refers elsewhere for (see `...`)."""
    if not isinstance(function, ast.FunctionDef) or not (doc := ast.get_docstring(function)):
        return []
    return [
        f"line {function.lineno}, {function.name}: {each.arg}"
        for each in ast.walk(function.args)
        if isinstance(each, ast.arg) and each.annotation and not re.search(rf"\b{each.arg}\b|[Ss]ee\s+`", doc)
        if re.search("ndarray|float|Tensor", ast.unparse(each.annotation))
    ]


def test_docstrings_name_their_arrays():
    """Shapes without names, as in "the motion (n, 3) under forces (k, 3)", leave strangers to guess which is which."""
    files = sources("tactile_core", "addon", "scripts", "scenes")
    found = [
        f"{path.relative_to(ROOT)} {each}" for path in files for node in nodes(path) for each in unnamed_arrays(node)
    ]
    assert found == [], "say in the docstring what each of these parameters is: meaning, shape, unit"


def test_an_array_that_its_docstring_does_not_name_is_found():
    code = "def f(x: np.ndarray, y: float | None, *z: Tensor):\n    'Add y.'"
    assert unnamed_arrays(ast.parse(code).body[0]) == ["line 1, f: x", "line 1, f: z"]
    assert unnamed_arrays(ast.parse(code.replace("Add y.", "As f, see `g`.")).body[0]) == []


def lint(path: str, code: str) -> str:
    """What ruff says of this code, were it in that file of the project."""
    command = [sys.executable, "-m", "ruff", "check", "--output-format=concise", "--stdin-filename", path, "-"]
    return subprocess.run(command, input=code, cwd=ROOT, capture_output=True, text=True, timeout=60).stdout


@pytest.mark.parametrize(
    ("path", "line", "rule", "reason"),
    [
        ("tactile_core/pictures/height_map.py", "import bpy", "TID251", "without Blender"),
        ("tactile_core/pictures/height_map.py", "import torch.nn", "TID251", "translate with numpy"),
        ("tactile_core/pictures/height_map.py", "from pickle import loads", "TID251", "runs code"),
        ("tests/pictures/test_height_map.py", "import bpy", "TID251", "belongs to addon/"),
        *[("tactile_core/pictures/height_map.py", f"import {name}", "TID253", name) for name in LAZY],
        ("tactile_core/pictures/height_map.py", "from scipy.sparse import csr_array", "TID253", "scipy"),
        ("tactile_core/pictures/height_map.py", "print('hello')", "T201", "print"),
    ],
)  # fmt: skip
def test_the_rules_bite(path, line, rule, reason):
    found = lint(path, f"{line}\n")
    assert rule in found and reason in found


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("addon/ui/bridge.py", "import bpy\n"),
        ("tactile_core/training/train.py", "import torch\n"),
        ("tactile_core/pictures/height_map.py", "def read() -> None:\n    import h5py\n"),
        ("tests/pictures/test_height_map.py", "import scipy\n"),
    ],
)
def test_the_rules_let_the_right_rooms_through(path, code):
    assert "TID25" not in lint(path, code)
