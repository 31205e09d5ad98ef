"""`lab toolbox`: the policies that were learned."""

from collections.abc import Callable
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import offers
from lab.cli.options import Json, ToolboxPlace
from lab.cli.output import end, show
from lab.errors import BadInput, counted, unknown

Name = Annotated[str, typer.Argument(help="A policy's name; lab toolbox list shows them.")]


def toolbox_list(
    subtask: Annotated[
        str | None, typer.Option("--subtask", help="Only policies of this sub-task.", autocompletion=offers("skills"))
    ] = None,
    task: Annotated[str | None, typer.Option("--task", help="Only those learned for this task.")] = None,
    advisor: Annotated[str | None, typer.Option("--advisor", help="Only those that this advisor helped.")] = None,
    solved: Annotated[
        bool | None, typer.Option("--solved/--unsolved", help="Only those that are solved, or are not.")
    ] = None,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """The policies in the toolbox."""
    box = deferred.Toolbox(toolbox)
    rows = box.list(subtask=subtask, task=task, advisor=advisor, solved=solved)
    if not rows:
        _check_filter(box, "sub-task", "subtask", subtask, _is_subtask)
        _check_filter(box, "task", "task", task, _is_task)
        _check_filter(box, "advisor", "advisor", advisor, _is_advisor)
    show({"folder": box.address, "policies": rows}, as_json, deferred.toolbox_summary)


def _check_filter(
    box: "deferred.Toolbox", what: str, field: str, value: str | None, known: Callable[[str], bool]
) -> None:
    """BadInput for a word that neither the toolbox nor the lab knows; an empty toolbox knows none, and says so."""
    held = {row[field] for row in box.list()}
    if value is not None and held and value not in held and not known(value):
        raise unknown(what, value, held, f"--{field}, toolbox {box.address}")


def _is_subtask(word: str) -> bool:
    return word in deferred.SKILLS


def _is_task(word: str) -> bool:
    return word in {path.stem for path in deferred.tasks_folder().glob("*.toml")}


def _is_advisor(word: str) -> bool:
    try:
        deferred.AdvisorName.of(word)
    except BadInput:
        return False
    return True


def toolbox_show(name: Name, toolbox: ToolboxPlace = None, as_json: Json = False) -> None:
    """All that is known of one policy: where it comes from, its versions, and what happened to it."""
    show(deferred.Toolbox(toolbox).show(name), as_json, deferred.policy_summary)


def toolbox_log(name: Name, toolbox: ToolboxPlace = None, as_json: Json = False) -> None:
    """What happened to the policies of a name: learned, put in use, evaluated, removed."""
    show({"name": name, "events": deferred.Toolbox(toolbox).log(name)}, as_json, deferred.log_summary)


def toolbox_promote(
    name: Name,
    version: Annotated[
        str, typer.Argument(help="Its number or the first digits of its hash; lab toolbox show has both.")
    ],
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Put a kept version of a policy in use."""
    box = deferred.Toolbox(toolbox)
    _show_in_use(box, name, box.promote(name, version), as_json)


def toolbox_rollback(name: Name, toolbox: ToolboxPlace = None, as_json: Json = False) -> None:
    """Put the version of a policy in use that was in use before; again for the one before that."""
    box = deferred.Toolbox(toolbox)
    _show_in_use(box, name, box.rollback(name), as_json)


def _show_in_use(box: "deferred.Toolbox", name: str, version: "deferred.Version", as_json: bool) -> None:
    file = box.place.where(box.versions(name).in_use_file)
    document = {"name": name, "version": version.number, "hash": version.hash, "file": file}
    show(document, as_json, lambda d: f"'{name}': version {d['version']} ({d['hash']}) is in use")


def toolbox_verify(
    repair: Annotated[
        bool, typer.Option("--repair", help="Remove what commands that were killed have left: half-written files.")
    ] = False,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Check every file: whole, finite, of the right shape; versions by their hash. Exit 1 when one is not."""
    box = deferred.Toolbox(toolbox)
    removed = {"removed": box.repair()} if repair else {}
    rows: list[dict[str, Any]] = [
        {"file": box.where(path), "ok": ok, "reason": reason} for path, ok, reason in box.verify()
    ]
    damaged = [row for row in rows if not row["ok"]]
    document = {"folder": box.address, "files": rows, "damaged": len(damaged)} | removed
    show(document, as_json, deferred.verify_summary)
    if damaged:
        are = "is" if len(rows) == 1 else "are"
        end(f"{len(damaged)} of {counted(len(rows), 'file')} in the toolbox {are} damaged", 1)


def toolbox_remove(name: Name, toolbox: ToolboxPlace = None, as_json: Json = False) -> None:
    """Remove one policy; lab toolbox restore brings it back."""
    box = deferred.Toolbox(toolbox)
    document = {"removed": box.where(box.remove(name))}
    show(document, as_json, lambda d: f"removed {d['removed']} (lab toolbox restore brings it back)")


def toolbox_restore(name: Name, toolbox: ToolboxPlace = None, as_json: Json = False) -> None:
    """Bring back the policy that was removed last under this name."""
    box = deferred.Toolbox(toolbox)
    show({"restored": box.where(box.restore(name))}, as_json, lambda d: f"restored {d['restored']}")
