"""`lab teach`: sessions are kept, gone on with, and refused in words."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Tree = Callable[[Path], list[str]]


def test_a_session_goes_on_from_another_folder(lab: Lab, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    whole = lab("teach", "w.txt", "--advisor", "expert", "--gate", "always", "--out", "lesson", "--json").json
    journal = folder / "lesson" / "events.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:7]) + lines[7][:11])
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    ran = lab("teach", "--resume", "../lesson", "--json")
    assert ran.code == 0
    assert "its last line was cut off and is left out" in ran.err
    kept = ("steps_per_episode", "helped_steps", "solved", "saved_as")
    assert [ran.json[name] for name in kept] == [whole[name] for name in kept]
    assert journal.read_bytes() == b"".join(lines)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("teach", "nothing to learn (SUBTASK): name a sub-task, a world or gym:ID, or go on with --resume DIR"),
        ("teach --resume nowhere", "journal 'nowhere' (--resume): cannot be read: No such file or directory"),
        ("replay nowhere", "journal 'nowhere' (DIR): cannot be read: No such file or directory"),
        (
            "teach world-1 --resume lesson",
            "SUBTASK: --resume takes its options from the session in lesson",
        ),
        ("teach world-1 --advisor recorded:lesson", "it is advice about another problem, 'w'"),
        ("teach world-1 --ask all", "unknown order of asking 'all' (--ask): known: in-turn, together"),
        ("teach world-1 --decide majorit", "unknown rule of deciding 'majorit' (--decide): did you mean 'majority'?"),
        ("teach --resume lesson --ask in-turn", "--ask: --resume takes its options from the session in lesson"),
        (
            "teach --resume lesson --out other",
            "--out other beside --resume lesson: a session goes on in its own folder",
        ),
        ("teach world-1 --advisor none --advisor expert", "advisor 'none' (--advisor) beside 1 more"),
        ("teach world-1 --advisor web --advisor web", "advisor 'web' (--advisor) is named 2 times: once is enough"),
        ("teach world-1 --peers 4 --advisor terminal", "--advisor beside peers: they are advised by each other alone"),
        ("teach world-1 --peers 4 --resume lesson", "--resume beside peers"),
        ("teach world-1 --peers 17", "invalid value for '--peers': '17'"),
        ("teach world-1 --peer-task toast", "task 'toast' (--peer-task): 'world-1' is no sub-task of a task"),
        ("teach insert --peer-task toast-panda --advisor expert", "--advisor beside peers"),
        ("teach world-1 --wait 0", "invalid value for '--wait': '0'"),
        ("teach gym:FrozenLak-v1", "FrozenLake-v1"),
        ("teach gym:Pendulum-v1", "its action space is Box"),
        ("teach gym:Pendulum-v1", "supported are Discrete, MultiDiscrete, MultiBinary"),
        (
            "teach gym:FrozenLake-v1 --task toast",
            "--task toast: a Gymnasium environment, 'gym:FrozenLake-v1', has none",
        ),
    ],
)
def test_bad_words_about_sessions(lab: Lab, folder: Path, words: str, reason: str, tree: Tree) -> None:
    (folder / "w.txt").write_text("S.G\n")
    lab("teach", "w.txt", "--out", "lesson", "--episodes", "2", "--gate", "always")
    before = tree(folder)
    ran = lab(*words.split())
    assert (ran.code, ran.out) == (2, "")
    assert reason in ran.err
    assert ran.err.count("\n") == 1
    assert tree(folder) == before


def test_a_gymnasium_environment_is_taught(lab: Lab, folder: Path) -> None:
    ran = lab("teach", "gym:FrozenLake-v1?is_slippery=false", "--advisor", "expert", "--json")
    assert (ran.code, ran.json["solved"], ran.json["final_steps"]) == (0, True, 6)


def test_a_picture_that_cannot_be_drawn_loses_nothing_else(lab: Lab, folder: Path) -> None:
    """The document is there, the policy is kept, and the command fails: something that was asked for is missing."""
    (folder / "lesson" / "learning-curve.png").mkdir(parents=True)
    ran = lab("teach", "world-1", "--out", "lesson", "--json")
    assert (ran.code, ran.json["solved"]) == (1, True)
    assert "is kept, but picture 'lesson/learning-curve.png': it is a folder" in ran.err.splitlines()[-1]
    assert lab("toolbox", "list", "--json").json["policies"]


# ---- judgements -----------------------------------------------------------------------------------------------------


def test_praise_from_a_pipe_is_kept_replayed_and_gone_on_with(lab: Lab, folder: Path) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    typed = ["+", "-", "--", "-3", "left", "", "good", "bad 2", "+"]
    words = ("teach", "w.txt", "--advisor", "praise:terminal", "--gate", "always", "--episodes", "9", "--out", "lesson")
    ran = lab(*words, stdin="\n".join(typed))
    assert ran.code == 0
    assert "this question is about the move that it makes" in ran.err
    assert "Noted: clearly bad." in ran.err
    assert "  judged: 3 times good, 4 times bad" in ran.out
    journal = folder / "lesson" / "events.jsonl"
    whole = journal.read_bytes()
    assert (whole.count(b'"kind": "praise"'), whole.count(b'"kind": "judged"')) == (7, 7)
    replayed = lab("replay", "lesson", "--json").json
    assert replayed["receipt"]["judged"]["praised"] == 3
    assert "Answer: bad, of the last 3 moves" in lab("replay", "lesson", "--pause", "0").err
    lines = whole.splitlines(keepends=True)
    cut = next(n for n, line in enumerate(lines) if b'"value": -2' in line and b'"praise"' in line) + 1
    journal.write_bytes(b"".join(lines[:cut]))
    assert lab("teach", "--resume", "lesson", stdin="\n".join(typed[3:])).code == 0
    assert journal.read_bytes() == whole


def test_who_judges_is_named_alone(lab: Lab) -> None:
    ran = lab("teach", "world-1", "--advisor", "praise:expert", "--advisor", "wrong")
    assert (ran.code, ran.out) == (2, "")
    assert (
        ran.err
        == "lab: advisor 'praise:expert' (--advisor) beside 1 more: it judges moves that others choose: name it alone\n"
    )


def test_orders_are_not_judged(lab: Lab) -> None:
    ran = lab("sequence", "toast-case-1", "--method", "srl", "--advisor", "praise:expert")
    assert (ran.code, ran.out) == (2, "")
    assert "advisor 'praise:expert': it judges the steps of a sub-task, not the order" in ran.err


def test_peers_are_told_one_by_one(lab: Lab, folder: Path, tree: Tree) -> None:
    (folder / "w.txt").write_text("S..\n.#.\n..G\n")
    words = ("teach", "w.txt", "--peers", "2", "--gate", "always", "--seed", "1", "--out", "pictures")
    told, document = lab(*words), lab(*words, "--json").json
    assert (told.code, document["solved"], len(document["peers"])) == (0, True, 2)
    assert f"this is peer {document['best_peer']}: solved, then the shortest path" in told.out
    assert "peer 2: 4 steps, " in told.out
    assert "learning-curve.png" in "".join(tree(folder / "pictures"))
    assert "session" not in document


def test_the_peers_of_two_arms_are_told_by_task(lab: Lab, folder: Path, tree: Tree) -> None:
    words = ("teach", "insert", "--peer-task", "toast-panda", "--episodes", "60", "--seed", "1", "--out", "pictures")
    told, document = lab(*words), lab(*words[:-2], "--json").json
    assert (told.code, document["task"], document["others"][0]["task"]) == (0, "toast", "toast-panda")
    assert "peer 2 with the arm panda: " in told.out
    assert "in task 'toast-panda', peer 2: learned path: " in told.out
    assert {"1-toast/learning-curve.png", "2-toast-panda/learning-curve.png"} <= {*tree(folder / "pictures")}
