"""Part `mutated-commands`: a damaged file is given to a command of the lab that reads it, in a process of its own."""

import shutil
from pathlib import Path
from random import Random
from typing import NamedTuple

from devtools.commands import environment, lab
from devtools.mutate import mutated
from devtools.mutations import prepare
from devtools.parts import Outcome, Part
from devtools.read_damaged import sound_files
from devtools.read_files import KINDS

COMMANDS = 1000
LATE_S = 300.0
REFUSED_S = 10.0  # CPU time, start and end of the process included
MOST_MB = 1000.0
ANSWERS = "1\n" * 50 + "quit\n"


class Command(NamedTuple):
    """A command, with {file} for the damaged file and {folder} for its folder; the kind of that file; the command's stdin."""

    words: str
    kind: str
    stdin: str = ""


READ_BY = (
    Command("task check {file}", "task"),
    Command("task check {file} --json", "task"),
    Command("task show {file}", "task"),
    Command("sequence {file} --episodes 20 --method srl", "task"),
    Command("teach grasp --task {file} --episodes 3 --json", "task"),
    Command("sequence {file} --method fifo --json", "cell"),
    Command("sequence {file} --episodes 20", "cell"),
    Command("task convert {file} --out cell.json", "cell"),
    Command("task check {file}", "cell"),
    Command("teach {file} --episodes 3", "world"),
    Command("view {file} --out page.html", "world"),
    Command("teach {file} --episodes 3 --json", "text grid"),
    Command("sequence {file} --method fifo", "instance"),
    Command("task convert {file} --out cell.toml", "instance"),
    Command("sequence jobs.csv --case 7:1 --layout layout.csv --method nearest-ready", "jobs and layout"),
    Command("toolbox list --toolbox {folder}", "policy"),
    Command("toolbox verify --toolbox {folder} --json", "policy"),
    Command("toolbox show mine --toolbox {folder}", "policy"),
    Command("teach world-1 --advisor policy:{file} --episodes 3", "policy"),
    Command("toolbox import {file} --toolbox new", "archive"),
    Command("toolbox import {file} --toolbox new --json", "archive"),
    Command("toolbox import {folder} --toolbox new", "folder for the Hub, model"),
    Command("toolbox import {folder} --toolbox new", "folder for the Hub, metadata"),
    Command("toolbox log mine", "toolbox's log"),
    Command("toolbox verify", "toolbox's log"),
    Command("toolbox list", "toolbox's index"),
    Command("sequence toast --toasts 1 --method fifo", "record of durations"),
    Command("toolbox verify", "record of durations"),
    Command("toolbox verify", "record of reuse"),
    Command("replay", "lesson's journal"),
    Command("replay {folder} --json", "lesson's journal"),
    Command("replay {folder} --plain --pause 0", "lesson's journal"),
    Command("teach --resume {folder} --plain", "lesson's journal", ANSWERS),
    Command("teach world-1 --advisor recorded:{folder} --episodes 3", "recorded advice"),
    Command("sequence --resume {folder} --plain", "order's journal", ANSWERS),
    Command("replay {folder} --json", "order's journal"),
    Command("teach world-1 --advisor answers:{file} --episodes 3", "answers"),
    Command("replay {folder} --json", "run's journal"),
    Command("run --resume {folder}", "run's journal"),
    Command("operate --resume {folder}", "run's journal"),
    Command("run --resume {folder}/..", "run's skills"),
    Command("run --resume {folder}", "run's known policies"),
    Command("export {folder} --format csv --out out", "run's program"),
    Command("export {folder} --format jbi --out out", "run's trajectory"),
    Command("sequence fms --method carried --policy {file}", "carried policy"),
    Command("see {file} --task toast", "picture"),
    Command("see {file}", "picture"),
    Command("see 00001.png --task toast --calibration {file}", "calibration"),
    Command("see --score {folder} --calibration lens.json", "truth of pictures"),
    Command("study compare world-1 --sessions 2 --advisor expert --out {folder}", "kept sessions of a study"),
)


def attempt(number: int, seed: int, room: Path) -> Outcome:
    """Run one command on one damaged file."""
    command = READ_BY[number % len(READ_BY)]
    kind, chance = KINDS[command.kind], Random(f"{seed} command {number}")
    folder = room / "commands" / str(number)
    shutil.rmtree(folder, ignore_errors=True)  # a stopped run may have left it
    files = sound_files(folder, room, kind)
    damaged = chance.choice(files)
    content, how = mutated(damaged.read_bytes(), kind.content, chance)
    damaged.write_bytes(content)
    words = [word.format(file=damaged, folder=damaged.parent) for word in command.words.split()]
    ended = lab(*words, cwd=folder, env=environment(folder), stdin=command.stdin, timeout_s=LATE_S)
    broke, mb = ended.fault(), ended.peak_bytes / 1e6
    if not broke and ended.code == 2 and ended.cpu_s > REFUSED_S:
        broke = f"refused after {ended.cpu_s:.1f} s of CPU time: {ended.stderr[:100]}"
    if not broke and mb > MOST_MB:
        broke = f"{mb:.0f} MB: exit {ended.code} {ended.stderr[:100]}"
    if not broke:
        shutil.rmtree(folder, ignore_errors=True)
    group = f"lab {' '.join(word for word in command.words.split()[:2] if '{' not in word)}, {command.kind}"
    figures = {"CPU s": round(ended.cpu_s, 1), "MB": round(mb), "exit": ended.code}
    return Outcome(group, f"{number}: lab {command.words}: {damaged.name}, {how}", broke, 1, figures)


PART = Part("commands on damaged files", "a clear line and the right exit code, under 1 GB", COMMANDS, prepare, attempt)
