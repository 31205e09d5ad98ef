"""A study's protocol: the steps that follow from it, and every mistake in one line with its place."""

import shutil
from pathlib import Path

import pytest

from lab.classroom.class_lesson import name_of
from lab.classroom.study import Study
from lab.classroom.study_protocol import PlannedStep, StudyProtocol
from lab.errors import BadInput
from lab.teaching.subjects import subject_of
from tests.classroom.scripted import PROTOCOL, study_in

EXAMPLE = Path(__file__).parents[2] / "examples" / "study_with_people.toml"


def test_the_steps_of_an_order() -> None:
    protocol, _ = StudyProtocol.read(PROTOCOL)
    assert protocol.steps(["b", "a"]) == [
        PlannedStep("questionnaire", "last"),
        PlannedStep("lesson", "small.txt", "b", 2),
        PlannedStep("questionnaire", "tlx", "b"),
        PlannedStep("text", "introduction", "a"),
        PlannedStep("lesson", "small.txt", "a", 1),
        PlannedStep("questionnaire", "tlx", "a"),
        PlannedStep("questionnaire", "last"),
    ]


def test_the_lessons_are_those_of_the_arms_with_their_options(tmp_path: Path) -> None:
    lessons = study_in(tmp_path, **{'advisor = "praise:web"': 'advisor = "praise:web"\nseed = 3'}).roster.lessons
    assert [name_of(lesson) for lesson in lessons] == [str(tmp_path / "small.txt")] * 3
    assert [lesson.advisor_names for lesson in lessons] == [("web",), ("praise:web",), ("web",)]
    assert [lesson.seed for lesson in lessons] == [7, 3, 7]
    assert [lesson.to_json()["episodes"] for lesson in lessons] == [2, 2, 2]


def test_the_example_is_a_study_of_three_arms(tmp_path: Path) -> None:
    study = Study.new(EXAMPLE, tmp_path / "study", subject_of)
    assert len(study.protocol.arms) == 3
    assert len(study.protocol.steps(study.protocol.order_at(0))) == 14
    assert not (tmp_path / "study").exists()


def test_the_example_on_the_page_is_a_protocol(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "study-with-people.md").read_text(encoding="utf-8")
    (tmp_path / "study.toml").write_text(page.split("```toml\n")[1].split("```")[0])
    study = Study.new(tmp_path / "study.toml", tmp_path / "study", subject_of)
    assert [arm.name for arm in study.protocol.arms] == ["when-slow", "praise"]


@pytest.mark.parametrize(
    ("before", "after", "line", "said"),
    [
        ("teaching-lab study 1", "teaching-lab study 2", 1, "'teaching-lab study 1'"),
        ("latin-square", "latin-sqare", 4, "did you mean 'latin-square'"),
        ("seed = 7", "sed = 7", 5, "did you mean 'seed'"),
        ("participants = 9", "participants = 0", 6, "greater than or equal to 1"),
        ('consent = "You agree."\n', "", 8, "texts.consent: Field required"),
        ('name = "b"', 'name = "a"', 21, "arm 'a' stands twice"),
        ('name = "c"', 'name = "c/d"', 28, "letters, digits"),
        ('"praise:web"', '"praise:wep"', 25, "did you mean 'praise:web'"),
        ("time_limit_s = 1", 'time_limit_s = "1 s"', 32, "valid integer"),
        ("time_limit_s = 1", "time_limit = 1", 32, "did you mean 'time_limit_s'"),
        ('"nasa-tlx"', '"nasa-tlz"', 36, "did you mean 'nasa-tlx'"),
        ('["after-arm"]', '["after-arms"]', 37, "did you mean 'after-arm'"),
        ('name = "hand"', 'name = "like"', 44, "'like' stands twice"),
        ('options = ["left", "right"]', "points = 3", 44, "a choice item takes options"),
        ('kind = "likert"', 'kind = "lickert"', 43, "did you mean 'likert'"),
        ("most = 20", "most = 0", 45, "greater than or equal to 1"),
    ],
)
def test_a_mistake_is_refused_in_one_line(tmp_path: Path, before: str, after: str, line: int, said: str) -> None:
    text = PROTOCOL.read_text()
    assert before in text
    path = tmp_path / "study.toml"
    path.write_text(text.replace(before, after, 1))
    with pytest.raises(BadInput) as refused:
        StudyProtocol.read(path)
    assert "\n" not in str(refused.value)
    assert said in str(refused.value)
    assert f"{path}: line {line}: " in str(refused.value)


@pytest.mark.parametrize(
    ("before", "after", "line", "said"),
    [
        ('lessons = ["small.txt"]', 'lessons = ["smal.txt"]', 16, "smal.txt"),
        ('lessons = ["small.txt"]', 'lessons = ["insrt"]', 16, "did you mean 'insert'"),
        ('gate = "always"', 'gate = "alway"', 17, "did you mean 'always'"),
        ('gate = "always"', 'learner = "dyna"', 17, "did you mean 'dyna-q'"),
        ('gate = "always"', 'gate = "./mine.py:MyGate"', 17, "--own ./mine.py:MyGate"),
    ],
)
def test_a_lesson_that_cannot_be_taught_is_refused_with_its_line(
    tmp_path: Path, before: str, after: str, line: int, said: str
) -> None:
    study_in(tmp_path)
    text = PROTOCOL.read_text().replace(before, after, 1)
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(BadInput) as refused:
        Study.new(tmp_path / "study.toml", tmp_path / "study", subject_of)
    assert said in str(refused.value)
    assert f"study.toml: line {line}: " in str(refused.value)


def test_a_protocol_is_no_other_file(tmp_path: Path) -> None:
    shutil.copy(Path(__file__), tmp_path / "x.toml")
    for path in (tmp_path / "x.toml", tmp_path / "none.toml", tmp_path):
        with pytest.raises(BadInput, match=path.name):
            StudyProtocol.read(path)
