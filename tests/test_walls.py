"""The house's walls, read from the source alone: who may import whom, and what no module does.

Every import counts: inside functions, relative, under TYPE_CHECKING. `LAYERS` lists the rooms from the ground up; a
module imports only its own room and the rooms below it. A new module belongs to the longest prefix that it starts with.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

from lab.lazy import LIBRARIES

ROOT = Path(__file__).resolve().parent.parent
LAYERS: tuple[tuple[str, ...], ...] = (
    ("lab.errors", "lab.interrupts", "lab.lazy", "lab.operating_system", "lab.version"),
    ("lab.files", "lab.mdp", "lab.optional", "lab.plugins", "lab.statistics", "lab.workers"),
    ("lab.learning", "lab.vision", "lab.words"),
    ("lab.sequencing", "lab.toolbox"),
    ("lab.advice", "lab.recordings", "lab.tasks"),
    ("lab.mentor", "lab.sim"),
    ("lab.skills", "lab.view", "lab.export", "lab.audit"),
    ("lab.gym",),
    ("lab.control", "lab.teaching"),
    ("lab.cloning", "lab.production"),
    ("lab.studies", "lab.seat"),
    ("lab.api", "lab.classroom", "lab.testing"),
    ("lab.cli",),
    ("lab_studies",),  # a package of its own, which the lab never imports
)
PACKAGES = ("lab", "lab_studies")
ALONE: dict[str, set[str]] = (
    {  # library -> the only modules that may import it
        "pybullet": {"lab.sim.world"},
        "pybullet_data": {"lab.sim.world"},
        "pybullet_utils": {"lab.sim.world"},
        "meshcat": {"lab.view.meshcat"},
        "cv2": {f"lab.vision.{name}" for name in ("calibration", "lens", "markers", "part_outline", "picture_files")},
        "PIL": {"lab.view.movie"},
        "numba": {"lab.learning.compiled"},  # what is kept of it is kept in one place
        "ortools": {"lab.sequencing.methods.cp_sat_solver"},  # without pandas
        "starlette": {
            "lab.view.server",
            "lab.view.server_page",
            "lab.view.polled_pages",
            "lab.classroom.class_server",
            "lab.classroom.browser_socket",
            "lab.classroom.door",
            "lab.classroom.step_pages",
        },
        "uvicorn": {"lab.view.server", "lab.view.server_page", "lab.classroom.class_server"},
        "websockets": {"lab.classroom.class_server", "lab.classroom.desk"},
        "segno": {"lab.classroom.code_picture"},
        "cryptography": {"lab.classroom.certificate"},
        "jinja2": {"lab.view.printed_page"},
        "av": {"lab.recordings.video"},
        "pyarrow": {"lab.classroom.export", "lab.recordings.lerobot_tables"},
        "sklearn": {"lab.cloning.student"},
        "threadpoolctl": {"lab.cloning.student"},
        "statsmodels": {"lab.studies.people"},
        "lark": {"lab.words.slots"},
        "fsspec": {"lab.toolbox.remote_place"},
        "s3fs": set(),  # fsspec's
        "optuna": {"lab.studies.tuning"},
        "torch": {f"lab_studies.comparisons.deep_student.{name}" for name in ("dqn", "deep_student")},
        "joblib": {"lab.studies.runner"},  # to work in several processes; its files are pickles, and nobody reads those
        "psutil": {"lab.studies.runner"},
    }
    | {library: {"lab.operating_system"} for library in ("fcntl", "resource", "msvcrt")}
    | {
        library: set()  # which one system or another lacks, or which are no use there
        for library in ("termios", "tty", "pty", "pwd", "grp", "select", "posix", "readline", "winreg", "_winapi")
    }
    | {library: set() for library in ("random", "pickle", "dill", "cloudpickle", "shelve", "marshal")}
)
NEVER = {  # room -> rooms that it never imports, whatever the layers say
    **dict.fromkeys(
        ("lab.mdp", "lab.learning", "lab.advice", "lab.sequencing"), ("lab.sim", "lab.view", "lab.seat", "lab.cli")
    ),
    "lab.sim": ("lab.learning", "lab.sequencing"),
    # it judges by frames and the task file, and shares no code with what carried the run out
    "lab.audit": ("lab.skills", "lab.sequencing", "lab.learning", "lab.sim.scene", "lab.sim.world", "lab.sim.arms"),
    "lab_studies.comparisons.schedule_checker": ("lab",),  # it shares no code with what it checks
}
HEAVY = (
    *("numpy", "pydantic", "scipy", "trimesh", "matplotlib", "numba", "meshcat", "cv2", "pybullet", "safetensors"),
    *("ortools", "starlette", "uvicorn", "gymnasium", "jinja2", "lark", "fsspec"),
)
READS_ITS_OWN = (  # what ships with the lab, or what it has just written: nothing that a stranger may have made
    *(
        "lab.classroom.class_place",
        "lab.view.meshcat",
        "lab.view.server_page",
        "lab.cli.export",
        "lab.toolbox.remote_place",
    ),
    *("lab.words.slots", "lab.words.vocabulary"),
    *("lab.api.lessons", "lab.api.pictures", "lab.api.runs", "lab.api.scenes"),
)
BY_TABLE = ("lab", "lab.lazy", "lab.cli.app", "lab.tasks.instances", "lab_studies")  # what these load stands in a table
GENERATORS = {"Generator", "default_rng", "SeedSequence", "BitGenerator", "PCG64"}


@dataclass(frozen=True)
class Import:
    """One imported module, and whether loading the importer loads it (module level, outside TYPE_CHECKING)."""

    target: str
    line: int
    at_load: bool


def within(module: str, room: str) -> bool:
    """Whether `module` is `room` or inside it."""
    return module == room or module.startswith(f"{room}.")


def layer(module: str) -> tuple[int, str]:
    """The layer and the room of a module: the longest listed prefix; the package itself stands above all."""
    if module == "lab":
        return len(LAYERS), module
    rooms = [(len(room), number, room) for number, rooms in enumerate(LAYERS) for room in rooms if within(module, room)]
    assert rooms, f"{module} has no room: give it a row in LAYERS (tests/test_walls.py), as low as it can stand"
    _, number, room = max(rooms)
    return number, room


def imports(tree: ast.Module, module: str, is_package: bool, known: frozenset[str]) -> list[Import]:
    """All imports of a module, absolute; `from package import name` is the submodule where there is one."""
    found = []
    for node, at_load in _statements(tree, True):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parents = module.split(".")[: len(module.split(".")) - node.level + is_package]
                base = ".".join([*parents, base] if base else parents)
            lazily = [alias.name for alias in node.names if base == "lab.lazy" and alias.name in LIBRARIES]
            found += [Import(library, node.lineno, False) for library in lazily]
            names = [f"{base}.{alias.name}" for alias in node.names]
            targets = [name if name in known else base for name in names]
        else:
            continue
        found += [Import(target, node.lineno, at_load) for target in targets]
    return found


def _statements(outer: ast.AST, at_load: bool) -> Iterator[tuple[ast.AST, bool]]:
    """Each statement inside, and whether it runs when the module is loaded."""
    for node in ast.iter_child_nodes(outer):
        if isinstance(node, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield node, at_load
            later = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or _is_type_checking(node)
            yield from _statements(node, at_load and not later)


def _is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING")


def import_faults(module: str, found: list[Import]) -> Iterator[str]:
    """What is wrong with a module's imports, one line each."""
    for item in found:
        top, place = item.target.partition(".")[0], f"{module}:{item.line} imports {item.target}"
        if module not in {
            *ALONE.get(top, {module}),
            "lab.lazy",
        }:  # the table of libraries is for those that may import them
            yield f"{place}: allowed in {sorted(ALONE[top]) or 'no module'}"
        if top not in PACKAGES or (item.target == "lab" and not within(module, "lab")):
            continue
        for room, banned in NEVER.items():
            if within(module, room) and any(within(item.target, other) for other in banned):
                yield f"{place}: {room} never does"
        (own_layer, own_room), (layer_there, room_there) = layer(module), layer(item.target)
        if own_room != room_there and layer_there >= own_layer:
            yield f"{place}: runs back up, {room_there} does not stand below {own_room}"


def code_faults(module: str, tree: ast.Module) -> Iterator[str]:
    """Prints outside the CLI, global random state, files read without bounds or pickled, imports by string, one line each."""
    for node in ast.walk(tree):
        line = f"{module}:{getattr(node, 'lineno', 0)}"
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            if called in ("print", "pprint", "rich.print") and module != "lab.cli.output":
                yield f"{line} prints: only the CLI does"
            if called in ("__import__", "import_module", "importlib.import_module") and module not in BY_TABLE:
                yield f"{line} imports by a string, which no wall can see"
            if called.rpartition(".")[2] in GENERATORS and not (node.args or node.keywords):
                yield f"{line} calls {called}() without a seed"
            if called.endswith((".read_bytes", ".read_text")) and module not in READS_ITS_OWN:
                yield f"{line} calls {called}(): files are read within bounds, by lab.files.read_limited"
            if any(word.arg == "allow_pickle" and ast.unparse(word.value) != "False" for word in node.keywords):
                yield f"{line} allows pickles"
        elif isinstance(node, ast.Attribute):
            text = ast.unparse(node)
            if text.startswith(("np.random.", "numpy.random.")) and text.split(".")[2] not in GENERATORS:
                yield f"{line} uses {text}: randomness is a Generator argument"
        elif isinstance(node, ast.ImportFrom) and node.module == "numpy.random":
            for name in {alias.name for alias in node.names} - GENERATORS:
                yield f"{line} imports numpy.random.{name}: randomness is a Generator argument"


def cycle(graph: dict[str, set[str]]) -> list[str]:
    """One import cycle of the graph as a closed walk, or []."""
    done: set[str] = set()

    def walk(module: str, path: list[str]) -> list[str]:
        if module in path:
            return [*path[path.index(module) :], module]
        if module in done:
            return []
        for target in sorted(graph.get(module, ())):
            if found := walk(target, [*path, module]):
                return found
        done.add(module)
        return []

    return next((found for module in sorted(graph) if (found := walk(module, []))), [])


def loads(module: str, item: Import) -> Iterator[str]:
    """The modules that an import runs: its target and the packages above it, but not those above the importer."""
    parts = item.target.split(".")
    for depth in range(1, len(parts) + 1):
        name = ".".join(parts[:depth])
        if name == item.target or not within(module, name):
            yield name


def paths() -> dict[str, Path]:
    """The file of every module of the packages."""
    found = {}
    for path in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


PATHS = paths()  # the files are parsed in the first test, not where every worker imports this module


@cache
def house() -> dict[str, tuple[ast.Module, list[Import]]]:
    """Every module of the packages: its tree and its imports."""
    trees = {name: ast.parse(path.read_text(encoding="utf-8"), str(path)) for name, path in PATHS.items()}
    known = frozenset(PATHS)
    return {name: (tree, imports(tree, name, PATHS[name].name == "__init__.py", known)) for name, tree in trees.items()}


@pytest.mark.parametrize("module", sorted(PATHS))
def test_a_module_keeps_the_walls(module: str) -> None:
    tree, found = house()[module]
    assert not [*import_faults(module, found), *code_faults(module, tree)]


def test_no_import_runs_in_a_circle() -> None:
    rooms = {name: found for name, (_, found) in house().items() if name != "lab"}  # which loads nothing by itself
    graph = {name: {to for item in found for to in loads(name, item)} for name, found in rooms.items()}
    assert cycle(graph) == []


def test_the_architecture_is_the_one_that_is_told() -> None:
    """docs/architecture.md: every folder of modules stands in its tree, and its floors are those of LAYERS."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    told, parents = set[str](), list[str]()
    for indent, name in re.findall(r"^    ( *)(\w+)/ ", text, re.MULTILINE):
        parents[len(indent) // 2 :] = [name]
        told.add("/".join(parents))
    folders = {path.parent for package in PACKAGES for path in (ROOT / package).rglob("__init__.py")}
    assert told == {folder.relative_to(ROOT).as_posix() for folder in folders}
    floors = re.findall(r"^    \d+ +([a-z_, ]+)$", text, re.MULTILINE)
    rooms = [tuple(room.removeprefix("lab.") for room in floor) for floor in LAYERS]
    assert [tuple(floor.split(", ")) for floor in floors] == rooms


def test_the_package_itself_loads_nothing_until_it_is_touched() -> None:
    assert [item.target for item in house()["lab"][1] if item.at_load] == ["lab.version"]


@pytest.mark.parametrize(
    "module", sorted(name for name, path in PATHS.items() if "loader(__name__" in path.read_text(encoding="utf-8"))
)
def test_a_table_of_what_is_loaded_later_holds_what_is_imported_for_types(module: str) -> None:
    """The walls see the imports of the table's module; what is loaded when it runs is the table's."""
    tree, _ = house()[module]
    block = next(node for node in tree.body if isinstance(node, ast.If) and _is_type_checking(node))
    for_types = {
        (node.module, alias.name, alias.asname or alias.name)
        for node in ast.walk(block)
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    (table,) = (
        node.value for node in tree.body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "TABLE"
    )
    rows = [(where, row) for where, names in ast.literal_eval(table).items() for row in names]
    assert {(where, row.partition(" ")[0], row.rpartition(" ")[2]) for where, row in rows} == for_types


def test_the_table_of_libraries_holds_what_is_imported_for_types() -> None:
    tree, _ = house()["lab.lazy"]
    block = next(node for node in tree.body if isinstance(node, ast.If) and _is_type_checking(node))
    for_types = [alias.name for node in block.body if isinstance(node, ast.Import) for alias in node.names]
    assert for_types == [module for modules in LIBRARIES.values() for module in modules]
    assert {name.partition(".")[0] for name in for_types} == {*LIBRARIES}


def test_ctrl_c_is_heard_before_anything_is_loaded() -> None:
    assert not [item.target for item in house()["lab.cli"][1] if item.at_load]


def test_starting_the_command_loads_nothing_heavy() -> None:
    """From the commands along module-level imports no heavy library is reached, or `lab run --help` takes seconds."""
    pending, seen = [module for module in house() if within(module, "lab.cli")], set[str]()
    while pending:
        module = pending.pop()
        if module in seen or module not in house():
            continue
        seen.add(module)
        for item in house()[module][1]:
            if item.at_load:
                assert item.target.partition(".")[0] not in HEAVY, f"{module}:{item.line} imports {item.target}"
                pending.extend(loads(module, item))


def faults(module: str, source: str) -> list[str]:
    """The faults of a module with this source, in a house of a few known modules."""
    tree = ast.parse(source)
    known = frozenset({"lab.sim.world", "lab.view.meshcat", "lab.learning.session", "lab.cli", "lab.vision.pictures"})
    return [*import_faults(module, imports(tree, module, False, known)), *code_faults(module, tree)]


@pytest.mark.parametrize(
    ("module", "source", "fault"),
    [
        ("lab.sim.arms.robot", "import pybullet", "allowed in ['lab.sim.world']"),
        ("lab.sim.arms.robot", "def f():\n    import pybullet as p", "lab.sim.arms.robot:2 imports pybullet"),
        ("lab.view.plots", "from meshcat.geometry import Box", "allowed in ['lab.view.meshcat']"),
        ("lab.skills.insert", "import cv2.gapi", "allowed in ['lab.vision.calibration'"),
        ("lab.skills.insert", "from lab.lazy import cv2, loader", "lab.skills.insert:1 imports cv2: allowed in"),
        ("lab.view.plots", "import s3fs", "allowed in no module"),
        (
            "lab.sequencing.methods.exact",
            "from ortools.sat.python import cp_model",
            "allowed in ['lab.sequencing.methods.cp_sat_solver']",
        ),
        ("lab.sequencing.methods.fifo", "def f():\n    import jinja2", "imports jinja2: allowed in"),
        ("lab.mdp", "import random", "allowed in no module"),
        ("lab.files", "def f():\n    import fcntl", "allowed in ['lab.operating_system']"),
        ("lab.toolbox.registry", "import pickle", "allowed in no module"),
        ("lab.mdp", "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import lab.sim.world", "never does"),
        ("lab.mdp", "from lab.sim import world", "imports lab.sim.world: lab.mdp never does"),
        ("lab.learning.session", "from ..view import meshcat", "imports lab.view.meshcat: lab.learning never does"),
        ("lab.advice.trust", "from lab import cli", "imports lab.cli: lab.advice never does"),
        ("lab.learning.session", "from lab.advice.trust import x", "runs back up"),
        ("lab.sequencing.methods.srl", "def f():\n    import lab.advice.advisors", "runs back up"),
        ("lab.sequencing.methods.srl", "from lab.seat.terminal.prompt import ReadLine", "lab.sequencing never does"),
        ("lab.sim.arms.robot", "from ...learning import session", "imports lab.learning.session: lab.sim never does"),
        ("lab.sim.world", "from lab.sequencing.cell.cell import Cell", "lab.sim never does"),
        (
            "lab_studies.comparisons.schedule_checker",
            "from lab.sequencing.simulate.run import follow",
            "checker never does",
        ),
        ("lab.production.composer", "from ..cli import main", "runs back up"),
        ("lab.cli.study", "def f():\n    from lab_studies import STUDIES", "runs back up"),
        ("lab.vision.pictures", "from lab.sim.world import World", "runs back up"),
        ("lab.mdp", "print('x')", "prints"),
        ("lab.mdp", "import numpy as np\nx = np.random.rand()", "uses np.random.rand"),
        ("lab.mdp", "from numpy.random import shuffle, default_rng", "imports numpy.random.shuffle"),
        ("lab.mdp", "import numpy as np\nrng = np.random.default_rng()", "without a seed"),
        (
            "lab_studies.many_sessions",
            "from numpy.random import SeedSequence\nx = SeedSequence()",
            "without a seed",
        ),
        ("lab.toolbox.registry", "np.load(path, allow_pickle=True)", "allows pickles"),
        ("lab.skills.grasp", "import_module('pybullet')", "no wall can see"),
    ],
)
def test_a_broken_wall_is_seen(module: str, source: str, fault: str) -> None:
    assert any(fault in line for line in faults(module, source)), faults(module, source)


@pytest.mark.parametrize(
    ("module", "source"),
    [
        ("lab.sim.world", "import pybullet"),
        ("lab.vision.lens", "from lab.lazy import cv2"),
        ("lab.cli.output", "print('x')\nfrom lab.view import meshcat"),
        ("lab.seat.terminal.prompt", "console.print('x')"),
        ("lab.learning.session", "from lab.learning.gates import GATES\nfrom .settings import GateSettings"),
        ("lab.sim.world", "from lab.sim.frames import Frame"),
        ("lab.mdp", "import numpy as np\ndef f(rng: np.random.Generator): return np.random.default_rng(1)"),
        ("lab.sequencing.methods.srl_advised", "from lab.learning.gates import GATES"),
        ("lab_studies.many_sessions", "from numpy.random import SeedSequence\nx = SeedSequence(1)"),
    ],
)
def test_what_is_allowed_passes(module: str, source: str) -> None:
    assert faults(module, source) == []


def test_a_cycle_is_found() -> None:
    assert cycle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c", "b"]
    assert cycle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_a_module_without_a_room_is_refused() -> None:
    with pytest.raises(AssertionError, match=r"lab\.attic has no room"):
        layer("lab.attic")
