"""Clones of what somebody demonstrates who reads the words alone, and of the script: `python -m devtools.told_teacher`.

A stand-in for a person is told what the page of `lab clone --demonstrator person` says, and nothing else. It answers with one
command a second. For each seed it gives demonstrations; two students are cloned, one from these and one from as many by the
scripted teacher, and each is measured in the same episodes.
"""

import re
from math import hypot
from typing import Annotated

import typer

from lab.cloning.person import PersonRollouts, Situation
from lab.cloning.rounds import EVALUATING, CloningOptions, seeds_for
from lab.cloning.skill_problem import SkillProblem
from lab.cloning.student import Student
from lab.cloning.takeover_command import TakeoverCommand, command_of
from lab.recordings.episode import Recording

SKILLS = ("grasp", "place")
NEAR_CM, TURNED_DEG = 0.7, 4.0  # over the part, and turned as it is
ABOVE_CM = 4.0  # where it halts
REACHED_CM = 0.5  # from the height at which the fingers close or open


def by_the_words(seen: Situation) -> TakeoverCommand:
    """Goes over the part, or its place, and turns; then down; then closes the fingers, or opens them; then up."""
    ahead, left, up, turn = (
        -float(number) if towards in ("back", "to the right", "below", "turned to the right") else float(number)
        for number, towards in re.findall(r"([\d.]+) (?:cm|degrees) ([a-z ]+)", seen.where)
    )
    takes, are_closed = "lifted" in seen.wanted, "are closed" in seen.fingers
    if takes == are_closed:
        return command_of("up 6")
    if hypot(ahead, left) > NEAR_CM or abs(turn) > TURNED_DEG:
        moves = (
            f"{'ahead' if ahead > 0 else 'back'} {abs(ahead):.1f}",
            f"{'left' if left > 0 else 'right'} {abs(left):.1f}",
        )
        turns = f"turn-{'left' if turn > 0 else 'right'} {abs(turn):.0f}"
        return command_of(" ".join((*moves, turns, f"down {max(0.0, -up - ABOVE_CM):.1f}")))
    if up < -REACHED_CM:
        return command_of(f"down {-up:.1f}")
    return command_of("close" if takes else "open")


def successes(problem: SkillProblem, shown: Recording, options: CloningOptions) -> int:
    """Episodes in which a student of these demonstrations succeeds."""
    student = Student.learn(shown, seed=options.seed)
    return sum(bool(problem(student, seed).success) for seed in seeds_for(options, EVALUATING, options.evaluated))


def told_teacher(
    seeds: Annotated[int, typer.Option("--seeds", min=1, help="Sessions of each skill, from seed 1 on.")] = 3,
) -> None:
    """Prints a line for each session, and one for all."""
    asked, own, scripted, episodes = 0, 0, 0, 0
    for skill in SKILLS:
        problem = SkillProblem("toast", skill)
        for seed in range(1, seeds + 1):
            options = CloningOptions(seed=seed)
            person = PersonRollouts(problem, options.takeover_steps, by_the_words)
            shown = [*person.demonstrations(options)]
            commands = sum(one.questions for one in shown)
            counts = [
                successes(problem, recording, options)
                for recording in (problem.recorded([one.episode for one in shown]), problem.demonstrated(options))
            ]
            asked, own, scripted = asked + commands, own + counts[0], scripted + counts[1]
            episodes += options.evaluated
            told = (
                f"tries {shown[-1].place + 1}, commands {commands}, successes {counts[0]} and by the script {counts[1]}"
            )
            typer.echo(f"{skill}, seed {seed}: {told}, of {options.evaluated} episodes")
        problem.close()
    typer.echo(f"all: commands {asked}, successes {own} and by the script {scripted}, of {episodes} episodes")


if __name__ == "__main__":
    typer.run(told_teacher)
