"""Advice on the order of the transfers, kept: gone on with, taken back, shown and said again."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lab.advice.entries import FILE
from lab.files import tasks_folder

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
WORDS = "toast --case I --toasts 3 --method srl --advisor terminal --gate always --episodes 3"
ANSWERS = ["2", "1", "3", "", "1", "2", "skip", "2", "", "1", "", "2"]  # some are no move there: those are asked again


def said(*answers: str) -> str:
    return "".join(f"{answer}\n" for answer in answers)


def advised(lab: Lab, *answers: str, words: str = WORDS) -> Any:
    return lab("sequence", *words.split(), "--json", stdin=said(*answers))


def journal_of(folder: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (Path(folder) / FILE).read_text(encoding="utf-8").splitlines()]


def what_came_of_it(ran: Any) -> dict[str, Any]:
    return {name: value for name, value in ran.json.items() if name != "session"}


@pytest.mark.parametrize("cut", [1, 4, 9])
def test_a_session_that_was_stopped_goes_on_bit_for_bit(lab: Lab, cut: int) -> None:
    """Answered at one go, and stopped after so many answers: the same document and the same journal."""
    whole = advised(lab, *ANSWERS)
    assert whole.code == 0, whole.err
    stopped = advised(lab, *ANSWERS[:cut], "quit")
    folder = stopped.err.rsplit("lab sequence --resume ", 1)[1].split()[0]
    assert stopped.code == 130
    resumed = lab("sequence", "--resume", folder, "--json", stdin=said(*ANSWERS[cut:]))
    assert resumed.code == 0, resumed.err
    assert what_came_of_it(resumed) == what_came_of_it(whole)
    assert journal_of(folder) == journal_of(whole.json["session"])
    assert lab("sequence", "--resume", folder).code == 2, "it is over"


def test_a_line_that_was_cut_off_is_said(lab: Lab) -> None:
    """As of a lesson: when it is gone on with, and when it is shown."""
    folder = advised(lab, "2", "1", "quit").err.rsplit("--resume ", 1)[1].split()[0]
    with (Path(folder) / FILE).open("a", encoding="utf-8") as journal:
        journal.write('{"kind": "answ')
    for words in (("replay", folder, "--json"), ("sequence", "--resume", folder, "--json")):
        ran = lab(*words, stdin=said("auto"))
        assert (ran.code, "its last line was cut off and is left out: '{" in ran.err) == (0, True), ran.err


def test_an_answer_is_taken_back(lab: Lab) -> None:
    ran, straight = advised(lab, "2", "1", "undo", "3", "auto"), advised(lab, "2", "3", "auto")
    assert ran.code == 0, ran.err
    assert "Your last answer is taken back." in ran.err
    assert what_came_of_it(ran) == what_came_of_it(straight)
    assert [entry["kind"] for entry in journal_of(ran.json["session"])].count("undo") == 1


def test_it_is_listed_and_shown_again(lab: Lab) -> None:
    kept = advised(lab, "2", "1", "auto").json
    row = lab("replay", "--json").json["sessions"][0]  # changed last
    assert (row["session"], row["problem"], row["advisor"]) == (kept["session"], "order of toast", "terminal")
    shown = lab("replay", kept["session"], "--json")
    assert shown.code == 0, shown.err
    assert shown.json["events"] == journal_of(kept["session"])[1:]
    assert shown.json["receipt"] == kept["receipt"]
    assert shown.json["closed"]["final_steps"] == kept["cost"]
    read = lab("replay", kept["session"], "--pause", "0")
    assert "Answer: move 2" in read.err
    assert "advice: it asked in" in read.out


def test_a_replay_of_a_session_that_is_not_over_ends_with_its_journal(lab: Lab) -> None:
    folder = advised(lab, "2", "1", "quit").err.rsplit("--resume ", 1)[1].split()[0]
    shown = lab("replay", folder, "--pause", "0")
    assert shown.code == 0, shown.err
    assert "it is not over: lab sequence --resume goes on with it" in shown.out


def test_what_was_said_advises_again_on_the_same_order_only(lab: Lab) -> None:
    kept = advised(lab, "3", "1", "auto").json
    again = f"toast --case I --toasts 3 --method srl --gate always --episodes 1 --advisor recorded:{kept['session']}"
    assert advised(lab, words=again).json["sequence"][:1] == [3]
    other = lab("sequence", *again.replace("--toasts 3", "--toasts 2").split())
    assert (other.code, "it is advice about another order, 'order of toast'" in other.err) == (2, True)
    taught = lab("teach", "insert", "--advisor", f"recorded:{kept['session']}")
    assert (taught.code, "it is advice about another problem" in taught.err) == (2, True)


def test_what_cannot_be_gone_on_with(lab: Lab, tmp_path: Path) -> None:
    stopped = advised(lab, "2", "quit")
    folder = stopped.err.rsplit("--resume ", 1)[1].split()[0]
    for words, message in (
        ("sequence", "nothing to sequence (TASK)"),
        (f"sequence --resume {folder} --seed 3", "--seed: --resume takes its options"),
        (f"sequence toast --resume {folder}", "TASK: --resume takes its options"),
        (f"teach --resume {folder}", "it is advice on an order"),
        (f"sequence --resume {tmp_path / 'nowhere'}", "cannot be read"),
    ):
        ran = lab(*words.split())
        assert (ran.code, message in ran.err) == (2, True), ran.err


def test_simulated_advisors_keep_no_journal(lab: Lab) -> None:
    before = lab("replay", "--json").json["sessions"]
    ran = advised(lab, words=WORDS.replace("terminal", "expert"))
    assert "session" not in ran.json
    assert lab("replay", "--json").json["sessions"] == before


def test_stopped_in_its_first_episode_it_has_an_order_and_goes_on_too(lab: Lab) -> None:
    stopped = advised(lab, "2", "quit")
    assert stopped.code == 130
    assert "the best order until then is above; go on with: lab sequence --resume " in stopped.err


def test_it_is_shown_again_without_its_file(lab: Lab, tmp_path: Path) -> None:
    cell = tmp_path / "mine.toml"
    cell.write_text((tasks_folder() / "toast-case-1.toml").read_text(encoding="utf-8"), encoding="utf-8")
    words = f"{cell} --toasts 2 --method srl --advisor terminal --gate always --episodes 2"
    folder = advised(lab, "1", "2", "auto", words=words).json["session"]
    before = lab("replay", folder, "--json")
    cell.unlink()
    after = lab("replay", folder, "--json")
    assert (after.code, after.json) == (0, before.json), after.err
    assert f"'{cell}' is not here: the session's own copy is used" in after.err
