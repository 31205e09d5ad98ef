"""Answers kept as a file: what somebody, a language model for instance, said of states, by their names or numbers."""

from pathlib import Path

from lab.errors import BadInput, unknown
from lab.files import json_of, read_limited
from lab.mdp import TabularMDP

MOST_BYTES = 10_000_000
MOST_DIGITS = 9


def answers_of(path: Path, mdp: TabularMDP) -> dict[int, int]:
    """The action said in each state of a problem, from a JSON object {"state": "action"}; both as labels or as numbers.

    Raises BadInput for a file that cannot be read, is too large or no such object, and for states or actions that there are not.
    """
    try:
        said = json_of(read_limited(path, MOST_BYTES))
    except OSError as error:
        raise BadInput(f"'{path}' cannot be read: {error.strerror}") from None
    except ValueError:
        raise BadInput(f"'{path}' is no JSON: wanted an object of states and actions") from None
    if not isinstance(said, dict) or not said:
        raise BadInput(f'\'{path}\': wanted an object of states and actions, such as {{"(0, 1)": "right"}}')
    states = {mdp.state_label(state): state for state in range(mdp.n_states)}
    actions = {label: action for action, label in enumerate(mdp.action_labels)}
    numbers = {str(action): action for action in actions.values()}
    found = {}
    for name, what in said.items():
        is_number = name.isascii() and name.isdigit() and len(name) <= MOST_DIGITS and int(name) < mdp.n_states
        state = int(name) if is_number else states.get(name)
        if state is None:
            raise unknown("state", name, states, str(path))
        word = str(what) if isinstance(what, str | int | float | None) else f"a {type(what).__name__}"
        if word not in actions and word not in numbers:
            raise unknown("action", word, actions, f"{path}, state {name}")
        found[state] = actions[word] if word in actions else numbers[word]
    return found
