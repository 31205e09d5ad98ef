"""`lab.find`: sub-tasks that are found in a problem."""

from collections.abc import Callable
from dataclasses import dataclass
from tempfile import TemporaryDirectory
from typing import Any

from lab.api.options import ToolboxOrPlace, check_common, toolbox_of
from lab.errors import BadInput, check_value
from lab.learning.bottlenecks import Bottleneck
from lab.teaching.found_subtasks import Proposal, found, learned
from lab.teaching.subjects import Teachable, subject_from
from lab.toolbox.policy import Policy
from lab.view.subtask_summary import map_of

Accept = Callable[[Proposal], bool | str]


@dataclass(frozen=True, eq=False)
class FoundSubtasks:
    """The sub-tasks that were found in a problem.

    proposals: all that were proposed, each with `name` and `states`; policies: the learned ways to the accepted ones, by name.
    document: the dict that `lab find --json` prints, with the gain; map: the map of a grid, on which the proposals are marked
    1, 2 and so on, otherwise "".

        >>> import lab
        >>> found = lab.find(lab.world("S..#...\\n...#...\\n.......\\n...#...\\n...#..G"))
        >>> print(found.map)
        S.. ...
        ... ...
        ...1...
        ... ...
        ... ..G
    """

    proposals: tuple[Proposal, ...]
    policies: dict[str, Policy]
    document: dict[str, Any]
    map: str

    def __str__(self) -> str:
        accepted = sum(one["accepted"] for one in self.document["proposed"])
        return f"{self.document['problem']}: {accepted} of {len(self.proposals)} proposed sub-tasks, {len(self.policies)} ways"


def find(
    problem: Teachable,
    *,
    method: str = "spectral",
    episodes: int = 20,
    accept: Accept | None = None,
    seed: int = 0,
    toolbox: ToolboxOrPlace = None,
) -> FoundSubtasks:
    """The sub-tasks, such as the doorways between rooms, that are found in a learner's own moves, and the ways to them.

    problem: as in `lab.teach`; its moves are certain and in a table.
    method: how they are proposed, "spectral", "betweenness" or "paths"; episodes: in whose moves they are looked for.
    accept: called with each proposal; returns whether it is accepted, or its new name; None: all are.
    seed: of all randomness. toolbox: keeps the ways; None (default): they are not saved.

    Raises BadInput for an unknown method or a name that two sub-tasks have, and if steps of the problem are by chance.

        >>> import lab
        >>> found = lab.find(lab.world("S..#...\\n...#...\\n.......\\n...#...\\n...#..G"), accept=lambda one: "hall")
        >>> [one["name"] for one in found.document["proposed"]], len(found.policies)
        (['hall'], 2)
    """
    check_common("lab.find", seed=seed, sessions=episodes)
    check_value("method", method, str, "lab.find")
    if accept is not None and not callable(accept):
        raise BadInput(f"accept {accept!r} (lab.find): wanted a function of a proposal")
    subject = subject_from(problem)
    finding = found(subject.prepare(seed), method, episodes, seed, subject.settings.learner.max_steps)
    names: dict[Bottleneck, str] = {}
    for proposal in finding.proposals:
        answer = True if accept is None else accept(proposal)
        if answer:
            names[proposal.states] = answer if isinstance(answer, str) else proposal.name
    with TemporaryDirectory() as nowhere:
        box = toolbox_of(toolbox, nowhere)
        document, kept = learned(finding, names, box)
        policies = {way["saved_as"]: policy for way, policy in zip(document["ways"], kept, strict=True)}
    groups = [proposal.states for proposal in finding.proposals]
    drawn = map_of(finding.problem.mdp, finding.experience.neighbours(), groups)
    return FoundSubtasks(finding.proposals, policies, document, drawn)
