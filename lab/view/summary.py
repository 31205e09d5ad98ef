"""The results of commands as text: short rich tables and lines, from the commands' JSON documents."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from shlex import quote
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from lab.errors import counted
from lab.sequencing import BESIDE_METHODS, method_in_words
from lab.view.cyclic_summary import period_in_words
from lab.view.figures import SAME, beside, gap_of
from lab.view.progress import sparkline

_STUDY_ROWS = 30
SHOWN_MOVES = 60


def run_summary(report: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab run`, from its JSON document."""
    skills = report["skills"]
    helped = sum(row["helped_steps"] for row in skills)
    table = Table.grid(padding=(0, 2))
    table.add_column(style="bold", justify="right")
    table.add_column(overflow="fold")
    done = delivered_in_words(report["delivered"], report["parts"])
    table.add_row("outcome", Text(f"{done} (seed {report['seed']})", "green" if report["success"] else "red"))
    if report["dropped"]:
        table.add_row("dropped", counted(report["dropped"], "part"))
    if report["failure"]:
        table.add_row("stopped", Text(report["failure"], "red"))
    for fault in report["faults"]:
        answer = (
            f"noticed: {fault['noticed']}; {fault['answer']}" if fault["noticed"] else "not noticed, and no harm done"
        )
        table.add_row("fault", Text(f"{fault['at_s']:.1f} s: {fault['true_reason']}; {answer}"))
    if report["retries"]:
        table.add_row("retries", Text("\n".join(report["retries"])))
    table.add_row("skills", _found(skills, report["task"]))
    if moves := sum(row["moves"] for row in skills):
        episodes = counted(sum(row["episodes"] for row in skills), "episode")
        table.add_row("learned in", f"{episodes}, {counted(moves, 'move')}, {helped} of them advised")
    saved = [sum(row[f"saved_{what}"] for row in skills) for what in ("episodes", "helped_steps")]
    if any(saved):
        table.add_row("saved", f"{counted(saved[0], 'episode')}, {counted(saved[1], 'helped step')}")
    table.add_row("sequence", " ".join(map(str, report["sequence"])))
    table.add_row("found by", Text(method_in_words(report["method"])))
    if report["order_learning"] is not None:
        table.add_row("order", Text("\n".join(report["order_learning"]["lines"])))
    for plan in report["replanned"]:
        gap = "" if plan["gap"] is None else f", gap {gap_of(plan['gap'], 2)}"
        table.add_row("new plan", Text(f"{plan['at_s']:.1f} s: by {plan['method']}{gap}: {plan['why']}"))
    measured = report["measured_makespan_s"]
    predicted, bound = beside(report["predicted_makespan_s"], report["bound_s"], " s", 1)
    text = f"{predicted} predicted"
    if measured is not None:
        text += f", {measured:.1f} s measured ({measured / report['predicted_makespan_s'] - 1:+.2%})"
    else:
        text += f", ended after {report['sim_s'] + report['skipped_s'] - report['timed_s']:.1f} s"
    table.add_row("makespan", text)
    proven = "proven optimum" if report["optimum_proven"] else "proven bound"
    table.add_row(proven, f"{bound} by the planned times, gap {gap_of(report['optimality_gap'], 2)}")
    if report["cyclic"] is not None:
        table.add_row("period", period_in_words(report["cyclic"]))
    for what, lines in _worth(report["receipts"] or {}):
        table.add_row(what, Text("\n".join(lines)))
    rate = report["sim_s"] / report["wall_s"] if report["wall_s"] else 0.0
    spent = f"{report['wall_s']:.1f} s for {report['sim_s']:.0f} simulated seconds ({rate:.0f} x real time)"
    table.add_row("time", spent)
    for name, path in report["files"].items():
        table.add_row(name.replace("_", " "), Text(path))
    return table


def _worth(receipts: Mapping[str, Any]) -> Iterator[tuple[str, list[str]]]:
    """The lines on what advice gained: for each skill with questions, and for the order, compared with other orders."""
    for name, worth in receipts.get("skills", {}).items():
        yield f"advice on {name}", worth["receipt"]["lines"]
    order = receipts.get("order")
    if order is not None:
        unit = " s" if order["objective"] == "makespan" else ""
        costs = ", ".join(f"{by} {cost:.1f}{unit}" for by, cost in order["costs"].items())
        guided = order.get("guided_best")
        own = "" if guided is None else f"; best episode with advice {guided:.1f}{unit}"
        yield (
            "advice on the order" if "lines" in order else "orders",
            [f"{costs}; used: {BESIDE_METHODS.get(order['used'], order['used'])}{own}", *order.get("lines", [])],
        )


def delivered_in_words(delivered: int, parts: Mapping[str, int]) -> str:
    """The delivered parts of an order: "2 of 3 slices delivered", "2 of 3 parts delivered (2 slices, 1 cup)"."""
    if len(parts) == 1:
        (kind, count), *_ = parts.items()
        return f"{delivered} of {counted(count, kind)} delivered"
    words = ", ".join(counted(count, kind) for kind, count in parts.items())
    return f"{delivered} of {sum(parts.values())} parts delivered ({words})"


def lesson_summary(lesson: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab teach`, from its JSON document."""
    lines = [
        f"{lesson['skill']}: {counted(lesson['episodes'], 'episode')}   {sparkline(lesson['steps_per_episode'], 40)}",
        f"learned path: {_way(lesson)}: {_verdict(lesson)}",
        *([_advice(lesson)] if lesson["requests"] else []),  # otherwise the receipt says that nobody was asked
        *(["it went on from what was left unfinished"] if lesson["source"] == "continued" else []),
        *(_peers(lesson) if "peers" in lesson else lesson["receipt"]["lines"]),
        f"saved as '{lesson['saved_as']}' (seed {lesson['seed']})",
        *([] if "peers" in lesson else [f"its journal: {lesson['session']} (lab replay shows it again)"]),
        *lesson["files"].values(),
        *(line for other in lesson.get("others", ()) for line in _other_task(other)),
    ]
    return Group(*map(Text, lines))


def _other_task(lesson: Mapping[str, Any]) -> Iterator[str]:
    """The lines of the lesson of another task, which peers learned at the same time."""
    yield f"in task '{lesson['task']}', peer {lesson['best_peer']}: learned path: {_way(lesson)}: {_verdict(lesson)}"
    yield f"saved as '{lesson['saved_as']}' (seed {lesson['seed']})"
    yield from lesson["files"].values()


def _peers(lesson: Mapping[str, Any]) -> Iterator[str]:
    """A line for each peer: its path, its moves, how often the others answered it, and what it trusts them."""
    yield f"this is peer {lesson['best_peer']}: solved, then the shortest path, then the fewest moves"
    for peer in lesson["peers"]:
        path = "misses the goal" if peer["final_steps"] is None else counted(peer["final_steps"], "step")
        others = ", ".join(
            f"{other['peer']}: {other['answered']} of {other['asked']} (trust {other['trust']:.2f}"
            f"{', dropped' if other['dropped'] else ''})"
            for other in peer["others"]
        )
        arm = f" with the arm {peer['arm']}" if peer["arm"] else ""
        yield f"peer {peer['peer']}{arm}: {path}, {counted(peer['moves'], 'move')}, {peer['helped_steps']} helped; asked {others}"


def replay_summary(replay: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab replay`, from its JSON document."""
    closed = replay["closed"]
    of_order = "method" in replay["words"]
    over = f"it is not over: lab {'sequence' if of_order else 'teach'} --resume goes on with it"
    if closed is not None:
        over = f"over after {counted(closed['episodes'], 'episode')}, {'solved' if closed['solved'] else 'not solved'}"
    return Group(*map(Text, [f"{replay['problem']} in {replay['session']}: {over}", *replay["receipt"]["lines"]]))


def run_replay_summary(replay: Mapping[str, Any]) -> RenderableType:
    """The text of `lab replay` for a run, from its JSON document."""
    table = Table.grid(padding=(0, 2))
    table.add_column(justify="right")
    table.add_column(overflow="fold")
    for event in replay["events"]:
        if text := _event_text(event):
            table.add_row(f"{event['at_s']:.1f} s" if "at_s" in event else "", Text(text))
    over = f"not over: lab {replay['command']} --resume {quote(replay['run'])} goes on with it"
    if replay["over"]:
        over = replay["failure"] or f"all of {counted(replay['delivered'], 'part')} delivered"
    skills = counted(len(replay["skills"]), "skill")
    lines = [Text(over)]
    if movie := replay.get("movie"):
        lines.append(Text(f"{movie['file']}: {movie['frames']} pictures, {movie['speed']:.3g} x real time"))
    return Group(Text(f"{replay['task']} in {replay['run']}: {skills} there"), table, *lines)


def audit_summary(document: Mapping[str, Any]) -> RenderableType:
    """The text of `lab replay --audit`, from its JSON document: where each part stood, and what is wrong."""
    rows = [
        {
            "part": stay["part"],
            "station": stay["station"],
            "from_s": f"{stay['start_s']:.1f}",
            "to_s": f"{stay['end_s']:.1f}",
            "stood_s": f"{stay['end_s'] - stay['start_s']:.1f}",
        }
        for stay in document["stays"]
    ]
    claimed, delivered = len(document["claimed"]), len(document["delivered"])
    lines = [Text(f"{finding['part']}: {finding['words']}") for finding in document["findings"]]
    said = f"delivered: {delivered} of the {counted(claimed, 'part')} that the run claims"
    return Group(table_of(rows, ("part", "station", "from_s", "to_s", "stood_s")), *lines, Text(said))


def _event_text(event: Mapping[str, Any]) -> str:
    """An entry of a run's journal in words; "" for entries that are shown elsewhere."""
    match event["kind"]:
        case "moved":
            return f"{event['part']}: {event['origin']} to {event['target']}"
        case "met":
            about = " at ".join(word for word in (event["part"], event["station"]) if word)
            return f"{about}: {event['what']}: {event['answer']}"
        case "stopped":
            stops = [f"{kind} ({why or by})" for kind, why, by in event["stops"]]
            return f"stopped: {', '.join(stops)}" if stops else "goes on"
        case "commanded":
            return f"{event['by']}: {event['words']}" + (f": refused, {event['refused']}" if event["refused"] else "")
        case "session":
            return f"people were asked: {event['name']}: lab replay {quote(event['folder'])}"
    return ""


def _found(skills: Sequence[Mapping[str, Any]], task: str) -> str:
    """The numbers of skills that are reused, adapted and learned, and of those that come from other tasks."""
    lines = []
    for kind in ("reused", "composed", "adapted"):
        rows = [row for row in skills if row["source"] == kind]
        from_tasks = Counter(row["from_task"] for row in rows if row["from_task"] not in (task, None))
        notes = [f"{count} from {name}" for name, count in from_tasks.most_common()]
        elsewhere = sum(kind == "reused" and row["fitness"] is not None for row in rows)
        notes += [f"{elsewhere} of another problem"] if elsewhere else []
        lines += [f"{len(rows)} {kind}" + (f" ({', '.join(notes)})" if notes else "")] if rows else []
    learned = sum(row["source"] in ("learned", "continued") for row in skills)
    return ", ".join([*lines, *([f"{learned} learned"] if learned or not lines else [])])


def _way(lesson: Mapping[str, Any]) -> str:
    """The steps of the learned path and the fewest possible; both are means if starts or transitions are random.

    In a problem that is scored by return, the mean returns of the learned and the best policy.
    """
    if "final_return" in lesson:
        learned, highest = f"mean return {lesson['final_return']:.4g}", lesson["best_return"]
        return learned if highest is None else f"{learned}, that of the best policy is {highest:.4g}"
    final, best, drawn = lesson["final_steps"], lesson["optimal_steps"], lesson["steps_are_means"]
    learned = "does not reach the goal" if final is None else counted(final, "step")
    learned += " on average, where it reaches the goal" if drawn and final is not None else ""
    return learned if best is None else f"{learned}, the {'best path' if drawn else 'shortest'} takes {best}"


def _verdict(lesson: Mapping[str, Any]) -> str:
    if lesson["failure"] is not None:
        return f"not solved in physics: {lesson['failure']}"
    if lesson["solved"]:
        return "solved"
    if lesson["final_steps"] is None:
        return "not solved"
    if lesson["steps_are_means"]:
        return (
            "not solved" if lesson["optimal_steps"] is None else "not solved, its mean return is below the best path's"
        )
    longer = lesson["optimal_steps"] is not None and lesson["final_steps"] > lesson["optimal_steps"]
    return "not solved, it is longer" if longer else "not solved, it does not reach the goal from every start"


def _advice(lesson: Mapping[str, Any]) -> str:
    counts = {"helped step": lesson["helped_steps"], "mislead": lesson["misleads"]}
    asked = f"asked in {counted(lesson['requests'], 'episode')}"
    text = ", ".join([asked, *(counted(number, what) for what, number in counts.items())])
    episode = lesson["rejected_at_episode"]
    return text if episode is None else f"{text}: rejected its advisor in episode {episode}"


MOST_PRODUCTS = 3  # up to which an order of one part each names every product


STOPPED = {
    "Ctrl-C": "stopped by Ctrl-C",
    "seconds": "the time is over (--seconds)",
    "gap": "the gap is reached (--gap)",
}


def sequence_summary(document: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab sequence`, from its JSON document."""
    what, unit = _measured(document["objective"])
    proven = "proven optimum" if document["optimum_proven"] else "proven bound"
    best, bound = beside(document["best_cost"], document["bound_cost"], unit, 2)
    alone = beside(document["cost"], document["bound_cost"], unit, 2)[0]
    whose = (
        " alone"
        if document["advice"] is None
        else {True: " with advice", False: " alone", None: ""}[document["advised"]]
    )
    lines = [
        f"best order known: {what}{best} for {_ordered(document['order'])} (by {document['best_by']}; seed {document['seed']})",
        f"{proven} {bound}{_gap(document['best_cost'], document)} ({document['bound_by']})",
        f"{document['method']}{whose}: {what}{alone}{_gap(document['cost'], document)}, "
        f"in episode {document['found_at_episode']} of {document['episodes']}",
        *_order_of_transfers(document),
    ]
    if document["stopped_by"] is not None:
        proven = "which is proven" if document["proven"] else "which is not proven to be the best"
        lines.insert(0, f"{STOPPED[document['stopped_by']]}: the best order until then, {proven}")
    if document["luckiest_cost"] is not None:
        lines.append(f"by the mean times; in its luckiest drawn episode {document['luckiest_cost']:.2f}{unit}")
    if document["sessions"] > 1:
        hits = "" if document["success_percent"] is None else f"optimum found in {document['success_percent']:.0f} %, "
        lines.append(f"{document['sessions']} sessions: {hits}mean best {document['mean_best_cost']:.2f}{unit}")
    for number, advice in enumerate(document["advice"] or [], 1):
        if advice["requests"] is None:
            continue
        asked, helped = counted(advice["requests"], "episode"), counted(advice["helped_steps"], "move")
        text = f"session {number}: asked in {asked}, {helped} advised"
        episode = advice["rejected_at_episode"]
        lines.append(text if episode is None else f"{text}; rejected its advisor in episode {episode}")
    if document["stochastic"] is not None:
        lines += _drawn(document["stochastic"], unit)
    if document.get("policy_kept") is not None:
        lines.append(f"the learned policy is kept in {document['policy_kept']}")
    elif document.get("policy", ()) is None:
        lines.append("the search was stopped before a policy was learned")
    return Group(*map(Text, [*lines, *document["files"].values()]))


def _gap(value: float, document: Mapping[str, Any]) -> str:
    """The gap between a cost and the bound, in words; "" when they are equal or the bound is 0."""
    bound = document["bound_cost"]
    share = value / bound - 1 if bound > 0 else 0.0
    return f", gap {gap_of(share, 2)}" if share > SAME else ""


def _order_of_transfers(document: Mapping[str, Any]) -> list[str]:
    """The best order, or the beginning of a long one: part numbers, or words if a part can continue in several ways."""
    sequence, words = document["best_sequence"], document["best_moves"]
    more = len(sequence) - SHOWN_MOVES
    rest = f" and {more} more (--json has all)" if more > 0 else ""
    if all(decision <= len(document["order"]) for decision in sequence):
        return [f"order of the transfers: {' '.join(map(str, sequence[:SHOWN_MOVES]))}{rest}"]
    return [
        "order of the transfers:",
        *(f"  {word}" for word in words[:SHOWN_MOVES]),
        *([rest.strip()] if rest else []),
    ]


def _measured(objective: str) -> tuple[str, str]:
    """The words before and after a cost of this objective."""
    if objective == "makespan":
        return "", " s"
    return f"{objective.replace('-', ' ')} ", "" if objective == "tardy-parts" else " s"


def _ordered(order: Sequence[str]) -> str:
    """An order in words: the number of each product, or the total if each of many parts is another product."""
    counts = Counter(order)
    if len(counts) == len(order) > MOST_PRODUCTS:
        return counted(len(order), "part")
    return ", ".join(counted(count, name) for name, count in counts.items())


def _drawn(stochastic: Mapping[str, Any], unit: str) -> list[str]:
    """The lines on the costs of a fixed list and of a policy when times are drawn."""

    def mean(name: str) -> str:
        low, high = stochastic[name]["ci95"]
        return f"{stochastic[name]['mean']:.2f}{unit} ({low:.2f} to {high:.2f})"

    every_s, repair_s = stochastic["robot_breaks_every_s"], stochastic["robot_repair_s"]
    robots = f", robots in order for {every_s:g} s on average, repaired for {repair_s:g} s" if every_s else ""
    return [
        f"{counted(stochastic['replications'], 'drawn episode')}{robots}: the list as it is {mean('fixed')}",
        f"reacting {mean('reacting')}: {stochastic['reacting']['policy']}",
        f"saved by reacting {mean('saved_by_reacting')}",
    ]


def table_of(rows: Sequence[Mapping[str, Any]], columns: Sequence[str], whole: str = "") -> Table:
    """The rows as a table with these columns; texts in the column `whole` are never wrapped, other columns get narrower."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for column in columns:
        table.add_column(column.replace("_", " "), overflow="fold", no_wrap=column == whole)
    for row in rows:
        table.add_row(*(Text(str(row[column])) for column in columns))
    return table


def study_summary(study: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab study run`, from its JSON document: up to 30 rows; the report has all of them."""
    shown = ("measure", "value", "ci95", "thesis", "within", "within_errors", "used", "easy", "lab_version")
    settings = list(dict.fromkeys(key for row in study["rows"] for key in row if key not in shown))
    first = study["rows"][:_STUDY_ROWS]
    varied = [key for key in settings if len({str(row.get(key)) for row in study["rows"]}) > 1]
    varied = [key for key in varied if any(row.get(key) is not None for row in first)]
    rows = [
        {key: "" if row.get(key) is None else row[key] for key in varied}
        | {
            "measure": row["measure"],
            "value": f"{row['value']:.4g}",
            "95 %": "" if row["ci95"] is None else f"{row['ci95'][0]:.4g} to {row['ci95'][1]:.4g}",
            "printed": "" if row["thesis"] is None else f"{row['thesis']:g}",
            "inside": {True: "yes", False: "no", None: ""}[row["within"]],
        }
        for row in first
    ]
    more = len(study["rows"]) - len(rows)
    lines = [f"... and {counted(more, 'more row')}"] * (more > 0) + [""]
    lines += [f"{key}: {v:.4g}" if isinstance(v, float) else f"{key}: {v}" for key, v in study["summary"].items()]
    lines += [f"{key}: {path}" for key, path in study["files"].items()]
    columns = (*varied, "measure", "value", "95 %", "printed", "inside")
    return Group(table_of(rows, columns), *(Text(line) for line in (*lines, "", *study["notes"])))


def grid_summary(seen: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab see`: the grid from above, y upwards, as the overhead camera shows it."""
    marks = {".": "·", "S": "S", "G": "G", "#": "█"}
    rows = ["".join(row) for row in seen["grid"]]
    turned = ["  ".join(marks[rows[i][j]] for i in range(len(rows))) for j in reversed(range(len(rows[0])))]
    ends = f"start {tuple(seen['start'])}, goal {tuple(seen['goal'])}"
    blocked, markers = counted(len(seen["obstacles"]), "cell"), counted(len(seen["markers"]), "marker")
    size_text = f"{ends}, {blocked} with obstacles, {markers}"
    return Group(*map(Text, turned), Text(size_text))


def pictures_summary(record: Mapping[str, Any]) -> RenderableType:
    """The text at the end of `lab see --calibrate`, `--make` and `--score`: one line per result."""
    if "lens" in record:
        lens, (x, y, z) = record["lens"], record["eye_m"]
        bends = ", ".join(f"{name} {value:+.4f}" for name, value in lens["distortion"].items())
        middle = f"({lens['middle'][0]:.1f}, {lens['middle'][1]:.1f})"
        lines = [
            f"lens: focal length {lens['focal'][0]:.1f} pixels, middle {middle}, {bends}",
            f"camera at ({x:.3f}, {y:.3f}, {z:.3f}) m; residual {record['residual_px']:.2f} pixels "
            f"over {record['points']} points, from {record['method']}",
        ]
    elif "exact" in record:
        lines = [f"{record['exact']} of {record['pictures']} grids exact ({record['exact_percent']:.1f} %)"]
        if record["marker_mean_m"] is not None:
            mean, most = 1e3 * record["marker_mean_m"], 1e3 * record["marker_max_m"]
            lines.append(f"markers seen {mean:.1f} mm off on average, {most:.1f} mm at the most")
        lines += [f"{picture['picture']}: {picture['reason']}" for picture in record["wrong"]]
    else:
        lines = [f"{counted(record['pictures'], 'picture')} of '{record['task']}' and {record['mats']} of the mat made"]
    return Group(*map(Text, [*lines, *(f"{name}: {path}" for name, path in record.get("files", {}).items())]))
