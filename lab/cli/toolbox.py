"""`lab toolbox`: the policies that were learned."""

from lab.cli.options import Json, ToolboxFolder
from lab.cli.output import end, show
from lab.errors import counted


def toolbox_list(toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """The policies in the toolbox."""
    from lab.toolbox.registry import Toolbox
    from lab.view.summary import toolbox_summary

    box = Toolbox(toolbox)
    show({"folder": str(box.folder), "policies": box.list()}, as_json, toolbox_summary)


def toolbox_show(name: str, toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """All that is known of one policy."""
    from lab.toolbox.registry import Toolbox
    from lab.view.summary import policy_summary

    show(Toolbox(toolbox).show(name), as_json, policy_summary)


def toolbox_verify(toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """Check every file: whole, finite, of the right shape. Exit 1 when one is not."""
    from lab.toolbox.registry import Toolbox
    from lab.view.summary import verify_summary

    box = Toolbox(toolbox)
    rows = [{"file": str(path), "ok": ok, "reason": reason} for path, ok, reason in box.verify()]
    damaged = [row for row in rows if not row["ok"]]
    document = {"folder": str(box.folder), "files": rows, "damaged": len(damaged)}
    show(document, as_json, verify_summary)
    if damaged:
        are = "is" if len(rows) == 1 else "are"
        end(f"{len(damaged)} of {counted(len(rows), 'file')} in the toolbox {are} damaged", 1)


def toolbox_remove(name: str, toolbox: ToolboxFolder = None, as_json: Json = False) -> None:
    """Delete one policy."""
    from lab.toolbox.registry import Toolbox

    show({"removed": str(Toolbox(toolbox).remove(name))}, as_json, lambda d: f"removed {d['removed']}")
