"""A toolbox in any order of saving, promoting, rolling back, removing and restoring does what a few dicts do."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from shutil import rmtree
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule, run_state_machine_as_test

from lab.errors import BadInput
from lab.toolbox.policy import Policy
from lab.toolbox.registry import Toolbox

MakePolicy = Callable[..., Policy]
NAMES = st.sampled_from(["insert", "Grasp it"])


class Name:
    """What is known of one name: hashes kept, in use and removed; which were in use before; how good each is."""

    def __init__(self) -> None:
        self.kept: list[str] = []
        self.worth: dict[str, tuple[bool, int]] = {}
        self.in_use: str | None = None
        self.removed: str | None = None
        self.before: list[str] = []

    def use(self, digits: str) -> None:
        """It is in use now."""
        self.in_use = digits
        if self.before[-1:] != [digits]:
            self.before.append(digits)


class Life(RuleBasedStateMachine):
    make_policy: MakePolicy

    def __init__(self) -> None:
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.box = Toolbox(self.folder)
        self.names = {"insert": Name(), "Grasp it": Name()}

    def teardown(self) -> None:
        assert all(ok for _, ok, _ in self.box.verify())
        rmtree(self.folder)

    @rule(name=NAMES, fill=st.integers(0, 3), solved=st.booleans(), steps=st.integers(3, 5))
    def save(self, name: str, fill: int, solved: bool, steps: int) -> None:
        held = self.names[name]
        saved = self.box.put(self.make_policy(fill, name=name, solved=solved, final_steps=steps))
        held.worth[saved.hash] = (solved, -steps)
        if saved.hash not in held.kept:
            held.kept.append(saved.hash)
        assert saved.version == held.kept.index(saved.hash) + 1
        goes_in = held.in_use is None or held.worth[saved.hash] >= held.worth[held.in_use]
        assert saved.in_use == goes_in
        if goes_in:
            held.use(saved.hash)

    @rule(name=NAMES, number=st.integers(1, 4))
    def promote(self, name: str, number: int) -> None:
        held = self.names[name]
        if number > len(held.kept):
            with pytest.raises(BadInput):
                self.box.promote(name, str(number))
            return
        self.box.promote(name, str(number))
        held.use(held.kept[number - 1])

    @rule(name=NAMES)
    def rollback(self, name: str) -> None:
        held = self.names[name]
        if held.in_use is not None:
            held.before.pop()
        if not held.before:
            with pytest.raises(BadInput):
                self.box.rollback(name)
            held.before = [held.in_use] if held.in_use is not None else []
            return
        held.in_use = held.before[-1]
        assert self.box.rollback(name).hash == held.in_use

    @precondition(lambda self: any(held.in_use for held in self.names.values()))
    @rule(name=NAMES)
    def remove(self, name: str) -> None:
        held = self.names[name]
        if held.in_use is None:
            with pytest.raises(BadInput):
                self.box.remove(name)
            return
        self.box.remove(name)
        held.removed, held.in_use = held.in_use, None

    @rule(name=NAMES)
    def restore(self, name: str) -> None:
        held = self.names[name]
        if held.removed is None or held.in_use is not None:
            with pytest.raises(BadInput):
                self.box.restore(name)
            return
        self.box.restore(name)
        held.use(held.removed)
        held.removed = None

    @rule()
    def come_back(self) -> None:
        self.box = Toolbox(self.folder)

    @invariant()
    def it_is_what_the_dicts_say(self) -> None:
        for box in (self.box, Toolbox(self.folder)):
            rows: dict[str, Any] = {row["name"]: row for row in box.list()}
            in_use = {name: held.in_use for name, held in self.names.items() if held.in_use is not None}
            assert {name: row["hash"] for name, row in rows.items()} == in_use
            for name, held in self.names.items():
                if held.kept:
                    assert list(box.versions(name).kept()) == held.kept
                if held.in_use is not None:
                    assert rows[name]["version"] == held.kept.index(held.in_use) + 1
                    found = box.find("insert", "0123456789abcdef", name)
                    assert found is not None
                    assert (found.solved, -(found.final_steps or 0)) == held.worth[held.in_use]


def test_any_order(make_policy: MakePolicy) -> None:
    Life.make_policy = staticmethod(make_policy)
    run_state_machine_as_test(Life, settings=settings(max_examples=25, stateful_step_count=25, deadline=None))
