"""The contract of studies: rows with a measure and a value, valid as JSON, the same for the same seed."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory

from lab.studies import STUDIES, Run, Study, carried_out
from lab.studies.runner import Job
from lab.testing.requirement import require


def check_study(study: str | Study | Run) -> None:
    """Tests a study, given by name, as a `Study`, or as a function of a job and a reading, with its fewest sessions."""
    if isinstance(study, str):
        tested, name = STUDIES[study], study
    else:
        tested = study if isinstance(study, Study) else Study(study.__name__, study, least=2)
        name = tested.title
    first, again = (tested.run(Job(tested.least, seed=1), {}) for _ in range(2))
    require(bool(first.rows), f"study '{name}': it has no rows")
    for row in first.rows:
        require({"measure", "value"} <= {*row}, f"study '{name}': a row has no measure or value: {row}")
        json.dumps(row, allow_nan=False)
    require(first.rows == again.rows, f"study '{name}': the same seed gives other rows")
    with TemporaryDirectory() as folder:
        document = carried_out(tested, "study", Job(tested.least, seed=1), Path(folder) / "out")
        require(all(Path(file).is_file() for file in document["files"].values()), f"study '{name}': a file is missing")
