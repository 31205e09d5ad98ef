"""What tests of instance files share: a text as a file's cell, and the one line with which a damaged one is refused."""

from collections.abc import Callable
from pathlib import Path

import pytest

from lab.errors import BadInput
from lab.tasks.cell_file import CellFile
from lab.tasks.instances import InstanceRequest, read_instance

LAYOUT = "from,to,time\nLU,M1,6\nLU,M2,8\nM1,LU,12\nM1,M2,6\nM2,LU,10\nM2,M1,6\n"  # the way back is another one


@pytest.fixture
def layout(tmp_path: Path) -> Path:
    path = tmp_path / "layout.csv"
    path.write_text(LAYOUT)
    return path


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., CellFile]:
    def of(text: str, name: str = "mine", asked: InstanceRequest | None = None) -> CellFile:
        path = tmp_path / name
        path.write_text(text)
        return read_instance(path, asked)

    return of


@pytest.fixture
def refused(read: Callable[..., CellFile]) -> Callable[..., str]:
    """The refusal of a text, without the folder."""

    def of(text: str, name: str = "mine", asked: InstanceRequest | None = None) -> str:
        with pytest.raises(BadInput) as caught:
            read(text, name, asked)
        message = str(caught.value)
        assert "\n" not in message
        return message[message.index(name) :] if name in message else message

    return of
