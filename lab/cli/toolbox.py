"""`lab toolbox`: list, evaluate, exchange and remove the policies that were learned."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import offers
from lab.cli.options import Json, Seed, ToolboxPlace
from lab.cli.output import complain, console, end, show
from lab.errors import BadInput, counted, unknown
from lab.lazy import rich

OutFolder = Annotated[Path, typer.Option("--out", help="The folder for its files.")]


def toolbox_card(name: str, out: OutFolder, toolbox: ToolboxPlace = None, as_json: Json = False) -> None:
    """A policy's card: what it does, where and with whose advice it was learned, its curve and its values as pictures."""
    policy, events = _told(deferred.Toolbox(toolbox), name)
    files = deferred.write_card(policy, events, out)
    show(
        {"policy": policy.name, "folder": str(out), "files": files},
        as_json,
        lambda d: f"the card: {d['files'][deferred.CARD]}",
    )


def toolbox_publish(
    name: str,
    out: OutFolder,
    license_name: Annotated[
        str, typer.Option("--license", help="The licence for others, by its name on the Hub, such as mit.")
    ] = "unknown",
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Write a folder for the Hugging Face Hub: model card, safetensors, metadata, pictures. Nothing is uploaded."""
    policy, events = _told(deferred.Toolbox(toolbox), name)
    files = deferred.publish(policy, events, license_name, out)
    document = {"policy": policy.name, "folder": str(out), "license": license_name, "files": files}
    push = f"hf upload YOUR-NAME/REPOSITORY {out} pushes it to the Hub"
    show(document, as_json, lambda d: f"{counted(len(files), 'file')} in {d['folder']}; {push}")


def toolbox_export(
    out: Annotated[Path, typer.Option("--out", help="The .zip file to write.")],
    names: Annotated[list[str] | None, typer.Argument(help="Which policies; none: all of them.")] = None,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Write policies to one archive; the same policies give the same bytes."""
    box = deferred.Toolbox(toolbox)
    wanted = list(dict.fromkeys(names or [row["name"] for row in box.list()]))
    if not wanted:
        raise BadInput(f"toolbox {box.address}: there is nothing to export")
    content, manifest = deferred.pack(_told(box, name)[0] for name in wanted)
    damaged = [] if names else box.index()[1]
    try:
        deferred.write_whole(out, content)
    except OSError as error:
        raise BadInput(f"archive '{out}' (--out) cannot be written: {error.strerror or error}") from error
    for reason in damaged:
        complain(f"left out: {reason}")
    document = {"file": str(out), "bytes": len(content), "damaged": damaged}
    document |= {"policies": [row.model_dump() for row in manifest.files]}
    exported = counted(len(manifest.files), "policy").replace("policys", "policies")
    show(document, as_json, lambda d: f"{d['file']}: {exported}, {d['bytes']} bytes")


def toolbox_import(
    file: Annotated[Path, typer.Argument(help="An archive of lab toolbox export, or a folder of lab toolbox publish.")],
    replace: Annotated[bool, typer.Option("--replace", help="Replace other policies of the same names.")] = False,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Import policies from others: every policy is checked before the first is kept, and either all are kept or none."""
    box = deferred.Toolbox(toolbox)
    policies = [deferred.read_folder(file)] if file.is_dir() else deferred.unpack(file)
    taken = deferred.take_in(box, policies, replace)
    document = {"file": str(file), "toolbox": box.address, **taken._asdict()}

    def told(d: dict[str, Any]) -> str:
        words = {"imported": "imported", "replaced": "in place of another", "unchanged": "there already"}
        return "\n".join(f"{words[kind]}: {name}" for kind in words for name in d[kind])

    show(document, as_json, told)


def _told(box: "deferred.Toolbox", name: str) -> "tuple[deferred.Policy, list[dict[str, Any]]]":
    """The policy and its log."""
    shown = box.show(name)
    return box.load(shown["file"]), shown["events"]


# ---- evaluate -----------------------------------------------------------------------------------------------------------


def toolbox_evaluate(
    name: str,
    scenes: Annotated[int, typer.Option("--scenes", min=1, help="How many scenes are drawn.")] = 20,
    task: Annotated[
        str | None,
        typer.Option("--task", help="The task whose scenes are drawn; default: the task in which it was learned."),
    ] = None,
    skill: Annotated[
        str | None, typer.Option("--skill", help="The policy's skill, if its name does not show it.")
    ] = None,
    seed: Seed = 0,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Measure a policy's success rate in physics, in scenes drawn from the seed, and record it in the policy's log."""
    box = deferred.Toolbox(toolbox)
    policy = box.load(box.show(name)["file"])
    in_task = deferred.task_of(policy, task)
    wanted = deferred.skill_of(policy, in_task, skill)
    with deferred.counting(console(), "scenes") as told:
        evaluation = deferred.evaluate(policy, in_task, wanted, scenes, seed, told)
    document = evaluation.to_json()
    if document["scenes"]:
        box.note(policy.name, deferred.EVALUATED, **evaluation.facts())
    show(document, as_json, evaluation_summary)
    if evaluation.interrupted:
        end(f"stopped by Ctrl-C after {counted(len(evaluation.scenes), 'scene')} of {scenes}", 130)
    if not document["scenes"]:
        end(f"in none of {counted(scenes, 'drawn scene')} can '{wanted}' reach its goal", 1)


def evaluation_summary(document: Mapping[str, Any]) -> "rich.console.RenderableType":
    """The text of `lab toolbox evaluate`, from its JSON document: the success rate, and a line for each failed scene."""
    scenes = f"{counted(document['scenes'], 'drawn scene')} of {document['task']} from seed {document['seed']}"
    lines = [f"'{document['policy']}' as '{document['skill']}': {document['successes']} of {scenes} succeeded"]
    if document["success_percent"] is not None:
        low, high = document["ci95"]
        lines.append(f"success {document['success_percent']:.1f} % (95 % interval {low:.1f} to {high:.1f})")
    if document["mean_sim_s"] is not None:
        lines.append(f"a success takes {document['mean_sim_s']:.1f} s on average")
    if document["unsolvable"]:
        lines.append(f"not counted: {counted(document['unsolvable'], 'scene')} in which nobody could reach the goal")
    failed = [row for row in document["rows"] if not row["success"]]
    return rich.console.Group(
        *map(rich.text.Text, lines), *(rich.text.Text(f"seed {row['seed']}: {row['reason']}", "red") for row in failed)
    )


# ---- list, show, versions, verify, remove -------------------------------------------------------------------------------


Name = Annotated[str, typer.Argument(help="A policy's name; lab toolbox list shows them.")]


def toolbox_list(
    subtask: Annotated[
        str | None, typer.Option("--subtask", help="Only policies of this sub-task.", autocompletion=offers("skills"))
    ] = None,
    task: Annotated[str | None, typer.Option("--task", help="Only policies learned for this task.")] = None,
    advisor: Annotated[
        str | None, typer.Option("--advisor", help="Only policies that this advisor helped to learn.")
    ] = None,
    solved: Annotated[
        bool | None, typer.Option("--solved/--unsolved", help="Only policies that are solved, or that are not.")
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
    """Raise BadInput for a filter's word that neither the toolbox nor the lab knows."""
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
    """One policy: its origin, its versions and its history."""
    show(deferred.Toolbox(toolbox).show(name), as_json, deferred.policy_summary)


def toolbox_log(name: Name, toolbox: ToolboxPlace = None, as_json: Json = False) -> None:
    """The history of the policies of a name: learned, put in use, evaluated, removed."""
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
    """Put the previously used version of a policy back in use; repeat for the one before that."""
    box = deferred.Toolbox(toolbox)
    _show_in_use(box, name, box.rollback(name), as_json)


def _show_in_use(box: "deferred.Toolbox", name: str, version: "deferred.Version", as_json: bool) -> None:
    file = box.place.where(box.versions(name).in_use_file)
    document = {"name": name, "version": version.number, "hash": version.hash, "file": file}
    show(document, as_json, lambda d: f"'{name}': version {d['version']} ({d['hash']}) is in use")


def toolbox_verify(
    repair: Annotated[
        bool, typer.Option("--repair", help="Remove half-written files that killed commands have left.")
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
    """Restore the policy that was removed last under this name."""
    box = deferred.Toolbox(toolbox)
    show({"restored": box.where(box.restore(name))}, as_json, lambda d: f"restored {d['restored']}")
