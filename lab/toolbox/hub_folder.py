"""A policy as a folder for the Hugging Face Hub: model card, safetensors file, metadata; writing and reading.

Source: https://huggingface.co/docs/hub/model-cards, and modelcard.md of huggingface/hub-docs for the card's header.
"""

import hashlib
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lab.errors import BadInput, printable
from lab.toolbox.archive import read_packed
from lab.toolbox.card import Event, last_evaluation
from lab.toolbox.policy import Policy
from lab.toolbox.policy_file import decode, described, encode

README, MODEL, CONFIG, ATTRIBUTES = "README.md", "model.safetensors", "config.json", ".gitattributes"
FORMAT = "teaching-lab-hub-1"
LIBRARY = "teaching-lab"
UNKNOWN_LICENSE = "unknown"  # the Hub's name for no chosen licence
TAGS = ("reinforcement-learning", "robotics", LIBRARY)
_LARGE = "".join(f"*.{suffix} filter=lfs diff=lfs merge=lfs -text\n" for suffix in ("png", "safetensors"))
_LICENSE = re.compile(r"[a-z0-9][a-z0-9.-]{0,60}")


def check_license(name: str) -> None:
    """Raises BadInput unless the name has the form of a licence name on the Hub."""
    if not _LICENSE.fullmatch(name):
        raise BadInput(
            f"licence '{name}' (--license): wanted a name that the Hub knows, such as mit, apache-2.0 or {UNKNOWN_LICENSE}"
        )


def hub_files(policy: Policy) -> dict[str, bytes]:
    """The files of the folder by name, without card and pictures."""
    content = encode(policy)
    config = {"format": FORMAT, "sha256": sha256(content), **described(policy)}
    return {
        MODEL: content,
        CONFIG: f"{json.dumps(config, indent=1, allow_nan=False)}\n".encode(),
        ATTRIBUTES: _LARGE.encode(),
    }


def sha256(content: bytes) -> str:
    """The hex digits of the content's SHA-256."""
    return hashlib.sha256(content).hexdigest()


def header(policy: Policy, license_name: str, events: Sequence[Event]) -> str:
    """The YAML header of a card on the Hub; its result is the last evaluation."""
    lines = ["---", f"license: {_text(license_name)}", f"library_name: {LIBRARY}", "tags:"]
    lines += [f"- {tag}" for tag in TAGS]
    evaluation = last_evaluation(events)
    if evaluation is not None:
        low, high = (end / 100 for end in evaluation["ci95"])
        lines += [
            "model-index:",
            f"- name: {_text(policy.name)}",
            "  results:",
            "  - task:",
            "      type: reinforcement-learning",
            "      name: reinforcement-learning",
            "    dataset:",
            f"      name: {_text('drawn scenes of ' + evaluation['task'])}",
            f"      type: {_text(evaluation['task'])}",
            "    metrics:",
            "    - type: success_rate",
            f"      value: {evaluation['success_percent'] / 100:.4f}",
            f"      name: share of {evaluation['scenes']} scenes that succeed, 95 % interval {low:.2f} to {high:.2f}",
        ]
    return "\n".join([*lines, "---", ""])


def _text(text: str) -> str:
    """The text as a double-quoted YAML string, which is also a JSON string."""
    return json.dumps(printable(text), ensure_ascii=False)


def read_folder(folder: Path) -> Policy:
    """The policy in such a folder. Raises BadInput unless the model's hash is the one in the metadata."""
    if not (folder / MODEL).is_file():
        raise BadInput(f"folder {folder}: it holds no {MODEL}, as a folder does that lab toolbox publish wrote")
    content = read_packed(folder / MODEL)
    policy, told = decode(content, str(folder / MODEL)), _config(folder)
    digest = sha256(content)
    if told["sha256"] != digest:
        raise BadInput(
            f"folder {folder}: {MODEL} has the SHA-256 {digest[:12]}..., {CONFIG} says {str(told['sha256'])[:12]}..."
        )
    return policy


def _config(folder: Path) -> dict[str, Any]:
    """The metadata in a folder. Raises BadInput if they cannot be read or have another format."""
    try:
        config = json.loads(read_packed(folder / CONFIG))
    except (ValueError, RecursionError) as error:
        raise BadInput(f"folder {folder}: {CONFIG} is not valid JSON: {error}") from error
    if not isinstance(config, dict) or config.get("format") != FORMAT or "sha256" not in config:
        raise BadInput(f"folder {folder}: {CONFIG} does not have the format '{FORMAT}' and the SHA-256 of {MODEL}")
    return config
