"""A whole way that a person has said at once, at the terminal or on the page: what is left of it, and where it leads."""

from collections.abc import Iterable

from lab.learning.requests import AdviceRequest, Request
from lab.seat.request_text import is_known


class PathAhead:
    """Moves that were typed or drawn at once, given one by one at the next questions of the episode, where they lead."""

    def __init__(self, request: AdviceRequest | None = None, moves: Iterable[int] = ()) -> None:
        self.request, self.left = request, list(moves)
        self._state, self._step = (-1, 0) if request is None else (request.state, request.step)

    def goes_on(self, request: Request) -> bool:
        """Whether this question comes where the path leads; where no table says that, whether it is the next one."""
        begun = self.request
        if not self.left or begun is None or not isinstance(request, AdviceRequest):
            return False
        if begun.mdp is not request.mdp or begun.episode != request.episode:
            return False
        return request.state == self._state if is_known(request.mdp) else request.step == self._step

    def step(self) -> int:
        """The next move."""
        assert self.request is not None
        action = self.left.pop(0)
        self._state, self._step = int(self.request.mdp.successor[self._state, action]), self._step + 1
        return action
