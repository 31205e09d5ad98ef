"""A folder as the Hub has it: its header is YAML of the documented form, and it is read again or refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from lab.errors import BadInput
from lab.toolbox.hub_folder import check_license, header, hub_files, read_folder, sha256
from lab.toolbox.policy import Policy, is_name
from lab.toolbox.policy_file import encode

EVALUATED = {
    "time": "2026-05-03T09:08:07+00:00",
    "what": "evaluated",
    "task": "my: toast # 2",
    "seed": 7,
    "scenes": 20,
    "successes": 17,
    "success_percent": 85.0,
    "ci95": [64.0, 94.8],
}
Make = Callable[..., Policy]


@pytest.fixture
def folder(tmp_path: Path, make_policy: Make) -> Path:
    for name, content in hub_files(make_policy(name="insert it")).items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


def read(text: str) -> Any:
    """The YAML between the two lines of a card's header."""
    assert text.startswith("---\n")
    assert text.endswith("\n---\n")
    return yaml.safe_load(text[4:-4])


def test_the_header_is_of_the_documented_form(make_policy: Make) -> None:
    policy = make_policy(name='say: "hi" # now')
    plain = {
        "license": "mit",
        "library_name": "teaching-lab",
        "tags": ["reinforcement-learning", "robotics", "teaching-lab"],
    }
    assert read(header(policy, "mit", [])) == plain
    measured = {
        "type": "success_rate",
        "value": 0.85,
        "name": "share of 20 scenes that succeed, 95 % interval 0.64 to 0.95",
    }
    result = {
        "task": {"type": "reinforcement-learning", "name": "reinforcement-learning"},
        "dataset": {"name": "drawn scenes of my: toast # 2", "type": "my: toast # 2"},
        "metrics": [measured],
    }
    index = [{"name": policy.name, "results": [result]}]
    assert read(header(policy, "mit", [EVALUATED])) == plain | {"model-index": index}


@given(st.text(min_size=1, max_size=40).filter(is_name))
def test_any_name_stands_in_the_header(make_policy: Make, name: str) -> None:
    (entry,) = read(header(make_policy(name=name), "mit", [EVALUATED]))["model-index"]
    assert entry["name"] == name


@pytest.mark.parametrize("name", ["", "MIT", "my licence", "a\nb: c", "-x"])
def test_a_licence_that_is_no_name(name: str) -> None:
    with pytest.raises(BadInput, match=r"\(--license\): wanted a name that the Hub knows"):
        check_license(name)


def test_what_is_written_is_read_again(folder: Path, make_policy: Make) -> None:
    assert encode(read_folder(folder)) == encode(make_policy(name="insert it"))
    config = json.loads((folder / "config.json").read_text())
    assert config["sha256"] == sha256((folder / "model.safetensors").read_bytes())
    assert (config["name"], config["states"], config["action_labels"]) == ("insert it", 4, ["left", "right"])
    assert "*.safetensors filter=lfs" in (folder / ".gitattributes").read_text()


@pytest.mark.parametrize(
    ("file", "content", "said"),
    [
        ("model.safetensors", None, "it holds no model.safetensors, as a folder does that lab toolbox publish wrote"),
        ("model.safetensors", b"version https://git-lfs.github.com/spec/v1\n", "model.safetensors: "),
        ("config.json", None, "config.json: there is no such file"),
        ("config.json", b"{", "config.json is not valid JSON"),
        ("config.json", b"\xff", "config.json is not valid JSON"),
        ("config.json", b"[]", "config.json does not have the format 'teaching-lab-hub-1'"),
        ("config.json", b'{"format": "teaching-lab-hub-1", "sha256": "0"}', "config.json says 0..."),
    ],
)
def test_a_folder_that_does_not_fit_together(folder: Path, file: str, content: bytes | None, said: str) -> None:
    (folder / file).unlink() if content is None else (folder / file).write_bytes(content)
    with pytest.raises(BadInput) as caught:
        read_folder(folder)
    assert said in str(caught.value)
