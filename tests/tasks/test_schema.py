"""The schema of the lab's files: every key is told, and an independent validator agrees with the loader."""

import tomllib
from collections.abc import Iterator
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from jsonschema import Draft7Validator
from pydantic import ValidationError

from lab.errors import BadInput
from lab.files import tasks_folder
from lab.tasks.cell_file import CellFile
from lab.tasks.grid_world import GridWorld
from lab.tasks.record import Record
from lab.tasks.schema import KINDS, TABLES, examples_of, page_of, schema_of, tables_of, unit_of
from lab.tasks.task import Task

DOCS = Path(__file__).resolve().parents[2] / "docs"
MODELS: dict[str, type[Record]] = {"task": Task, "cell": CellFile, "world": GridWorld}
SHIPPED = sorted(tasks_folder().glob("*.toml"))
SMALL = [path for path in SHIPPED if path.stat().st_size < 20_000]
OF_SEVERAL = {"value_error", "assertion_error"}  # what one key demands of another, which a schema does not say
BARE = {"LearnerSettings", "GateSettings", "Rewards"}  # whose numbers have no units
UNITS = {
    "_s": "s", "_m": "m", "_kg": "kg", "_n": "N", "_nm": "Nm", "_rad": "rad", "_m_s": "m/s", "_rad_s": "rad/s", "_m_s2": "m/s2",
}  # fmt: skip


@cache
def schema(kind: str) -> dict[str, Any]:
    found = schema_of(kind)
    Draft7Validator.check_schema(found)
    return found


@cache
def read(path: Path) -> tuple[str, dict[str, Any]]:
    raw = tomllib.loads(path.read_text(encoding="utf-8"))
    return raw.get("kind", "task"), raw


def told(kind: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Every key of a kind of file: its table, its name, its schema."""
    yield from (("", key, field) for key, field in schema(kind)["properties"].items())
    for name, table in schema(kind)[TABLES].items():
        yield from ((name, key, field) for key, field in table["properties"].items())


def holds_numbers(field: dict[str, Any]) -> bool:
    inner = [field.get("items"), field.get("additionalProperties"), *field.get("anyOf", [])]
    flat = [one for each in inner for one in (each if isinstance(each, list) else [each]) if isinstance(one, dict)]
    return field.get("type") == "number" or any(holds_numbers(one) for one in flat)


# ---- what is told of each key -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_has_a_description_and_a_quantity_its_unit(kind: str) -> None:
    for table, key, field in told(kind):
        where = f"{table}.{key}"
        assert field.get("description"), where
        if table in BARE:
            continue
        unit = unit_of(field["description"])
        assert unit or not holds_numbers(field), where
        suffix = max((end for end in UNITS if key.endswith(end)), key=len, default=None)
        if suffix is not None:
            assert unit == UNITS[suffix], where


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_has_an_example_that_it_may_hold(kind: str) -> None:
    for table, key, field in told(kind):
        held = {"$ref", "allOf", "enum", "const"} & {*field} or "default" in field or field.get("type") in ("boolean",)
        tables = "$ref" in str(field)
        assert field.get("examples") or held or tables, f"{table}.{key}"
        for value in field.get("examples", []):
            Draft7Validator(field | {TABLES: schema(kind)[TABLES]}).validate(value)


@pytest.mark.parametrize("kind", KINDS)
def test_every_table_of_a_file_is_reached(kind: str) -> None:
    reached = [id(table.schema) for table in tables_of(schema(kind))]
    assert {id(table) for table in schema(kind)[TABLES].values()} <= {*reached}
    assert len(reached) == len({*reached})


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_is_the_one_of_the_records(kind: str) -> None:
    """`lab task schema KIND --out docs/KIND-file.md` makes it anew."""
    page = (DOCS / f"{kind}-file.md").read_text(encoding="utf-8")
    assert page == page_of(kind)
    assert {f"`{key}`" for _, key, _ in told(kind)} <= {
        line.split(" | ")[0].removeprefix("| ") for line in page.splitlines() if line.startswith("| `")
    }


def test_defaults_of_learning_are_those_of_a_file_that_leaves_them_out() -> None:
    world = GridWorld(name="bare", shape=(1, 3), start=(0, 0), goal=(0, 2))
    for table, held in (("LearnerSettings", world.learner), ("GateSettings", world.gate), ("Rewards", world.rewards)):
        for key, field in schema("world")[TABLES][table]["properties"].items():
            assert getattr(held, key) in (field.get("default"), *field.get("examples", [])), key


def test_examples_and_units_are_read_out_of_a_text() -> None:
    assert examples_of('A size [m], such as `[1.0, 2.0]` or `"a"`; left out: `3`.') == [[1.0, 2.0], "a"]
    assert examples_of("A size [m].") == []
    assert unit_of("Two, such as `[1]`, of them [m, rad].") == "m, rad"
    assert unit_of("A name, such as `[1]`.") == ""


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(BadInput, match="unknown kind 'tasks'"):
        schema_of("tasks")


# ---- the same as the loader ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_what_ships_is_valid(path: Path) -> None:
    kind, raw = read(path)
    Draft7Validator(schema(kind)).validate(raw)


def places(value: Any, way: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """The way to everything in a file."""
    if way:
        yield way
    inner = value.items() if isinstance(value, dict) else enumerate(value[:3]) if isinstance(value, list) else ()
    for key, one in inner:
        yield from places(one, (*way, key))


def at(value: Any, way: tuple[str | int, ...]) -> Any:
    for key in way:
        value = value[key]
    return value


# no 3.0: for JSON Schema it is a whole number
WRONG = [
    True,
    "",
    "no such thing",
    -1e9 - 0.5,
    1e9 + 0.5,
    -3,
    0,
    10**8,
    0.5,
    [],
    [1],
    ["x", "y"],
    {},
    {"no_such_key": 1},
]


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(st.data())
def test_what_the_loader_refuses_the_schema_refuses_and_nothing_else(data: st.DataObject) -> None:
    """In a file that ships something is put, taken away or added; structural faults are those of one key alone."""
    kind, raw = read(data.draw(st.sampled_from(SMALL)))
    changed = deepcopy(raw)
    way = data.draw(st.sampled_from([*places(raw)]))
    assume(way != ("kind",))
    what = data.draw(st.sampled_from(["put", "take", "add"]))
    holder, key = at(changed, way[:-1]), way[-1]
    if what == "put":
        holder[key] = data.draw(st.sampled_from(WRONG))
    elif what == "take":
        del holder[key]
    else:
        assume(isinstance(holder[key], dict))
        holder[key]["no_such_key"] = 1
    valid = Draft7Validator(schema(kind)).is_valid(changed)
    try:
        MODELS[kind].model_validate(changed)
    except ValidationError as error:
        structural = {one["type"] for one in error.errors()} - OF_SEVERAL
        assert not (structural and valid), (way, structural)
    except BadInput:
        pass  # names that do not fit together, and what rewards come to
    else:
        assert valid, (way, at(changed, way) if what == "put" else what)


@pytest.mark.parametrize(
    ("fault", "valid"),
    [
        ({"what": "machine slow", "station": "oven", "share": 2.0}, True),
        ({"what": "machine slow"}, False),
        ({"what": "machine fails", "station": "oven", "share": 2.0}, False),
    ],
)
def test_a_fault_has_the_keys_of_its_kind(fault: dict[str, Any], valid: bool) -> None:
    whole = {"$ref": f"#/{TABLES}/FaultFields", TABLES: schema("task")[TABLES]}
    assert Draft7Validator(whole).is_valid(fault) is valid
