"""What a plain install does not bring: each missing library is one line that says what to install, and changes nothing else."""

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from lab.errors import BadInput
from lab.lazy import LIBRARIES
from lab.optional import EXTRAS, optional

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("lab", "lab_studies")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
RIVALS = {"jax"}  # libraries that a study measures itself beside, where they are: never installed by an extra
BROUGHT = {"pydantic_core": "pydantic", "pybullet_data": "pybullet"}  # a part of another library, and never without it
HIDING = """
import sys
from importlib.machinery import PathFinder

MODULES, DISTRIBUTIONS = {modules!r}, {distributions!r}


class Hiding(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        return None if name.partition(".")[0] in MODULES else super().find_spec(name, path, target)

    @classmethod
    def find_distributions(cls, *context):
        return (one for one in super().find_distributions(*context) if one.name.lower() not in DISTRIBUTIONS)


sys.meta_path[:] = [Hiding if finder is PathFinder else finder for finder in sys.meta_path]
"""
Without = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def without(tmp_path: Path) -> Without:
    """Runs a command, or a line of Python, in a fresh interpreter that does not find some libraries, nor do its children."""

    def run(libraries: set[str], *words: str) -> subprocess.CompletedProcess[str]:
        owners = packages_distributions()
        named = {name.lower() for library in libraries for name in owners.get(library, [library])}
        text = HIDING.format(modules=libraries, distributions=named)
        (tmp_path / "sitecustomize.py").write_text(text, encoding="utf-8")
        code = words[0] if len(words) == 1 else "import sys; from lab.cli import main; sys.argv[0] = 'lab'; main()"
        return subprocess.run(
            [sys.executable, "-c", code, *words[len(words) == 1 :]],
            cwd=tmp_path,
            env={
                **os.environ,
                "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}",
                "LAB_TOOLBOX": str(tmp_path / "toolbox"),
                "MINARI_DATASETS_PATH": str(tmp_path / "minari"),
            },
            capture_output=True,
            text=True,
            check=False,
        )

    return run


def plain_install() -> set[str]:
    """The names of the distributions that a plain install brings, dependencies of dependencies among them."""
    found, pending = set[str](), ["teaching-lab"]
    while pending:
        name = canonicalize_name(pending.pop())
        if name in found:
            continue
        try:
            lines = requires(name) or []
        except PackageNotFoundError:  # of another system, say
            continue
        found.add(name)
        pending += [
            one.name for one in map(Requirement, lines) if one.marker is None or one.marker.evaluate({"extra": ""})
        ]
    return found


def not_plain() -> set[str]:
    """The modules of this environment that a plain install does not have."""
    plain = plain_install()
    modules = packages_distributions()
    return {module for module, owners in modules.items() if plain.isdisjoint(map(canonicalize_name, owners))}


# ---- each library in turn -----------------------------------------------------------------------------------------

REPLAY = ("replay", "kept")
DATASET = "from pathlib import Path; from lab.recordings.lerobot_tables import task_texts; task_texts(Path('tasks'))"
PICTURE = r"from lab.recordings.video import decoded_picture; decoded_picture(b'\xff\xd8', 'x')"
TABLE = "import lab; lab.teach('world-1', advisor=None, episodes=2).{}"


@pytest.mark.parametrize(
    ("library", "words", "said"),
    [
        ("optuna", ("tune", "world-1", "--trials", "2", "--sessions", "2"), "tuning: {} '.[tune]' {}"),
        ("distributed", ("study", "run", "table-9.2", "--dask", "127.0.0.1:9"), "--dask 127.0.0.1:9: {} '.[dask]' {}"),
        ("torch", ("study", "run", "deep-student"), "study deep-student: {} '.[deep]' {}"),
        ("fsspec", ("toolbox", "list", "--toolbox", "s3://lab/box"), "toolbox s3://lab/box: {} '.[remote]' {}"),
        ("s3fs", ("toolbox", "list", "--toolbox", "s3://lab/box"), "toolbox s3://lab/box: {} '.[remote]' {}"),
        ("botocore", ("toolbox", "list", "--toolbox", "s3://lab/box"), "toolbox s3://lab/box: {} botocore"),
        ("gcsfs", ("toolbox", "list", "--toolbox", "gs://lab/box"), "toolbox gs://lab/box: {} gcsfs"),
        ("minari", (*REPLAY, "--minari", "lab/kept-v0"), "dataset 'lab/kept-v0': {} '.[data]' {}"),
        ("h5py", (*REPLAY, "--minari", "lab/kept-v0"), "dataset 'lab/kept-v0': {} '.[data]' {}"),
        ("tensorboard", (*REPLAY, "--tensorboard", "curves"), "folder 'curves': {} '.[data]' {}"),
        *(
            (library, ("clone", "place", "--out", "cloned"), "lab clone: {} '.[recordings]' {}")
            for library in ("av", "pyarrow", "sklearn", "threadpoolctl")
        ),
        ("pyarrow", ("study", "export", "nowhere", "--out", "x", "--parquet"), "--parquet: {} '.[people]' {}"),
    ],
)
def test_a_command_says_what_to_install(
    library: str, words: tuple[str, ...], said: str, without: Without, tmp_path: Path
) -> None:
    if words[0] == "replay":
        (tmp_path / "small.txt").write_text("S..\n.#.\n..G")
        taught = without(set(), "teach", "small.txt", "--gate", "always", "--episodes", "5", "--out", "kept")
        assert taught.returncode == 0, taught.stderr
    ran = without({library}, *words, "--json")
    missing = f"the library '{library}' is not installed: pip install"
    line = said.format(missing, "in a checkout of the lab")
    assert (ran.returncode, ran.stderr.splitlines()[-1]) == (2, f"lab: {line}")
    assert "Traceback" not in ran.stderr
    assert json.loads(ran.stdout) == {"error": line, "exit_code": 2}
    assert {path.name for path in tmp_path.iterdir()} <= {
        "sitecustomize.py",
        "__pycache__",
        "toolbox",
        "small.txt",
        "kept",
    }


@pytest.mark.parametrize(
    ("library", "code", "said"),
    [
        ("pandas", TABLE.format("to_dataframe()"), "to_dataframe(): {} '.[data]' in a checkout of the lab"),
        (
            "optuna",
            "import lab; lab.tune('world-1', trials=2, sessions=2)",
            "tuning: {} '.[tune]' in a checkout of the lab",
        ),
        ("pyarrow", DATASET, "'tasks': {} '.[recordings]' in a checkout of the lab"),
        ("av", PICTURE, "x: {} '.[recordings]' in a checkout of the lab"),
    ],
)
def test_a_call_says_what_to_install(library: str, code: str, said: str, without: Without) -> None:
    ran = without({library}, code)
    line = said.format(f"the library '{library}' is not installed: pip install")
    assert ran.stderr.splitlines()[-1] == f"lab.errors.BadInput: {line}"


def test_what_is_installed_and_cannot_be_loaded_is_said() -> None:
    with (
        pytest.raises(
            BadInput, match=r"^dataset 'x': a library that it needs cannot be loaded: libhdf5: wrong ELF class$"
        ),
        optional("dataset 'x'"),
    ):
        raise ImportError("libhdf5: wrong ELF class")


def test_too_little_memory_is_not_taken_for_a_missing_library() -> None:
    with pytest.raises(ImportError, match="failed to map segment"), optional("dataset 'x'"):
        raise ImportError("libhdf5.so: failed to map segment from shared object")


# ---- all of them at once ------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_without_all_that_is_not_plain_toast_is_made_and_its_times_are_kept(without: Without) -> None:
    """The second run learns nothing and times nothing."""
    hidden = not_plain()
    # PyTorch is in no extra of the tests; pandas comes with others
    assert {library for libraries in EXTRAS.values() for library in libraries} - {"pandas", "torch"} <= hidden
    documents = []
    for _ in range(2):
        ran = without(hidden, "run", "toast", "--toasts", "1", "--json")
        assert (ran.returncode, "skipped" in ran.stderr) == (0, False), ran.stderr[-1000:]
        documents.append(json.loads(ran.stdout))
    cold, warm = documents
    assert {row["source"] for row in warm["skills"]} == {"reused"}
    assert warm["timed_s"] == 0.0 < cold["timed_s"]
    assert warm["measured_makespan_s"] == pytest.approx(warm["predicted_makespan_s"], rel=0.01)


def test_without_all_that_is_not_plain_every_module_can_be_imported(without: Without) -> None:
    names = sorted(".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in SOURCES)
    ran = without(not_plain(), f"from importlib import import_module\nfor name in {names}: import_module(name)")
    assert (ran.returncode, ran.stderr) == (0, "")


# ---- what is written down -----------------------------------------------------------------------------------------


def import_name(distribution: str) -> str:
    """The name by which a library is imported."""
    return {"scikit-learn": "sklearn"}.get(distribution, distribution)


def test_the_table_of_extras_is_the_projects() -> None:
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    extras = {
        name: lines for name, lines in project["optional-dependencies"].items() if name not in ("docs", "test", "dev")
    }
    assert {name: {import_name(Requirement(line).name) for line in lines} for name, lines in extras.items()} == {
        name: {*libraries} for name, libraries in EXTRAS.items()
    }


def test_each_library_that_is_imported_is_a_dependency_or_is_asked_for_as_optional() -> None:
    """None comes by accident, through another library."""
    own = {
        canonicalize_name(Requirement(line).name) for line in requires("teaching-lab") or [] if "extra ==" not in line
    }
    owners = {module: {canonicalize_name(name) for name in names} for module, names in packages_distributions().items()}
    for path in SOURCES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for library, asked in (*imported(tree), *lazily_imported(tree)):
            given = bool(own & owners.get(library, set())) or BROUGHT.get(library) in own
            assert given != asked or library in RIVALS, f"{path.relative_to(ROOT)}: {library}"


def imported(tree: ast.AST, asked: bool = False) -> Iterator[tuple[str, bool]]:
    """Each library that a module imports, and whether it does so inside `with optional(...)`."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [str(node.module)] if isinstance(node, ast.ImportFrom) and not node.level else []
        for name in names:
            library = name.partition(".")[0]
            if library not in PACKAGES and library not in sys.stdlib_module_names:
                yield library, asked
        inside = isinstance(node, ast.With) and any("optional(" in ast.unparse(item) for item in node.items)
        yield from imported(node, asked or inside)


def lazily_imported(tree: ast.AST) -> Iterator[tuple[str, bool]]:
    """Each library of `lab.lazy` that a module uses, and whether it names it in `require` or inside `with optional(...)`."""
    nodes = list(ast.walk(tree))
    found = {
        alias.name
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module == "lab.lazy"
        for alias in node.names
    } & LIBRARIES.keys()
    asking = [
        node
        for node in nodes
        if (isinstance(node, ast.Call) and ast.unparse(node.func) == "require")
        or (isinstance(node, ast.With) and any("optional(" in ast.unparse(item) for item in node.items))
    ]
    used = {node.id for node in nodes if isinstance(node, ast.Name)}  # and not only in a quoted annotation
    asked = {node.id for outer in asking for node in ast.walk(outer) if isinstance(node, ast.Name)}
    yield from ((name, name in asked) for name in sorted(found & used))


def test_no_message_and_no_page_installs_the_lab_from_an_index() -> None:
    """None has it yet: only a checkout, or the repository's address, can be installed."""
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *SOURCES]
    found = [path for path in pages if re.search(r"pip install [^`\n]*teaching-lab", path.read_text(encoding="utf-8"))]
    assert found == []
