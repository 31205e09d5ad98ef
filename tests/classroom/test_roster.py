"""The roster of a class: who joins, by which name, and what is kept of it."""

import errno
import json
import stat
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.classroom import roster as roster_module
from lab.classroom.roster import FILE, LETTERS, NAME_LENGTH, Full, Pupil, Roster, StudyEntry, clean_name, hash_of
from lab.errors import BadInput
from lab.operating_system import WINDOWS
from lab.teaching.lesson_options import LessonOptions


def roster(folder: Path, lesson: LessonOptions, most: int = 3, typed: bool = False, seed: int = 0) -> Roster:
    made = Roster.new(folder, [lesson, lesson], seed, most, typed)
    made.write()
    return made


def joined(roster: Roster, name: str = "") -> tuple[Pupil, str]:
    found = roster.join(roster.code, name)
    assert found is not None
    return found


def test_who_joins_gets_a_number_a_name_and_a_key_of_which_a_hash_is_kept(
    tmp_path: Path, lesson: LessonOptions
) -> None:
    made = roster(tmp_path / "a", lesson)
    first, key = joined(made)
    second, other = joined(made)
    assert (first.number, second.number) == (1, 2)
    assert first.name != second.name
    assert made.of_key(key) == first
    assert made.of_key(other) == second
    assert made.of_key(key + "x") is made.of_key("") is None
    text = (tmp_path / "a" / FILE).read_text()
    assert key not in text
    assert hash_of(key) in text
    assert Roster.read(tmp_path / "a") == made


def test_pseudonyms_depend_on_the_seed_alone(tmp_path: Path, lesson: LessonOptions) -> None:
    one, two, three = (roster(tmp_path / name, lesson, seed=seed) for name, seed in (("1", 5), ("2", 5), ("3", 6)))
    names = [[joined(made, "Eve")[0].name for _ in range(3)] for made in (one, two, three)]
    assert names[0] == names[1] != names[2]
    assert "Eve" not in str(names)


def test_a_typed_name_is_kept_where_the_class_wants_it(tmp_path: Path, lesson: LessonOptions) -> None:
    made = roster(tmp_path / "a", lesson, typed=True)
    assert [joined(made, name)[0].name for name in ("Zoë <b>", "Zoë b")] == ["Zoë b", "Zoë b 2"]
    assert joined(made, "///")[0].name.count(" ") == 1  # a pseudonym


@pytest.mark.parametrize("code", ["", "x", "aaaaaa", "é", "\0"])
def test_a_wrong_code_makes_no_pupil(tmp_path: Path, lesson: LessonOptions, code: str) -> None:
    made = roster(tmp_path / "a", lesson)
    assert made.join(code) is None
    assert made.pupils == []


def test_a_code_may_be_typed_in_capitals_and_is_of_letters_that_differ(tmp_path: Path, lesson: LessonOptions) -> None:
    made = roster(tmp_path / "a", lesson)
    assert made.join(f" {made.code.upper()} ") is not None
    assert not {*made.code} - {*LETTERS}
    assert not {*"01ilo"} & {*LETTERS}


def test_a_full_class_takes_nobody(tmp_path: Path, lesson: LessonOptions) -> None:
    made = roster(tmp_path / "a", lesson, most=1)
    joined(made)
    with pytest.raises(Full, match="1 seat"):
        made.join(made.code)
    assert len(made.pupils) == 1


def test_a_pupil_goes_on_to_a_lesson_that_there_is(tmp_path: Path, lesson: LessonOptions) -> None:
    made = roster(tmp_path / "a", lesson)
    joined(made)
    made.move({1: 1})
    assert Roster.read(tmp_path / "a").pupils[0].lesson == 1
    for number, wrong in ((1, 2), (1, -1), (2, 0), (0, 0)):
        with pytest.raises(BadInput):
            made.move({number: wrong})


def test_what_cannot_be_written_has_not_happened(
    tmp_path: Path, lesson: LessonOptions, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Roster.new(tmp_path / "a", [lesson, lesson], 0, 3, False)
    made.study = StudyEntry("0" * 64)
    made.admit("key", "P01")
    before = replace(made, pupils=[*made.pupils])

    def full(path: Path, content: bytes) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(roster_module, "write_whole", full)
    for change in (
        lambda: made.join(made.code),
        lambda: made.admit("another", "P02"),
        lambda: made.move({1: 1}),
        lambda: made.remove(1),
        lambda: made.retire(1),
    ):
        with pytest.raises(OSError, match="No space"):
            change()
        assert made == before


def test_a_removed_pupil_has_no_key_and_leaves_the_name_to_another_one(tmp_path: Path, lesson: LessonOptions) -> None:
    made = roster(tmp_path / "a", lesson, typed=True)
    first, key = joined(made, "Eve")
    made.remove(1)
    assert made.of_key(key) is made.of_key("") is None
    assert made.present == []
    second, _ = joined(made, "Eve")
    assert (second.number, second.name) == (2, first.name)
    assert Roster.read(tmp_path / "a") == made
    with pytest.raises(BadInput, match="pupil 3"):
        made.remove(3)


@pytest.mark.skipif(WINDOWS, reason="rights of POSIX")
def test_nobody_else_reads_the_folder_of_a_class(tmp_path: Path, lesson: LessonOptions) -> None:
    made = roster(tmp_path / "a", lesson)
    assert stat.S_IMODE(made.folder.stat().st_mode) == 0o700


def test_who_withdraws_leaves_a_number_and_the_next_one_gets_the_position(
    tmp_path: Path, lesson: LessonOptions
) -> None:
    made = Roster.new(tmp_path / "a", [lesson], 0, 3, False)
    made.study = StudyEntry("0" * 64)
    assert [made.admit(f"key {n}", f"P0{n}")[1] for n in (1, 2, 3)] == [0, 1, 2]
    with pytest.raises(Full):
        made.admit("key 4")
    made.retire(2)
    assert made.of_key("key 2") is None
    assert made.admit("key 4", "P04") == (Pupil(4, "P04", hash_of("key 4")), 1)
    assert [pupil.number for pupil in made.present] == [1, 3, 4]
    assert made.study.positions == [0, None, 2, 1]
    assert Roster.read(tmp_path / "a") == made


def test_a_class_that_is_no_study_is_kept_as_before(tmp_path: Path, lesson: LessonOptions) -> None:
    made = roster(tmp_path / "a", lesson)
    assert "study" not in json.loads((tmp_path / "a" / FILE).read_text())
    assert made.study is None


def test_a_class_is_never_written_over(tmp_path: Path, lesson: LessonOptions) -> None:
    roster(tmp_path / "a", lesson)
    with pytest.raises(BadInput, match="holds a class"):
        roster(tmp_path / "a", lesson)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("format", "teaching-lab class 9"),
        ("pupils", [{"number": 2, "name": "a", "key_hash": "", "lesson": 0}]),
        ("pupils", [{"number": 1, "name": "../..", "key_hash": "", "lesson": 0}]),
        ("pupils", [{"number": 1, "name": "a", "key_hash": "", "lesson": 2}]),
        ("pupils", [{"number": 1}]),
        ("pupils", 3),
        ("pupils", [{"number": n, "name": "a", "key_hash": "", "lesson": 0} for n in range(1, 5)]),
        ("pupils", [{"number": n, "name": "a", "key_hash": "", "lesson": 0, "removed": True} for n in range(1, 902)]),
        ("lessons", [{"subtask": 5}]),
        ("lessons", "x"),
        ("lessons", []),
        ("lessons", [{"subtask": "world-1", "advisors": ["llm:http://127.0.0.1:1/v1#x"]}]),
        ("port", "80"),
        ("port", 70000),
        ("most", 0),
        ("seed", -1),
        ("code", "../.."),
        ("study", {"protocol_sha256": "x", "positions": [0]}),
        ("study", {"protocol_sha256": 3}),
    ],
)
def test_a_damaged_class_is_refused_in_one_line(tmp_path: Path, lesson: LessonOptions, key: str, value: object) -> None:
    roster(tmp_path / "a", lesson)
    path = tmp_path / "a" / FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    with pytest.raises(BadInput) as refused:
        Roster.read(tmp_path / "a")
    assert "\n" not in str(refused.value)


def test_a_folder_without_a_class_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="holds no class"):
        Roster.read(tmp_path)


@given(st.text())
def test_a_clean_name_is_short_and_a_part_of_a_path(name: str) -> None:
    clean = clean_name(name)
    assert len(clean) <= NAME_LENGTH
    assert clean == clean_name(clean)
    assert not {*clean} & {*"/\\.:<>&\"'\n\0"}
