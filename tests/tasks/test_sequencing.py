"""The search that a file asks for."""

from lab.sequencing.cell.chance import NO_CHANCE, Chance
from lab.sequencing.search import Search, SrlSettings
from lab.tasks.sequencing import search_for
from lab.tasks.task_file import load_cell


def test_a_search_as_the_file_says_or_changed() -> None:
    settings = load_cell("toast-case-2").sequencing.model_copy(
        update={"episodes": 7, "alpha": 0.2, "discount": 0.8, "beta": 2.0, "reward_factor": "A", "state": "stations"}
    )
    srl = SrlSettings(0.2, 0.8, 2.0, "A", "pairs", "stations")
    assert search_for(settings) == Search(7, "makespan", NO_CHANCE, srl)
    changed = search_for(settings, episodes=3, objective="robot-idle", chance=Chance())
    assert changed == Search(3, "robot-idle", Chance(), srl)
