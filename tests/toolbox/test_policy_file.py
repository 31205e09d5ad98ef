"""The bytes of a policy's file."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from safetensors import safe_open

from lab.toolbox.names import hash_of
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import decode, encode

MakePolicy = Callable[..., Policy]
CODE = """
import sys
from pathlib import Path
from lab.toolbox.names import hash_of
from lab.toolbox.policy_file import decode, encode
sys.stdout.write(hash_of(encode(decode(Path(sys.argv[1]).read_bytes(), "file"))))
"""


def test_the_same_policy_gives_the_same_bytes_in_every_process(
    make_policy: MakePolicy, tmp_path: Path, root: Path
) -> None:
    """The library alone writes metadata in any order: each process would give another hash."""
    content = encode(make_policy(0.5, parent="insert@0123456789ab", scene="toast"))
    file = tmp_path / "insert.safetensors"
    file.write_bytes(content)
    ran = [
        subprocess.run([sys.executable, "-c", CODE, str(file)], cwd=root, capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    assert [one.stdout for one in ran] == [hash_of(content)] * 2


def test_others_read_it_and_its_tables_stand_at_multiples_of_8_bytes(make_policy: MakePolicy, tmp_path: Path) -> None:
    content = encode(make_policy(0.5, ends=np.zeros(4, np.uint8)))
    assert int.from_bytes(content[:8], "little") % 8 == 0
    (tmp_path / "file").write_bytes(content)
    with safe_open(tmp_path / "file", framework="np") as file:
        assert file.get_tensor("q").tolist() == [[0.5, 0.5]] * 4
        assert file.metadata()["name"] == '"insert"'


def test_a_table_that_was_read_can_be_learned_on(make_policy: MakePolicy) -> None:
    policy = decode(encode(make_policy()), "here")
    policy.q[0, 0] = 20.0
    assert policy.q.max() == 20.0
