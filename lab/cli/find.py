"""`lab find`: sub-tasks that are found in a problem."""

import sys
from typing import Annotated, Any

import typer

from lab.cli import deferred
from lab.cli.options import Json, Port, ProblemName, Seed, ShowPage, ToolboxPlace
from lab.cli.output import console, show
from lab.errors import BadInput, counted


def find(
    problem: ProblemName,
    method: Annotated[
        str, typer.Option("--method", help="How bottlenecks are looked for: spectral, betweenness or paths.")
    ] = "spectral",
    episodes: Annotated[
        int,
        typer.Option("--episodes", min=1, max=1_000_000, help="Episodes in whose moves bottlenecks are looked for."),
    ] = 20,
    yes: Annotated[bool, typer.Option("--yes", help="Ask nothing and accept every proposed sub-task.")] = False,
    page: ShowPage = False,
    port: Port = 0,
    seed: Seed = 0,
    toolbox: ToolboxPlace = None,
    as_json: Json = False,
) -> None:
    """Find sub-tasks, such as the doorways between rooms, in a learner's own moves; learn the ways to them, and keep them.

    In a terminal it shows each proposed sub-task on the map, and asks: enter accepts it, no refuses it, any other word is its
    name. With --page, a page shows them and takes the names. With --yes, and in a pipe, all are accepted.
    """
    if yes and page:
        raise BadInput("--yes beside --page: with --yes nothing is asked: leave one of them away")
    subject = deferred.subject_of(deferred.LessonOptions(problem, seed=seed).complete())
    place = deferred.Toolbox(toolbox)
    place.check()
    finding = deferred.found(subject.prepare(seed), method, episodes, seed, subject.settings.learner.max_steps)
    accepted = {proposal.states: proposal.name for proposal in finding.proposals}
    if finding.proposals and not as_json:
        mdp, groups = finding.problem.mdp, [proposal.states for proposal in finding.proposals]
        for text in (
            deferred.map_of(mdp, finding.experience.neighbours(), groups),
            deferred.proposals_text(mdp, [(proposal.name, proposal.states) for proposal in finding.proposals]),
        ):
            if text:
                console().print(text, markup=False)
    if finding.proposals and page:
        with deferred.FindingPage(finding, port) as shown:
            console().print(f"page: {shown.url}\nfrom another machine: {shown.hint}", soft_wrap=True)
            accepted = shown.accepted()
            shown.tell(f"The ways to {counted(len(accepted), 'sub-task')} are being learned.")
            document = _learned(finding, accepted, place)
            shown.tell(deferred.gain_text(document))
    else:
        if finding.proposals and not yes and sys.stdin.isatty():
            reader = deferred.default_reader(console(), moves=False)
            accepted = deferred.accepted_by(finding.proposals, reader, console())
        document = _learned(finding, accepted, place)
    show(document, as_json, deferred.subtask_summary)


def _learned(finding: Any, accepted: dict[Any, str], place: "deferred.Toolbox") -> dict[str, Any]:
    """The document after the ways to the accepted sub-tasks were learned."""
    document, _ = deferred.learned(finding, accepted, place)
    return document
