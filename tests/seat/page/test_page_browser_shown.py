"""What the teaching seat shows in a real browser: layers, drawings, orders, the receipt, a phone. Skipped without Chromium."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from copy import deepcopy
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lab.advice.entries import Entry
from lab.advice.receipt import receipt
from lab.learning.physics import PHYSICS
from lab.learning.physics.environment import PhysicsEnvironment
from lab.learning.requests import AdviceRequest, Reason, TooSlow
from lab.learning.session_events import AdviceGiven, AdviceRequested, EpisodeEnded, Improvement
from lab.learning.settings import GateSettings
from lab.mdp import TabularMDP, grid, optimal_values
from lab.seat.page.teaching_page import SeatPage
from lab.sequencing.search import Reference, SequenceRequest
from lab.sequencing.simulate.follow import follow
from lab.sequencing.simulate.run import Run
from lab.tasks.task_file import load_cell
from lab.teaching.events import SequencingBegan

if TYPE_CHECKING:
    from playwright.sync_api import Page

Until = Callable[["Page", str], None]


def ask(page: SeatPage, request: AdviceRequest) -> "Future[Any]":
    """Ask in a thread: the browser has this one."""
    return ThreadPoolExecutor(1).submit(page.ask, request)


def test_nothing_is_loaded_from_elsewhere(tab: "Page", page: SeatPage, until: Until) -> None:
    asked: list[str] = []
    broken: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.on("console", lambda message: broken.append(message.text))
    tab.reload()
    until(tab, "document.querySelector('#chair.yours')")
    own = f"http://127.0.0.1:{page.port}/"
    assert len(asked) >= 8
    assert [url for url in asked if not url.startswith((own, own.replace("http", "ws"), "data:", "blob:"))] == []
    assert broken == []  # the browser's rules were kept
    later = "() => new Promise((done) => setTimeout(() => { try { done(eval('1')); } catch (reason) { done(reason.name); } }))"
    assert tab.evaluate(later) == "EvalError"


# ---- other questions


def space() -> TabularMDP:
    labels = ("left", "right", "backward", "forward", "down", "up")
    return grid((3, 2, 3), np.zeros((3, 2, 3), bool), (0, 0, 1), (2, 1, 2), action_labels=labels)


def test_a_space_is_shown_in_layers(tab: "Page", page: SeatPage, until: Until) -> None:
    mdp = space()
    request = AdviceRequest(
        mdp=mdp,
        q=[[0.0] * 6 for _ in range(18)],
        state=mdp.start,
        episode=1,
        step=1,
        own=5,
        reason=Reason(),
        allowed=range(mdp.n_actions),
    )
    asked = ask(page, request)
    until(tab, "document.getElementById('layer-name').textContent === '1 of 0–2: robot'")
    tab.fill("#layer", "2")
    until(tab, "document.getElementById('layer-name').textContent === '2 of 0–2: goal'")
    tab.keyboard.press("Escape")  # leaves the slider
    tab.keyboard.press("PageUp")
    assert asked.result(20) == 5
    tab.click("#layer-robot")
    until(tab, "document.getElementById('layer-name').textContent === '1 of 0–2: robot'")


class Drawing:
    def picture(self, state: int) -> str:
        return "\x1b[43m \x1b[0m|A\n<b>|B"


def test_an_environments_own_drawing_is_shown_as_text(tab: "Page", page: SeatPage, until: Until) -> None:
    goal = np.array([False, False, True])
    mdp = TabularMDP(np.ones((3, 2), np.int32), np.zeros((3, 2)), goal, goal, 0, ("pick-up", "drop-off"))
    asked = ask(
        page,
        AdviceRequest(
            mdp=mdp,
            q=[[0.0] * 2] * 3,
            state=0,
            episode=1,
            step=1,
            own=0,
            environment=Drawing(),
            allowed=range(mdp.n_actions),
        ),
    )
    until(tab, "!document.getElementById('picture').hidden")
    assert tab.text_content("#picture") == " |A\n<b>|B\n"
    assert tab.locator("#picture .bg-3").count() == 1
    assert tab.is_hidden("#map")
    tab.keyboard.press("2")
    assert asked.result(20) == 1


def test_the_car_is_drawn_on_its_hill(tab: "Page", page: SeatPage, until: Until) -> None:
    place = PhysicsEnvironment(PHYSICS["MountainCar-v0"])
    place.point = [-0.7, 0.03]
    state, mdp = place.physics.bounds.number(place.point), place.mdp
    asked = ask(
        page,
        AdviceRequest(
            mdp=mdp,
            q=[[0.0] * 3] * mdp.n_states,
            state=state,
            episode=1,
            step=1,
            own=0,
            environment=place,
            allowed=range(3),
        ),
    )
    until(tab, "!document.getElementById('shapes').hasAttribute('hidden')")
    assert tab.is_hidden("#picture")
    assert tab.locator("#shapes circle.body").count() == 2
    hill, car = (tab.locator(f"#shapes {part}").first.bounding_box() for part in (".ground", "polygon.body"))
    assert hill is not None
    assert car is not None
    assert hill["width"] > 400.0
    assert hill["x"] < car["x"] < hill["x"] + 0.5 * hill["width"]  # in the left half
    tab.keyboard.press("3")
    assert asked.result(20) == 2


def test_the_order_is_advised(tab: "Page", page: SeatPage, until: Until) -> None:
    run = follow(load_cell("toast-case-1").cell(3), [1])
    request = SequenceRequest(
        run=run,
        allowed=run.allowed(),
        own=1,
        episode=30,
        reason=TooSlow(0.012, 0.05),
        improvement=Improvement(0.012, 606.0, 613.4),
        step=2,
        state=0,
        made=(1,),
    )
    page.hear(SequencingBegan(100, Reference(213.0, True, "A*"), GateSettings()))
    ThreadPoolExecutor(1).submit(page.ask, replace(request, run=follow(run.cell, ()), allowed=(1, 2, 3), made=()))
    until(tab, "document.querySelectorAll('#moves button:enabled').length === 3")
    tab.keyboard.press("1")
    until(tab, "!document.querySelector('#moves button:enabled')")
    asked = ThreadPoolExecutor(1).submit(page.ask, request)
    until(tab, "document.getElementById('says').textContent.includes('57 s: the robot is at toaster')")
    until(tab, "document.querySelectorAll('#bars g rect').length === 3")
    tab.click("#moves >> text=toast 2")
    assert asked.result(20) == 2


def test_a_pallets_move_is_no_carry(tab: "Page", page: SeatPage, until: Until) -> None:
    run = Run(load_cell("fms").cell(("rook",)))
    page.hear(SequencingBegan(100, None, GateSettings()))
    made = list[int]()
    while run.allowed():
        request = SequenceRequest(
            run=deepcopy(run),
            allowed=run.allowed(),
            own=run.allowed()[0],
            episode=1,
            reason=Reason(),
            step=1,
            state=0,
            made=tuple(made),
        )
        ThreadPoolExecutor(1).submit(page.ask, request)
        made.append(run.allowed()[0])
        carries = run.move(made[-1]).carries
        until(tab, "document.querySelector('#moves button:enabled')")
        tab.keyboard.press("1")
        until(tab, "!document.querySelector('#moves button:enabled')")
        if carries == "pallet":
            break
        assert tab.is_hidden("#work [data-kind=pallet]")
    assert carries == "pallet"
    ThreadPoolExecutor(1).submit(page.ask, replace(request, run=run, allowed=run.allowed() or (1,), made=tuple(made)))
    until(tab, "document.querySelectorAll('#bars .k-pallet').length === 1")
    assert tab.is_visible("#work [data-kind=pallet]")
    assert "carries an empty pallet" in (tab.text_content("#bars .k-pallet title") or "")


def test_the_receipt_is_shown(tab: "Page", page: SeatPage, until: Until) -> None:
    """Of two questions one was answered: right, which was best."""
    mdp = grid((1, 3), np.zeros((1, 3), bool), (0, 0), (0, 2), action_labels=("up", "down", "left", "right"))
    entries: list[Entry] = [
        AdviceRequested(1, None, None, None),
        AdviceGiven(1, 1, 0, 3, 3),
        AdviceGiven(1, 2, 1, None, 0),
    ]
    entries.append(EpisodeEnded(1, 2, True, 1, None, True))
    page.receipt(receipt(entries, mdp, optimal_values(mdp, 0.9)).to_json())
    page.finished("The lesson is over.")
    until(tab, "document.getElementById('says').textContent === 'The lesson is over.'")
    until(tab, "!document.getElementById('receipt').hidden")
    shown = tab.inner_text("#receipt")
    assert "It asked in\n1 episode, about 2 steps" in shown
    assert "With advice\n1 step, 1 its own choice, too" in shown
    assert "Not followed\n1: nothing was said" in shown
    assert "Not the best\n0 of 1" in shown


def test_everything_has_a_name_and_a_phone_has_no_sideways_scrolling(tab: "Page", page: SeatPage, until: Until) -> None:
    mdp = grid((2, 3), np.zeros((2, 3), bool), (0, 0), (1, 2), action_labels=("up", "down", "left", "right"))
    ask(
        page, AdviceRequest(mdp=mdp, q=[[0.0] * 4] * 6, state=0, episode=1, step=1, own=3, allowed=range(mdp.n_actions))
    )
    until(tab, "document.querySelector('#moves button:enabled')")
    until(tab, "document.querySelector('#grid').getAttribute('aria-label')")
    nameless = "b => !(b.getAttribute('aria-label') || b.textContent).trim()"
    assert tab.evaluate(f"() => [...document.querySelectorAll('button')].filter({nameless}).length") == 0
    assert (tab.get_attribute("#grid", "aria-label") or "").startswith(
        "Grid of 2 rows and 3 columns, the robot in row 1"
    )
    assert tab.get_attribute("#question", "role") == "status"
    tab.set_viewport_size({"width": 390, "height": 844})
    until(tab, "document.documentElement.scrollWidth <= 390")
    assert tab.evaluate("Math.min(...[...document.querySelectorAll('#moves button')].map(b => b.offsetHeight))") >= 44
