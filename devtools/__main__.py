"""Try to break the lab: `python -m devtools PART... [--count N] [--seed N] [--workers N] [--out DIR]` prints a scoreboard.

It needs an environment in which the lab can be imported. With the same folder it continues where it stopped; exit 1 if
anything broke.
"""

from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress

from devtools.audits import PART as AUDITS
from devtools.class_attacks import PART as CLASS
from devtools.ctrl_c import PART as CTRL_C
from devtools.drawn_physics import PART as PHYSICS
from devtools.kills import PART as KILLS
from devtools.mutated_commands import PART as MUTATED_COMMANDS
from devtools.mutations import PART as MUTATIONS
from devtools.page_attacks import PART as REQUESTS
from devtools.parts import Part
from devtools.proofs import PART as PROOFS
from devtools.resources import PART as RESOURCES
from devtools.scoreboard import outcome_line, read_outcomes, show
from devtools.sizes import PART as SIZES

PARTS: dict[str, Part] = {
    "kills": KILLS,
    "mutations": MUTATIONS,
    "mutated-commands": MUTATED_COMMANDS,
    "sizes": SIZES,
    "requests": REQUESTS,
    "class": CLASS,
    "resources": RESOURCES,
    "physics": PHYSICS,
    "audits": AUDITS,
    "proofs": PROOFS,
    "ctrl-c": CTRL_C,
}


def main(
    parts: Annotated[
        list[str] | None, typer.Argument(help=f"which: {', '.join(PARTS)}; all of them if none is named")
    ] = None,
    count: Annotated[
        int | None, typer.Option(min=1, help="attempts of each part; by default as many as a long run makes")
    ] = None,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    workers: Annotated[int, typer.Option(min=1)] = 2,
    out: Annotated[Path, typer.Option(help="folder of the outcomes; attempts that it holds are not repeated")] = Path(
        "devtools-out"
    ),
) -> None:
    """Try to break the lab, and print what held."""
    console = Console(width=160)
    unknown = [name for name in parts or () if name not in PARTS]
    if unknown:
        raise typer.BadParameter(f"{unknown[0]!r}: allowed are {', '.join(PARTS)}")
    chosen = {name: PARTS[name] for name in parts or PARTS}
    for name, part in chosen.items():
        attempts(name, part, count, seed, workers, out.resolve(), console)
    if not show(chosen, out, console):
        raise typer.Exit(1)


def attempts(name: str, part: Part, count: int | None, seed: int, workers: int, out: Path, console: Console) -> None:
    """Make the attempts of a part that its file does not hold yet."""
    room = out / f"{name}-{seed}"
    room.mkdir(parents=True, exist_ok=True)
    available = part.prepare(room, seed)
    most = part.count if part.count is not None else available
    assert most is not None, f"part {name} has no count, and its prepare returns none"
    numbers = range(min(count or most, available or count or most))
    file = out / f"{name}.jsonl"
    todo = [number for number in numbers if number not in read_outcomes(file)]
    with (
        Progress(console=console) as progress,
        ThreadPoolExecutor(workers) as pool,
        file.open("a", encoding="utf-8") as lines,
    ):
        bar = progress.add_task(name, total=len(numbers), completed=len(numbers) - len(todo))
        running = {pool.submit(part.attempt, number, seed, room): number for number in todo}
        try:
            for ended in as_completed(running):
                lines.write(outcome_line(running[ended], ended.result()))
                lines.flush()
                progress.advance(bar)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


if __name__ == "__main__":
    typer.run(main)
