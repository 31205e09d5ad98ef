"""The address of a language model: a server that speaks the chat-completions form, the model's name, and limits."""

from contextlib import suppress
from dataclasses import dataclass, replace
from ipaddress import ip_address
from math import isfinite
from urllib.parse import urlsplit

from lab.errors import BadInput, shortened

WANTED = "llm:http://127.0.0.1:8080/v1#MODEL"
ENDPOINT = "/chat/completions"
KEY = "LAB_LLM_KEY"  # the environment variable that holds the key
UNENCRYPTED = "unencrypted"  # the word that allows the key to be sent by http to another computer
TIMEOUT_S, LONGEST_S = 10.0, 600.0
MOST_CALLS = 1000
MOST_CHARACTERS = 500


@dataclass(frozen=True)
class ModelAddress:
    """A parsed address.

    scheme: "http" or "https"; host, port, path: of the endpoint; model: its name, "" if the server has one; timeout_s: for one
    answer [s]; most_calls: of one command; unencrypted: whether a key may be sent by http to another computer.
    """

    scheme: str
    host: str
    port: int
    path: str
    model: str = ""
    timeout_s: float = TIMEOUT_S
    most_calls: int = MOST_CALLS
    unencrypted: bool = False

    @classmethod
    def of(cls, text: str) -> "ModelAddress":
        """The address in "http://127.0.0.1:8080/v1#MODEL,timeout=30,calls=200,unencrypted"; all after # may be left out.

        Raises BadInput for anything else. A text that may hold a password or a key is not repeated in the error.
        """
        if not (text.isascii() and text.isprintable() and " " not in text and len(text) <= MOST_CHARACTERS):
            raise BadInput(f"its address is no URL: wanted printable ASCII without spaces, such as {WANTED}")
        try:
            parts = urlsplit(text)
            host, port, secret = parts.hostname, parts.port, parts.username or parts.password or parts.query
        except ValueError:
            raise BadInput(f"its address is no URL: wanted {WANTED}") from None
        if secret or "@" in parts.netloc or "?" in text.partition("#")[0]:
            raise BadInput(f"its address holds a user, a password or a query: the key belongs in {KEY} (environment)")
        if parts.scheme not in ("http", "https") or not host or port == 0:
            raise BadInput(f"'{shortened(text)}' is no address of a server: wanted {WANTED}, http or https")
        path = parts.path.rstrip("/") or "/v1"
        path = path if path.endswith(ENDPOINT) else path + ENDPOINT
        model, *words = parts.fragment.split(",")
        if "=" in model or model == UNENCRYPTED:
            model, words = "", [model, *words]
        own = cls(parts.scheme, host, port or (443 if parts.scheme == "https" else 80), path, model)
        return own._limited(words)

    def _limited(self, words: list[str]) -> "ModelAddress":
        """The address with the limits that these words set. Raises BadInput."""
        timeout_s, most_calls, unencrypted = self.timeout_s, self.most_calls, False
        for word in words:
            name, _, value = word.partition("=")
            number = 0.0
            with suppress(ValueError):
                number = float(value)
            if word == UNENCRYPTED:
                unencrypted = True
            elif name == "timeout" and isfinite(number) and 0.0 < number <= LONGEST_S:
                timeout_s = number
            elif name == "calls" and value.isdecimal() and 0 < number <= 1_000_000:
                most_calls = int(value)
            else:
                raise BadInput(
                    f"'{shortened(word)}' after the model's name: wanted timeout=SECONDS (up to {LONGEST_S:g}), "
                    f"calls=NUMBER (at least 1) or {UNENCRYPTED}"
                )
        return replace(self, timeout_s=timeout_s, most_calls=most_calls, unencrypted=unencrypted)

    @property
    def is_local(self) -> bool:
        """Whether the server is on this computer."""
        if self.host == "localhost":
            return True
        with suppress(ValueError):
            return ip_address(self.host).is_loopback
        return False

    @property
    def server(self) -> str:
        """Host and port."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"
