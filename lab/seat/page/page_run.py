"""A whole run, or a sequencer's sessions, in the panel of the teaching page: phases, skills, times, the order, the moves."""

from dataclasses import replace

from lab.seat.event_text import PHASES, lesson_parts, move_text, sequence_parts
from lab.seat.page.page_order import bars_of
from lab.seat.page.page_state import MOST_LINES, Known, Learning, Progress
from lab.sequencing.cell.schedule import EpisodeSequenced
from lab.teaching.events import (
    Event,
    MoveMade,
    MoveRetried,
    MoveTimed,
    PhaseBegan,
    RecordSkipped,
    SequenceFound,
    SequencingBegan,
    SkillReady,
)


def hear_run(known: Known, event: Event) -> None:
    """Take over what happens in a run: a line in the panel, the moves so far, the costs of a sequencer's episodes."""
    match event:
        case PhaseBegan():
            title = PHASES.get(event.name, event.name)
            lines = () if known.progress is None else known.progress.lines
            known.progress = Progress(title, event.parts, 0, lines)
            _say(known, title)
            if event.name == "carry out":
                known.moves = []
        case SequencingBegan():
            known.work, known.advised_episodes = None, set()
            optimal = None if event.reference is None else event.reference.bound
            known.begin(
                Learning(
                    "The order of the transfers",
                    "order",
                    "s",
                    gate=event.gate,
                    episodes=event.episodes,
                    optimal=optimal,
                )
            )
        case EpisodeSequenced():
            known.learning.curve.add(event.cost, event.episode in known.advised_episodes)
            known.changed("curve")
        case RecordSkipped():
            _say(known, f"skipped: {event.why}")
        case MoveRetried():
            _say(known, f"failed, trying again: {event.why}")
        case SkillReady():
            _say(known, f"{event.lesson.source} {event.name}: {', '.join(lesson_parts(event.lesson))}", done=1)
        case MoveTimed():
            _say(known, f"{event.name}: {event.seconds:.2f} s", done=1)
        case SequenceFound():
            _say(known, " ".join(sequence_parts(event)), done=1)
        case MoveMade():
            known.moves.append(event.move)
            known.work = bars_of(known.moves)
            known.changed("work")
            _say(known, f"{event.move.drop_s:.1f} s: {move_text(event.move)}", done=1)


def _say(known: Known, line: str, done: int = 0) -> None:
    before = known.progress or Progress()
    lines = (*before.lines[1 - MOST_LINES :], line)
    known.progress = replace(before, done=before.done + done, lines=lines)
    known.changed("progress")
