"""The options of a run: the task that they load, and what a journal keeps of them."""

import json
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.production.run_options import RunOptions, begun, gone_on
from lab.tasks.task_file import load


def test_the_method_is_the_tasks_unless_another_one_is_given() -> None:
    toast = load("toast")
    assert RunOptions("toast").by_method(toast) is toast
    changed = RunOptions("toast", method="fifo").by_method(toast)
    assert changed.sequencing == toast.sequencing.model_copy(update={"method": "fifo"})


def test_an_unknown_method_is_refused_at_once() -> None:
    with pytest.raises(BadInput, match=r"unknown method 'exakt' \(--method\): did you mean 'exact'\?"):
        RunOptions("toast", method="exakt").by_method(load("toast"))


def test_a_run_goes_on_with_its_method(tmp_path: Path) -> None:
    options = RunOptions("toast", method="fifo")
    begun(options, load("toast"), tmp_path).close()
    assert gone_on(RunOptions(""), tmp_path, None) == (options, load("toast"))
    assert gone_on(RunOptions("", method="fifo"), tmp_path, None)[0].method == "fifo"  # the same, said again
    with pytest.raises(BadInput, match="--method"):
        gone_on(RunOptions("", method="exact"), tmp_path, None)


def test_a_journal_from_before_there_were_methods(tmp_path: Path) -> None:
    begun(RunOptions("toast"), load("toast"), tmp_path).close()
    journal = next(path for path in tmp_path.iterdir() if '"method"' in path.read_text(encoding="utf-8"))
    first, *rest = journal.read_text(encoding="utf-8").splitlines()
    head = json.loads(first)
    del head["words"]["method"]
    journal.write_text("\n".join([json.dumps(head), *rest]) + "\n", encoding="utf-8")
    assert gone_on(RunOptions(""), tmp_path, None)[0].method is None


def test_a_method_of_ones_own_has_to_be_named_again(tmp_path: Path) -> None:
    begun(RunOptions("toast", method="mine.first"), load("toast"), tmp_path).close()
    with pytest.raises(
        BadInput, match=r"'mine.first', which is not the lab's: name its code again, --method FILE.py:NAME"
    ):
        gone_on(RunOptions(""), tmp_path, None)
