"""Names such as "gym:FrozenLake-v1?is_slippery=false": parsing them, making the environment, one-line errors."""

import inspect
import json
import sys
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

import gymnasium
from gymnasium import error as refused
from gymnasium.envs.registration import load_env_creator

from lab.errors import BadInput, unknown
from lab.gym import symbolic_view
from lab.gym.our_environments import register
from lab.optional import optional

PREFIX = "gym:"
WANTED = "wanted gym:ID, or gym:ID?KEYWORD=VALUE&..., such as gym:FrozenLake-v1?is_slippery=false"
OWN = ("render_mode", "disable_env_checker")  # keywords that the lab itself passes
_CONSTANTS: dict[str, object] = {"true": True, "false": False, "null": None, "none": None}

Env = gymnasium.Env[Any, Any]


@dataclass(frozen=True)
class GymName:
    """The arguments of `gymnasium.make`: an id, possibly "module:id", and keywords."""

    id: str
    options: Mapping[str, object]

    @property
    def module(self) -> str:
        """The module that is imported to make the environment, "" if the id names none."""
        return self.id.partition(":")[0] if ":" in self.id else ""

    def __str__(self) -> str:
        written = "&".join(f"{key}={json.dumps(value)}" for key, value in self.options.items())
        return f"{self.id}?{written}" if written else self.id


def names_environment(word: str) -> bool:
    """Whether a word names a Gymnasium environment."""
    return word.startswith(PREFIX)


def parse_name(word: str, where: str) -> GymName:
    """The parsed name "gym:ID?KEYWORD=VALUE&...".

    Values are true, false, null, numbers, JSON lists and strings, or plain text, URL-encoded. Raises BadInput, with `where`.
    """
    made, asked, query = word.removeprefix(PREFIX).partition("?")
    if not names_environment(word) or not made or not word.isprintable():
        raise BadInput(f"environment '{word}' ({where}): {WANTED}")
    options: dict[str, object] = {}
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=True) if asked else []
    except ValueError:
        raise BadInput(f"environment '{word}' ({where}): '{query}' is no query: {WANTED}") from None
    for key, value in pairs:
        if not key.isidentifier() or key in options or key in OWN:
            why = "stands there twice" if key in options else "cannot be given"
            raise BadInput(f"environment '{word}' ({where}): keyword '{key}' {why}: {WANTED}")
        options[key] = _literal(value)
    return GymName(made, options)


def _literal(text: str) -> object:
    """The value of a Python constant or JSON text; any other text unchanged."""
    if text.lower() in _CONSTANTS:
        return _CONSTANTS[text.lower()]
    try:
        return json.loads(text, parse_constant=str)
    except (ValueError, RecursionError):
        return text


def quiet() -> "warnings.catch_warnings[None]":
    """A context that suppresses the warnings of Gymnasium and of environments."""
    return warnings.catch_warnings(action="ignore")


def make(name: GymName, where: str, render_mode: str | None = None) -> Env:
    """The environment of that name, whose module may be in the current folder. Raises BadInput if it cannot be made."""
    register()
    if name.id.rpartition(":")[2].startswith(symbolic_view.PREFIX):
        return _minigrid(name, where, render_mode)
    mode = {} if render_mode is None else {"render_mode": render_mode}
    here = str(Path.cwd())
    adds = bool(name.module) and here not in sys.path
    if adds:
        sys.path.append(here)
    try:
        with quiet():
            return gymnasium.make(name.id, disable_env_checker=True, **mode, **name.options)  # type: ignore[arg-type]
    except Exception as error:
        raise _refusal(name, where, error) from None
    finally:
        if adds:
            sys.path.remove(here)


def _minigrid(name: GymName, where: str, render_mode: str | None) -> Env:
    """A world of MiniGrid by its symbolic view; its keyword `seed`, default 0, draws the layout."""
    with optional(f"environment '{name}' ({where})"):
        import minigrid  # noqa: F401, it registers its worlds
    options = {key: value for key, value in name.options.items() if key != "seed"}
    try:
        with quiet():
            env = gymnasium.make(name.id, disable_env_checker=True, **options).unwrapped  # type: ignore[arg-type]
            if symbolic_view.is_minigrid(env):
                which = f"environment '{name}' ({where})"
                return symbolic_view.SymbolicEnv(env, name.options.get("seed", 0), which, render_mode)
    except BadInput:
        raise
    except Exception as error:
        raise _refusal(name, where, error) from None
    return env


def said(error: Exception) -> str:
    """The type and the text of a foreign error in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


def _refusal(name: GymName, where: str, error: Exception) -> BadInput:
    """The error for an environment that cannot be made."""
    which = f"environment '{name}' ({where})"
    match error:
        case BadInput():
            return BadInput(f"{which}: {error}")
        case refused.UnregisteredEnv():
            return unknown("Gymnasium environment", name.id, _discrete(), f"{where}; one of your own is gym:MODULE:ID")
        case ImportError() | refused.DependencyNotInstalled():
            return BadInput(f"{which}: it needs what is not installed: {said(error)}")
        case TypeError() if name.options:
            known = _keywords(name)
            wrong = sorted(set(name.options) - set(known)) if known else []
            if wrong:
                return unknown("keyword", wrong[0], known, which)
    given = f" with {', '.join(name.options)}" if name.options else ""
    return BadInput(f"{which}: it cannot be made{given}: {said(error)}")


def _discrete() -> list[str]:
    """The registered ids that may be discrete: Gymnasium's toy-text environments, and those of other packages."""
    modules = {
        spec.id: str(getattr(spec.entry_point, "__module__", spec.entry_point)) for spec in gymnasium.registry.values()
    }
    return [name for name, module in modules.items() if not module.startswith("gymnasium.envs") or "toy_text" in module]


def _keywords(name: GymName) -> list[str]:
    """The keywords that an environment takes; [] if it takes any, or if its signature cannot be read."""
    try:
        with quiet():
            maker: Any = gymnasium.spec(name.id.rpartition(":")[2]).entry_point
            parameters = inspect.signature(load_env_creator(maker) if isinstance(maker, str) else maker).parameters
    except (TypeError, ValueError):
        return []
    if any(p.kind is inspect.Parameter.VAR_KEYWORD for p in parameters.values()):
        return []
    return [*(key for key in parameters if key not in OWN), "max_episode_steps"]
