"""Peers: who knows nothing says nothing, each judges each, the same seed gives the same result."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from lab.advice.table_level import SILENT
from lab.errors import BadInput
from lab.learning.problem import Problem
from lab.learning.session import Session
from lab.learning.session_events import AdviceGiven, AdvisorDropped, Event
from lab.learning.settings import GateSettings, LearnerSettings
from lab.mdp import grid
from lab.teaching.peers import MOST, GroupResult, Peer, PeerGroup, PeerPlan, matched_states

LEFT, RIGHT = 0, 1
LEARNER = LearnerSettings(episodes=6, max_steps=200)
ALWAYS, NEVER = GateSettings("always"), GateSettings("never")


def corridor(length: int = 3, axes: int = 1) -> Problem:
    """From the first to the last cell of a row."""
    shape = (1,) * (axes - 1) + (length,)
    labels = [f"{way} {axis}" for axis in range(axes - 1) for way in ("less", "more")] + ["left", "right"]
    start, goal = (0,) * axes, (0,) * (axes - 1) + (length - 1,)
    return Problem("corridor", "push", grid(shape, np.zeros(shape, bool), start, goal, action_labels=labels))


def group(
    roles: Sequence[str | None] = (None, None),
    gate: GateSettings = ALWAYS,
    seed: int = 0,
    problem: Problem | None = None,
    learner: LearnerSettings = LEARNER,
    **more: Any,
) -> PeerGroup:
    return PeerGroup([PeerPlan(problem or corridor(), learner, gate, role) for role in roles], seed, **more)


def facts(result: GroupResult) -> list[dict[str, Any]]:
    return [peer.to_json() | {"steps": peer.session.steps.tolist()} for peer in result.peers]


def test_who_knows_nothing_says_nothing_and_who_has_been_there_says_it() -> None:
    told: list[tuple[int, Event]] = []
    peers = group(tell=lambda number, event: told.append((number, event)))
    first, second = peers.peers
    assert [first.knows(state) for state in range(3)] == [None, None, None]
    first.session.play(1)
    assert [first.knows(state) for state in range(3)] == [RIGHT, RIGHT, None]  # the goal is over
    assert [[*first.path(state)] for state in range(3)] == [[1, 2], [2], []]
    assert [event.action for _, event in told if isinstance(event, AdviceGiven)] == [None] * first.moves
    told.clear()
    second.session.play(1)
    assert [event.action for _, event in told if isinstance(event, AdviceGiven)] == [RIGHT, RIGHT]
    assert (second.moves, second.session.steps) == (2, [2])
    results = [peer.result(interrupted=False) for peer in (first, second)]
    assert [(peer.others[0].asked, peer.others[0].answered) for peer in results] == [(first.moves, 0), (2, 2)]
    assert results[1].others[0].trust == 0.75  # 1 + 2 good answers of 2 + 2


def test_a_path_that_was_never_walked_is_not_known() -> None:
    first, _ = group(learner=LearnerSettings(episodes=1, max_steps=1)).peers
    first.session.play(1)
    assert [first.knows(state) for state in range(3)] == [None, None, None]


def test_the_better_of_two_known_moves_is_named() -> None:
    blocked = np.zeros((2, 2), bool)
    square = Problem(
        "square", "push", grid((2, 2), blocked, (0, 0), (1, 1), action_labels=["up", "down", "left", "right"])
    )
    first, _ = group(problem=square, learner=LearnerSettings(episodes=40)).peers
    for episode in range(1, 41):
        first.session.play(episode)
    assert first.knows(0) == max((1, 3), key=lambda action: first.session.q[0][action])


def test_the_same_seed_gives_the_same_and_each_peer_has_a_stream_of_its_own() -> None:
    results = [facts(group((None,) * 3, seed=seed, problem=corridor(5)).run()) for seed in (1, 1, 2)]
    assert results[0] == results[1] != results[2]
    alone = [facts(group((None,) * 3, NEVER, seed, problem=corridor(5)).run()) for seed in (1, 2)]
    streams = [peer["steps"] for peers in alone for peer in peers]
    assert len({tuple(steps) for steps in streams}) == 6


def test_a_peer_whose_gate_never_asks_learns_as_alone() -> None:
    peers = group(gate=NEVER)
    draws = [peer.session.draw for peer in group(gate=NEVER).peers]
    alone = [Session(corridor().mdp, LEARNER, NEVER, None, draw).run() for draw in draws]
    for peer, session in zip(peers.run().peers, alone, strict=True):
        assert peer.session.steps.tolist() == session.steps.tolist()
        assert np.array_equal(peer.session.q, session.q)
        assert [(other.asked, other.trust) for other in peer.others] == [(0, 0.5)]


def test_a_wrong_peer_is_dropped_and_a_right_one_is_not() -> None:
    dropped: list[tuple[int, str]] = []

    def tell(number: int, event: Event) -> None:
        if isinstance(event, AdvisorDropped):
            dropped.append((number, event.advisor))

    learner = LearnerSettings(episodes=20, max_steps=30)
    result = group((None, None, "wrong"), problem=corridor(6), learner=learner, tell=tell).run()
    assert dropped == [(1, "peer 3"), (2, "peer 3")]
    for peer in result.peers[:2]:
        assert [other.dropped for other in peer.others] == [False, True]
        assert peer.session.final_steps == 5
    assert result.peers[2].others[0].answered > 0  # it asks, and learns, as everybody does


def test_an_expert_may_answer_for_a_peer_and_a_person_may_not() -> None:
    result = group((None, "expert")).run()
    assert result.peers[0].session.steps.tolist() == [2] * 6
    assert group((None, "none")).run().peers[0].session.helped_steps == 0
    with pytest.raises(BadInput, match="role 'terminal' of peer 2"):
        group((None, "terminal"))
    with pytest.raises(BadInput, match="role 'praise:expert' of peer 2: it judges moves"):
        group((None, "praise:expert"))


def test_cells_match_by_their_place_relative_to_the_goal() -> None:
    short, four, long = (corridor(length).mdp for length in (3, 4, 5))
    assert matched_states(four, short) == [1, 2, 3]
    assert matched_states(four, long) == [SILENT, 0, 1, 2, 3]
    assert matched_states(four, four) == [0, 1, 2, 3]
    assert matched_states(four, corridor(axes=2).mdp) == [SILENT] * 3


def test_a_peer_whose_path_is_out_of_reach_says_nothing() -> None:
    reach = np.array([True, False, True])  # from state 0 its path leads through 1, from 1 to the goal
    asker = PeerPlan(corridor(), LEARNER, ALWAYS, reach=reach)
    first, second = PeerGroup([PeerPlan(corridor(), LEARNER, ALWAYS), asker], 0).peers
    first.session.play(1)
    heard: list[tuple[int, int | None]] = []
    tell = lambda event: heard.append((event.state, event.action)) if isinstance(event, AdviceGiven) else None  # noqa: E731
    second.session.tell = tell
    second.session.play(1)
    assert {*heard} == {(0, None), (1, RIGHT)}


def test_other_problems_are_matched_by_their_cells_or_not_at_all() -> None:
    def asked(asker: Problem) -> list[int | None]:
        peers = PeerGroup([PeerPlan(problem, LEARNER, ALWAYS) for problem in (corridor(4), asker)], 0)
        peers.peers[0].session.play(1)
        told = peers.peers[1]
        told.session.tell = lambda event: answers.append(event.action) if isinstance(event, AdviceGiven) else None
        answers: list[int | None] = []
        told.session.play(1)
        return answers

    assert asked(corridor(3)) == [RIGHT, RIGHT]
    assert {*asked(corridor(3, axes=2))} == {None}


def test_a_peer_stops_at_its_moves_and_at_its_episodes() -> None:
    result = group(gate=NEVER, learner=LearnerSettings(episodes=50, max_steps=1)).run(most_moves=3)
    assert [(len(peer.session.steps), peer.moves) for peer in result.peers] == [(3, 3)] * 2
    plans = [PeerPlan(corridor(), LearnerSettings(episodes=n), NEVER) for n in (1, 4)]
    assert [len(peer.session.steps) for peer in PeerGroup(plans, 0).run().peers] == [1, 4]


def test_ctrl_c_keeps_what_was_learned() -> None:
    def stop(peer: Peer) -> None:
        if (peer.number, peer.session.episode) == (1, 3):
            raise KeyboardInterrupt

    result = group().run(stop)
    assert [(len(peer.session.steps), peer.session.interrupted) for peer in result.peers] == [(3, True), (2, True)]


def test_the_best_is_solved_then_short_then_soon() -> None:
    result = group((None, "expert"), learner=LearnerSettings(episodes=30)).run()
    assert result.best.session.solved
    merits = [(not peer.session.solved, peer.session.final_steps or 99, peer.moves) for peer in result.peers]
    assert result.best is result.peers[merits.index(min(merits))]


def test_a_group_has_2_to_16_peers_and_a_goal() -> None:
    for count in (1, MOST + 1):
        with pytest.raises(BadInput, match=rf"peers {count} \(--peers\): allowed 2 to 16"):
            group((None,) * count)
    endless = Problem.from_arrays([[[0.5, 0.5]] * 2] * 2, [[0, 1], [1, 0]], horizon=5)
    with pytest.raises(BadInput, match="it has no goal to which a peer could know a path"):
        group(problem=endless)
