"""Where a live page may be shown inside another page, such as a notebook, and what a proxy on the way to it does."""

from dataclasses import dataclass
from pathlib import Path

NOWHERE = "frame-ancestors 'none'"
POLLING_SCRIPT = Path(__file__).with_name("polling.js")


@dataclass(frozen=True)
class Framing:
    """The pages that may show a live page in a frame, and how requests to it arrive there.

    ancestors: sources of a content security policy, such as "https://hub.example.org"; hosts: names in requests besides those of
    this computer, "*.example.org" for all below one; origin: of the page behind a proxy, from which its websocket is opened, ""
    for 127.0.0.1; polls: whether the page asks for its news by GET requests, because the proxy passes no websockets.
    """

    ancestors: tuple[str, ...]
    hosts: tuple[str, ...] = ()
    origin: str = ""
    polls: bool = False

    def policy(self, policy: str) -> str:
        """A page's content security policy that allows this framing, and the websocket to the origin."""
        if self.origin:
            socket = self.origin.replace("http", "ws", 1)
            policy = policy.replace("connect-src 'self'", f"connect-src 'self' {socket}")
        return policy.replace(NOWHERE, f"frame-ancestors {' '.join(self.ancestors)}")
