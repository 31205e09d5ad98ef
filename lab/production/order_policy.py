"""Policies of sequencing by name or file: `--keep-policy` keeps them; `--method policy:NAME` and `--policy` use them."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from lab.errors import BadInput, counted, unknown
from lab.sequencing.cell.cell import Cell
from lab.sequencing.methods.carried_over_policy import CarriedPolicy
from lab.sequencing.search import Search, SequenceResult
from lab.tasks.instances import InstanceRequest
from lab.tasks.sequencing import policy_of, policy_record, read_policy, write_policy
from lab.tasks.task_file import load_cell_beside
from lab.toolbox.policy import MAX_NAME_LENGTH, is_name
from lab.toolbox.registry import Toolbox

RECORDS = "order-policies"  # their kind in the toolbox
PREFIX = "policy:"  # of a method that is a policy
SUFFIX = ".json"
LEARNS, DECIDES = "srl-linear", "carried"  # the method that learns a policy, and the one that decides by one


def policy_named(word: str, toolbox: Toolbox, where: str) -> CarriedPolicy:
    """The policy in a file (any file that exists, or a name that ends with .json), or else the toolbox's of that name.

    where: the option that names it. Raises BadInput, in one line, for an unknown name, and for what is no policy.
    """
    if is_policy_file(word) or Path(word).is_file():
        return read_policy(Path(word), where)
    record = toolbox.load_record(RECORDS, word)
    if record is None:
        place = f"toolbox {toolbox.address}"
        if known := toolbox.record_keys(RECORDS):
            raise unknown("policy", word, known, f"{where}, {place}")
        raise BadInput(
            f"unknown policy '{word}' ({where}): {place} has no policy of sequencing: --keep-policy keeps one"
        )
    return policy_of(json.dumps(record), f"policy '{word}' ({where})")


def is_policy_file(word: str) -> bool:
    """Whether a word is the path of a policy's file and no name."""
    return word.lower().endswith(SUFFIX)


def check_keeping(word: str, toolbox: Toolbox) -> None:
    """Raises BadInput unless a policy can be kept under a name in the toolbox, or in a .json file."""
    if not is_policy_file(word):
        if not is_name(word):
            raise BadInput(
                f"policy name {word!r} (--keep-policy): allowed are 1 to {MAX_NAME_LENGTH} printable characters"
            )
        toolbox.check()
    elif not Path(word).parent.is_dir():
        raise BadInput(f"policy file '{word}' (--keep-policy): there is no folder '{Path(word).parent}'")


def kept_policy(word: str, policy: CarriedPolicy, toolbox: Toolbox) -> Path:
    """The file of a policy that is kept now under a name in the toolbox, or in a .json file; it replaces an earlier one."""
    if not is_policy_file(word):
        return toolbox.save_record(RECORDS, word, policy_record(policy))
    write_policy(Path(word), policy)
    return Path(word)


def practice_cells(words: str | None) -> tuple[Cell, ...]:
    """The cells of the comma-separated names or files of --practice, each with its file's own order; none for None.

    Raises BadInput for what is no cell.
    """
    names = [] if words is None else words.split(",")
    try:
        return tuple(load_cell_beside(name.strip(), InstanceRequest()).cell() for name in names)
    except BadInput as error:
        raise BadInput(f"--practice {words}: {error}") from None


def learned_policy(cell: Cell, search: Search, found: Sequence[SequenceResult], seed: int) -> CarriedPolicy | None:
    """The policy of the session that found the cheapest order, with the work that it was learned on; None without any."""
    learned = [result for result in found if isinstance(getattr(result, "policy", None), CarriedPolicy)]
    if not learned:
        return None
    best: Any = min(learned, key=lambda result: result.cost)
    kinds = " and ".join(dict.fromkeys(cell.order))
    more = f" and {counted(len(search.practice), 'practice cell')}" if search.practice else ""
    said = (
        f"{counted(cell.parts, 'part')} ({kinds}){more}; --method {LEARNS} --episodes {search.episodes} --seed {seed}"
    )
    policy: CarriedPolicy = best.policy
    return replace(policy, learned_on=said)
