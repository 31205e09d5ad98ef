"""Where parts stand, and where there is room to set one down."""

from collections.abc import Collection
from math import cos, hypot, sin

from lab.production.trouble import Trouble
from lab.sim.parts.kinds import Spot, comes_as
from lab.sim.scene.scene import Scene, pallet_of
from lab.skills.skill import UPRIGHT, Bench
from lab.skills.skillset import Carried, SkillSet

ASTRAY_M = 0.15  # a part this near to a spot of a station is taken up by the station's own way
DELIVERED_M = 0.02  # a part this near to its spot has been delivered
FREE_M = 0.005  # around a part where it is set down, of what lies about


def free_spot(scene: Scene, name: str, way: Carried, taken: Collection[Spot], lying: Collection[str]) -> Spot:
    """The first spot at the end of a way that is not taken, and on which nothing of what lies about is. Raises Trouble."""
    blocked = ""
    for spot in scene.places.spots(scene.task.station(way.target)):
        if spot not in taken:
            blocked = blocked_by(scene, name, way, spot, lying)
            if not blocked:
                return spot
    why = f": {blocked} is there" if blocked else ""
    raise Trouble(f"no spot of '{way.target}' is free{why}", name, way.target, final=True)


def blocked_by(scene: Scene, name: str, way: Carried, spot: Spot, lying: Collection[str]) -> str:
    """Which of the bodies that lie about is where a part is to be set down; "" for none."""
    shape = scene.kinds[way.kind].shape
    half = max(abs(shape.low[0]), abs(shape.high[0])), max(abs(shape.low[1]), abs(shape.high[1]))
    c, s = abs(cos(spot.yaw)), abs(sin(spot.yaw))
    x, y = c * half[0] + s * half[1] + FREE_M, s * half[0] + c * half[1] + FREE_M
    for body in lying:
        low, high = scene.world.bounds(body)
        aside = low[0] > spot.x + x or high[0] < spot.x - x or low[1] > spot.y + y or high[1] < spot.y - y
        if not aside and high[2] > spot.z and body != name:
            return body
    return ""


def station_near(bench: Bench, body: str, way: Carried, skillset: SkillSet) -> str:
    """The station of the two on a way that a part stands at; its origin when it stands at neither."""
    at, places = bench.part_pose(body), bench.scene.places
    for station in (way.origin, way.target):
        foots = places.spots(bench.scene.task.station(station))
        near = any(hypot(at.x - foot.x, at.y - foot.y) < ASTRAY_M for foot in foots)
        if near and (way.kind, station) in skillset.picks:
            return station
    return way.origin


def stands(bench: Bench, name: str, spot: Spot) -> bool:
    """Whether a part, and its pallet, really stands on its spot."""
    scene = bench.scene
    kind = comes_as(scene.kind_of[name].part)
    for body, own in zip(scene.bodies_of(name, kind), scene.kinds[kind].stack(), strict=True):
        if not bench.stands(body, spot, DELIVERED_M, truly=True):
            return False
        spot = spot.raised(own.shape.height_m)
    return True


def has_fallen(bench: Bench, name: str) -> bool:
    """Whether a part is neither held nor upright."""
    return bench.held not in (name, pallet_of(name)) and bench.upright(name) < UPRIGHT
