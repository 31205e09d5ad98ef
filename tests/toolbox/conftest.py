"""What the tests of the toolbox stand on: small policies, and an object store on this machine."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lab.toolbox.policy import Policy

MakePolicy = Callable[..., Policy]


@pytest.fixture(scope="session")
def make() -> MakePolicy:
    """Makes a policy: make(name="insert", solved=False); `fill` is what its table holds."""
    return _made


def _made(fill: float = 0.0, **changed: Any) -> Policy:
    base = Policy(
        name="insert",
        subtask="insert",
        task="toast",
        q=np.full((4, 2), float(fill)),
        visits=np.zeros((4, 2), dtype=np.int64),
        action_labels=("left", "right"),
        shape=(4,),
        start=0,
        signature="0123456789abcdef",
        learner={"learner": "q", "alpha": 0.95},
        gate={"gate": "ccrl"},
        advisor="expert",
        seed=0,
        curve=[21, 3],
        guided=[False, True],
        helped_steps=3,
        requests=1,
        optimal_steps=3,
        final_steps=3,
        solved=True,
        created="2026-05-01T12:00:00+00:00",
        versions={"numpy": "2.0"},
    )
    return replace(base, **changed)


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of its own, and one for data."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(scope="session")
def s3_server() -> Iterator[str]:
    """The address of an S3 server on this machine."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    yield f"http://{host}:{port}"
    listening = server._server
    server.stop()
    assert listening is not None
    listening.server_close()


@pytest.fixture
def bucket(s3_server: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """An address in an empty bucket of that server."""
    from s3fs import S3FileSystem

    for name, value in (
        ("AWS_ENDPOINT_URL", s3_server),
        ("AWS_ACCESS_KEY_ID", "test"),
        ("AWS_SECRET_ACCESS_KEY", "test"),
        ("AWS_DEFAULT_REGION", "us-east-1"),
    ):
        monkeypatch.setenv(name, value)
    S3FileSystem.clear_instance_cache()
    store = S3FileSystem()
    if store.exists("lab"):
        store.rm("lab", recursive=True)
    store.mkdir("lab")
    return "s3://lab/box"
