"""What a session tells, taken over into what the teaching page shows: counts, the curve, and notices."""

from lab.learning.session_events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRemembered,
    AdviceRequested,
    EpisodeEnded,
    Event,
)
from lab.seat.page.page_state import ShownLesson

STEP = ("standing", "robot", "slice")
EPISODE = ("standing", "curve", "slice", "notices")


def hear(learning: ShownLesson, event: Event) -> tuple[str, ...]:
    """Take an event over; the parts of the document that it has changed. Called for every answer, so it does little."""
    kind = type(event)
    if kind is AdviceGiven:
        return _given(learning, event)  # type: ignore[arg-type]
    if kind is EpisodeEnded:
        return _episode(learning, event)  # type: ignore[arg-type]
    told = learning.text.told(event, learning.mdp)
    match event:
        case AdviceRequested():
            learning.requests += 1
            learning.means = (event.current_mean, event.previous_mean)
            return STEP
        case AdviceRemembered():
            learning.remembered += event.steps
            return STEP
        case AdviceRejected():
            learning.verdict, learning.misleads = "rejected", event.misleads
        case AdviceEnded():
            learning.verdict = "converged" if event.reason == "converged" else "left"
    if told is not None:
        learning.notice(told)
    return ("standing", "notices")


def _given(learning: ShownLesson, event: AdviceGiven) -> tuple[str, ...]:
    if event.action is None:
        learning.skipped += 1
    else:
        learning.taken += 1
        learning.helped_steps += 1
    learning.state = event.state
    return STEP


def _episode(learning: ShownLesson, event: EpisodeEnded) -> tuple[str, ...]:
    learning.curve.add(event.steps, event.guided)
    learning.lately.append(event.steps)
    learning.rate = event.improvement_rate
    if told := learning.text.told(event, learning.mdp):
        learning.notice(told)
    return EPISODE if event.guided else EPISODE[:-1]
