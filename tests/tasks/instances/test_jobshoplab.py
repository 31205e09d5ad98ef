"""JobShopLab's YAML: jobs and travel times as tables within strings, vehicles that begin at the machines."""

from collections.abc import Callable

import pytest

from lab.tasks.cell_file import CellFile
from lab.tasks.instances import InstanceRequest

TEXT = """title: InstanceConfig
instance_config:
  description: "two jobs"
  instance:
    description: "two"
    specification: |
      (m0,t)|(m1,t)
      j0|(0,3) (1,2)
      j1|(1,4) (0,1)
  logistics:
    type: agv
    amount: 2
    specification: |
      m-0|m-1|in-buf|out-buf
      m-0|0 2 5 6
      m-1|2 0 5 6
      in-buf|5 5 0 9
      out-buf|6 6 9 0
"""


def test_vehicles_begin_at_the_machines_and_jobs_end_with_their_last_operation(read: Callable[..., CellFile]) -> None:
    cell = read(TEXT, "two.yaml").cell()
    assert [robot.start for robot in cell.robots] == ["m-0", "m-1"]
    ways = [[stage.station for stage in product.routes[0]] for product in cell.products]
    assert ways == [["in-buf", "m-0", "m-1"], ["in-buf", "m-1", "m-0"]]
    assert cell.loaded_s[cell.index("in-buf"), cell.index("m-1")] == 5.0
    assert len(read(TEXT, "two.yaml", InstanceRequest(robots=1)).cell().robots) == 1


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "(1,4) (0,1)",
            "(1,4) (2,1)",
            "line 9: wanted the machine of operation 2 of job 1, a whole number from 0 to 1, not '2'",
        ),
        ("(1,4) (0,1)", "(1,4) (0,1", "line 9: wanted 1 to 99 pairs (machine,time) of job 1, not '(0,1'"),
        ("j1|", "j2|", "line 9: wanted the row of job 1, such as j1|(0,3) (1,2), not 'j2|(1,4) (0,1)'"),
        ("m-1|2 0 5 6", "m-1|2 0 5", "line 16: wanted a row such as m-0|0 2 5, with 4 times, once for each station"),
        (
            "amount: 2",
            "amount: many",
            "line 12: wanted 'instance_config.logistics.amount', a whole number from 1 to 50, not 'many'",
        ),
        ("  logistics:", "  trucks:", "line 3: wanted 'logistics' in 'instance_config': it has none"),
        ("    type: agv", "   type: agv", "line 12: wanted YAML: mapping values are not allowed here"),
        ("    type: agv", "    time_behavior: uniform", "line 11: wanted time_behavior: static"),
        ("    type: agv", "    type: *agv", "line 11: wanted YAML: found undefined alias 'agv'"),
    ],
)
def test_a_damaged_file_is_refused_with_its_line(
    refused: Callable[..., str], old: str, new: str, expected: str
) -> None:
    assert refused(TEXT.replace(old, new), "two.yaml").startswith(f"two.yaml: {expected}")
