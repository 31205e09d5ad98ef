"""The keys of task, cell and world files, generated from the records: a JSON Schema for editors, and a reference page."""

import ast
import json
import re
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from inspect import cleandoc, getsource
from itertools import pairwise
from textwrap import dedent
from typing import Any, NamedTuple, get_type_hints

from annotated_types import DocInfo

from lab.errors import unknown
from lab.learning.gates import GATES
from lab.learning.selection import SELECTIONS
from lab.learning.settings import GateSettings, LearnerSettings
from lab.learning.updates import UPDATES
from lab.mdp import Rewards
from lab.sequencing import SEQUENCERS
from lab.sequencing.cell.chance import LAWS
from lab.sequencing.cell.objectives import OBJECTIVES
from lab.tasks.cell_file import CellFile
from lab.tasks.grid_world import GridWorld
from lab.tasks.record import NAME_PATTERN, Record
from lab.tasks.robot_fields import MODELS
from lab.tasks.task import Task

DRAFT = "http://json-schema.org/draft-07/schema#"  # the draft that editors' extensions for TOML support
TABLES = "definitions"
STAGES = ("Stage", "CellStage")  # records that may be written as the names of their stations
UNIT = re.compile(r" \[([^\]]+)\]")
EXAMPLES = re.compile(r",? such as (`[^`]*`(?:(?:, | or )`[^`]*`)*)")
QUOTED = re.compile(r"`[^`]*`")

Schema = dict[str, Any]


def _records() -> dict[str, type[Record]]:
    return {"task": Task, "cell": CellFile, "world": GridWorld}


KINDS = ("task", "cell", "world")  # of files


def schema_of(kind: str) -> Schema:
    """The JSON Schema (draft 7) of a kind of file; raises BadInput for an unknown kind.

    It covers each key by itself: names, types, ranges, choices, lengths. Conditions between keys are checked by
    `lab task check`.
    """
    if kind not in KINDS:
        raise unknown("kind", kind, KINDS, "of file")
    record = _records()[kind]
    raw = record.model_json_schema(ref_template=f"#/{TABLES}/{{model}}")
    _describe(raw, record)
    tables = {name: _plain(table) for name, table in raw.pop("$defs").items()}
    for name, described in _from_dataclasses().items():
        if name in tables:
            tables[name] |= {"additionalProperties": False, "description": described.pop("")}
            for key, text in described.items():
                tables[name]["properties"][key]["description"] = text
    for (name, key), (names, open_to_others) in _names().items():
        if name in tables:
            field = tables[name]["properties"][key]
            del field["type"]
            field |= {"anyOf": [{"enum": names}, open_to_others]} if open_to_others else {"enum": names}
    if "Rewards" in tables:  # `Learned` has other defaults than its records have by themselves
        tables["GateSettings"]["properties"]["spare_best"]["default"] = True
        collision = tables["Rewards"]["properties"]["collision"]
        del collision["default"]
        collision["description"] += "; left out: the return of the longest walk minus `goal`"
        collision["examples"] = [-11.5]  # that value, with the defaults of all others
    whole = _plain(raw)
    if "kind" in whole["properties"]:  # a file that does not say its kind is a task
        del whole["properties"]["kind"]["default"]
        whole["required"] = ["kind", *whole["required"]]
    return {"$schema": DRAFT, "title": f"A {kind} file of the Teaching Lab", **whole, TABLES: tables}


def _describe(raw: Schema, whole: type[Record]) -> None:
    """Adds to a schema and its tables the texts below the fields of their records.

    Pydantic could add them when it makes the classes, but would then read their sources in each command that reads a file.
    """
    tables = raw["$defs"] | {whole.__name__: raw}
    for record in _below(Record):
        if record.__name__ in tables:
            for key, text in field_texts(record).items():
                tables[record.__name__]["properties"][key].setdefault("description", text)


def _below(record: type[Record]) -> Iterator[type[Record]]:
    """All subclasses of a record."""
    for below in record.__subclasses__():
        yield below
        yield from _below(below)


def field_texts(record: type[Record]) -> dict[str, str]:
    """The text below each field of a record, inherited fields included; a field may have none."""
    texts: dict[str, str] = {}
    for kind in reversed(record.__mro__):
        if issubclass(kind, Record):
            [made] = ast.parse(dedent(getsource(kind))).body
            assert isinstance(made, ast.ClassDef)
            for field, below in pairwise(made.body):
                match field, below:
                    case ast.AnnAssign(target=ast.Name(name)), ast.Expr(ast.Constant(str(text))):
                        texts[name] = cleandoc(text)
    return texts


def _from_dataclasses() -> dict[str, dict[str, str]]:
    """The descriptions of dataclasses and of their fields, by class and field; "" holds the description of the class."""
    by_class: dict[str, dict[str, str]] = {}
    for kind in (LearnerSettings, GateSettings, Rewards):
        hints = get_type_hints(kind, include_extras=True)
        by_class[kind.__name__] = {"": " ".join(str(kind.__doc__).split("\n\n")[0].split())}
        for field in fields(kind):
            texts = [item.documentation for item in hints[field.name].__metadata__ if isinstance(item, DocInfo)]
            by_class[kind.__name__][field.name] = "".join(texts)
    return by_class


def _names() -> dict[tuple[str, str], tuple[list[str], Schema | None]]:
    """The names that a key may hold, by record and key; and the schema of other values, such as a plug-in's or a file's name."""
    plugged: Schema = {"type": "string"}
    urdf: Schema = {"type": "string", "pattern": r"\.[uU][rR][dD][fF]$"}
    return {
        ("LearnerSettings", "learner"): ([*UPDATES], plugged),
        ("LearnerSettings", "selection"): ([*SELECTIONS], plugged),
        ("GateSettings", "gate"): ([*GATES], plugged),
        ("Sequencing", "method"): ([*SEQUENCERS], plugged),
        ("Sequencing", "objective"): ([*OBJECTIVES], None),
        ("Stochastic", "processing"): ([*LAWS], None),
        ("Stochastic", "arrivals"): ([*LAWS], None),
        ("RobotSettings", "model"): ([*MODELS], urdf),
    }


def _plain(schema: Schema) -> Schema:
    """A schema adapted to draft 7 and TOML: without null, arrays with items, references without siblings, with examples."""
    plain = {key: value for key, value in schema.items() if key != "title"}
    if "properties" in plain:
        plain["properties"] = {key: _plain(value) for key, value in plain["properties"].items()}
    for pattern, value in plain.pop("patternProperties", {}).items():  # tables by name, all of one kind
        plain |= {"propertyNames": {"pattern": pattern}, "additionalProperties": value}
    for key in ("items", "additionalProperties"):
        if isinstance(plain.get(key), dict):
            plain[key] = _plain(plain[key])
    if plain.get("default", ()) is None or isinstance(plain.get("default"), dict) or plain.get("default") == []:
        del plain["default"]
    choices = [_plain(choice) for choice in plain.pop("anyOf", []) if choice != {"type": "null"}]
    if len(choices) == 1:
        plain = choices[0] | plain
    elif choices:
        plain["anyOf"] = choices
    if plain.get("type") == "array":
        for old, new in (("minLength", "minItems"), ("maxLength", "maxItems")):
            if old in plain:
                plain[new] = plain.pop(old)
        if places := [_plain(place) for place in plain.pop("prefixItems", [])]:
            plain["items"] = places[0] if all(place == places[0] for place in places) else places
    if "description" in plain:
        plain["description"] = " ".join(plain["description"].split())
        if examples := examples_of(plain["description"]):
            plain["examples"] = examples
    if plain.get("$ref", "").rpartition("/")[2] in STAGES:
        plain = {"anyOf": [{"type": "string", "pattern": NAME_PATTERN}, plain]}
    if "$ref" in plain and len(plain) > 1:
        plain["allOf"] = [{"$ref": plain.pop("$ref")}]
    return plain


def examples_of(description: str) -> list[Any]:
    """The example values in a description, after "such as", parsed as TOML."""
    match = EXAMPLES.search(description)
    return (
        [] if match is None else [tomllib.loads(f"value = {word[1:-1]}")["value"] for word in QUOTED.findall(match[1])]
    )


def unit_of(description: str) -> str:
    """The unit in brackets in a description; "-": a bare number; empty: there is none."""
    match = UNIT.search(QUOTED.sub("", description))
    return "" if match is None else match[1]


# ---- The reference page -------------------------------------------------------------------------------------------

HEADS = {
    "task": (
        "Keys of a task file",
        "This page lists the keys of a task file, a cell in physics: `lab run FILE` runs it, `lab task check FILE` checks it.",
    ),
    "cell": (
        "Keys of a cell file",
        "This page lists the keys of a cell file, a cell without physics: `lab sequence FILE` orders its parts.",
    ),
    "world": (
        "Keys of a world file",
        "This page lists the keys of a world file, a grid of cells: `lab teach FILE` learns the path through it.",
    ),
}


class SchemaTable(NamedTuple):
    """A table of a file: its heading on the page, and its schema."""

    heading: str
    schema: Schema


def page_of(kind: str) -> str:
    """The reference page of a kind of file as Markdown: every key of every table. Raises BadInput for an unknown kind."""
    schema = schema_of(kind)
    title, first = HEADS[kind]
    lines = [
        f"# {title}",
        "",
        f"{first} It is generated from the records that check the file (`lab task schema {kind} --out keys.md`). The unit -",
        "means a number without a unit. A key that is not *required* may be left out.",
        "",
    ]
    for table in tables_of(schema):
        lines += [f"## {table.heading}", "", table.schema["description"], ""]
        lines += ["| key | meaning | unit | allowed | default | example |", "|---|---|---|---|---|---|"]
        required = table.schema.get("required", [])
        for key, field in table.schema["properties"].items():
            text = field["description"]
            meaning = EXAMPLES.sub("", UNIT.sub("", text, count=1) if unit_of(text) else text)
            meaning = meaning[:1].upper() + meaning[1:].rstrip(".") + "."
            default = _code(field["default"]) if "default" in field else "*required*" if key in required else ""
            shown = " or ".join(_code(value) for value in field.get("examples", []))
            row = (f"`{key}`", meaning, unit_of(text), _allowed(field, schema), default, shown or _choice(field))
            lines.append(f"| {' | '.join(word.replace('|', chr(92) + '|') for word in row)} |")
        lines.append("")
    return "\n".join(lines)


def tables_of(schema: Schema) -> list[SchemaTable]:
    """The tables of a kind of file, each once, in the order of the keys that hold them; the whole file first."""
    tables = [SchemaTable("The file itself", schema)]
    seen: set[str] = set()

    def walk(above: str, properties: Schema) -> None:
        inner = [(key, *held) for key, field in properties.items() for held in _held(field) if held[0] not in seen]
        for key, name, many in inner:
            if name in seen:
                continue
            seen.add(name)
            path = f"{above}{key}"
            own = {"[]": f"`[[{path}]]`", "{}": f"`[{path}.NAME]`", "": f"`[{path}]`"}.get(many, f"A stage of `{path}`")
            tables.append(SchemaTable(own, schema[TABLES][name]))
            walk(path + {"{}": ".NAME."}.get(many, "."), schema[TABLES][name]["properties"])

    walk("", schema["properties"])
    return tables


def _held(field: Schema, many: str = "") -> Iterator[tuple[str, str]]:
    """The records in a field and their nesting: "" one, "[]" a list, "[][]" a list of lists, "{}" a table by name."""
    for schema in (field, *field.get("allOf", []), *field.get("anyOf", [])):
        if "$ref" in schema:
            yield schema["$ref"].rpartition("/")[2], many
    for key, way in (("items", "[]"), ("additionalProperties", "{}")):
        if isinstance(field.get(key), dict):
            yield from _held(field[key], many + way)


def _allowed(field: Schema, schema: Schema) -> str:
    """The values that a field allows, in words."""
    if "anyOf" in field:
        return ", or ".join(_allowed(choice, schema) for choice in field["anyOf"])
    if (held := next(_held(field), None)) and field.get("type") != "array":
        return next(table.heading for table in tables_of(schema) if table.schema is schema[TABLES][held[0]])
    if "enum" in field or "const" in field:
        return ", ".join(_code(value) for value in field.get("enum", [field.get("const")]))
    match field.get("type"):
        case "array":
            items = field.get("items", {})
            each = " and ".join(
                dict.fromkeys(_allowed(item, schema) for item in (items if isinstance(items, list) else [items]))
            )
            return f"{_count(field.get('minItems', 0), field.get('maxItems'))}: {each}"
        case "object":
            return f"a table by name, of: {_allowed(field['additionalProperties'], schema)}"
        case "boolean":
            return "`true`, `false`"
        case "string":
            return "a name" if "pattern" in field else "text"
        case kind:
            return f"{'whole numbers' if kind == 'integer' else 'numbers'}{_range(field)}"


def _count(least: int, most: int | None) -> str:
    if least == most:
        return f"{least} values"
    return f"a list of {least} or more" if most is None else f"a list of {least} to {most}"


def _range(field: Schema) -> str:
    words = {"exclusiveMinimum": "above", "minimum": "from", "exclusiveMaximum": "below", "maximum": "to"}
    return "".join(f" {word} {field[key]:g}" for key, word in words.items() if key in field)


def _choice(field: Schema) -> str:
    """An example of a key whose choices or default show one."""
    if "default" in field:
        return _code(field["default"])
    choices = field.get("enum", [field["const"]] if "const" in field else [])
    return _code(choices[-1]) if choices else ""


def _code(value: Any) -> str:
    return f"`{toml_value(value)}`"


def toml_value(value: Any) -> str:
    """A value as TOML, on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, list):
        return f"[{', '.join(toml_value(inner) for inner in value)}]"
    return json.dumps(value, ensure_ascii=False)
