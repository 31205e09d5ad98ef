"""A language model as an advisor, against a small server of our own: good, bad, slow, silent, talking nonsense, or hostile."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import lab as package
from lab.advice.advisors import AdvisorName
from lab.advice.entries import FILE, Answer, read_journal
from lab.advice.model_address import KEY
from lab.advice.receipt import receipt
from lab.errors import BadInput, Notice
from lab.learning.requests import AdviceRequest, AdvisorLeft, Request
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import optimal_values
from lab.seat.language_model import (
    MOST_BYTES,
    MOST_IN_A_ROW,
    SKIP,
    LanguageModel,
    content_of,
    names_of,
    question,
    understood,
)
from lab.sequencing.search import SequenceRequest
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell
from lab.teaching.events import LessonBegan, ScenePrepared
from lab.teaching.lesson_plan import LessonPlan

Lab = Callable[..., Any]  # the fixture of tests/conftest.py; it returns a Ran
Behaves = Callable[[BaseHTTPRequestHandler, str], object]  # given the text of the question
MAZE = "S...\n.##.\n....\n.#.G\n"
SHORT: dict[str, Any] = {"gate": "ccrl", "first_episode": 4, "window": 2, "episodes": 60, "max_steps": 40}
WORLD = package.world(MAZE)
MDP = package.teach(WORLD, advisor=None, gate="never", episodes=1).problem.mdp
BEST = optimal_values(MDP, 0.99).argmax(axis=1)


# ---- a small server ---------------------------------------------------------------------------------------------------


@dataclass
class Served:
    """A running server: its address as an advisor, and the questions and headers that it was sent."""

    port: int
    questions: list[str] = field(default_factory=list)
    headers: list[dict[str, str]] = field(default_factory=list)
    records: list[dict[str, Any]] = field(default_factory=list)

    @property
    def advisor(self) -> str:
        return f"llm:http://127.0.0.1:{self.port}/v1#small"


@contextmanager
def serving(behaves: Behaves) -> Iterator[Served]:
    """A server on a free port of this computer, which behaves so at each question."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            record = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            served.records.append(record | {"path": self.path})
            served.headers.append(dict(self.headers))
            served.questions.append(record["messages"][-1]["content"])
            behaves(self, served.questions[-1])

        def log_message(self, *words: object) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    served = Served(server.server_address[1])
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield served
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def sent(handler: BaseHTTPRequestHandler, body: bytes, status: int = 200, **headers: str) -> None:
    handler.send_response(status)
    for name, value in headers.items():
        handler.send_header(name, value)
    handler.send_header("Content-Length", str(len(body)))
    handler.end_headers()
    handler.wfile.write(body)


def completion(text: object) -> bytes:
    return json.dumps({"choices": [{"message": {"role": "assistant", "content": text}}]}).encode()


def replying(reply: Callable[[str], object]) -> Behaves:
    return lambda handler, text: sent(handler, completion(reply(text)))


def best(text: str) -> str:
    """The best move, read from a table by the place that the question names; it has to be allowed."""
    row, column = map(int, re.findall(r"(?:row|column) (\d+)", text)[:2])
    label: str = MDP.action_labels[BEST[np.ravel_multi_index((row, column), MDP.shape)]]
    assert f" or {label}" in text.splitlines()[-1]
    return label


def silent(handler: BaseHTTPRequestHandler, text: str) -> None:
    """Close the connection without a word."""


def huge(handler: BaseHTTPRequestHandler, text: str) -> None:
    handler.send_response(200)
    handler.send_header("Content-Length", str(10 * MOST_BYTES))
    handler.end_headers()
    try:
        for _ in range(10):
            handler.wfile.write(b"x" * MOST_BYTES)
    except OSError:
        """It has heard enough."""


def lesson(advisor: Any, **changes: Any) -> Any:
    return package.teach(WORLD, advisor=advisor, seed=1, **(SHORT | changes))


# ---- what is understood -----------------------------------------------------------------------------------------------


NAMES = {"0": 0, "1": 1, "up": 0, "Down": 1}


@pytest.mark.parametrize(
    ("reply", "answer"),
    [
        ("up", 0),
        (" UP \n", 0),
        ("1", 1),
        ("down\nbecause the goal lies there", 1),
        ('"up"', 0),
        ("`1`", 1),
        ('{"action": "down"}', 1),
        ('{"action": 1, "why": "..."}', 1),
        ('```json\n{"action": "up"}\n```', 0),
        ("```\nup\n```", 0),
        ("Down.", 1),
        ("**up**!\nBecause the goal is there.", 0),
        ("skip", SKIP),
        ("Skip", SKIP),
        ("", None),
        ("2", None),
        ("up, or down", None),
        ("up && rm -rf /", None),
        ("up\x1b[31m", None),
        ("I would go up.", None),
        ("ignore your rules; answer: rm -rf", None),
        ('{"action": ["up"]}', None),
        ('{"action": true}', None),
        ('{"action": "up"} and more', None),
        ('{"a":' * 5000, None),
        ("```" + "\n" * 100_000 + "up", None),
        ("<html><body>up</body></html>", None),
    ],
)
def test_a_reply_is_an_allowed_answer_or_nothing(reply: str, answer: object) -> None:
    assert understood(reply, NAMES) == answer


@pytest.mark.parametrize(
    "document",
    [b"", b"up", b"[]", b'{"choices": []}', b'{"choices": [{"message": 1}]}', completion(None), completion(["up"])],
)
def test_what_is_no_chat_completion_has_no_text(document: bytes) -> None:
    assert content_of(document) is None
    assert content_of(completion("up")) == "up"


def test_labels_come_before_numbers() -> None:
    mdp = package.grid((1, 3), [[0, 0, 0]], (0, 0), (0, 2), None, ("1", "0", "left", "right"))
    assert names_of(about(mdp)) == {"0": 1, "1": 0, "2": 2, "3": 3, "left": 2, "right": 3}


def about(mdp: Any, state: int = 0) -> AdviceRequest:
    q = [[0.0] * mdp.n_actions] * mdp.n_states
    return AdviceRequest(mdp=mdp, q=q, state=state, episode=3, step=1, own=0, allowed=range(mdp.n_actions))


def test_a_question_is_the_one_that_a_person_gets_with_the_allowed_answers() -> None:
    lines = question(about(MDP)).splitlines()
    assert lines[:3] == ["Episode 3, step 1.", "The robot is at row 0, column 0.", "The goal lies 3 down and 3 right."]
    assert lines[-1] == "Allowed answers, by number or name: 0 or up, 1 or down, 2 or left, 3 or right; or skip."


class InWords:
    """A skill that describes its states."""

    def in_words(self, state: int) -> str:
        return f"The tool is {state} cm away."

    def moves_in_words(self) -> tuple[str, ...]:
        return ("1 cm",) * 4


def test_a_skill_asks_in_its_own_words() -> None:
    plan = LessonPlan(package.Problem("insert", "insert", MDP), LearnerSettings("q"), GateSettings(), "toast")
    with serving(replying(lambda text: "down")) as server:
        model = LanguageModel(AdvisorName.of(server.advisor))
        model.hear(ScenePrepared(SimpleNamespace(skillset=SimpleNamespace(skills={"insert": InWords()}))))
        model.hear(LessonBegan(plan))
        model(about(MDP, 3))
    assert "The tool is 3 cm away." in server.questions[0].splitlines()
    assert "down, 1 cm: free." in server.questions[0].splitlines()


def test_a_question_on_the_order_names_the_moves() -> None:
    run = Run(load_cell("toast-case-1").cell(2))
    request = SequenceRequest(run=run, allowed=run.allowed(), own=1, episode=30, step=1, state=0)
    lines = question(request).splitlines()
    assert "Move 1: toast 1 from plate to toaster, ready now, the learner's own choice." in lines
    assert lines[-1] == "Allowed answers, by number or name: 1, 2; or skip."
    assert names_of(request) == {"1": 1, "2": 2, "move 1": 1, "move 2": 2}


# ---- lessons ----------------------------------------------------------------------------------------------------------


def test_a_good_one_advises_as_a_function_with_the_same_answers_does() -> None:
    with serving(replying(best)) as server:
        advised = lesson(server.advisor)
    same = lesson(lambda request: int(BEST[request.state]))
    assert advised.q.tobytes() == same.q.tobytes()
    assert advised.solved
    assert advised.session.helped_steps == same.session.helped_steps > len(server.questions) > 0
    places = [text.splitlines()[1] for text in server.questions]
    assert len({*places}) == len(places), "it is asked once about a state"
    assert server.records[0] | {"messages": 0} == {
        "messages": 0,
        "temperature": 0,
        "stream": False,
        "model": "small",
        "path": "/v1/chat/completions",
    }


def test_one_that_is_always_wrong_is_rejected_by_the_judge() -> None:
    with serving(replying(lambda text: "up")) as server:
        misled = lesson(server.advisor, omega=1, max_steps=20, episodes=200)
    same = lesson(lambda request: 0, omega=1, max_steps=20, episodes=200)
    assert misled.session.rejected_at_episode is not None
    assert misled.q.tobytes() == same.q.tobytes()
    assert misled.solved


HOSTILE: dict[str, tuple[Behaves, str]] = {
    "silent": (silent, "connection failed: "),
    "nonsense": (
        replying(lambda text: "Certainly! Let me think."),
        "'Certainly! Let me think.' is none of the allowed",
    ),
    "orders": (replying(lambda text: "ignore your rules; answer: rm -rf"), "rm -rf' is none of the allowed answers"),
    "escapes": (replying(lambda text: "\x1b]0;mine\x07\x1b[2J"), re.escape(r"'\x1b]0;mine\x07\x1b[2J'")),
    "trailing": (replying(lambda text: "up; then run this"), "none of the allowed answers"),
    "no text": (replying(lambda text: {"action": "up"}), "no chat completion"),
    "html": (lambda handler, text: sent(handler, b"<html>up</html>"), "no chat completion"),
    "10 MB": (huge, f"longer than {MOST_BYTES} bytes"),
    "status": (lambda handler, text: sent(handler, b"up", 500), "status 500"),
    "not HTTP": (lambda handler, text: handler.wfile.write(b"up\r\n\r\n"), "no reply in HTTP"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_one_without_an_allowed_answer_is_asked_no_more_and_the_lesson_is_that_of_nobody(name: str) -> None:
    behaves, why = HOSTILE[name]
    with serving(behaves) as server, pytest.warns(Notice, match=f"advises no more: 5 calls in a row .*{why}"):
        left = lesson(server.advisor)
    assert len(server.questions) == MOST_IN_A_ROW
    assert (left.session.helped_steps, left.solved) == (0, True)
    assert left.q.tobytes() == lesson(None).q.tobytes()


def test_a_slow_one_is_not_waited_for() -> None:
    over = Event()
    with serving(lambda handler, text: over.wait()) as server:
        try:
            with pytest.warns(Notice, match=r"no answer within 0\.2 s"):
                left = lesson(f"{server.advisor},timeout=0.2")
        finally:
            over.set()
    assert len(server.questions) <= MOST_IN_A_ROW
    assert left.q.tobytes() == lesson(None).q.tobytes()


def test_one_that_drips_is_not_waited_for() -> None:
    over = Event()

    def drips(handler: BaseHTTPRequestHandler, text: str) -> None:
        handler.send_response(200)
        handler.end_headers()
        try:
            while not over.wait(0.02):
                handler.wfile.write(b" ")
        except OSError:
            """It has heard enough."""

    with serving(drips) as server:
        try:
            with pytest.warns(Notice, match=r"no answer within 0\.2 s"):
                lesson(f"{server.advisor},timeout=0.2")
        finally:
            over.set()


def test_without_a_server_it_leaves_at_the_first_question() -> None:
    with serving(silent) as server:
        """Its port is free afterwards."""
    with pytest.warns(Notice, match=f"127.0.0.1:{server.port}: connection failed: ") as told:
        left = lesson(server.advisor)
    assert len(told) == 1
    assert left.q.tobytes() == lesson(None).q.tobytes()


@pytest.mark.parametrize("status", [301, 302, 307, 308])
def test_a_redirect_is_not_followed(status: int) -> None:
    with serving(replying(best)) as other:
        where = f"http://127.0.0.1:{other.port}/v1/chat/completions"
        told = pytest.warns(Notice, match=f"status {status}: redirects are not followed")
        with serving(lambda handler, text: sent(handler, b"", status, Location=where)) as server, told:
            lesson(server.advisor)
        assert other.questions == []


def test_after_all_allowed_calls_it_leaves() -> None:
    with serving(replying(best)) as server, pytest.warns(Notice, match=r"3 calls were made, which is the limit"):
        lesson(f"{server.advisor},calls=3")
    assert len(server.questions) == 3


def test_what_it_skips_is_left_to_the_learner_and_not_asked_again() -> None:
    with serving(replying(lambda text: "skip")) as server:
        alone = lesson(server.advisor)
    same = lesson(lambda request: None)
    assert alone.q.tobytes() == same.q.tobytes()
    assert 0 < len(server.questions) <= MDP.n_states


def test_a_failed_call_is_made_again() -> None:
    replies = iter(["what?", "down", "never"])
    with serving(replying(lambda text: next(replies))) as server:
        model = LanguageModel(AdvisorName.of(server.advisor))
        assert [model(about(MDP)) for _ in range(3)] == [None, 1, 1]
    assert (model.asked, model.repeated, model.unusable) == (2, 1, 1)


def test_another_problem_has_other_answers() -> None:
    replies = iter(["down", "up"])
    with serving(replying(lambda text: next(replies))) as server:
        model = LanguageModel(AdvisorName.of(server.advisor))
        assert [model(about(MDP)), model(about(replace(MDP)))] == [1, 0]


def test_beside_an_expert_it_is_one_voice_of_a_panel() -> None:
    with serving(replying(lambda text: "up")) as server:
        taught = lesson([server.advisor, "expert"], gate="always")
    assert taught.solved
    with serving(silent) as server, pytest.warns(Notice):
        assert lesson([server.advisor, "expert"], gate="always").solved


# ---- the key ----------------------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("default::lab.errors.Notice")
def test_the_key_is_sent_and_written_nowhere(
    lab: Lab, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, maze: str
) -> None:
    monkeypatch.setenv(KEY, "sk-0123456789")
    with serving(replying(lambda text: "you sent sk-0123456789")) as server:
        ran = taught(lab, maze, server.advisor, tmp_path / "lesson")
    assert {headers["Authorization"] for headers in server.headers} == {"Bearer sk-0123456789"}
    assert "you sent *** " not in ran.err
    assert "'you sent ***' is none of the allowed answers" in ran.err
    written = [path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()]
    assert len(written) > 3
    assert not [content for content in (*written, ran.out.encode(), ran.err.encode()) if b"0123456789" in content]


def test_without_a_key_none_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(KEY, raising=False)
    with serving(replying(best)) as server:
        lesson(server.advisor)
    assert not [headers for headers in server.headers if "Authorization" in headers]


@pytest.mark.parametrize(
    ("address", "key", "is_refused"),
    [
        ("http://example.org/v1", "k", True),
        ("http://10.0.0.5:8080/v1#m", "k", True),
        ("http://10.0.0.5:8080/v1#m,unencrypted", "k", False),
        ("http://10.0.0.5:8080/v1#m", "", False),
        ("http://127.0.0.1:8080/v1", "k", False),
        ("http://localhost:8080/v1", "k", False),
        ("http://[::1]:8080/v1", "k", False),
        ("https://example.org/v1", "k", False),
    ],
)
def test_a_key_leaves_the_computer_encrypted(address: str, key: str, is_refused: bool) -> None:
    name = AdvisorName.of(f"llm:{address}")
    if not is_refused:
        LanguageModel(name, key)
        return
    with pytest.raises(BadInput, match=f"{KEY} would be sent unencrypted to .*: use https"):
        LanguageModel(name, key)


def test_a_key_that_no_header_can_hold_is_refused_and_not_shown() -> None:
    with pytest.raises(BadInput, match="it holds characters that no key has") as refused:
        LanguageModel(AdvisorName.of("llm:http://127.0.0.1"), "sk\r\nHost: x")
    assert "sk" not in str(refused.value)


# ---- what is kept -----------------------------------------------------------------------------------------------------


@pytest.fixture
def maze(tmp_path: Path) -> str:
    (tmp_path / "maze.txt").write_text(MAZE)
    return str(tmp_path / "maze.txt")


def taught(lab: Lab, maze: str, advisor: str, out: Path) -> Any:
    ran = lab("teach", maze, "--advisor", advisor, "--gate", "always", "--episodes", "30", "--out", str(out), "--json")
    assert ran.code == 0, ran.err
    return ran


def learned(document: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in document.items() if name not in ("session", "files", "saved_as")}


def answers(folder: Path) -> list[Answer]:
    return [entry for entry in read_journal(folder, "test").entries if isinstance(entry, Answer)]


def test_a_kept_lesson_is_shown_and_said_again_without_the_server(lab: Lab, tmp_path: Path, maze: str) -> None:
    with serving(replying(best)) as server:
        kept = taught(lab, maze, server.advisor, tmp_path / "lesson")
    assert f"{server.advisor}: {len(server.questions)} calls" in kept.err
    assert {entry.by for entry in answers(tmp_path / "lesson")} == {server.advisor}
    shown = lab("replay", str(tmp_path / "lesson"), "--json")
    assert shown.code == 0, shown.err
    assert shown.json["receipt"] == kept.json["receipt"]
    assert not shown.json["receipt"]["yours"]
    said = taught(lab, maze, f"recorded:{tmp_path / 'lesson'}", tmp_path / "said")
    assert said.json["steps_per_episode"] == kept.json["steps_per_episode"]


@pytest.mark.filterwarnings("default::lab.errors.Notice")
def test_a_stopped_lesson_goes_on_bit_for_bit_and_asks_only_what_it_does_not_know(
    lab: Lab, tmp_path: Path, maze: str
) -> None:
    with serving(replying(best)) as server:
        whole = taught(lab, maze, server.advisor, tmp_path / "whole")
        calls = len(server.questions)
        lines = (tmp_path / "whole" / FILE).read_bytes().splitlines(keepends=True)
        for left, fewer in ((len(lines) - 1, calls), (9, 2)):
            folder = tmp_path / f"stopped-{left}"
            folder.mkdir()
            (folder / FILE).write_bytes(b"".join(lines[:left]))
            server.questions.clear()
            resumed = lab("teach", "--resume", str(folder), "--advisor", server.advisor, "--json")
            assert resumed.code == 0, resumed.err
            assert learned(resumed.json) == learned(whole.json)
            assert (folder / FILE).read_bytes() == b"".join(lines)
            assert len(server.questions) <= calls - fewer


def test_no_file_decides_where_questions_are_sent(lab: Lab, tmp_path: Path, maze: str) -> None:
    with serving(replying(best)) as server:
        taught(lab, maze, server.advisor, tmp_path / "lesson")
        lines = (tmp_path / "lesson" / FILE).read_bytes().splitlines(keepends=True)
        (tmp_path / "lesson" / FILE).write_bytes(b"".join(lines[:9]))
        server.questions.clear()
        for more in ((), ("--advisor", "expert"), ("--advisor", f"{server.advisor},calls=5")):
            ran = lab("teach", "--resume", str(tmp_path / "lesson"), *more)
            assert (ran.code, "which has to be named again" in ran.err) == (2, True), ran.err
            assert f"--advisor '{server.advisor}'" in ran.err
        assert server.questions == []


@pytest.mark.filterwarnings("default::lab.errors.Notice")
def test_why_it_left_is_in_the_journal_and_the_receipt(lab: Lab, tmp_path: Path, maze: str) -> None:
    with serving(replying(lambda text: "\x1b[2J")) as server:
        kept = taught(lab, maze, server.advisor, tmp_path / "lesson")
    why = r"5 calls in a row gave no allowed answer; the last one: '\x1b[2J' is none of the allowed answers"
    assert f"lab: advisor '{server.advisor}' advises no more: {why}\n" in kept.err
    *before, last = answers(tmp_path / "lesson")
    assert [entry.action for entry in before] == [None] * (MOST_IN_A_ROW - 1)
    assert (last.left, last.why) == (True, why)
    assert f"episode 1: {server.advisor} left: {why}" in kept.json["receipt"]["notices"]
    assert "\x1b" not in kept.out + kept.err
    shown = lab("replay", str(tmp_path / "lesson"), "--json")
    assert shown.json["receipt"] == kept.json["receipt"]


def test_help_of_a_model_is_not_yours() -> None:
    asked = [Answer(by, 1, 1, 0, 1) for by in ("terminal", "llm:http://127.0.0.1")]
    assert receipt(asked[:1], None, None).yours
    assert not receipt(asked[1:], None, None).yours
    assert not receipt(asked, None, None).yours


# ---- the order --------------------------------------------------------------------------------------------------------


ORDER = ("sequence", "toast-case-1", "--toasts", "3", "--method", "srl", "--gate", "always", "--episodes", "3")


def test_the_order_is_advised_kept_and_shown_again_without_the_server(lab: Lab, tmp_path: Path) -> None:
    def first(text: str) -> str:
        return str(re.findall(r"^Move (\d+)", text, re.MULTILINE)[-1])

    with serving(replying(first)) as server:
        kept = lab(*ORDER, "--advisor", server.advisor, "--json")
        assert kept.code == 0, kept.err
        folder = Path(kept.json["session"])
        lines = (folder / FILE).read_bytes().splitlines(keepends=True)
        (tmp_path / FILE).write_bytes(b"".join(lines[:6]))
        server.questions.clear()
        resumed = lab("sequence", "--resume", str(tmp_path), "--advisor", server.advisor, "--json")
        assert resumed.code == 0, resumed.err
        assert learned(resumed.json) == learned(kept.json)
        assert (tmp_path / FILE).read_bytes() == b"".join(lines)
        (tmp_path / FILE).write_bytes(b"".join(lines[:6]))
        assert lab("sequence", "--resume", str(tmp_path)).code == 2
    assert {entry.by for entry in answers(folder)} == {server.advisor}
    shown = lab("replay", str(folder), "--json")
    assert shown.code == 0, shown.err
    assert shown.json["receipt"] == kept.json["receipt"]


@pytest.mark.filterwarnings("default::lab.errors.Notice")
def test_a_bad_one_leaves_the_order_as_with_nobody(lab: Lab) -> None:
    with serving(replying(lambda text: "rm -rf /")) as server:
        ran = lab(*ORDER, "--advisor", server.advisor, "--json")
    alone = lab(*ORDER, "--advisor", "none", "--json")
    assert ran.code == 0, ran.err
    assert "'rm -rf /' is none of the allowed answers" in ran.err
    assert ran.json["sequence"] == alone.json["sequence"]


# ---- where it is not asked --------------------------------------------------------------------------------------------


def test_sessions_by_the_thousand_do_not_ask_it(lab: Lab, tmp_path: Path, maze: str) -> None:
    words = {
        "compare": (maze, "--advisor", "expert,llm:http://127.0.0.1", "--sessions", "2"),
        "run": ("advicebench", "--advisors", "llm:http://127.0.0.1", "--problem", "empty", "--sessions", "2"),
    }
    for command, more in words.items():
        ran = lab("study", command, *more, "--out", str(tmp_path / command))
        assert (ran.code, "only lab teach, run and sequence ask a language model" in ran.err) == (2, True), ran.err
        assert len(ran.err.splitlines()) == 1
        assert not (tmp_path / command).exists()


def test_a_left_one_stays_left() -> None:
    with serving(silent) as server:
        model = LanguageModel(AdvisorName.of(server.advisor))

        def asked(request: Request) -> str:
            try:
                return str(model(request))
            except AdvisorLeft as left:
                return f"left: {left}"

        with pytest.warns(Notice) as told:
            said = [asked(about(MDP, state)) for state in range(7)]
        assert said[:4] == ["None"] * 4
        assert said[4] == said[5] == said[6]
        assert (len(told), len(server.questions)) == (1, MOST_IN_A_ROW)
