"""What is measured with the lab: every test here is marked, so that `-m "not studies"` leaves them out."""

from pathlib import Path

import pytest
from sequencing_cells import cells, fms_cell, oven_cell, toast_cell

from tests.studies.conftest import cluster

__all__ = ["cells", "cluster", "fms_cell", "oven_cell", "toast_cell"]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of this folder."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.studies)
