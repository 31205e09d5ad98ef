"""Part `audits`: violations are inserted into recorded runs (`audit_violations`); the audit must name them.

The runs are those of the tasks that ship, made by the real command. A number draws a run and a kind of violation. The
unchanged runs must pass.
"""

from pathlib import Path

import numpy as np

from devtools.audit_violations import VIOLATIONS, Impossible, Violated
from devtools.commands import environment, lab
from devtools.parts import Outcome, Part
from lab.audit.audit import audit, kept_evidence
from lab.audit.evidence import Evidence
from lab.production.run_options import kept_task

TASKS = (
    *("toast", "toast-window", "two-toasters", "toast-panda", "toast-iiwa", "toast-xarm6"),
    *("breakfast", "sorting", "fms-arm", "palletise", "furnace", "kit"),
)
SEEDS = 3  # runs of each task
RUN_S = 900.0


def evidence_of(folder: Path) -> Evidence:
    """The evidence in a run's folder."""
    options, task = kept_task(folder, "audits")
    return kept_evidence(folder, task, task.ordered(options.toasts, options.parts))


def missed(violated: Violated) -> str:
    """What the audit reports instead of a violation; "" if it names the violation."""
    report = audit(violated.evidence)
    said = [
        finding for finding in report.findings if violated.part in ("", finding.part) and finding.rule in violated.rules
    ]
    if said and violated.part not in report.delivered:
        return ""
    return f"{violated.words}: the audit says {[(finding.rule, finding.words) for finding in report.findings][:3]}"


def _prepare(room: Path, seed: int) -> int | None:
    for task in TASKS:
        for number in range(SEEDS):
            folder = room / f"{task}-{number}"
            if not (folder / "run.json").is_file():
                words = ("run", task, "--seed", str(seed + number), "--out", folder)
                ended = lab(*words, cwd=room, env=environment(room), timeout_s=RUN_S)
                assert ended.code == 0, f"{task} with seed {seed + number}: {ended.stderr[-300:]}"
    return None


def _attempt(number: int, seed: int, room: Path) -> Outcome:
    runs = sorted(path.parent for path in room.glob("*/run.json"))
    if number < len(runs):
        folder = runs[number]
        findings = audit(evidence_of(folder)).findings
        return Outcome("sound", folder.name, "; ".join(finding.words for finding in findings))
    rng = np.random.default_rng([seed, number])
    kind = VIOLATIONS[number % len(VIOLATIONS)]
    for _ in range(100):
        folder = runs[int(rng.integers(len(runs)))]
        try:
            violated = kind(evidence_of(folder), rng)
        except Impossible:
            continue
        return Outcome(kind.__name__, f"{folder.name}: {violated.words}", missed(violated))
    return Outcome(kind.__name__, "no run has anything to which it applies", "nothing could be tried")


PART = Part(
    "violations in recorded runs, judged by the audit",
    "every violation is named, and none in unchanged runs",
    500 + len(TASKS) * SEEDS,
    _prepare,
    _attempt,
)
