"""Job shops with vehicles in JobShopLab's YAML: jobs, machines and travel times as tables within strings.

As in its simulator, vehicle n starts at machine n (modulo the number of machines); jobs start in the input buffer; machines have
unlimited room before and after them; the makespan ends with the last operation, without the transport to the output buffer. Its
vehicles set out for a part only once its machine works on it; here they may set out earlier.
Source: github.com/proto-lab-ro/jobshoplab.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import yaml

from lab.sequencing.cell.cell import MAX_PARTS
from lab.tasks.cell_file import CellFile
from lab.tasks.instances.job_shop import JobShop, Operation, in_layout
from lab.tasks.instances.layout import TravelTimes
from lab.tasks.instances.source import MOST_MACHINES, MOST_OPERATIONS, InstanceRequest, Source

MAX_YAML = 100_000  # bytes; the safe reader takes seconds for more
MOST_VEHICLES = 50
BUFFERS = {"input": "in-buf", "output": "out-buf"}
_LEFT_OUT = ("setup_times", "outages")  # keys of instance_config that the lab does not support
_JOB = re.compile(r"j([0-9]{1,4})\|(.*)")
_PAIR = re.compile(r"\(\s*([0-9]{1,9})\s*,\s*([0-9]{1,9})\s*\)")


@dataclass(frozen=True)
class _Yaml:
    """A place in a YAML file: a node with its line."""

    source: Source
    node: yaml.Node
    where: str = ""

    @property
    def line(self) -> int:
        return int(self.node.start_mark.line) + 1

    def get(self, key: str) -> "_Yaml | None":
        """The value under a key of this mapping; None where it has no such key."""
        where = f"{self.where}.{key}" if self.where else key
        if not isinstance(self.node, yaml.MappingNode):
            raise self.source.refusal(self.line, f"a mapping under '{self.where}', with '{key}'")
        values = [value for name, value in self.node.value if name.value == key]
        return _Yaml(self.source, values[0], where) if values else None

    def need(self, *keys: str) -> "_Yaml":
        """The value under a path of keys; raises BadInput, with line, where one is missing."""
        at = self
        for key in keys:
            below = at.get(key)
            if below is None:
                raise self.source.refusal(at.line, f"'{key}' in '{at.where or 'the file'}': it has none")
            at = below
        return at

    def table(self) -> Iterator[tuple[int, str]]:
        """The non-empty lines of a string, each with its number in the file."""
        if not isinstance(self.node, yaml.ScalarNode):
            raise self.source.refusal(self.line, f"a table as text under '{self.where}'")
        first = self.line + (1 if self.node.style in ("|", ">") else 0)
        for number, text in enumerate(self.node.value.splitlines(), first):
            if text.strip():
                yield number, text.strip()

    def whole(self, most: int) -> int:
        """The value as an integer from 1 to `most`."""
        word = self.node.value if isinstance(self.node, yaml.ScalarNode) else "a mapping or a list"
        return self.source.whole(word, self.line, f"'{self.where}'", 1, most)


def _parsed(source: Source) -> _Yaml:
    if len(source.text) > MAX_YAML:
        raise source.refusal(None, f"up to {MAX_YAML} characters of YAML", f"{len(source.text)}")
    try:
        node = yaml.compose(source.text, Loader=yaml.SafeLoader)  # nodes, since aliases cannot multiply them
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = None if mark is None else mark.line + 1
        raise source.refusal(line, f"YAML: {error.problem or error.context}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise source.refusal(
            None, f"YAML: {str(error).splitlines()[0] if str(error) else 'it nests too deep'}"
        ) from None
    if node is None:
        raise source.refusal(1, "'instance_config': the file is empty")
    return _Yaml(source, node)


def read(source: Source, asked: InstanceRequest) -> CellFile:
    """The cell of such a file; raises BadInput, with file and line, for a damaged one and for outages, tools and drawn times."""
    config = _parsed(source).need("instance_config")
    for key in _LEFT_OUT:
        if (refused := config.get(key)) is not None:
            raise source.refusal(refused.line, f"an instance without '{key}': the lab's cells do not have them")
    logistics = config.need("logistics")
    for part in (config.need("instance"), logistics):
        behaviour = part.get("time_behavior")
        if behaviour is not None and behaviour.node.value != "static":
            raise source.refusal(behaviour.line, "time_behavior: static: other times would be drawn")
    machines, jobs, lines = _jobs(source, config.need("instance", "specification"))
    layout = _travel(source, logistics.need("specification"), machines)
    transport, amount = config.need("instance").get("transport"), logistics.get("amount")
    amount = amount or (None if transport is None else transport.get("amount"))
    count = asked.robots or (len(jobs) if amount is None else amount.whole(MOST_VEHICLES))
    file = in_layout(source, JobShop(machines, jobs, lines), layout, count)
    begins = [f"m-{number % machines}" for number in range(count)]
    present = set(file.station_names)
    given = file.robots if file.robots is not None else (file.robot,)
    moved = [
        robot.model_copy(update={"start": at if at in present else robot.start})
        for robot, at in zip(given, begins, strict=True)
        if robot is not None
    ]
    update = {"robots": tuple(moved)} if file.robots is not None else {"robot": moved[0]}
    placed = file.model_copy(update=update)
    placed.cell()
    return placed


def _jobs(source: Source, spec: _Yaml) -> tuple[int, list[list[Operation]], list[int | None]]:
    """The number of machines in the head, the operations of each job, and the line of each job."""
    rows = list(spec.table())
    if not rows:
        raise source.refusal(spec.line, "a head such as (m0,t)|(m1,t) and a row a job: the table is empty")
    line, head = rows[0]
    machines = len(head.split("|"))
    if not head.startswith("(m") or machines > MOST_MACHINES:
        raise source.refusal(line, f"a head such as (m0,t)|(m1,t), up to {MOST_MACHINES} machines", head)
    if not 1 <= len(rows) - 1 <= MAX_PARTS:
        raise source.refusal(line, f"1 to {MAX_PARTS} jobs below it", len(rows) - 1)
    jobs = list[list[Operation]]()
    for number, (line, text) in enumerate(rows[1:]):
        match = _JOB.fullmatch(text)
        if match is None or int(match[1]) != number:
            raise source.refusal(line, f"the row of job {number}, such as j{number}|(0,3) (1,2)", text)
        pairs = _PAIR.findall(match[2])
        left = _PAIR.sub("", match[2]).strip()
        if left or not 1 <= len(pairs) <= MOST_OPERATIONS:
            raise source.refusal(line, f"1 to {MOST_OPERATIONS} pairs (machine,time) of job {number}", left or text)
        operations = list[Operation]()
        for step, (machine, time) in enumerate(pairs, 1):
            which = f"of operation {step} of job {number}"
            at = source.whole(machine, line, f"the machine {which}", 0, machines - 1)
            operations.append(((at, source.time(time, line, f"the time {which}")),))
        jobs.append(operations)
    return machines, jobs, [line for line, _ in rows[1:]]


def _travel(source: Source, spec: _Yaml, machines: int) -> TravelTimes:
    """The matrix of travel times without the output buffer; the input buffer is called in-buf."""
    rows = list(spec.table())
    head = [_station(name) for name in rows[0][1].split("|")] if rows else []
    wanted = {*(f"m-{number}" for number in range(machines)), BUFFERS["input"]}
    if set(head) - {BUFFERS["output"]} != wanted or len(head) != len(set(head)):
        line = rows[0][0] if rows else spec.line
        raise source.refusal(line, f"m-0 to m-{machines - 1}, in-buf and out-buf with | between", "|".join(head))
    travel = dict[str, dict[str, float]]()
    for line, text in rows[1:]:
        name, bar, rest = text.partition("|")
        times = rest.split()
        if not bar or _station(name) not in head or _station(name) in travel or len(times) != len(head):
            raise source.refusal(line, f"a row such as m-0|0 2 5, with {len(head)} times, once for each station", text)
        where = f"a time from '{name.strip()}'"
        travel[_station(name)] = {b: source.time(word, line, where) for b, word in zip(head, times, strict=True)}
    if len(travel) != len(head):
        raise source.refusal(rows[-1][0], f"{len(head)} rows of times", len(travel))
    end = BUFFERS["output"]
    used = {a: {b: time for b, time in row.items() if b != end} for a, row in travel.items() if a != end}
    return TravelTimes(source.path, _ordered([name for name in head if name != end]), used)


def _ordered(names: Sequence[str]) -> tuple[str, ...]:
    """The machines by their numbers, the buffers after them."""
    machines = [name for name in names if name.startswith("m-")]
    return (*sorted(machines, key=lambda name: int(name[2:])), *(name for name in names if name not in machines))


def _station(name: str) -> str:
    """The station's name, with one spelling for all that JobShopLab accepts for its two buffers."""
    plain = re.sub(r"[ _]", "-", name.strip().lower())
    for word, own in BUFFERS.items():
        if plain in (word, f"{word}-buffer", f"{word}buffer", own, own.replace("-", ""), f"{own[:-4]}-buffer"):
            return own
    return plain
