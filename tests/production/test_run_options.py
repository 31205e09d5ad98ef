"""The options of a run: the task that they load, and what a journal keeps of them."""

import json
from pathlib import Path
from typing import Any

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


def test_a_language_model_has_to_be_named_again(tmp_path: Path) -> None:
    """No file decides where questions are sent."""
    model = "llm:http://127.0.0.1:8080/v1#m"
    begun(RunOptions("toast", advisors=(model, "expert")), load("toast"), tmp_path).close()
    for advisors in ((), (model,), ("expert", model), ("llm:http://127.0.0.1:9/v1#m", "expert")):
        with pytest.raises(BadInput, match=f"named again, .*: add --advisor '{model}' --advisor expert$"):
            gone_on(RunOptions("", advisors=advisors), tmp_path, None)
    assert gone_on(RunOptions("", advisors=(model, "expert")), tmp_path, None)[0].advisors == (model, "expert")


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
    with pytest.raises(BadInput, match=r"'mine\.first'.* --method FILE\.py:NAME"):
        gone_on(RunOptions(""), tmp_path, None)


@pytest.mark.parametrize(
    ("task", "words", "told"),
    [
        ("toast", {"order": "1,2,7"}, "move 3 '7': there is no part 7, only 1 to 3"),
        ("toast", {"order": "1,1"}, "slice 1 is still at 'butter_applier'"),
        ("toast", {"order": ""}, "no moves"),
        ("kit", {"order": "4 1"}, "move 1 '4': lid 4 at 'magazine' may not come to 'tray'"),
        ("kit", {"cyclic": True}, "--cyclic: the cell has precedences"),
        ("toast", {"cyclic": True, "order": "1,1,1"}, "an order is one or the other"),
    ],
)
def test_an_order_that_cannot_be_is_refused_before_anything_is_surveyed_or_learned(
    task: str, words: dict[str, Any], told: str
) -> None:
    with pytest.raises(BadInput) as caught:
        RunOptions(task, **words).ordered(load(task))
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_order_that_can_be_passes_whatever_the_windows_say() -> None:
    """In `toast-window` toast burns: whether an order is in time is not known before its moves are timed."""
    kept_long = RunOptions("toast-window", parts="slice=2", order="1,2,1,2,1,2,2")
    assert kept_long.ordered(load("toast-window")) == ("slice", "slice")
    assert RunOptions("toast", cyclic=True).ordered(load("toast")) == ("slice", "slice", "slice")
