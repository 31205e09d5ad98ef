"""A run's journal: what is written is read again, damage is told with its line, and a run does again what it did."""

import fcntl
import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput, WorkFailed
from lab.production.controls import Held, StopKind, StopsChanged
from lab.production.run_journal import (
    FILE,
    KINDS,
    Commanded,
    DurationsKept,
    Led,
    Met,
    Moved,
    RunBegan,
    RunEnded,
    RunJournal,
    SessionKept,
    SkillKept,
    Stopped,
    line_of,
    read_run,
)

HEAD = RunBegan({"task": "toast", "seed": 3}, "toast", "abc")
MOVED = Moved(4150, "slice 1", "plate", "toaster", 1.5, 17.25)
LED = Led(4500, "transfer a to b", "operator", {"(0, 0)": "right"})
MET = Met(5000, "it lies on its side", "leaves it", "slice 2", "plate")
STOPPED = Stopped(200, [("emergency", "pressed by hand", "operator")])


@pytest.fixture
def journal(tmp_path: Path) -> RunJournal:
    """A journal that was begun, stopped and broken off."""
    journal = RunJournal.begin(tmp_path, HEAD)
    journal.note_stops(StopsChanged(200, (Held(StopKind.EMERGENCY, "pressed by hand"),)))
    journal.note_stops(StopsChanged(300, ()))
    journal.tell(MOVED)
    journal.write(Commanded(4200, "jog +x 10", "operator"))
    journal.tell(MET)
    journal.close()
    return journal


def test_what_was_written_is_read(journal: RunJournal, tmp_path: Path) -> None:
    head, entries, whole = read_run(tmp_path, "DIR")
    assert head == HEAD
    assert entries == (STOPPED, Stopped(300, []), MOVED, Commanded(4200, "jog +x 10", "operator"), MET)
    assert whole == (tmp_path / FILE).stat().st_size


def test_a_run_that_is_gone_on_with_does_again_what_it_did(journal: RunJournal, tmp_path: Path) -> None:
    again = RunJournal.resume(tmp_path)
    assert again.stops() == [
        StopsChanged(200, (Held(StopKind.EMERGENCY, "pressed by hand", "operator"),)),
        StopsChanged(300, ()),
    ]
    assert (again.last_step(), [one.words for one in again.commands()]) == (5000, ["jog +x 10"])
    size = (tmp_path / FILE).stat().st_size
    again.tell(MOVED)
    again.tell(MET)
    assert (tmp_path / FILE).stat().st_size == size  # it was known
    again.tell(RunEnded(1, ""))
    again.close()
    assert read_run(tmp_path, "DIR")[1][-1] == RunEnded(1, "")


def test_what_was_led_is_kept_as_answers_and_held_against_what_is_led_again(tmp_path: Path) -> None:
    journal = RunJournal.begin(tmp_path, HEAD)
    journal.keep_led(LED)
    journal.close()
    (file,) = (tmp_path / "led").iterdir()
    assert json.loads(file.read_text()) == LED.said
    again = RunJournal.resume(tmp_path)
    with pytest.raises(WorkFailed, match="cannot be carried out again"):
        again.keep_led(replace(LED, said={}))
    again.close()
    assert json.loads(file.read_text()) == LED.said


def test_a_run_that_goes_another_way_than_it_did_is_refused(journal: RunJournal, tmp_path: Path) -> None:
    again = RunJournal.resume(tmp_path)
    with pytest.raises(WorkFailed, match=r"cannot be carried out again: in .*it says .*17\.25.*, now comes .*18\.0"):
        again.tell(replace(MOVED, drop_s=18.0))
    again.close()


def test_what_was_cut_off_at_the_end_is_taken_away(journal: RunJournal, tmp_path: Path) -> None:
    path = tmp_path / FILE
    whole = path.read_bytes()
    path.write_bytes(whole + line_of(MOVED).encode()[:30])
    RunJournal.resume(tmp_path).close()
    assert path.read_bytes() == whole


def test_a_run_that_is_over_is_not_gone_on_with(journal: RunJournal, tmp_path: Path) -> None:
    again = RunJournal.resume(tmp_path)
    again.write(RunEnded(2, ""))
    again.close()
    with pytest.raises(BadInput, match=r"is over: look at it again with lab replay"):
        RunJournal.resume(tmp_path)


def test_one_command_at_a_time_writes_it(tmp_path: Path) -> None:
    one = RunJournal.begin(tmp_path, HEAD)
    whole = (tmp_path / FILE).read_bytes()
    for writes in (RunJournal.resume, partial(RunJournal.begin, head=HEAD)):
        with pytest.raises(BadInput, match="another command is writing it"):
            writes(tmp_path)
    assert (tmp_path / FILE).read_bytes() == whole
    assert not (tmp_path / "run-before.jsonl").exists()
    one.close()
    RunJournal.resume(tmp_path).close()


def test_a_journal_that_is_put_aside_while_it_is_opened_is_not_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between its opening and its lock another command has begun a new run in the folder."""
    RunJournal.begin(tmp_path, HEAD).close()
    lock = fcntl.flock

    def overtaken(file: int, how: int) -> None:
        monkeypatch.setattr(fcntl, "flock", lock)
        RunJournal.begin(tmp_path, HEAD).close()
        lock(file, how)

    monkeypatch.setattr(fcntl, "flock", overtaken)
    with pytest.raises(BadInput, match="another command has just put it aside and begun a new one"):
        RunJournal.resume(tmp_path)


def test_a_new_run_puts_the_journal_before_aside(journal: RunJournal, tmp_path: Path) -> None:
    RunJournal.begin(tmp_path, HEAD).close()
    assert read_run(tmp_path, "DIR")[1] == ()
    assert len(read_run(tmp_path / "run-before.jsonl", "DIR")[1]) == 5


def test_without_a_folder_nothing_is_written_and_nothing_known() -> None:
    journal = RunJournal()
    journal.tell(MOVED)
    journal.keep_skill({"name": "grasp"}, None)  # type: ignore[arg-type]
    assert (journal.stops(), journal.skill("grasp"), journal.durations(), journal.last_step()) == ([], None, None, 0)
    journal.close()


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ('{"kind": []}', "kind [] is none of run, session"),
        ('{"kind": "moved", "step": -1}', "part: Field required"),
        (line_of(Stopped(-1, [])), "step -1: wanted 0 to"),
        (line_of(Stopped(1, [("nap", "", "")])), "'nap' is not a valid StopKind"),
        (line_of(SkillKept({"source": "learned"}, "a.safetensors")), "row: it has no name"),
        (line_of(SkillKept({"name": "grasp", "source": "learned"}, "a")), "row: it has no whole number of episodes"),
        (line_of(HEAD), "a second run in one journal"),
        (
            line_of(SkillKept({"name": "grasp", "episodes": 1}, "a")).replace("1", "1e400"),
            "1e400 is too large a number",
        ),
        ("[" * 100_000, "nested too deeply"),
        ("\xff", "kind"),
    ],
)
def test_a_damaged_line_is_told(journal: RunJournal, tmp_path: Path, line: str, why: str) -> None:
    with (tmp_path / FILE).open("ab") as file:
        file.write(line.encode("latin-1") + b"\n")
    with pytest.raises(BadInput) as refused:
        read_run(tmp_path, "DIR")
    text = str(refused.value)
    assert text.startswith(f"journal '{tmp_path / FILE}' (DIR): ")
    assert "\n" not in text
    assert why in text or line == "\xff"


@pytest.mark.parametrize("content", [b"", b"{}\n", line_of(MOVED).encode() + b"\n", b"\x00\n"])
def test_what_does_not_begin_with_a_run_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE).write_bytes(content)
    with pytest.raises(BadInput, match=r"^journal '"):
        RunJournal.resume(tmp_path)


def test_a_folder_without_a_run(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no run was begun there"):
        RunJournal.resume(tmp_path)


@given(
    st.sampled_from(
        [
            MOVED,
            MET,
            LED,
            STOPPED,
            HEAD,
            RunEnded(0, "why"),
            SessionKept("grasp", "/there"),
            DurationsKept({"empty_s": {"a > b": 1.25}}, 3.0),
        ]
    ),
    st.text(max_size=20),
)
def test_every_entry_is_one_line_that_is_read_again(entry: object, text: str) -> None:
    assert type(entry) in KINDS.values()
    met = replace(MET, what=text)
    assert "\n" not in line_of(met)
