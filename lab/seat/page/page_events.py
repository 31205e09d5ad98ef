"""What a session tells, taken over into what the teaching page shows: counts, the curve, and notices in plain words."""

from lab.errors import counted
from lab.learning.events import (
    AdviceEnded,
    AdviceGiven,
    AdviceRejected,
    AdviceRemembered,
    AdviceRequested,
    AdvisorDropped,
    AdvisorReadmitted,
    AdvisorsDisagreed,
    EpisodeEnded,
    Event,
)
from lab.seat.page.page_state import Learning

ENDED = {
    "converged": "The same result again and again: I ask no more.",
    "advisor left": "Advice has ended; I go on alone.",
}

STEP = ("standing", "robot", "slice")
EPISODE = ("standing", "curve", "slice")
GUIDED = (*EPISODE, "notices")
SAID = ("standing", "notices")


def hear(learning: Learning, event: Event) -> tuple[str, ...]:
    """Take an event over; the parts of the document that it has changed. Called for every answer, so it does little."""
    kind = type(event)
    if kind is AdviceGiven:
        return _given(learning, event)  # type: ignore[arg-type]
    if kind is EpisodeEnded:
        return _episode(learning, event)  # type: ignore[arg-type]
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
            learning.notice(_rejected(learning, event), "bad")
        case AdviceEnded():
            learning.verdict = "converged" if event.reason == "converged" else "left"
            learning.notice(f"Episode {event.episode}: {ENDED.get(event.reason, event.reason)}")
        case AdvisorsDisagreed():
            learning.notice(_disagreed(learning, event))
        case AdvisorDropped():
            learning.notice(f"I do not listen to {event.advisor} any more: {_trust(event.trust)}, {event.why}.", "bad")
        case AdvisorReadmitted():
            learning.notice(f"I listen to {event.advisor} again: {_trust(event.trust)}, {event.why}.", "good")
    return SAID


def _given(learning: Learning, event: AdviceGiven) -> tuple[str, ...]:
    if event.action is None:
        learning.skipped += 1
    else:
        learning.taken += 1
        learning.helped_steps += 1
    learning.state = event.state
    return STEP


def _episode(learning: Learning, event: EpisodeEnded) -> tuple[str, ...]:
    learning.curve.add(event.steps, event.guided)
    learning.lately.append(event.steps)
    learning.rate = event.improvement_rate
    if not event.guided:
        return EPISODE
    learning.notices.append(event)
    return GUIDED


def _rejected(learning: Learning, event: AdviceRejected) -> str:
    asked = max(learning.requests, event.misleads)
    return (
        f"Advice did not help in {event.misleads} of {counted(asked, 'episode')}, {event.omega} are tolerated: I go on "
        f"alone. Episode {event.episode} took {counted(event.steps, 'step')}, those before it {event.mean_before:.1f} "
        "on average."
    )


def _disagreed(learning: Learning, event: AdvisorsDisagreed) -> str:
    def named(action: int) -> str:
        return str(action) if learning.mdp is None else learning.mdp.action_labels[action]

    where = f"state {event.state}" if learning.mdp is None else learning.mdp.state_label(event.state)
    said = ", ".join(f"{name} said {named(action)}" for name, action in event.said)
    return f"At {where} you disagreed: {said}. I went {named(event.followed)}."


def _trust(trust: float) -> str:
    return f"trust {trust:.0%}"
