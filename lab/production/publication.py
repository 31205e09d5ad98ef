"""Publication of a policy: its card with pictures in a folder, or a whole folder for the Hugging Face Hub."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from lab.errors import WorkFailed
from lab.files import check_out, draft
from lab.operating_system import replace
from lab.skills import SKILLS
from lab.toolbox.card import Event, Telling, card
from lab.toolbox.hub_folder import MODEL, README, check_license, header, hub_files, sha256
from lab.toolbox.names import SUFFIX, slug
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import encode
from lab.view.plots import learning_curves
from lab.view.value_levels import can_be_drawn, value_levels

CARD = "card.md"
PICTURES = {"learning curve": "learning-curve.png", "value map": "value-map.png"}
Files = dict[str, str]  # the written files, by kind


def write_card(policy: Policy, events: Sequence[Event], out: Path) -> Files:
    """Writes the policy's file and its card with pictures to `out`, and returns the files. Raises BadInput and WorkFailed."""
    file, content = f"{slug(policy.name)}{SUFFIX}", encode(policy)
    bring_in = f"lab toolbox export {shlex.quote(policy.name)} --out skill.zip\nlab toolbox import skill.zip"
    telling = Telling(_what(policy), sha256(content), file, bring_in, _pictures(policy), events)
    return _write(policy, {CARD: card(policy, telling).encode(), file: content}, out)


def publish(policy: Policy, events: Sequence[Event], license_name: str, out: Path) -> Files:
    """Writes a folder that can be pushed to the Hub and imported again, and returns its files. Raises BadInput and WorkFailed."""
    check_license(license_name)
    files = hub_files(policy)
    bring_in = "lab toolbox import ."
    telling = Telling(_what(policy), sha256(files[MODEL]), MODEL, bring_in, _pictures(policy), events)
    text = header(policy, license_name, events) + "\n" + card(policy, telling)
    return _write(policy, {README: text.encode(), **files}, out)


def _what(policy: Policy) -> str:
    """The purpose of the policy, in words."""
    skill = SKILLS.get(policy.subtask)
    return f"a path to the goal in '{policy.task}'" if skill is None else skill.help


def _pictures(policy: Policy) -> Files:
    """The possible pictures of a policy."""

    there = {"learning curve": bool(policy.curve), "value map": can_be_drawn(policy)}
    return {name: file for name, file in PICTURES.items() if there[name]}


def _write(policy: Policy, contents: dict[str, bytes], out: Path) -> Files:
    """Writes files and pictures to `out`, after all are drawn, and removes pictures of another policy; returns the files."""

    check_out(out)
    pictures = _pictures(policy)
    try:
        out.mkdir(parents=True, exist_ok=True)
        with draft(out) as beside:
            for name, content in contents.items():
                (beside / name).write_bytes(content)
            if "learning curve" in pictures:
                learning_curves({policy.name: policy}, beside / pictures["learning curve"])
            if "value map" in pictures:
                value_levels(policy, beside / pictures["value map"])
            for name in (*contents, *pictures.values()):
                replace(beside / name, out / name)
        for file in set(PICTURES.values()) - set(pictures.values()):
            (out / file).unlink(missing_ok=True)
    except OSError as error:
        raise WorkFailed(f"output folder '{out}' (--out) cannot be written: {error.strerror or error}") from error
    return {name: str(out / name) for name in (*contents, *pictures.values())}
