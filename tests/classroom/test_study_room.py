"""A study with real lessons in their own processes, and participants who are programs."""

import errno
import json
import shutil
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection
from websockets.exceptions import InvalidStatus

from lab.advice.entries import read_journal
from lab.classroom.class_server import ClassServer
from lab.classroom.holding import closing
from lab.classroom.participant import Participant
from lab.classroom.roster import Pupil, Roster
from lab.classroom.study import PROTOCOL, Study
from lab.classroom.study_room import StudyRoom
from lab.errors import BadInput
from tests.classroom.conftest import asked, at_page, question, seated, until
from tests.classroom.scripted import LAST, TLX, Scripted, served, study_in

Json = dict[str, Any]


@pytest.fixture
def server(tmp_path: Path) -> Iterator[ClassServer]:
    """A study of three arms with nine seats."""
    with served(study_in(tmp_path)) as running:
        yield running


def files(server: ClassServer) -> dict[str, bytes]:
    """All files of the study, by path."""
    folder = server.roster.folder
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_participants_go_through_all_arms_and_one_withdraws(server: ClassServer) -> None:
    people = [Scripted.joined(server) for _ in range(4)]
    for person in people[:3]:
        assert person.goes_through()["text"] == "Thanks."
    people[3].goes_through("lesson")
    position = server.roster.study and server.roster.study.positions[3]
    teacher = server.teacher_url.partition(str(server.port))[2]
    at_page(server, teacher, lambda page: until(page, lambda news: len(news.get("rows", ())) >= 6))
    assert people[3].says(do="withdraw") == {"kind": "withdrawn"}

    kept = [person.kept() for person in people[:3]]
    assert [record["participant"] for record in kept] == ["P01", "P02", "P03"]
    for record in kept:
        by_kind = Counter(step["kind"] for step in record["steps"])
        assert by_kind == {"lesson": 3, "questionnaire": 5, "text": 1}
        assert {step["arm"]: step["timed_out"] for step in record["steps"] if step["kind"] == "lesson"} == {
            "a": False,
            "b": False,
            "c": True,
        }
        assert [step["arm"] for step in record["steps"] if step["kind"] == "lesson"] == record["order"]
        assert [step["answers"] for step in record["steps"] if step["kind"] == "questionnaire"] == [
            LAST,
            *[TLX] * 3,
            LAST,
        ]
        assert all(step["began"] <= step["ended"] <= record["finished"] for step in record["steps"])
        assert record["consented"] <= record["steps"][0]["began"]
        lessons = server.roster.folder / f"{record['number']:02}-{record['participant']}"
        assert (lessons / "lesson-1" / "lesson.json").is_file()
        assert not (lessons / "lesson-3" / "lesson.json").exists()
        assert (lessons / "lesson-3" / "events.jsonl").is_file()
    journal = (server.roster.folder / "01-P01" / "lesson-2" / "events.jsonl").read_text()
    assert '"praise:web"' in journal

    later = Scripted.agreed(server)
    assert later.kept()["number"] == 5
    assert server.roster.study is not None
    assert server.roster.study.positions[3:] == [None, position]


def test_a_study_with_a_withdrawal_ends_and_goes_on_without_a_trace(server: ClassServer) -> None:
    first, second = Scripted.agreed(server), Scripted.agreed(server)
    first.says(do="withdraw")
    document = closing(server)  # the server has ended: table, report and hand-outs are written
    assert [pupil["name"] for pupil in document["pupils"]] == ["P02"]
    assert not (server.roster.folder / "01-P01").exists()
    with served(Study.read(Roster.read(server.roster.folder))) as again:
        Scripted(again, second.page).says(do="withdraw")
        assert not any(b"P02" in content or "P02" in name for name, content in files(server).items())


@pytest.mark.slow
def test_nothing_comes_back_of_lessons_that_were_just_taught(tmp_path: Path) -> None:
    """The desks of two lessons may still draw their pictures when the participant withdraws."""
    text = 'lessons = ["small.txt"]\ngate = "always"\nepisodes = 2\n\n[[arms]]\nname = "b"'
    with served(study_in(tmp_path, **{text: text.replace('"small.txt"]', '"small.txt", "small.txt"]')})) as server:
        person = Scripted.agreed(server)
        while (shown := person.goes_through("lesson"))["kind"] == "lesson":
            taught = person.arm() == "a" and person.lesson()
            if taught and person.kept()["steps"][-1]["lesson"] == 2:
                break
            person.goes_on(shown) if taught else person.lesson() and person.goes_on(shown)
        person.says(do="withdraw")
        server.stop()  # whatever still ran has ended
        assert not (server.roster.folder / "01-P01").exists()


def test_whoever_leads_a_study_removes_nobody(server: ClassServer) -> None:
    Scripted.agreed(server)
    with pytest.raises(BadInput, match="withdraw themselves"):
        server.call(lambda: server.room.remove(1))
    assert [pupil.name for pupil in server.roster.present] == ["P01"]


def test_the_time_of_a_lesson_begins_with_its_page(tmp_path: Path) -> None:
    with served(study_in(tmp_path)) as server:
        person = Scripted.agreed(server)
        while person.goes_through("lesson")["kind"] == "lesson" and person.arm() != "c":
            person.lesson()
            person.goes_on(person.state())
        number = server.roster.present[0].number
        assert server.call(lambda: isinstance(server.room, StudyRoom) and number not in server.room._limits)
        assert person.lesson(answers=False)["timed_out"]  # its limit is one second


def test_who_ends_a_lesson_has_ended_it_also_after_the_server(server: ClassServer) -> None:
    person = Scripted.agreed(server)
    shown = person.goes_through("lesson")

    async def ends(page: ClientConnection) -> object:
        asks = await seated(page)
        await page.send(json.dumps({"answer": {"question": asks["number"], "word": "quit"}}))
        return await until(page, lambda news: news.get("class", {}).get("study", {}).get("over"))

    at_page(server, person.page.replace("/step/", "/desk/"), ends)
    assert person.state()["over"]
    server.stop()
    with served(Study.read(Roster.read(server.roster.folder))) as again:
        later = Scripted(again, person.page)
        assert later.state()["over"]
        assert later.goes_on(shown)["step"] == shown["step"] + 1


def test_a_lesson_ends_with_its_last_episode_and_not_with_its_pictures(tmp_path: Path) -> None:
    with served(study_in(tmp_path, **{"time_limit_s = 1": "time_limit_s = 60"})) as server:
        person = Scripted.agreed(server)
        person.goes_through("lesson")
        person.lesson()
        ended = person.kept()["steps"][-1]
        assert (ended["ended"] is not None, ended["timed_out"]) == (True, False)
        person.goes_through("questionnaire")
        teacher = server.teacher_url.partition(str(server.port))[2]
        at_page(server, teacher, lambda page: until(page, lambda news: news.get("rows")))  # it is kept nevertheless
        folder = server.roster.folder / "01-P01" / f"lesson-{ended['lesson']}"
        assert read_journal(folder, "test").closed is not None


def test_a_study_whose_world_was_changed_does_not_go_on(server: ClassServer, tmp_path: Path) -> None:
    Scripted.agreed(server)
    server.stop()
    (tmp_path / "small.txt").write_text("S..G\n....\n")
    with pytest.raises(BadInput, match=r"small.txt.*changed since the study began"):
        Study.read(Roster.read(server.roster.folder))


def test_nothing_is_kept_before_the_consent_and_nothing_after_the_withdrawal(server: ClassServer) -> None:
    before = files(server)
    person = Scripted.joined(server)
    shown = person.state()
    assert (shown["kind"], shown["text"], shown["consent"]) == ("consent", "Welcome.", "You agree.")
    assert Scripted.joined(server).says(do="decline") == {"kind": "declined"}
    assert files(server) == before

    person.says(do="agree")
    person.goes_through("lesson")
    person.lesson(answers=person.arm() != "c")
    key = person.page.partition("token=")[2]
    pupil = server.roster.of_key(key)
    assert pupil is not None
    said = [pupil.key_hash, person.kept()["consented"]]
    person.says(do="withdraw")
    after = files(server)
    assert {*after} == {*before}
    assert not any(text.encode() in content for text in said for content in after.values())
    assert json.loads(after["class.json"])["pupils"] == [asdict(Pupil(1, "", ""))]
    assert server.call(server.room.tiles) == {}
    assert asked(server, f"/step/state?token={key}")[0] == 403
    with pytest.raises(InvalidStatus):
        at_page(server, f"/desk/?token={key}", question)


def test_a_full_disk_keeps_nobody_half(server: ClassServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever could not be written may agree again, and has the first position of the design."""
    person = Scripted.joined(server)

    def full(*arguments: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Participant, "write", full)
        status, said = person.tries(do="agree")
    assert (status, "No space left" in said["error"]) == (500, True)
    assert person.state()["kind"] == "consent"
    assert server.roster.present == []
    person.says(do="agree")
    assert server.roster.study is not None
    assert server.roster.study.positions == [None, 0]


def test_a_withdrawal_that_was_cut_off_is_finished(server: ClassServer) -> None:
    Scripted.agreed(server)
    Scripted.agreed(server)
    server.stop()
    folder = server.roster.folder
    (folder / "01-P01").rename(folder / ".withdrawn-1")
    with served(Study.read(Roster.read(folder))) as again:
        assert not (folder / ".withdrawn-1").exists()
        assert [pupil.number for pupil in again.roster.present] == [2]


def test_who_has_not_agreed_reaches_no_desk_and_is_forgotten_with_the_server(server: ClassServer) -> None:
    person = Scripted.joined(server)
    with pytest.raises(InvalidStatus):
        at_page(server, person.page.replace("/step/", "/desk/"), question)
    server.stop()
    with served(Study.read(Roster.read(server.roster.folder))) as again:
        assert asked(again, person.page.replace("/?", "/state?"))[0] == 403
        assert again.roster.pupils == []


def test_a_study_goes_on_after_its_server_has_ended(server: ClassServer) -> None:
    person = Scripted.agreed(server)
    while person.goes_through("lesson") and person.arm() == "c":
        person.lesson(answers=False)
        person.goes_on(person.state())
    at_page(server, person.page.replace("/step/", "/desk/"), question)
    before = person.kept()
    server.stop()
    with served(Study.read(Roster.read(server.roster.folder))) as again:
        person.server = again
        assert again.call(lambda: [desk.state for desk in again.room.desks.values()]) == ["idle"]
        assert person.state()["step"] == len(before["steps"])
        assert person.goes_through()["kind"] == "thanks"
        assert person.kept()["steps"][: len(before["steps"]) - 1] == before["steps"][:-1]


def test_a_changed_protocol_is_refused(server: ClassServer, tmp_path: Path) -> None:
    server.stop()
    path = server.roster.folder / PROTOCOL
    path.write_text(path.read_text().replace("Thanks.", "Thank you."))
    with pytest.raises(BadInput, match=r"protocol\.toml.*has been changed"):
        Study.read(Roster.read(server.roster.folder))


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"number": 2}, "wanted P01"),
        ({"consented": "yesterday"}, "yesterday"),
        ({"order": ["a"]}, "not the protocol's"),
        ({"order": ["a", "b", "x"]}, "not the protocol's"),
        ({"steps": []}, "not the protocol's"),
        ({"steps": [{"kind": "nap"}]}, "steps"),
    ],
)
def test_a_damaged_record_is_refused_in_one_line(server: ClassServer, changed: Json, said: str) -> None:
    Scripted.agreed(server)
    server.stop()
    path = server.roster.folder / "01-P01" / "participant.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changed))
    with pytest.raises(BadInput, match=said) as refused:
        Study.read(Roster.read(server.roster.folder))
    assert "\n" not in str(refused.value)


def test_a_step_ends_once_and_not_before_it_may(server: ClassServer) -> None:
    person = Scripted.agreed(server)
    shown = person.state()
    assert shown["kind"] == "questionnaire"
    for answers in ({}, {"like": 9, "hand": "left"}, {"like": True, "hand": "left"}, LAST | {"more": 1}, [1]):
        assert person.tries(do="go on", step=shown["step"], answers=answers)[0] == 409
    after = person.goes_on(shown, answers=LAST | {"note": "<b>\ud800"})
    assert person.kept()["steps"][0]["answers"]["note"] == "<b>?"
    status, said = person.tries(do="go on", step=shown["step"], answers=LAST)
    assert (status, "You are at step" in said["error"]) == (409, True)
    while after["kind"] != "lesson" or person.arm() == "c":
        after = person.goes_through("lesson")
        if person.arm() == "c":
            person.lesson(answers=False)
            after = person.goes_on(after)
    status, said = person.tries(do="go on", step=after["step"])
    assert (status, said["error"]) == (409, "This lesson is not over yet.")


@pytest.mark.parametrize("body", [b"", b"[]", b"{}", b'{"do": "go on"}', b'{"do": "agree"}', b"[" * 9999])
def test_a_wrong_wish_is_refused(server: ClassServer, body: bytes) -> None:
    person = Scripted.agreed(server)
    status, said = asked(server, person.page.replace("/?", "/do?"), body)
    assert (status in (400, 409), "message" in json.loads(said)["error"]) == (True, True)
    assert asked(server, person.page.replace("/?", "/do?"), b"x" * (1 << 19))[0] == 413
    assert asked(server, "/step/do?token=x", {"do": "agree"})[0] == 403
    elsewhere = {"Origin": "https://elsewhere.example"}
    assert asked(server, person.page.replace("/?", "/do?"), {"do": "withdraw"}, **elsewhere)[0] == 403


def test_whoever_leads_the_study_sees_the_steps_and_only_looks_on(server: ClassServer) -> None:
    Scripted.agreed(server)
    teacher = server.teacher_url.partition(str(server.port))[2]

    async def looks(page: ClientConnection) -> tuple[Json, list[str]]:
        news = await until(page, lambda news: news.get("tiles"))
        refused = []
        for wish in ("next", "help", "hint", "pause"):
            await page.send(json.dumps({"do": wish, "pupil": 1, "on": True, "text": "x"}))
            refused.append((await until(page, lambda news: news.get("refusal")))["refusal"])
        return news, refused

    news, refused = at_page(server, teacher, looks)
    assert news["class"]["study"] == {"title": "Three <b>arms</b>", "may": []}
    [tile] = news["tiles"]
    assert (tile["name"], tile["study"]["step"], tile["study"]["steps"]) == ("P01", 1, 9)
    assert tile["study"]["doing"] == "questionnaire last"
    assert sorted(tile["study"]["order"]) == ["a", "b", "c"]
    assert all("protocol" in said for said in refused)


def test_a_protocol_may_let_somebody_else_end_a_step(tmp_path: Path) -> None:
    study = study_in(tmp_path, **{"participants = 9": 'participants = 9\nteacher_may = ["next"]\nnames = "pseudonyms"'})
    with served(study) as server:
        person = Scripted.agreed(server)
        server.call(lambda: server.room.go_on(1))
        assert person.state()["step"] == 2
        assert person.kept()["participant"].count(" ") == 1
        with pytest.raises(BadInput, match="step by step"):
            server.call(lambda: server.room.go_on(None, 2))


def test_a_participant_is_not_told_the_arm(server: ClassServer) -> None:
    person = Scripted.agreed(server)
    shown = person.goes_through("lesson")

    async def told(page: ClientConnection) -> Json:
        return dict((await until(page, lambda news: "class" in news))["class"])

    said = at_page(server, person.page.replace("/step/", "/desk/"), told)
    assert (said["lesson"], said["lessons"], said["study"]["here"]) == (1, 1, True)
    assert "arm" not in shown
    assert "order" not in shown


def test_a_lesson_whose_folder_is_gone_is_no_reason_to_lose_the_study(server: ClassServer) -> None:
    """A participant's whole folder that somebody has deleted counts as a withdrawal."""
    Scripted.agreed(server)
    server.stop()
    shutil.rmtree(server.roster.folder / "01-P01")
    with served(Study.read(Roster.read(server.roster.folder))) as again:
        assert again.roster.present == []
        assert again.roster.study is not None
        assert again.roster.study.positions == [None]


def test_pages_of_a_study_bring_what_they_need(server: ClassServer) -> None:
    for page, inside in (("/", b"of the study"), ("/step/", b"step.js"), ("/step/step_items.js", b"textContent")):
        status, text = asked(server, page)
        assert (status, inside in text) == (200, True)
