"""The results of `lab toolbox` as text: tables and lines from its JSON documents."""

from collections.abc import Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from lab.errors import counted, printable
from lab.view.progress import sparkline
from lab.view.summary import table_of

_SHOWN_VERSIONS = 10
_SHOWN_EVENTS = 10


def toolbox_summary(box: Mapping[str, Any]) -> RenderableType:
    """The text of `lab toolbox list`, from its JSON document."""
    if not box["policies"]:
        return Text(f"nothing in {box['folder']}")
    columns = ("name", "subtask", "task", "solved", "version", "signature", "created")
    rows = [
        {
            **row,
            "created": _minute(row["created"]),
            "solved": "yes" if row["solved"] else "no",
            "version": row["version"] or "?",
        }
        for row in box["policies"]
    ]
    return table_of(rows, columns, whole="name")


def policy_summary(policy: Mapping[str, Any]) -> RenderableType:
    """The text of `lab toolbox show`, from its JSON document."""
    curve = policy["curve"] or [0]
    guided = [str(n) for n, was_guided in enumerate(policy["guided"], start=1) if was_guided]
    apart = ("lineage", "kept_versions", "kept_bytes", "events")
    shown = {
        **{name: value for name, value in policy.items() if name not in apart},
        "curve": f"{sparkline(curve, 40)}  {min(curve)} to {max(curve)} steps",
        "guided": counted(len(guided), "episode")
        + (f", the first {guided[0]}, the last {guided[-1]}" if guided else ""),
        "created": policy["created"].replace("T", " "),
        "solved": "yes" if policy["solved"] else "no",
        **{name: ", ".join(f"{k} {v}" for k, v in policy[name].items()) for name in ("learner", "gate", "versions")},
        **{name: ", ".join(map(str, policy[name])) for name in ("action_labels", "shape")},
    }
    fields = [{"field": name.replace("_", " "), "value": value} for name, value in shown.items()]
    return Group(table_of(fields, ("field", "value")), *map(Text, _lineage(policy)), *map(Text, _kept(policy)))


def _lineage(policy: Mapping[str, Any]) -> list[str]:
    """The policy's ancestors, one per line, the nearest first."""
    lines = []
    for ancestor in policy["lineage"]:
        where = f", learned in {ancestor['scene']}" if ancestor["scene"] else ""
        known = where if ancestor["kept"] else ", not kept here"
        lines.append(printable(f"warm-started from {ancestor['name']}@{ancestor['hash']}{known}"))
    return ["", *lines] if lines else []


def _kept(policy: Mapping[str, Any]) -> list[str]:
    """The lines on kept versions and on the latest events."""
    versions, events = policy["kept_versions"], policy["events"]
    lines = [f"{counted(len(versions), 'version')} kept, {policy['kept_bytes'] / 1e6:.2f} MB"] if versions else []
    for row in versions[-_SHOWN_VERSIONS:]:
        saved, mark = _minute(row["saved"] or ""), "  in use" if row["in_use"] else ""
        lines.append(f"  {row['version']:>3}  {row['hash']}  {saved}{mark}")
    lines += [f"  {_happened(event)}" for event in events[-_SHOWN_EVENTS:]]
    return ["", *lines] if lines else []


def log_summary(log: Mapping[str, Any]) -> RenderableType:
    """The text of `lab toolbox log`, from its JSON document: a line for each event."""
    return (
        Group(*(Text(_happened(event)) for event in log["events"])) if log["events"] else Text("nothing happened yet")
    )


def _happened(event: Mapping[str, Any]) -> str:
    named = f" version {event['version']} ({event.get('hash')})" if event.get("version") else ""
    left_out = ("time", "what", "version", "hash", "in_use", "why_not")
    words = {True: "yes", False: "no", None: "none"}
    facts = [
        f"{name.replace('_', ' ')} {words[value] if isinstance(value, bool | None) else value}"
        for name, value in event.items()
        if name not in left_out
    ]
    why_not = [f"kept beside: {event['why_not']}"] if event.get("why_not") else []
    more = ": " if facts or why_not else ""
    return printable(f"{_minute(event['time'])}  {event['what']}{named}{more}{', '.join(why_not + facts)}")


def _minute(time: str) -> str:
    return time[:16].replace("T", " ")


def verify_summary(report: Mapping[str, Any]) -> RenderableType:
    """The text of `lab toolbox verify`, from its JSON document: the damaged files, and the number of sound ones."""
    files, damaged = report["files"], [row for row in report["files"] if not row["ok"]]
    left = [Text(f"removed {name}, which was left half written") for name in report.get("removed", ())]
    if not files:
        return Group(*left, Text(f"nothing in {report['folder']}"))
    are = "is" if len(files) == 1 else "are"
    lines = [Text(f"{len(files) - len(damaged)} of {counted(len(files), 'file')} in {report['folder']} {are} sound")]
    return Group(*left, *lines, *(Text(row["reason"], "red") for row in damaged))
