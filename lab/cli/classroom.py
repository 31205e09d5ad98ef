"""`lab class`: many pupils teach in their browsers, and one teacher looks on and helps."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.families import from_files, offers
from lab.cli.options import GateName, Json, LearnerName, Own, Port, Seed, Times, TrustModule
from lab.cli.output import console, show
from lab.errors import BadInput, counted
from lab.lazy import rich

SEATS = 30  # seats of a class


def hold_class(
    lessons: Annotated[
        list[str] | None,
        typer.Argument(
            help="The lessons, in their order: whatever lab teach takes as SUBTASK: {skills}, a world, gym:ID, "
            "./mine.py:Problem, {problems}; or order:TASK, advice on an order, as lab sequence TASK asks for it; or, "
            "alone, operate:TASK, one run by hand in turns, as lab operate TASK.",
            metavar="LESSON...",
            autocompletion=offers("skills", "problems"),
            callback=from_files("problems"),
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for the class: each pupil's sessions, and the table.")
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option("--resume", help="Go on with the class in this folder: all lessons go on where they stopped."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            "--report", help="Write the report and the hand-outs of the class in this folder, and hold no class."
        ),
    ] = None,
    study: Annotated[
        Path | None,
        typer.Option(
            "--study",
            metavar="FILE",
            help="A study with people by this protocol (TOML), instead of a class with lessons.",
        ),
    ] = None,
    pupils: Annotated[int, typer.Option("--pupils", min=1, max=60, help="The number of seats.")] = SEATS,
    teams: Annotated[
        int,
        typer.Option(
            "--teams",
            min=0,
            max=12,
            help="The pupils teach in so many teams, each with one learner that judges whom of them to believe; 0: each alone.",
        ),
    ] = 0,
    turn: Annotated[
        float | None,
        typer.Option(
            "--turn",
            metavar="SECONDS",
            min=0.0,
            max=3600.0,
            help="Length of a turn at operate:TASK; 0, the default: until it is handed over.",
        ),
    ] = None,
    typed_names: Annotated[
        bool, typer.Option("--typed-names", help="Pupils type their names; by default each is given a pseudonym.")
    ] = False,
    task: Annotated[str | None, typer.Option("--task", help="The task that sub-tasks are of; default: toast.")] = None,
    learner: LearnerName = None,
    gate: GateName = None,
    episodes: Annotated[
        int | None, typer.Option("--episodes", min=1, help="Session length; default: the task's.")
    ] = None,
    lan: Annotated[
        str | None,
        typer.Option(
            "--lan",
            metavar="ADDRESS",
            help="This computer's address in the class's network, over TLS; default: this computer alone.",
        ),
    ] = None,
    name: Annotated[
        list[str] | None, typer.Option("--name", help="A host name under which pupils find that address.")
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option("--certificate", help="Certificate (PEM); default: made on the spot.")
    ] = None,
    key: Annotated[Path | None, typer.Option("--key", help="The key of the certificate (PEM).")] = None,
    times: Times = False,
    trust_module: TrustModule = None,
    own: Own = None,
    port: Port = 0,
    seed: Seed = 0,
    as_json: Json = False,
) -> None:
    """A class in browsers: each pupil teaches a learner of their own, and the teacher looks on and helps.

    With --study it is a study with people: participants agree, go through the protocol's arms, and may withdraw.
    Pupils open the printed address and type the code. Their learners go on where they stopped: after a closed lid, a killed
    server, and with --resume.
    """
    given = {
        "LESSON": bool(lessons),
        "--out": out is not None,
        "--typed-names": typed_names,
        "--task": task is not None,
        "--learner": learner is not None,
        "--gate": gate is not None,
        "--episodes": episodes is not None,
        "--seed": seed != 0,
        "--pupils": pupils != SEATS,
        "--teams": teams != 0,
        "--turn": turn is not None,
        "--times": times,
        "--study": study is not None,
        "--resume": resume is not None,
    }
    if report is not None:
        _refuse(given, f"--report {report}", "it is written of a class that is there, and none is held")
        show(deferred.write_report(deferred.Roster.read(report, "--report")), as_json, _report_summary)
        return
    held = None
    if resume is not None:
        why = "a class goes on in its own folder, with its own lessons, options and seats"
        _refuse(given, f"--resume {resume}", why, allowed=("--resume", "--turn", "--times"))
        roster = deferred.Roster.read(resume)
        roster.modules = tuple(trust_module or ())
        if turn is not None:
            roster.turn_s = _checked_turn(turn, roster)
        held = None if roster.study is None else deferred.StudyWithPeople.read(roster)
    elif study is not None:
        if typed_names:
            raise BadInput(
                f"--typed-names beside --study {study}: participants have ids or pseudonyms, and never names"
            )
        why = "lessons, options, seed and seats of a study are in its protocol"
        _refuse(given, f"--study {study}", why, allowed=("--out", "--study", "--times"))
        held = _study(study, out, tuple(trust_module or ()))
        roster = held.roster
    else:
        roster = _new(lessons or [], out, pupils, typed_names, seed, (task, learner, gate, episodes))
        roster.teams, roster.turn_s = _checked_teams(teams, roster), _checked_turn(turn or 0.0, roster)
        roster.modules = tuple(filter(None, map(deferred.module_of, roster.lessons)))
    if times and deferred.is_operation(roster.lessons):
        raise BadInput("--times with a run by hand: nobody is asked anything, so there are no answers with times")
    roster.times = roster.times or times
    _check(roster)
    place = deferred.place_of(lan, name or (), certificate, key)
    said = console()
    with deferred.ClassServer(roster, place, port or roster.port, held) as server:
        for line in deferred.begun_words(server):
            said.print(line, soft_wrap=True, highlight=False)
        if said.is_terminal:
            said.print(rich.text.Text(deferred.code_text(server.join_url)))
        try:
            deferred.attend(server, lambda line: said.print(line, soft_wrap=True, highlight=False))
        except KeyboardInterrupt:
            said.print("the class ends: every lesson is kept")
        document = deferred.closing(server)
    show(document, as_json, _summary)


def _new(
    lessons: list[str], out: Path | None, pupils: int, typed_names: bool, seed: int, options: tuple[Any, ...]
) -> "deferred.Roster":
    if not lessons:
        raise BadInput("no lesson (LESSON...): name what is taught, such as lab class world-1 insert --out monday")
    if out is None:
        raise BadInput("--out is missing: the folder in which the class is kept, such as --out monday")
    task, learner, gate, episodes = options
    if learner is not None and all(lesson.startswith(deferred.ORDER_LESSON) for lesson in lessons):
        raise BadInput(f"--learner {learner}: lessons on an order are learned by srl, and there is no other: remove it")
    wanted: list[deferred.ClassLesson] = []
    for lesson in lessons:
        if lesson.startswith(deferred.OPERATE_LESSON):
            given = {"--task": task, "--learner": learner, "--gate": gate, "--episodes": episodes}
            if named := [option for option, value in given.items() if value is not None]:
                raise BadInput(f"{named[0]} with the lesson '{lesson}': a run by hand has no such option: remove it")
            wanted.append(deferred.operation_named(lesson, seed))
            continue
        if lesson.startswith(deferred.ORDER_LESSON):
            wanted.append(deferred.order_lesson_named(lesson, gate, episodes, seed))
            continue
        is_skill = lesson in deferred.SKILLS
        of = deferred.LessonOptions(
            lesson, task if is_skill else None, None, learner, gate, None, deferred.PUPILS, episodes=episodes, seed=seed
        )
        wanted.append(of)
    deferred.is_operation(wanted)
    return deferred.Roster.new(out, wanted, seed, pupils, typed_names)


def _refuse(given: Mapping[str, bool], beside: str, why: str, allowed: Collection[str] = ()) -> None:
    """Raises BadInput for the first option that was given and is not allowed beside another one."""
    for option, is_given in given.items():
        if is_given and option not in allowed:
            raise BadInput(f"{option} beside {beside}: {why}")


def _study(file: Path, out: Path | None, modules: tuple[str, ...]) -> "deferred.StudyWithPeople":
    """A new study. Raises BadInput for what is wrong in its protocol, and without a folder."""
    if out is None:
        raise BadInput("--out is missing: the folder in which the study is kept, such as --out who-asks")
    held = deferred.StudyWithPeople.new(file, out, lambda lesson: _check_lesson(lesson, str(file), modules))
    held.roster.modules = modules
    return held


def _checked_teams(teams: int, roster: "deferred.Roster") -> int:
    """The number of teams. Raises BadInput for teams in a class that has a lesson on an order, or a run by hand."""
    if teams and deferred.is_operation(roster.lessons):
        name = deferred.name_of(roster.lessons[0])
        raise BadInput(f"--teams {teams} with the lesson '{name}': all pupils operate one run in turns")
    for lesson in roster.lessons if teams else ():
        if lesson.command == "sequence":
            raise BadInput(
                f"--teams {teams} with the lesson '{deferred.name_of(lesson)}': teams advise one table, no order"
            )
    return teams


def _checked_turn(turn: float, roster: "deferred.Roster") -> float:
    """The length of a turn [s]. Raises BadInput for turns in a class without a run by hand."""
    if turn and not deferred.is_operation(roster.lessons):
        raise BadInput(f"--turn {turn:g}: only a run by hand has turns, such as lab class operate:toast")
    return turn


def _check(roster: "deferred.Roster") -> None:
    """Check every lesson before anybody joins. Raises BadInput, also for code that is named in the class's file alone."""
    for lesson in roster.lessons:
        _check_lesson(lesson, f"class '{roster.folder}'", roster.modules)


def _check_lesson(lesson: "deferred.ClassLesson", where: str, modules: tuple[str, ...]) -> None:
    if (module := deferred.module_of(lesson)) and module not in modules:
        raise BadInput(
            f"{where} names the module '{module}', whose code would run: if you trust whoever made it, "
            f"say --trust-module {module}"
        )
    deferred.check_lesson(lesson)


def _report_summary(document: dict[str, Any]) -> str:
    files = document["files"]
    return f"{_taught(document)}; table: {files['table']}; report: {files['report']}; hand-outs: {files['hand_outs']}"


def _summary(document: dict[str, Any]) -> str:
    return f"{_report_summary(document)}; go on with: lab class --resume {document['class']}"


def _taught(document: dict[str, Any]) -> str:
    """What was done in a class, in words."""
    rows, there = document["rows"], counted(len(document["pupils"]), "team" if document["teams"] else "pupil")
    if rows and "delivered" in rows[0]:
        return f"{there}; {rows[0]['delivered']} of {rows[0]['parts']} parts delivered in the run"
    return f"{there}, {counted(len(rows), 'lesson')} taught"
