"""Whole commands of the lab against a plain CP-SAT program, in pairs: seconds from the start of the process to the proof.

    python -m devtools.plain_pairs [--seed 1] [--each 5] [--rounds 3] [--seconds 60] [--out FOLDER]

Shops are drawn: job shops, with due dates, flexible, and with vehicles. The plain program (`plain_model.py`) is one that
somebody writes in an hour. Both run in turn in new processes on the same machine; the time before their search counts.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
SAME = 1e-6


@dataclass(frozen=True)
class Kind:
    """A kind of random shop. operations: of each job; choices: the most machines for an operation; vehicles None: no travel."""

    name: str
    jobs: int
    machines: int
    operations: int
    choices: int = 1
    vehicles: int | None = None
    due: bool = False


KINDS = (
    Kind("job shop", 6, 6, 6),
    Kind("job shop, due dates", 5, 4, 4, due=True),
    Kind("flexible job shop", 6, 4, 4, choices=3),
    Kind("job shop, 1 vehicle", 4, 4, 3, vehicles=1),
    Kind("job shop, 2 vehicles", 4, 4, 3, vehicles=2),
    Kind("flexible job shop, 2 vehicles", 4, 4, 3, choices=2, vehicles=2),
    Kind("larger job shop", 10, 10, 10),
    Kind("larger job shop, due dates", 8, 5, 5, due=True),
    Kind("larger flexible job shop", 10, 6, 6, choices=3),
    Kind("larger job shop, 1 vehicle", 5, 4, 4, vehicles=1),
    Kind("larger job shop, 2 vehicles", 6, 4, 4, vehicles=2),
    Kind("larger flexible job shop, 2 vehicles", 6, 4, 4, choices=2, vehicles=2),
)


def random_shop(kind: Kind, seed: int) -> dict[str, Any]:
    """A random shop as `plain_model.py` reads it."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    jobs = []
    for _ in range(kind.jobs):
        first = rng.permutation(kind.machines)[: kind.operations]
        more = [rng.choice(kind.machines, int(rng.integers(1, kind.choices + 1)), replace=False) for _ in first]
        jobs.append(
            [
                {int(m): int(rng.integers(3, 31)) for m in {own_machine, *choices[1:]}}
                for own_machine, choices in zip(first, more, strict=True)
            ]
        )
    points = rng.integers(0, 12, (kind.machines + 1, 2))
    far = 2 + abs(points[:, None] - points[None]).sum(axis=2)
    travel = (far - np.diag(np.diag(far))).tolist()
    longest = [sum(min(times.values()) for times in job) for job in jobs]
    due = [int(work * rng.uniform(1.0, 1.8)) for work in longest]
    return {
        "jobs": jobs,
        "due": due if kind.due else None,
        "travel": None if kind.vehicles is None else travel,
        "vehicles": kind.vehicles,
    }


def shop_files(shop: dict[str, Any], kind: Kind, folder: Path) -> tuple[list[str], Path]:
    """The arguments of `lab sequence` for a shop, and the plain program's file; both files are written to `folder`."""
    plain, jobs = folder / "plain.json", shop["jobs"]
    plain.write_text(json.dumps(shop), encoding="utf-8")
    if kind.due:
        tasks = [(job, times) for job, own in enumerate(jobs) for times in own]
        numbers = [[n for n, (job, _) in enumerate(tasks) if job == number] for number in range(len(jobs))]
        document = {
            "jobs": [{"tasks": own, "due_date": due} for own, due in zip(numbers, shop["due"], strict=True)],
            "resources": [{"type": "machine"} for _ in range(kind.machines)],
            "tasks": [{"job": job} for job, _ in tasks],
            "modes": [
                {"task": n, "resources": [m], "duration": t, "demands": [0]}
                for n, (_, times) in enumerate(tasks)
                for m, t in times.items()
            ],
            "constraints": {
                "end_before_start": [{"task1": a, "task2": b, "delay": 0} for own in numbers for a, b in pairwise(own)]
            },
        }
        file = folder / "shop.json"
        file.write_text(json.dumps(document), encoding="utf-8")
        return [str(file), "--objective", "mean-tardiness"], plain
    file = folder / "shop.fjs"
    rows = [
        f"{len(job)}  " + "  ".join(f"{len(t)} " + " ".join(f"{m + 1} {s}" for m, s in t.items()) for t in job)
        for job in jobs
    ]
    if kind.choices == 1:
        file = file.with_suffix(".txt")
        rows = ["  ".join(f"{m} {s}" for t in job for m, s in t.items()) for job in jobs]
    file.write_text("\n".join([f"{len(jobs)} {kind.machines}", *rows]) + "\n", encoding="utf-8")
    if shop["travel"] is None:
        return [str(file)], plain
    names = ["LU", *(f"M{n}" for n in range(1, kind.machines + 1))]
    table = [
        ",".join(["station", *names]),
        *(",".join([n, *map(str, row)]) for n, row in zip(names, shop["travel"], strict=True)),
    ]
    layout = folder / "travel.csv"
    layout.write_text("\n".join(table) + "\n", encoding="utf-8")
    return [str(file), "--layout", str(layout), "--robots", str(kind.vehicles)], plain


def timed_command(command: list[str]) -> tuple[float, float, dict[str, Any]]:
    """Wall and processor seconds of a new process, and the last line that it prints, as JSON."""
    before, began = os.times(), time.perf_counter()
    without = ("PYTHONDONTWRITEBYTECODE",)  # users keep the bytecode that Python compiles
    keeps = {name: value for name, value in os.environ.items() if name not in without}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=keeps)
    wall, after = time.perf_counter() - began, os.times()
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return wall, spent, json.loads(done.stdout.splitlines()[-1])


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> None:
    """Print a row a shop and the ratios of wall time; exit 1 where a proof differs."""
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", type=int, default=5, help="shops of each kind")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--workers", type=int, default=1, help="threads of the plain program's solver")
    parser.add_argument("--method", default="cp-sat")
    parser.add_argument("--only", default="", help="kinds whose names hold this")
    parser.add_argument("--out", type=Path, default=None)
    asked = parser.parse_args()
    room = asked.out or Path(tempfile.mkdtemp())
    ratios: list[float] = []
    wrong = 0
    for kind in (kind for kind in KINDS if asked.only in kind.name):
        for number in range(asked.each):
            folder = room / f"{kind.name.replace(', ', '-').replace(' ', '-')}-{number}"
            folder.mkdir(parents=True, exist_ok=True)
            shop = random_shop(kind, 1000 * asked.seed + number)
            words, file = shop_files(shop, kind, folder)
            plain = [sys.executable, str(HERE / "plain_model.py"), str(file), f"{asked.seconds}", f"{asked.workers}"]
            ours = [sys.executable, "-c", "from lab.cli import main; main()", "sequence", *words]
            ours += ["--method", asked.method, "--seconds", f"{asked.seconds}", "--json"]
            walls: list[list[float]] = [[], []]
            spent: list[list[float]] = [[], []]
            for _ in range(asked.rounds):
                for at, command in enumerate((plain, ours)):
                    wall, cpu, printed = timed_command(command)
                    walls[at].append(wall)
                    spent[at].append(cpu)
                    if at == 0:
                        cost, proven = (
                            printed["cost"] / (len(shop["jobs"]) if kind.due else 1),
                            printed["status"] == "OPTIMAL",
                        )
                    else:
                        lab_cost, lab_proven = printed["best_cost"], printed["optimum_proven"]
            if proven and (lab_cost < cost - SAME or (lab_proven and abs(lab_cost - cost) > SAME)):
                wrong += 1
            middle = [statistics.median(each) for each in (*walls, *spent)]
            ratio = statistics.median(b / a for a, b in zip(*walls, strict=True))
            ratios.append(ratio)
            sure = ["no proof", "proven"]
            say(
                f"{kind.name} {number}: plain {cost:g} {sure[proven]} {middle[0]:.2f} s ({middle[2]:.2f} s of processor), "
                f"lab {lab_cost:g} {sure[bool(lab_proven)]} {middle[1]:.2f} s ({middle[3]:.2f}), ratio {ratio:.2f}"
            )
    say(
        f"{len(ratios)} shops: median ratio {statistics.median(ratios):.2f}, worst {max(ratios):.2f}; {wrong} proofs differ"
    )
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
