import subprocess
import sys
from pathlib import Path

import pytest

AFTER = """
import sys
from lab.sequencing.methods.cp_sat_solver import cp_model
print("pandas" in sys.modules, *(name for name in sys.modules if name.startswith("pandas.")))
import pandas
model = cp_model.CpModel()
rooms = model.new_int_var_series("room", pandas.Index(["a", "b"]), 1, pandas.Series([2, 3], ["a", "b"]))
model.maximize(sum(rooms))
solver = cp_model.CpSolver()
solver.solve(model)
found = solver.values(rooms)
print(type(found) is pandas.Series, *map(int, found), pandas is sys.modules["pandas"], cp_model.pd.DataFrame is pandas.DataFrame)
try:
    model.new_bool_var_series("none", [1])
except TypeError:
    print("refused")
"""


def printed(code: str, root: Path) -> list[str]:
    """The lines that a new interpreter prints."""
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    return ran.stdout.splitlines()


def test_pandas_is_loaded_when_a_series_is_wanted_and_not_before(root: Path) -> None:
    assert printed(AFTER, root) == [
        "False",
        "True 2 3 True True",
        "refused",
    ]


@pytest.mark.parametrize("first", ["pandas", "ortools.sat.python.cp_model"])
def test_it_is_the_same_module_whoever_loads_it_first(root: Path, first: str) -> None:
    code = f"import {first}, ortools.sat.python.cp_model as theirs\nfrom lab.sequencing.methods.cp_sat_solver import cp_model\n"
    assert printed(code + "import pandas\nprint(cp_model is theirs, cp_model.pd is pandas)", root) == ["True True"]
