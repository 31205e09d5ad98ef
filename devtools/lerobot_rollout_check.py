"""Hold the mentor in LeRobot's own rollout against its word: `python -m devtools.lerobot_rollout_check --python PATH`.

PATH is the Python of an environment with LeRobot and the lab. `examples/lerobot_asking_rollout.py` runs there with LeRobot's
engine, DAgger strategy, dataset and terminal keys; the arm, its leader and the policy are those of `lerobot_plugin`. The arm is
pushed off its way: the rollout has to pause within a second. This program is the person: where it pauses, they press LeRobot's
keys, lead back and hand back. The dataset that LeRobot wrote is then read here. Prints figures; exit 1 if a push was not
asked about, or a takeover not recorded.
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
import pexpect
import typer

from devtools.circle import JOINTS, KNOWN, NOISE, START, chosen, off, reached
from lab.recordings.episode import Episode, Recording
from lab.recordings.lerobot_read import read
from lab.recordings.lerobot_write import write

ROOT = Path(__file__).resolve().parent.parent
FPS, ROUND = 20, 126  # steps a second, and in one round of the circle
PUSHES = (45, 160)  # steps of the arm: early in a round, and again after the first correction
LED_S, PATIENCE_S = 1.5, 60.0  # how long the person leads; how long is waited for LeRobot


def alone(seed: int) -> Episode:
    """A round that the policy stirs without a push; it succeeds."""
    rng, joints = np.random.default_rng(seed), np.array(START)
    states, actions = [], []
    for _ in range(ROUND):
        states.append(joints)
        actions.append(chosen(joints))
        joints = reached(joints, actions[-1], rng.normal(0, NOISE, 2))
    rows = np.array(states, np.float32), np.array(actions, np.float32)
    return Episode("stir", *rows, np.zeros(ROUND, bool), success=True)


def rolled_out(python: Path, room: Path, options: list[str]) -> tuple[list[str], str]:
    """One rollout of LeRobot with a person at its keys: why the mentor asked, and all that LeRobot said."""
    environment = {**os.environ, "HF_HUB_OFFLINE": "1", "HF_HOME": str(room / "home"), "PYTHONPATH": str(ROOT)}
    environment |= {"TERM": "dumb", "COLUMNS": "400"}
    for display in ("DISPLAY", "WAYLAND_DISPLAY"):
        environment.pop(display, None)
    words = [str(ROOT / "examples" / "lerobot_asking_rollout.py"), f"--mentor={room / 'mentor.safetensors'}"]
    words += ["--robot.discover_packages_path=devtools.lerobot_plugin", "--robot.type=circle_arm", "--robot.id=arm"]
    words += ["--teleop.type=circle_leader", "--teleop.id=leader", f"--policy.path={room / 'policy'}", "--device=cpu"]
    words += ["--strategy.type=dagger", "--strategy.smooth_handover=false", f"--fps={FPS}", "--play_sounds=false"]
    words += ["--dataset.repo_id=check/rollout_circle", "--task=stir"]
    words += ["--dataset.no_stamp=true", "--dataset.push_to_hub=false", f"--dataset.fps={FPS}", *options]
    child = pexpect.spawn(str(python), words, env=environment, cwd=str(room), encoding="utf-8", timeout=PATIENCE_S)
    child.delayafterterminate = child.ptyproc.delayafterterminate = PATIENCE_S / 10
    asked, said = list[str](), list[str]()
    answers = {"autonomous -> paused": "\t", "paused -> correcting": "\t", "correcting -> paused": " "}
    try:
        while said[-1:] != ["loop ended"]:
            child.expect([r"The mentor asks: [^\r\n]*", *answers, "loop ended"])
            said += [child.before, child.after]
            if child.after in answers:
                time.sleep(LED_S if child.after == "paused -> correcting" else 0.0)
                child.send(answers[child.after])
            elif child.after.startswith("The mentor asks: "):
                asked.append(child.after.removeprefix("The mentor asks: "))
        child.expect(pexpect.EOF)
        child.wait()
    except (pexpect.TIMEOUT, pexpect.EOF) as error:
        raise SystemExit(f"LeRobot's side failed ({type(error).__name__}):\n{child.before}") from None
    finally:
        child.close(force=True)
    return asked, "".join(said)


def by_lab(*words: str) -> str:
    """What a command of the lab prints."""
    command = [sys.executable, "-c", "from lab.cli import main; main()", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"lab {' '.join(words)}: {done.stderr}")
    return done.stdout


def delays(episode: Episode) -> list[int | None]:
    """For each takeover the number of the policy's steps from the push, that one included, until the rollout paused."""
    found, begin = list[int | None](), 0
    for first, after in episode.takeovers():
        away = [step for step in range(begin, first) if off(episode.states[step]) > KNOWN]
        found.append(first - away[0] if away else None)
        begin = after
    return found


def main(
    python: Annotated[Path, typer.Option(help="Python of an environment with LeRobot and the lab")],
    sessions: Annotated[int, typer.Option(min=3, help="how many rollouts with pushes")] = 4,
    rule: Annotated[str, typer.Option(help="the mentor's measure of doubt")] = "distance",
    duration: Annotated[float, typer.Option(min=14, help="seconds a rollout")] = 18.0,
) -> None:
    """Hold the mentor in LeRobot's own rollout against its word."""
    with TemporaryDirectory() as temporary:
        room = Path(temporary)
        for name, seeds in (("demonstrations", range(20)), ("rollouts", range(100, 300))):
            rounds = [alone(seed) for seed in seeds]
            write(Recording(FPS, "circle_arm", JOINTS, JOINTS, rounds), room / name)
        typer.echo(
            by_lab(
                "mentor",
                str(room / "demonstrations"),
                "--rollouts",
                str(room / "rollouts"),
                "--rule",
                rule,
                "--false-alarms",
                "0.01",
                "--keep",
                str(room / "mentor.safetensors"),
            )
        )
        saved = [str(python), "-m", "devtools.lerobot_plugin.modeling_circle", str(room / "policy")]
        subprocess.run(saved, env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=room, check=True, capture_output=True)
        seen, faults = list[tuple[list[str], str]](), list[str]()
        for number in range(sessions + 1):
            pushes = list(PUSHES) if number < sessions else []
            options = [f"--robot.pushes={pushes}", f"--robot.seed={number}", f"--duration={duration}"]
            options += ["--strategy.record_autonomous=true", f"--dataset.root={room / 'recorded'}"]
            options += [f"--resume={'true' if number else 'false'}"]
            seen.append(rolled_out(python, room, options))
            typer.echo(f"session {number}: {len(pushes)} pushes; {'; '.join(seen[-1][0]) or 'no question'}")
        recording = read(room / "recorded")
        if len(recording.episodes) != sessions + 1:
            faults.append(f"{len(recording.episodes)} episodes: wanted {sessions + 1}")
        for number, ((asked, output), episode) in enumerate(zip(seen, recording.episodes, strict=False)):
            taken, waits = episode.takeovers(), delays(episode)
            back = [round(off(episode.states[after - 1]), 1) for _, after in taken]
            typer.echo(
                f"episode {number}: {len(episode)} steps, {int(episode.corrected.sum())} with intervention in "
                f"{len(taken)} takeovers; {len(asked)} questions; steps from push to pause {waits}; off the circle at the "
                f"hand-back {back}; {len(re.findall('running slower', output))} steps late"
            )
            answered = [wait for wait in waits if wait is not None and wait <= FPS]
            if len(answered) != (len(PUSHES) if number < sessions else 0) or len(taken) > len(asked):
                faults.append(
                    f"episode {number}: wanted a takeover within {FPS} steps of each push, and after a question"
                )
        typer.echo(by_lab("mentor", str(room / "recorded"), "--window", "0.5", "--false-alarms", "0.3"))
        options = [f"--robot.pushes={list(PUSHES)}", f"--dataset.root={room / 'corrections'}"]
        asked, _ = rolled_out(python, room, [*options, f"--strategy.num_episodes={len(PUSHES)}"])
        kept = read(room / "corrections").episodes
        typer.echo(f"corrections alone: {len(asked)} questions, {len(kept)} episodes, {sum(map(len, kept))} steps")
        if len(kept) != len(PUSHES) or not all(episode.corrected.all() for episode in kept):
            faults.append(f"corrections alone: wanted {len(PUSHES)} episodes with intervention in all steps")
        for fault in faults:
            typer.echo(f"fault: {fault}")
        if faults:
            raise typer.Exit(1)


if __name__ == "__main__":
    typer.run(main)
