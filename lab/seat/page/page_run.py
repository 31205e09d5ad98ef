"""Events of a run, or of a sequencer's sessions, in the panel of the teaching page: phases, skills, times, order, moves."""

from dataclasses import replace

from lab.seat.event_text import PARTS_DONE, run_text
from lab.seat.page.page_console import bars_of, changed_by
from lab.seat.page.page_state import MOST_LINES, PageContent, Progress, ShownLesson
from lab.sequencing.search import EpisodeSequenced
from lab.teaching.events import (
    ORDER,
    Event,
    LessonContinued,
    MoveMade,
    OrderLearned,
    PhaseBegan,
    SequencingBegan,
)


def hear_run(known: PageContent, event: Event) -> None:
    """Take over an event of a run: as a line in the panel, a move, or the cost of a sequencer's episode."""
    if known.console is not None:
        known.console.hear(event)
        known.changed(*changed_by(event))
    text, before = run_text(event), known.progress or Progress()
    match event:
        case PhaseBegan():
            before = Progress(text, event.parts, 0, before.lines)
            if event.name == "carry out":
                known.moves = []
        case SequencingBegan():
            known.work = None
            shown = ShownLesson(ORDER, "order", gate=event.gate, episodes=event.episodes, method=event.method)
            if event.reference is not None:
                shown.optimal, shown.proven = event.reference.bound, event.reference.proven
            known.begin(shown)
        case OrderLearned(lines):
            known.learning.learned = lines
            known.changed("lesson")
        case EpisodeSequenced():
            if known.learning.gate is None:  # otherwise the session reports the episode, and whether it was guided
                known.learning.curve.add(event.cost, False)
                known.changed("curve")
        case MoveMade():
            known.moves.append(event.move)
            known.work = bars_of(known.moves)
            known.changed("work")
    if text and not isinstance(event, LessonContinued):  # which is not part of a run
        done = before.done + isinstance(event, PARTS_DONE)
        known.progress = replace(before, done=done, lines=(*before.lines[1 - MOST_LINES :], text))
        known.changed("progress")
