"""The door of a class: how often something may happen, and who has to wait."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from starlette.requests import Request

from lab.classroom import door
from lab.classroom.door import ALL_WRONG, WRONG, WRONG_S, Door, Often
from lab.classroom.roster import MOST_JOINED, Pupil, Roster
from lab.teaching.lesson_options import LessonOptions


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_what_happens_too_often_may_happen_again_later() -> None:
    twice = Often(2, 10.0)
    for now_s in (0.0, 4.0):
        assert not twice.is_full(now_s)
        twice.happened(now_s)
    assert [twice.is_full(now_s) for now_s in (4.0, 9.9, 10.0)] == [True, True, False]


@pytest.fixture
def roster(tmp_path: Path, lesson: LessonOptions) -> Roster:
    return Roster.new(tmp_path / "class", [lesson], 0, 2, False)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def seated() -> list[Pupil]:
    return []


@pytest.fixture
def entrance(roster: Roster, clock: Clock, seated: list[Pupil]) -> Door:
    def joined(code: str, name: str) -> dict[str, Any] | None:
        if (new := roster.join(code, name)) is None:
            return None
        seated.append(new[0])
        return {"name": new[0].name, "page": f"/desk/?token={new[1]}"}

    return Door(joined, clock)


def asked(entrance: Door, body: bytes, address: str = "192.0.2.1", ends: bool = True) -> int:
    """The status of a request to join from an address; ends: whether its body does."""

    async def receive() -> dict[str, Any]:
        if not ends:
            await asyncio.Event().wait()
        return {"type": "http.request", "body": body}

    scope = {"type": "http", "method": "POST", "headers": [], "client": (address, 1)}

    async def joined() -> int:
        return (await entrance.join(Request(scope, receive))).status_code

    return asyncio.run(joined())


def somebody_waits(entrance: Door) -> bool:
    return entrance.tried


def code(text: str) -> bytes:
    return json.dumps({"code": text}).encode()


def test_an_address_that_tries_codes_waits_a_minute_and_others_do_not(
    entrance: Door, roster: Roster, clock: Clock, seated: list[Pupil]
) -> None:
    assert [asked(entrance, code("wrong")) for _ in range(WRONG)] == [403] * WRONG
    assert asked(entrance, code(roster.code)) == 429
    assert somebody_waits(entrance)
    assert asked(entrance, code(roster.code), "192.0.2.2") == 200
    clock.now_s = WRONG_S
    assert not somebody_waits(entrance)
    assert asked(entrance, code(roster.code)) == 200
    assert [pupil.number for pupil in seated] == [1, 2]


def test_codes_are_limited_whoever_tries_them(entrance: Door, roster: Roster, clock: Clock) -> None:
    statuses = [asked(entrance, code("wrong"), f"192.0.{number // 250}.{number % 250}") for number in range(ALL_WRONG)]
    assert statuses == [403] * ALL_WRONG
    assert asked(entrance, code(roster.code), "198.51.100.1") == 429
    clock.now_s = WRONG_S
    assert asked(entrance, code(roster.code), "198.51.100.1") == 200


def test_a_code_of_no_characters_is_wrong(entrance: Door) -> None:
    assert asked(entrance, b'{"code": "\\ud800"}') == 403


def test_a_body_that_never_ends_is_given_up(entrance: Door, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door, "BODY_S", 0.01)
    assert asked(entrance, b"", ends=False) == 408


def test_a_closed_door_lets_nobody_in_until_it_is_opened(entrance: Door, roster: Roster) -> None:
    entrance.is_open = False
    assert asked(entrance, code(roster.code)) == 403
    assert roster.pupils == []
    entrance.is_open = True
    assert asked(entrance, code(roster.code)) == 200


def test_a_removed_pupil_makes_room_for_another_one(entrance: Door, roster: Roster) -> None:
    assert [asked(entrance, code(roster.code)) for _ in range(3)] == [200, 200, 409]
    roster.remove(1)
    assert asked(entrance, code(roster.code)) == 200
    assert [pupil.number for pupil in roster.present] == [2, 3]


def test_a_class_has_not_more_pupils_in_all_than_there_are_numbers(entrance: Door, roster: Roster) -> None:
    gone = [Pupil(number, "gone", "", removed=True) for number in range(1, MOST_JOINED + 1)]
    roster.pupils.extend(gone)
    assert asked(entrance, code(roster.code)) == 409
