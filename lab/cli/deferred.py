"""The functions that commands call: each name is loaded when it is first used, so that `lab run --help` loads nothing heavy."""

from typing import TYPE_CHECKING

from lab.lazy import loader

if TYPE_CHECKING:
    from lab.advice.advisors import ADVISORS, MODEL, PAGE_OF, AdvisorName, split_praise
    from lab.advice.answer_times import AnswerTimes
    from lab.advice.entries import Read, read_journal
    from lab.advice.panel import ASKED, DECISIONS
    from lab.api.scenes import SceneRequest as SceneAsked
    from lab.api.scenes import seen
    from lab.audit.audit import audit, kept_evidence
    from lab.classroom.class_lesson import ADVISORS as PUPILS
    from lab.classroom.class_lesson import OPERATE as OPERATE_LESSON
    from lab.classroom.class_lesson import ORDER as ORDER_LESSON
    from lab.classroom.class_lesson import (
        ClassLesson,
        check_lesson,
        is_operation,
        module_of,
        name_of,
        operation_named,
        order_lesson_named,
    )
    from lab.classroom.class_report import write_report
    from lab.classroom.class_server import ClassServer
    from lab.classroom.code_picture import code_text
    from lab.classroom.export import export, exported
    from lab.classroom.holding import attend, begun_words, closing, place_of
    from lab.classroom.roster import Roster
    from lab.classroom.study import Study as StudyWithPeople
    from lab.cloning.kept_cloning import KeptOptions as KeptCloningOptions
    from lab.cloning.kept_cloning import check_new as check_new_cloning
    from lab.cloning.kept_cloning import options_of as cloning_options_of
    from lab.cloning.kept_cloning import rounds_of
    from lab.cloning.person import PersonRollouts
    from lab.cloning.rounds import CloningOptions
    from lab.cloning.skill_problem import SkillProblem
    from lab.export import FORMATS, DatasetFormat
    from lab.export.commands import Path as Lines
    from lab.export.lerobot import RunRecord
    from lab.export.play import deviation
    from lab.export.program import POSITIONS, Options, Program
    from lab.files import check_out, tasks_folder, write_whole
    from lab.gym import parse_name
    from lab.learning.gates import GATES
    from lab.learning.requests import Ask, Request
    from lab.learning.selection import SELECTIONS
    from lab.learning.settings import USUAL
    from lab.learning.updates import UPDATES
    from lab.mentor.conformal import check_share
    from lab.mentor.doubts import DOUBTS, check_rule
    from lab.mentor.mentor import Mentor, parted
    from lab.mentor.takeovers import RULES, RulesCompared, rules_compared
    from lab.optional import require_extra
    from lab.plugins.code_file import is_file_word, take
    from lab.production import load_run
    from lab.production.composer import Conditions
    from lab.production.controls import Controls
    from lab.production.cyclic_job import CyclicOptions, cyclic_named
    from lab.production.evaluation import evaluate, skill_of, task_of
    from lab.production.operation.commands import Done, pace
    from lab.production.operation.desk import Desk, RunDesk
    from lab.production.operation.operated_run import kept_operation, operating_desk
    from lab.production.order_session import sequenced
    from lab.production.publication import CARD, publish, write_card
    from lab.production.run import run as run_task
    from lab.production.run_advice import RunAdvice
    from lab.production.run_film import RunFilm, by_hand_s
    from lab.production.run_journal import RunJournal, is_run, replayed_run
    from lab.production.run_options import RunOptions, begun, kept_task
    from lab.production.run_options import gone_on as run_gone_on
    from lab.recordings.lerobot_read import read as read_recording
    from lab.seat.language_model import language_models
    from lab.seat.lesson_seat import LessonSeat
    from lab.seat.page.finding_page import FindingPage
    from lab.seat.page.takeover_page import TakeoverPage
    from lab.seat.page.teaching_page import SeatPage
    from lab.seat.run_progress import RunProgress
    from lab.seat.team import Team
    from lab.seat.terminal.console_app import OperatorConsole
    from lab.seat.terminal.console_view import PlainConsole
    from lab.seat.terminal.line_reader import default_reader
    from lab.seat.terminal.new_task_questions import ask
    from lab.seat.terminal.prompt import TeachingPrompt
    from lab.seat.terminal.replay_keys import HELP as KEYS_HELP
    from lab.seat.terminal.replay_keys import replay_keys
    from lab.seat.terminal.subtask_questions import accepted_by
    from lab.seat.terminal.takeover_prompt import takeover_prompt
    from lab.sequencing import SEQUENCERS
    from lab.sequencing.cell.objectives import OBJECTIVES
    from lab.sequencing.methods.srl_advised import FITTING
    from lab.skills import SKILLS
    from lab.skills.camera_grids import camera_view
    from lab.skills.cell_outline import outline
    from lab.skills.made_pictures import make_pictures, mat_of
    from lab.skills.new_cell import new_cell
    from lab.skills.prepared_scene import check_task, prepare
    from lab.skills.scored_pictures import parts_seen, score_pictures
    from lab.studies import STUDIES, Study, carried_out, run_study, study_of
    from lab.studies.compared import Compared, compared
    from lab.studies.leaderboard import draw_board, leaderboard
    from lab.studies.people_report import people_compared
    from lab.studies.runner import Job
    from lab.studies.tuning import FILE, Tuning, tuned
    from lab.tasks.cell_file import CellFile, toml_of
    from lab.tasks.grid_world import write_random
    from lab.tasks.instances import INSTANCES, pyjobshop
    from lab.tasks.instances import InstanceRequest as InstanceAsked
    from lab.tasks.new_task import MACHINE, Changes, file_of, new_task
    from lab.tasks.record import write_whole as write_text
    from lab.tasks.robot_fields import MODELS
    from lab.tasks.schedule_table import read_schedule
    from lab.tasks.schema import page_of, schema_of
    from lab.tasks.task import Task
    from lab.tasks.task_file import describe, is_path, load, load_any, load_cell_beside, shipped
    from lab.teaching.events import told_to, unheard
    from lab.teaching.found_subtasks import found, learned
    from lab.teaching.kept_order import OrderSession, OrderSessionOptions, kept_order
    from lab.teaching.kept_order import gone_on as order_gone_on
    from lab.teaching.kept_session import KeptSession, check_new, named_with
    from lab.teaching.lesson import replay as replay_session
    from lab.teaching.lesson import teach as teach_session
    from lab.teaching.lesson_options import DEFAULT_ADVISORS, LessonOptions
    from lab.teaching.named_problems import PROBLEMS
    from lab.teaching.peer_lesson import check_alone as check_peers_alone
    from lab.teaching.peer_lesson import of_tasks as peer_subjects
    from lab.teaching.peer_lesson import teach_peers
    from lab.teaching.session_list import session_rows
    from lab.teaching.step_record import StepRecord, check_libraries
    from lab.teaching.subjects import subject_of
    from lab.teaching.teacher import Teacher
    from lab.toolbox.archive import pack, take_in, unpack
    from lab.toolbox.hub_folder import read_folder
    from lab.toolbox.policy import Policy
    from lab.toolbox.registry import Toolbox
    from lab.toolbox.versions import EVALUATED, Version
    from lab.view.canvas import check_picture
    from lab.view.cell_plan import draw_cell
    from lab.view.clone_plot import success_by_questions
    from lab.view.cyclic_summary import cyclic_summary
    from lab.view.mentor_report import COLUMNS, report_document, report_page, table_lines
    from lab.view.meshcat import LiveView, replay_html
    from lab.view.movie import write_movie
    from lab.view.progress import EscapingConsole, counting
    from lab.view.schedule_scene import scene_of
    from lab.view.subtask_summary import gain_text, map_of, proposals_text, subtask_summary
    from lab.view.summary import (
        audit_summary,
        delivered_in_words,
        grid_summary,
        lesson_summary,
        pictures_summary,
        replay_summary,
        run_replay_summary,
        run_summary,
        sequence_summary,
        study_summary,
        table_of,
    )
    from lab.view.toolbox_summary import log_summary, policy_summary, toolbox_summary, verify_summary
    from lab.vision import Image, View, draw, read_picture, see, write_picture
    from lab.vision.calibration import (
        Calibration,
        Mat,
        calibrate,
        drawn,
        from_corners,
        pinhole,
        read_calibration,
        write_calibration,
    )
    from lab.workers import Workers

TABLE = {
    "lab.advice.advisors": ("AdvisorName", "ADVISORS", "MODEL", "PAGE_OF", "split_praise"),
    "lab.advice.answer_times": ("AnswerTimes",),
    "lab.advice.entries": ("Read", "read_journal"),
    "lab.advice.panel": ("ASKED", "DECISIONS"),
    "lab.api.scenes": ("SceneRequest as SceneAsked", "seen"),
    "lab.audit.audit": ("audit", "kept_evidence"),
    "lab.classroom.class_lesson": (
        "ADVISORS as PUPILS",
        "check_lesson",
        "ClassLesson",
        "is_operation",
        "module_of",
        "name_of",
        "OPERATE as OPERATE_LESSON",
        "operation_named",
        "ORDER as ORDER_LESSON",
        "order_lesson_named",
    ),
    "lab.classroom.class_report": ("write_report",),
    "lab.classroom.class_server": ("ClassServer",),
    "lab.classroom.code_picture": ("code_text",),
    "lab.classroom.export": ("export", "exported"),
    "lab.classroom.holding": ("attend", "begun_words", "closing", "place_of"),
    "lab.classroom.roster": ("Roster",),
    "lab.classroom.study": ("Study as StudyWithPeople",),
    "lab.cloning.kept_cloning": (
        "KeptOptions as KeptCloningOptions",
        "check_new as check_new_cloning",
        "options_of as cloning_options_of",
        "rounds_of",
    ),
    "lab.cloning.person": ("PersonRollouts",),
    "lab.cloning.rounds": ("CloningOptions",),
    "lab.cloning.skill_problem": ("SkillProblem",),
    "lab.export": ("FORMATS", "DatasetFormat"),
    "lab.export.commands": ("Path as Lines",),
    "lab.export.program": ("Options", "POSITIONS", "Program"),
    "lab.export.lerobot": ("RunRecord",),
    "lab.export.play": ("deviation",),
    "lab.files": ("check_out", "tasks_folder", "write_whole"),
    "lab.gym": ("parse_name",),
    "lab.learning.gates": ("GATES",),
    "lab.learning.requests": ("Ask", "Request"),
    "lab.learning.selection": ("SELECTIONS",),
    "lab.learning.settings": ("USUAL",),
    "lab.learning.updates": ("UPDATES",),
    "lab.mentor.conformal": ("check_share",),
    "lab.mentor.doubts": ("DOUBTS", "check_rule"),
    "lab.mentor.mentor": ("Mentor", "parted"),
    "lab.mentor.takeovers": ("RULES", "RulesCompared", "rules_compared"),
    "lab.optional": ("require_extra",),
    "lab.plugins.code_file": ("is_file_word", "take"),
    "lab.production": ("load_run",),
    "lab.production.composer": ("Conditions",),
    "lab.production.controls": ("Controls",),
    "lab.production.cyclic_job": ("cyclic_named", "CyclicOptions"),
    "lab.production.evaluation": ("evaluate", "skill_of", "task_of"),
    "lab.production.operation.commands": ("Done", "pace"),
    "lab.production.operation.desk": ("Desk", "RunDesk"),
    "lab.production.operation.operated_run": ("kept_operation", "operating_desk"),
    "lab.production.order_session": ("sequenced",),
    "lab.production.publication": ("CARD", "publish", "write_card"),
    "lab.production.run": ("run as run_task",),
    "lab.production.run_advice": ("RunAdvice",),
    "lab.production.run_film": ("RunFilm", "by_hand_s"),
    "lab.production.run_journal": ("is_run", "replayed_run", "RunJournal"),
    "lab.production.run_options": ("begun", "kept_task", "gone_on as run_gone_on", "RunOptions"),
    "lab.seat.language_model": ("language_models",),
    "lab.seat.lesson_seat": ("LessonSeat",),
    "lab.seat.team": ("Team",),
    "lab.seat.page.finding_page": ("FindingPage",),
    "lab.seat.page.takeover_page": ("TakeoverPage",),
    "lab.seat.page.teaching_page": ("SeatPage",),
    "lab.seat.run_progress": ("RunProgress",),
    "lab.seat.terminal.console_app": ("OperatorConsole",),
    "lab.seat.terminal.console_view": ("PlainConsole",),
    "lab.seat.terminal.line_reader": ("default_reader",),
    "lab.seat.terminal.new_task_questions": ("ask",),
    "lab.seat.terminal.prompt": ("TeachingPrompt",),
    "lab.seat.terminal.replay_keys": ("HELP as KEYS_HELP", "replay_keys"),
    "lab.seat.terminal.subtask_questions": ("accepted_by",),
    "lab.seat.terminal.takeover_prompt": ("takeover_prompt",),
    "lab.recordings.lerobot_read": ("read as read_recording",),
    "lab.sequencing": ("SEQUENCERS",),
    "lab.sequencing.cell.objectives": ("OBJECTIVES",),
    "lab.sequencing.methods.srl_advised": ("FITTING",),
    "lab.skills": ("SKILLS",),
    "lab.skills.camera_grids": ("camera_view",),
    "lab.skills.cell_outline": ("outline",),
    "lab.skills.made_pictures": ("make_pictures", "mat_of"),
    "lab.skills.new_cell": ("new_cell",),
    "lab.skills.prepared_scene": ("check_task", "prepare"),
    "lab.skills.scored_pictures": ("parts_seen", "score_pictures"),
    "lab.studies": ("carried_out", "run_study", "STUDIES", "Study", "study_of"),
    "lab.studies.compared": ("Compared", "compared"),
    "lab.studies.leaderboard": ("draw_board", "leaderboard"),
    "lab.studies.people_report": ("people_compared",),
    "lab.studies.runner": ("Job",),
    "lab.studies.tuning": ("FILE", "tuned", "Tuning"),
    "lab.tasks.cell_file": ("CellFile", "toml_of"),
    "lab.tasks.grid_world": ("write_random",),
    "lab.tasks.instances": ("InstanceRequest as InstanceAsked", "INSTANCES", "pyjobshop"),
    "lab.tasks.new_task": ("Changes", "file_of", "MACHINE", "new_task"),
    "lab.tasks.record": ("write_whole as write_text",),
    "lab.tasks.robot_fields": ("MODELS",),
    "lab.tasks.schedule_table": ("read_schedule",),
    "lab.tasks.schema": ("page_of", "schema_of"),
    "lab.tasks.task": ("Task",),
    "lab.tasks.task_file": ("describe", "is_path", "load", "load_any", "load_cell_beside", "shipped"),
    "lab.teaching.events": ("told_to", "unheard"),
    "lab.teaching.found_subtasks": ("found", "learned"),
    "lab.teaching.kept_order": ("kept_order", "gone_on as order_gone_on", "OrderSessionOptions", "OrderSession"),
    "lab.teaching.kept_session": ("check_new", "KeptSession", "named_with"),
    "lab.teaching.lesson": ("replay as replay_session", "teach as teach_session"),
    "lab.teaching.lesson_options": ("DEFAULT_ADVISORS", "LessonOptions"),
    "lab.teaching.named_problems": ("PROBLEMS",),
    "lab.teaching.peer_lesson": ("check_alone as check_peers_alone", "of_tasks as peer_subjects", "teach_peers"),
    "lab.teaching.session_list": ("session_rows",),
    "lab.teaching.step_record": ("check_libraries", "StepRecord"),
    "lab.teaching.subjects": ("subject_of",),
    "lab.teaching.teacher": ("Teacher",),
    "lab.toolbox.archive": ("pack", "take_in", "unpack"),
    "lab.toolbox.versions": ("EVALUATED", "Version"),
    "lab.toolbox.hub_folder": ("read_folder",),
    "lab.toolbox.policy": ("Policy",),
    "lab.toolbox.registry": ("Toolbox",),
    "lab.view.canvas": ("check_picture",),
    "lab.view.cell_plan": ("draw_cell",),
    "lab.view.clone_plot": ("success_by_questions",),
    "lab.view.cyclic_summary": ("cyclic_summary",),
    "lab.view.progress": ("counting", "EscapingConsole"),
    "lab.view.mentor_report": ("COLUMNS", "report_document", "report_page", "table_lines"),
    "lab.view.meshcat": ("LiveView", "replay_html"),
    "lab.view.movie": ("write_movie",),
    "lab.view.schedule_scene": ("scene_of",),
    "lab.view.subtask_summary": ("gain_text", "map_of", "proposals_text", "subtask_summary"),
    "lab.view.summary": (
        "audit_summary",
        "delivered_in_words",
        "grid_summary",
        "lesson_summary",
        "pictures_summary",
        "replay_summary",
        "run_replay_summary",
        "run_summary",
        "sequence_summary",
        "study_summary",
        "table_of",
    ),
    "lab.view.toolbox_summary": ("log_summary", "policy_summary", "toolbox_summary", "verify_summary"),
    "lab.vision": ("draw", "Image", "read_picture", "see", "View", "write_picture"),
    "lab.vision.calibration": (
        "calibrate",
        "Calibration",
        "drawn",
        "from_corners",
        "Mat",
        "pinhole",
        "read_calibration",
        "write_calibration",
    ),
    "lab.workers": ("Workers",),
}

if not TYPE_CHECKING:  # hidden from mypy, so that it accepts only the names of the table
    __getattr__ = loader(__name__, TABLE)
