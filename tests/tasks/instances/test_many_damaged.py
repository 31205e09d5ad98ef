"""Many damaged instance files, one after the other: how many are refused in one clear line, accepted, or neither.

    PYTHONPATH=. python tests/tasks/instances/test_many_damaged.py 1000

Prints counts, the slowest file and the peak memory as one JSON line.
"""

import json
import re
import resource
import sys
import time
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from lab.errors import BadInput
from lab.tasks.instances import InstanceRequest, pyjobshop, read_instance

SPITE = [
    "-1",
    "1e999",
    "nan",
    "100000",
    "999999999999",
    "0",
    "",
    "x",
    "[" * 3000,
    "{",
    "|",
    ",",
    ";",
    "\0",
    "é",
    "&a *a",
    "\t",
]


def originals(chance: np.random.Generator) -> dict[str, str]:
    """A sound text of each format, of a size that instances have, by the file's name."""
    jobs, machines = 10, 5
    ways = [chance.permutation(machines) for _ in range(jobs)]
    times = chance.integers(1, 99, (jobs, machines))
    names = ["LU", *(f"M{n}" for n in range(1, machines + 1))]
    travel = [(a, b, int(chance.integers(2, 20))) for a in names for b in names if a != b]
    text = {
        "la.jsp": f"{jobs} {machines}\n"
        + rows([[x for p in zip(w, t, strict=True) for x in p] for w, t in zip(ways, times, strict=True)])
    }
    text["ta.txt"] = f"{jobs} {machines}\nTimes\n{rows(times)}Machines\n{rows([w + 1 for w in ways])}"
    text["mk.fjs"] = f"{jobs} {machines} 1\n" + rows(
        [
            [machines, *(x for m, p in zip(w, t, strict=True) for x in (1, m + 1, p))]
            for w, t in zip(ways, times, strict=True)
        ]
    )
    listed = [(1, j + 1, o + 1, f"M{m + 1}", times[j][o]) for j, way in enumerate(ways) for o, m in enumerate(way)]
    text["jobs.csv"] = "set,job,operation,machine,time\n" + rows(listed, ",")
    text["layout.csv"] = "from,to,time\n" + rows(travel, ",")
    tanks = [(n, 30 + n, 90 + n, 22) for n in range(1, machines + 1)]
    text["tanks.csv"] = "tank,soak_min,soak_max,move_from_previous\n" + rows(tanks, ",") + "unload,,,30\n"
    places = ["load", *map(str, range(1, machines + 1))]
    empty = [(a, b, abs(n - m)) for n, a in enumerate([*places[1:], "unload"], 1) for m, b in enumerate(places)]
    text["empty.csv"] = "after_move_into,to_remove_from,time\n" + rows(empty, ",")
    least, most, matrix = (
        [t[1] for t in tanks],
        [t[2] for t in tanks],
        np.array([e[2] for e in empty]).reshape(-1, machines + 1),
    )
    text["line.dzn"] = (
        f"Ninner = {machines}; % tanks\ntmin = {least};\ntmax = {most};\nf = {[22] * (machines + 1)};\n"
        f"e = [| {' | '.join(', '.join(map(str, row)) for row in matrix)} |];\n"
    )
    head = "|".join(f"(m{n},t)" for n in range(machines))
    pairs = [
        f"j{n}|" + " ".join(f"({m},{p})" for m, p in zip(w, t, strict=True))
        for n, (w, t) in enumerate(zip(ways, times, strict=True))
    ]
    spots = [*(f"m-{n}" for n in range(machines)), "in-buf", "out-buf"]
    table = [
        "|".join(spots),
        *(f"{a}|" + " ".join(str(abs(i - j)) for j in range(len(spots))) for i, a in enumerate(spots)),
    ]
    spec = ["instance_config:", "  instance:", "    specification: |", *(f"      {line}" for line in [head, *pairs])]
    text["agv.yaml"] = (
        "\n".join([*spec, "  logistics:", "    specification: |", *(f"      {line}" for line in table)]) + "\n"
    )
    with TemporaryDirectory() as folder:
        path = Path(folder) / "la"
        path.write_text(text["la.jsp"])
        text["shop.json"] = pyjobshop.write(read_instance(path))
    return text


def rows(values: object, between: str = " ") -> str:
    """Values as lines."""
    return "".join(between.join(map(str, row)) + "\n" for row in values)  # type: ignore[attr-defined]


def damaged(text: str, chance: np.random.Generator) -> str:
    """A text with one to three places spoilt."""
    for _ in range(int(chance.integers(1, 4))):
        words, lines = re.split(r"(\W+)", text), text.splitlines(keepends=True)
        word, line, at = (int(chance.integers(max(1, len(x)))) for x in (words, lines, text))
        spite = SPITE[int(chance.integers(len(SPITE)))]
        how = int(chance.integers(8))
        if how < 2 and words:  # a number or a name is another one
            words[word] = spite
            text = "".join(words)
        elif how == 2 and lines:
            text = "".join(lines[:line] + lines[line + 1 :])
        elif how == 3 and lines:
            text = "".join(lines[:line] + lines[line : line + 1] * int(chance.choice([2, 2, 3000])) + lines[line + 1 :])
        elif how == 4:
            text = text[:at]
        elif how == 5:
            text = text[:at] + spite + text[at:]
        elif how == 6:
            text = text[:at] + text[at + int(chance.integers(1, 30)) :]
        else:
            text = re.sub(r"\d+", spite.replace("\\", ""), text, count=int(chance.integers(1, 4)))
    return text


def main(count: int, seed: int = 0) -> None:
    """Reads so many damaged files of all formats, half of them beside a layout."""
    chance = np.random.default_rng(seed)
    sound, ended, slowest = originals(chance), Counter[str](), (0.0, "")
    names = [name for name in sound if name not in ("layout.csv", "empty.csv")]
    bad = list[str]()
    with TemporaryDirectory() as folder:
        for number in range(count):
            name = names[number % len(names)]
            beside = (
                "empty.csv"
                if name == "tanks.csv"
                else "layout.csv"
                if number // len(names) % 2 and name != "line.dzn"
                else None
            )
            spoilt = beside if beside is not None and chance.random() < 0.3 else name
            for one in filter(None, (name, beside)):
                text = damaged(sound[one], chance) if one == spoilt else sound[one]
                (Path(folder) / one).write_bytes(text.encode(errors="replace"))
            asked = InstanceRequest(None if beside is None else Path(folder) / beside)
            begun = time.perf_counter()
            try:
                read_instance(Path(folder) / name, asked)
                ended["accepted"] += 1
            except BadInput as error:
                said = str(error)
                clear = len(said.splitlines()) == 1 and folder in said and len(said) < 1000
                ended["refused in one line" if clear else "refused otherwise"] += 1
                bad += [] if clear else [said]
                ended["of these with a line number"] += bool(re.search(r"line \d", said))
            except Exception as error:
                ended["traceback"] += 1
                bad.append(f"{name}: {type(error).__name__}: {error}"[:200])
            slowest = max(slowest, (time.perf_counter() - begun, name))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"files": count, **ended, "slowest_s": slowest, "peak_mb": round(memory)}))  # noqa: T201
    for one in bad[:20]:
        print(one, file=sys.stderr)  # noqa: T201


def test_a_few_of_many(capsys: pytest.CaptureFixture[str]) -> None:
    main(90, seed=11)
    found = json.loads(capsys.readouterr().out)
    assert found["refused in one line"] + found["accepted"] == 90
    assert found["refused in one line"] > 60


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
