"""A study as tables: a lesson of a participant a row, an answer a row, and a dictionary that names every column."""

import csv
import json
from pathlib import Path
from shutil import copytree

import pytest

from lab.classroom.class_rows import rows_of
from lab.classroom.export import csv_text, export
from lab.errors import BadInput
from tests.classroom.made_study import made_class, made_study, step, taught

PERSON = json.dumps(
    {
        "format": "teaching-lab participant 1",
        "participant": "silver deer",
        "number": 1,
        "order": [],
        "consented": "2026-11-28T19:00:00Z",
        "steps": [step("questionnaire", "tlx", 1, answers={"a": "x"})],
    }
)


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return [*csv.DictReader(file)]


def test_each_lesson_of_a_participant_is_a_row_with_its_questionnaires(tmp_path: Path) -> None:
    document = export(made_study(tmp_path), tmp_path / "out")
    rows = table(tmp_path / "out" / "participants.csv")
    known = [
        (row["participant"], row["arm"], row["position"], row["lesson"], row["state"], row["solved"]) for row in rows
    ]
    assert known == [
        ("silver deer", "a", "1", "1", "over", "true"),
        ("silver deer", "b", "2", "2", "over", "true"),
        ("red owl", "b", "1", "2", "over", "true"),
        ("red owl", "a", "2", "1", "timed out", "false"),
    ]
    assert [row["seconds"] for row in rows] == ["30.0"] * 4
    assert [row["tlx_mean"] for row in rows] == ["25", "25", "25", "30"]
    assert [row["robot_useful"] for row in rows] == ["1", "2", "2", "1"]
    assert [row["after_last_remarks"] for row in rows] == ["'=1+1", "'=1+1", "fine", "fine"]
    assert (document["participants"], document["withdrawn"], document["lessons"]) == (2, 1, 4)
    assert json.loads((tmp_path / "out" / "export.json").read_text())["protocol_sha256"] is not None


def test_each_answer_is_a_row_those_that_were_taken_back_too(tmp_path: Path) -> None:
    export(made_study(tmp_path), tmp_path / "out")
    rows = [
        row
        for row in table(tmp_path / "out" / "answers.csv")
        if (row["participant"], row["arm"]) == ("silver deer", "a")
    ]
    lessons = table(tmp_path / "out" / "participants.csv")
    assert [(row["means"], row["undone"]) for row in rows] == [("move", "true"), *[("move", "false")] * 4]
    assert [(row["episode"], row["step"], row["action"]) for row in rows[1:]] == [
        ("1", "1", "3"),
        ("1", "2", "3"),
        ("2", "1", "3"),
        ("2", "2", "3"),
    ]
    assert (lessons[0]["answers"], lessons[0]["undone"]) == ("4", "1")
    assert json.loads(rows[0]["allowed"]) == [0, 1, 2, 3]
    assert all(float(row["latency_s"]) >= 0 and row["shown"].endswith("Z") for row in rows)


def test_the_dictionary_has_every_column_of_both_tables(tmp_path: Path) -> None:
    export(made_study(tmp_path), tmp_path / "out")
    rows = table(tmp_path / "out" / "dictionary.csv")
    for name in ("participants", "answers"):
        with (tmp_path / "out" / f"{name}.csv").open(newline="") as file:
            head = next(csv.reader(file))
        assert head == [row["name"] for row in rows if row["table"] == name]
    useful = next(row for row in rows if row["name"] == "robot_useful")
    assert (useful["meaning"], useful["allowed"]) == ("It helped.", "whole numbers from 1 to 7; no, yes")
    assert all(row["type"] and row["meaning"] for row in rows)


def test_the_same_folder_gives_the_same_bytes(tmp_path: Path) -> None:
    made = made_study(tmp_path)
    contents = []
    for _ in range(2):
        export(made, tmp_path / "out")
        contents.append({path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()})
    assert contents[0] == contents[1]


def test_a_plain_class_has_no_arms_and_no_questionnaires(tmp_path: Path) -> None:
    made = made_class(tmp_path / "class", ["silver deer"], 1)
    copytree(taught(tmp_path, ["right"] * 4), made / "01-silver-deer" / "lesson-1")
    rows = rows_of(made)
    assert (rows.asked, rows.withdrawn, rows.protocol_sha256) == ({}, 0, None)
    (row,) = rows.lessons
    assert (row["participant"], row["arm"], row["lesson"], row["skill"]) == ("silver deer", None, 1, "small")
    assert (row["episodes"], row["episodes_to_goal"], row["moves_to_goal"]) == (2, 1, 2)
    assert row["began"] <= row["ended"]


def test_a_formula_is_a_text() -> None:
    rows = [{"a": text} for text in ("=1", "+1", "-1", "@x", "\t=1", " =1", "a=1", -1, None, True, "x\ry")]
    cells = csv_text(["a"], rows).split("\n", 1)[1]
    assert cells == "'=1\n'+1\n'-1\n'@x\n'\t=1\n' =1\na=1\n-1\n\"\"\ntrue\n\"x\ny\"\n"


def test_parquet_holds_the_same_rows_with_types(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    export(made_study(tmp_path), tmp_path / "out", parquet=True)
    read = parquet.read_table(tmp_path / "out" / "participants.parquet")
    rows = read.to_pylist()
    assert [row["participant"] for row in rows] == ["silver deer", "silver deer", "red owl", "red owl"]
    assert rows[0]["after_last_remarks"] == "=1+1"
    assert (rows[0]["solved"], rows[0]["seconds"], rows[0]["lesson"]) == (True, 30.0, 1)
    assert (rows[0]["ended"] - rows[0]["began"]).total_seconds() == 30.0
    assert read.schema.field("seconds").metadata[b"unit"] == b"s"
    assert parquet.read_table(tmp_path / "out" / "answers.parquet").num_rows == len(
        table(tmp_path / "out" / "answers.csv")
    )


@pytest.mark.parametrize(
    ("file", "text", "said"),
    [
        ("class.json", "{}", "class.json' (DIR): format: "),
        ("class.json", None, "holds no class"),
        ("01-silver-deer/participant.json", '{"format": "x"}', "participant.json': format = 'x': "),
        ("01-silver-deer/participant.json", PERSON.replace("T19:01", "T99:01"), "participant.json': steps.0.began: "),
        ("01-silver-deer/participant.json", PERSON.replace('"x"', "NaN"), "participant.json': steps.0.answers."),
        ("01-silver-deer/lesson-1/receipt.json", "{", "receipt.json': "),
        ("01-silver-deer/lesson-1/times.jsonl", "{}\n", "times.jsonl': line 1: "),
        ("01-silver-deer/lesson-1/events.jsonl", "x\n", "events.jsonl' (DIR): line 1: "),
    ],
)
def test_a_damaged_folder_is_refused_with_its_file(tmp_path: Path, file: str, text: str | None, said: str) -> None:
    path = made_study(tmp_path) / file
    if text is None:
        path.unlink()
    else:
        path.write_text(text)
    with pytest.raises(BadInput) as refused:
        export(tmp_path / "study", tmp_path / "out")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "out").exists()


def test_a_name_that_leads_elsewhere_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"pupil 1 is .*'../x'"):
        rows_of(made_class(tmp_path / "class", ["../x"], 1))
