"""`lab toolbox card, export, import, publish`: policies shown and given to others, and taken from them."""

from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.options import Json, ToolboxPlace
from lab.cli.output import complain, show
from lab.errors import BadInput, counted

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
        str, typer.Option("--license", help="Under which others may use it, as the Hub names it, such as mit.")
    ] = "unknown",
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """A folder as the Hugging Face Hub has it: model card, safetensors, metadata, pictures. Nothing is sent anywhere."""
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
    """Policies as one archive; the same policies give the same bytes."""
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
    replace: Annotated[
        bool, typer.Option("--replace", help="Also where another policy of that name is there already.")
    ] = False,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Bring in policies that somebody gave you: every one is checked before the first is kept, and all are kept or none."""
    box = deferred.Toolbox(toolbox)
    policies = [deferred.read_folder(file)] if file.is_dir() else deferred.unpack(file)
    taken = deferred.take_in(box, policies, replace)
    document = {"file": str(file), "toolbox": box.address, **taken._asdict()}

    def told(d: dict[str, Any]) -> str:
        words = {"imported": "imported", "replaced": "in place of another", "unchanged": "there already"}
        return "\n".join(f"{words[kind]}: {name}" for kind in words for name in d[kind])

    show(document, as_json, told)


def _told(box: "deferred.Toolbox", name: str) -> "tuple[deferred.Policy, list[dict[str, Any]]]":
    """A policy and its log."""
    shown = box.show(name)
    return box.load(shown["file"]), shown["events"]
