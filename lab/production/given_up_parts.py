"""Parts that were given up: their state when they were left, and whether they can be brought on after all."""

from dataclasses import dataclass, replace

from lab.production.answers import with_room
from lab.production.floor import Floor
from lab.production.parts_in_machines import PartsInMachines
from lab.production.perception import BELOW_M, seen_at
from lab.production.run_state import GivenUp, RunState
from lab.production.standing import DELIVERED_M, too_near
from lab.sim.parts.kinds import Spot
from lab.skills.skill import UPRIGHT
from lab.teaching.events import PartLost


@dataclass(frozen=True)
class GivenUpParts:
    """The given-up parts of a job, in `RunState.lost` and `RunState.given_up`."""

    floor: Floor
    state: RunState
    machines: PartsInMachines

    def lose(self, part: int, why: str, left: GivenUp | None = None) -> None:
        """Gives a part up and tells why; left: its state, None: the present one."""
        state, name = self.state, self.state.name(part)
        state.lost[part] = why
        if (left := left or self.as_left(part)) is not None:
            state.given_up[part] = left
        state.left_lying.add(name)
        state.spot_of.pop(name, None)
        state.finished.pop(part, None)
        state.to_put_back = [other for other in state.to_put_back if other != part]
        self.floor.tell(PartLost(name, why, self.floor.now_s))

    def as_left(self, part: int, astray: bool = False) -> GivenUp | None:
        """The state of a part that is given up now; None if it cannot be brought on later."""
        state, work = self.state, self.machines.work_on(part)
        position = state.plan.locations[part - 1]
        if position >= len(state.cell.laid_out):
            return None
        undone = part in state.to_put_back or (work is not None and not work.done(self.floor.now_s))
        return GivenUp(position, state.spot_of.get(state.name(part)), undone, astray, state.finished.get(part))

    def found(self, attended: bool) -> dict[int, GivenUp]:
        """The parts that can be brought on now, with the states in which they were left; those without room yet come last.

        attended: a person has put things right; parts that were given up although they could be taken up then count, too.
        """
        state = self.state
        asked = {part: left for part, left in state.given_up.items() if attended or left.astray}
        back = {part: left for part, left in asked.items() if self._is_back(part, left)}
        standing = {part for part, left in back.items() if left.spot is not None and self._stands(part, left.spot)}
        ready, later = with_room(state, back, standing)
        state.given_up |= {part: replace(left, astray=True) for part, left in later.items()}
        return ready

    def take_back(self, part: int, left: GivenUp) -> None:
        """Returns a given-up part to the job."""
        state, name = self.state, self.state.name(part)
        del state.given_up[part], state.lost[part]
        state.left_lying.discard(name)
        stands = left.spot is not None and self._stands(part, left.spot)
        state.spot_of[name] = left.spot if left.spot is not None and stands else seen_at(self.floor, name)
        if left.finished_s is not None:
            state.finished[part] = left.finished_s
        if left.undone or (left.finished_s is not None and not stands):
            self.machines.begin_again(part, stands)

    def _is_back(self, part: int, left: GivenUp) -> bool:
        """Whether a given-up part can be brought on: it stands where it was left, or can be taken up elsewhere."""
        cell = self.state.cell
        if left.undone and cell.names[cell.laid_out[left.position].station] in self.state.out:
            return False
        return (left.spot is not None and self._stands(part, left.spot)) or self._can_be_taken_up(part)

    def _stands(self, part: int, spot: Spot) -> bool:
        """Whether a part is seen standing upright on a spot."""
        floor, name = self.floor, self.state.name(part)
        upright = not floor.world.dark and floor.bench.upright(name) >= UPRIGHT
        return upright and floor.bench.stands(name, spot, DELIVERED_M)

    def _can_be_taken_up(self, part: int) -> bool:
        floor, name = self.floor, self.state.name(part)
        at = seen_at(floor, name)
        reached = floor.scene.robot.arm.inverse(floor.bench.part_pose(name)) is not None
        stands = at.z > BELOW_M and floor.bench.upright(name) >= UPRIGHT and not too_near(floor.bench, name)
        return not floor.world.dark and stands and reached
