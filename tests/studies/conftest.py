"""What the tests of studies share."""

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The address of a Dask cluster in this process."""
    distributed = pytest.importorskip("distributed", reason="no Dask: install the extra 'dask'")
    local: dict[str, Any] = {"host": "127.0.0.1", "protocol": "tcp", "dashboard_address": None}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, **local) as running:
        yield running.scheduler_address
