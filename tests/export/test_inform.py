"""INFORM II job files: a job by hand, any job there and back, and what is said of a line that is wrong."""

import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.export.inform import (
    Call,
    Comment,
    Dout,
    InformJob,
    InformPosition,
    InformWait,
    Instruction,
    MoveJ,
    MoveL,
    Timer,
    read_job,
)

JOB = InformJob(
    "M001",
    "slice 1: plate to toaster",
    "2026/11/22 21:00",
    (
        InformPosition((500.0, -100.0, 300.0, 180.0, 0.0, 90.0), (0, 0, 0, 0, 0, 0, 0, 0)),
        InformPosition((500.0, -100.0, 150.5, 180.0, 0.0, 90.0), (0, 0, 0, 0, 0, 0, 0, 0)),
        InformPosition((500.0, -100.0, 300.0, 180.0, 0.0, 90.0), (0, 0, 0, 0, 1, 0, 0, 0)),
    ),
    (
        MoveJ(0, 10.0),
        Comment("toaster done"),
        InformWait(1),
        MoveL(1, "V", 250.0, 0),
        Call("CLOSE"),
        Timer(0.5),
        MoveL(2, "VR", 90.0, 1),
        Dout(2, False),
    ),
)
TEXT = """\
/JOB
//NAME M001
//POS
///NPOS 3,0,0,0,0,0
///TOOL 0
///POSTYPE ROBOT
///RECTAN
///RCONF 0,0,0,0,0,0,0,0
C00000=500.000,-100.000,300.000,180.00,0.00,90.00
C00001=500.000,-100.000,150.500,180.00,0.00,90.00
///RCONF 0,0,0,0,1,0,0,0
C00002=500.000,-100.000,300.000,180.00,0.00,90.00
//INST
///DATE 2026/11/22 21:00
///COMM slice 1: plate to toaster
///ATTR SC,RW
///GROUP1 RB1
NOP
MOVJ C00000 VJ=10.00
'toaster done
WAIT IN#(1)=ON
MOVL C00001 V=250.0 PL=0
CALL JOB:CLOSE
TIMER T=0.50
MOVL C00002 VR=90.0 PL=1
DOUT OT#(2) OFF
END
"""


def test_a_job_is_written_as_the_thesis_has_it() -> None:
    assert JOB.text() == TEXT.replace("\n", "\r\n")


def test_a_job_is_read_whatever_its_lines_end_with() -> None:
    assert read_job(TEXT, "M001.JBI") == read_job(JOB.text(), "M001.JBI") == JOB


def test_the_thesiss_own_job_is_read() -> None:
    """POLICY1 of Appendix VI, with the positions of stations 3 and 9."""
    text = "/JOB\n//NAME POLICY1\n//POS\n///NPOS 3,0,0,0,0,0\n///TOOL 0\n///POSTYPE PULSE\n///PULSE\n"
    text += "C00000=-32661,-208,4629,-1195,-1475,8985\nC00001=-32661,-2931,-11835,-1207,6782,9085\n"
    text += "C00002=-32661,-208,4629,-1195,-1475,8985\n//INST\n///DATE 2055/03/01 22:24\n///ATTR SC,RW\n///GROUP1 RB1\n"
    text += "NOP\nMOVJ C00000 VJ=10.00\nMOVJ C00001 VJ=10.00\nCALL JOB:CLOSE\nTIMER T=1.00\nMOVJ C00002 VJ=10.00\nEND\n"
    job = read_job(text, "POLICY1.JBI")
    assert job.positions[1] == InformPosition((-32661.0, -2931.0, -11835.0, -1207.0, 6782.0, 9085.0))
    assert job.instructions == (MoveJ(0, 10.0), MoveJ(1, 10.0), Call("CLOSE"), Timer(1.0), MoveJ(2, 10.0))
    assert job.text() == text.replace("\n", "\r\n")


def scaled(digits: int, most: int) -> st.SearchStrategy[float]:
    """Numbers with so many digits behind the point."""
    return st.integers(-most * 10**digits, most * 10**digits).map(lambda n: n / 10**digits)


names = st.from_regex(r"[A-Z0-9][A-Z0-9_-]{0,7}", fullmatch=True)
words = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=32).map(str.strip)
bits = st.tuples(*[st.integers(0, 1)] * 8)
rectangular = st.builds(InformPosition, st.tuples(*[scaled(3, 5000)] * 3, *[scaled(2, 180)] * 3), bits)
pulses = st.builds(InformPosition, st.tuples(*[st.integers(-999_999, 999_999).map(float)] * 6))


@st.composite
def jobs(draw: Any) -> InformJob:
    positions = tuple(draw(st.lists(draw(st.sampled_from([rectangular, pulses])), max_size=4)))
    number, positive = st.integers(0, 9999), scaled(2, 600).map(abs)
    kinds: list[st.SearchStrategy[Instruction]] = [
        st.builds(Dout, number, st.booleans()),
        st.builds(InformWait, number),
        st.builds(Timer, positive),
        st.builds(Call, names),
        st.builds(Comment, words),
    ]
    if positions:
        at = st.integers(0, len(positions) - 1)
        kinds.append(st.builds(MoveJ, at, positive))
        kinds.append(st.builds(MoveL, at, st.sampled_from(["V", "VR"]), scaled(1, 1500).map(abs), st.integers(0, 8)))
    instructions = tuple(draw(st.lists(st.one_of(kinds), max_size=6)))
    return InformJob(draw(names), draw(words), "2026/11/22 21:00", positions, instructions)


@given(jobs())
def test_any_job_comes_back(job: InformJob) -> None:
    read = read_job(job.text(), "job")
    assert read == job
    assert read.text() == job.text()


WRONG = [
    ("/JOB", "/JOBS", "line 1: '/JOBS', wanted /JOB"),
    ("//NAME M001", "//NAME a name", "line 2: '//NAME a name', wanted //NAME and up to 8 capital letters and digits"),
    ("///NPOS 3,", "///NPOS 4,", "line 13: '//INST', wanted C00003= and six numbers"),
    ("///POSTYPE ROBOT", "///POSTYPE BASE", "line 6: '///POSTYPE BASE', wanted ///POSTYPE PULSE or ROBOT"),
    ("///RCONF 0,0,0,0,0,0,0,0\n", "", "line 8: a position before any ///RCONF"),
    ("300.000,180.00,0.00,90.00\nC00001", "300.000,180.00,0.00\nC00001", "line 9: 'C00000=500.000,-100.000,300.000,"),
    ("C00001=", "C00003=", "line 10: 'C00003=500.000"),
    (
        "///DATE 2026/11/22",
        "///DATE 22.11.2026",
        "line 14: '///DATE 22.11.2026 21:00', wanted ///DATE yyyy/mm/dd hh:mm",
    ),
    ("MOVJ C00000", "MOVX C00000", "unknown instruction 'MOVX' (M001.JBI, line 19): did you mean 'MOV"),
    ("MOVJ C00000 VJ=10.00", "MOVJ C00000 V=10.00", "line 19: 'MOVJ C00000 V=10.00' is not how MOVJ is written here"),
    ("MOVL C00001", "MOVL C00007", "line 22: 'MOVL C00007 V=250.0 PL=0': the job has 3 positions"),
    ("PL=0", "PL=9", "line 22: 'MOVL C00001 V=250.0 PL=9' is not how MOVL"),
    ("IN#(1)=ON", "IN#(1)=PERHAPS", "line 21: 'WAIT IN#(1)=PERHAPS' is not how WAIT"),
    ("END\n", "", "line 27: the file ends before END"),
    ("END\n", "END\nNOP\n", "line 28: something follows END"),
]


@pytest.mark.parametrize(("right", "wrong", "said"), WRONG)
def test_a_wrong_line_is_named(right: str, wrong: str, said: str) -> None:
    assert right in TEXT
    with pytest.raises(BadInput, match=re.escape(said)) as told:
        read_job(TEXT.replace(right, wrong, 1), "M001.JBI")
    assert "M001.JBI, line " in str(told.value)
