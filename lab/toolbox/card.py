"""A policy's card in Markdown: what it does, where and how it was learned, and how it performed since."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import mean
from typing import Any

from lab.errors import counted, printable
from lab.toolbox.policy import Policy
from lab.toolbox.versions import EVALUATED

Event = Mapping[str, Any]  # "time", "what", and facts; see the toolbox's log
_PLUMBING = ("time", "what", "hash", "version")  # keys of an event that are no facts
_SHOWN = 20  # the most events that a card lists, the last ones
_ENDS = 5  # episodes at each end of the curve that are averaged


@dataclass(frozen=True)
class Telling:
    """The contents of a card that are not in the policy.

    what: the sub-task in words; sha256: of the policy's file; file: its name, beside the card; bring_in: the command that imports
    it; pictures: file by content ("learning curve", "value map"); events: of its log.
    """

    what: str
    sha256: str
    file: str
    bring_in: str
    pictures: Mapping[str, str] = field(default_factory=dict)
    events: Sequence[Event] = ()


def card(policy: Policy, telling: Telling) -> str:
    """The card's Markdown."""
    sections = {
        "What it is": _facts(policy, telling),
        "How it was learned": _learning(policy, telling),
        "What each state is worth": _values(policy, telling),
        "How it did since": since(telling.events),
        "How to use it": _use(policy, telling),
        "What it does not promise": _limits(policy, telling),
    }
    head = f"# {plain(policy.name)}\n\n{plain(_sentence(telling.what))}\n"
    return "\n".join([head, *(f"## {title}\n\n{text}\n" for title, text in sections.items())])


def plain(text: str) -> str:
    """The text with Markdown and HTML characters escaped, in one line."""
    return re.sub(r"([\\`*<>|\[\]&])", r"\\\1", printable(text))


def last_evaluation(events: Sequence[Event]) -> Event | None:
    """The last event with a complete evaluation, None if there is none."""
    told = [event for event in events if _tells_success(event)]
    return told[-1] if told else None


def _tells_success(event: Event) -> bool:
    measured = {"task", "seed", "scenes", "successes", "success_percent", "ci95"}
    return event["what"] == EVALUATED and all(event.get(name) is not None for name in measured)


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _facts(policy: Policy, telling: Telling) -> str:
    states, actions = policy.q.shape
    shape = f", a grid of {' x '.join(map(str, policy.shape))}" if policy.shape else ""
    rows = {
        "sub-task": policy.subtask,
        "states": f"{states}{shape}",
        "actions": f"{actions}: {', '.join(policy.action_labels)}",
        "learned in": ", ".join(
            filter(None, [policy.task, policy.scene, policy.arm and f"arm {policy.arm}", f"seed {policy.seed}"])
        ),
        "its path": _path_length(policy),
        "learner": _settings(policy.learner),
        "gate (when it asks)": _settings(policy.gate),
        "advisor": _advice(policy),
        "warm-started from": policy.parent or "nothing: it was learned from the beginning",
        "created": f"{policy.created[:16].replace('T', ' ')} UTC with {_settings(policy.versions)}",
        "problem's signature": policy.signature,
        "SHA-256 of its file": telling.sha256,
    }
    return "\n".join(["| | |", "|---|---|", *(f"| {name} | {plain(value)} |" for name, value in rows.items())])


def _settings(settings: Mapping[str, Any]) -> str:
    """Names and values in one line; for "learner" and "gate" only the value."""
    return ", ".join(
        str(value) if name in ("learner", "gate") else f"{name} {value}" for name, value in settings.items()
    )


def _path_length(policy: Policy) -> str:
    """The lengths of the learned and of the shortest path."""
    length = "it does not reach the goal" if policy.final_steps is None else counted(policy.final_steps, "step")
    if policy.optimal_steps is not None:
        length += f", the shortest takes {policy.optimal_steps}"
    return f"{length}: {'solved' if policy.solved else 'not solved'}"


def _advice(policy: Policy) -> str:
    if not policy.helped_steps:
        return f"{policy.advisor}: no step was helped"
    asked, helped = counted(policy.requests, "episode"), counted(policy.helped_steps, "helped step")
    return f"{policy.advisor}: asked in {asked} of {len(policy.curve)}, {helped}"


def _learning(policy: Policy, telling: Telling) -> str:
    lines = _picture(telling, "learning curve", "steps of each episode")
    curve = policy.curve
    if not curve:
        return "It has no learning curve."
    ends = f"{mean(curve[:_ENDS]):.1f} steps in its first {_ENDS} episodes, {mean(curve[-_ENDS:]):.1f} in its last"
    few = len(curve) <= _ENDS
    took = f"{', '.join(map(str, curve))} steps" if few else f"on average {ends}"
    guided = sum(policy.guided)
    text = f"{lines}{counted(len(curve), 'episode')}, {guided} of them guided by the advisor: {took}."
    most = policy.learner.get("max_steps")
    return text if most is None else f"{text} One that is broken off after {most} counts as {most + 1}."


def _values(policy: Policy, telling: Telling) -> str:
    lines = _picture(telling, "value map", "value of each cell, and the move that is rated best there")
    if not lines:
        return "Its states are no grid, so that there is no map of them."
    tried = int((policy.visits.sum(axis=1) > 0).sum())
    return (
        f"{lines}Colours: the value of the best move, max Q; signs: that move; grey: never visited. "
        f"It has visited {tried} of {counted(len(policy.q), 'state')}."
    )


def _picture(telling: Telling, name: str, shows: str) -> str:
    """The Markdown of the picture and an empty line, "" if there is no picture."""
    return f"![{name}: {shows}]({telling.pictures[name]})\n\n" if name in telling.pictures else ""


def since(events: Sequence[Event]) -> str:
    """The events of the log as a list in Markdown, the last one last."""
    if not events:
        return "Nothing is noted of it since it was learned."
    lines = [f"- {_happened(event)}" for event in events[-_SHOWN:]]
    if len(events) > _SHOWN:
        lines.insert(0, f"- {counted(len(events) - _SHOWN, 'earlier event')}")
    return "\n".join(lines)


def _happened(event: Event) -> str:
    """One event in a line."""
    when = plain(str(event["time"])[:16].replace("T", " "))
    if "version" in event:
        when += f", version {plain(str(event['version']))}"
    if (
        event["what"] == EVALUATED
        and {"scenes", "successes", "success_percent", "ci95", "task", "seed"} <= event.keys()
    ):
        low, high = event["ci95"]
        text = (
            f"evaluated in physics in {counted(event['scenes'], 'drawn scene')} of {event['task']} from seed "
            f"{event['seed']}: {event['successes']} succeeded, {event['success_percent']:.0f} % "
            f"(95 % interval {low:.0f} to {high:.0f})"
        )
    else:
        facts = [_fact(name.replace("_", " "), value) for name, value in event.items() if name not in _PLUMBING]
        text = f"{event['what']}{': ' if facts else ''}{', '.join(facts)}"
    return f"{when}: {plain(text)}"


def _fact(name: str, value: object) -> str:
    """A fact in words; for True only its name."""
    if isinstance(value, bool):
        return name if value else f"not {name}"
    return f"{name} {value}"


def _use(policy: Policy, telling: Telling) -> str:
    state = f"state {policy.start}"
    return f"""Into a toolbox, where `lab run` finds it for its own problem, and for others in which its path is free and short:

```sh
{telling.bring_in}
```

Without the lab, in Python:

```python
{python_lines(policy, telling.file)}
```

That prints the move that it makes in {state}, where its path begins."""


def python_lines(policy: Policy, file: str) -> str:
    """Five lines of Python that read the file with safetensors alone, and print the best action in the start."""
    return f"""import json
from safetensors import safe_open
with safe_open({json.dumps(file)}, framework="numpy") as model:
    q, actions = model.get_tensor("q"), json.loads(model.metadata()["action_labels"])
print(actions[q[{policy.start}].argmax()])"""


def _limits(policy: Policy, telling: Telling) -> str:
    limits = [
        "It is a table for one problem, the one with its signature. Where something else stands in the way its states mean "
        "something else, and what it does there was not learned.",
        "It was learned, and is carried out, in simulation with an approximate model of an arm. Nothing is known of a real one.",
        "The move that is rated best in a state that was seldom visited may be no good.",
    ]
    if not policy.solved:
        limits.insert(0, "It is not solved: see its path above.")
    if last_evaluation(telling.events) is None:
        limits.append("It was not evaluated in other scenes yet: lab toolbox evaluate does that.")
    return "\n".join(f"- {limit}" for limit in limits)
