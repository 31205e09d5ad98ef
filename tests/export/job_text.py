"""Reads job files and URScript as a controller's programmer would, by a page of rules, without the lab's export.

MOVL and movel are straight lines. Position level n begins an arc LEVELS_MM[n] before the position and ends it as far
behind, at most half of the shorter line; level 0 stops; r is such a length itself. Angles turn evenly along a line, and along two
lines and their arc.
"""

import re
from dataclasses import dataclass, field

import numpy as np

LEVELS_MM = (0.0, 2.0, 4.0, 8.0, 15.0, 20.0, 30.0, 40.0, 50.0)
STEP_MM = 0.25


@dataclass
class Stretch:
    """Moves between two signals: poses x, y, z [mm], Rz [degrees], and roundings [mm]."""

    poses: list[np.ndarray] = field(default_factory=list)
    roundings: list[float] = field(default_factory=list)

    def sampled(self) -> np.ndarray:
        """Points (n, 4) every STEP_MM."""
        corners = np.array(self.poses)
        corners[:, 3] = np.degrees(np.unwrap(np.radians(corners[:, 3])))
        lengths = np.linalg.norm(np.diff(corners[:, :3], axis=0), axis=1)
        rows, begin = [corners[:1]], corners[0]
        for k in range(1, len(corners)):
            room = 0.0
            if self.roundings[k] and k < len(corners) - 1:
                room = min(self.roundings[k], lengths[k - 1] / 2, lengths[k] / 2)
            entry = corners[k] + (corners[k - 1] - corners[k]) * (room / max(lengths[k - 1], 1e-9))
            rows.append(_line(begin, entry))
            begin = entry
            if room:
                begin = corners[k] + (corners[k + 1] - corners[k]) * (room / lengths[k])
                rows.append(_arc(entry, corners[k], begin))
        return np.concatenate(rows)


def _line(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    count = max(2, int(np.linalg.norm(end[:3] - start[:3]) / STEP_MM), int(abs(end[3] - start[3]) / 0.1))
    return np.asarray(start + (end - start) * np.linspace(0.0, 1.0, count)[:, None])


def _arc(start: np.ndarray, corner: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The circle that touches both lines, at `start` and at `end`, which are equally far from `corner`."""
    u, v = (corner - start)[:3], (end - corner)[:3]
    turn = np.arccos(np.clip(u @ v / np.linalg.norm(u) / np.linalg.norm(v), -1.0, 1.0))
    if turn < 1e-3 or turn > np.pi - 1e-3:
        return np.vstack([_line(start, corner), _line(corner, end)])
    u = u / np.linalg.norm(u)
    side = v / np.linalg.norm(v) - np.cos(turn) * u
    side = side / np.linalg.norm(side)
    radius = np.linalg.norm((corner - start)[:3]) / np.tan(turn / 2)
    share = np.linspace(0.0, 1.0, max(8, int(radius * turn / STEP_MM)))
    angle = (share * turn)[:, None]
    places = start[:3] + radius * (np.sin(angle) * u + (1.0 - np.cos(angle)) * side)
    return np.column_stack([places, start[3] + share * (end[3] - start[3])])


def stretches(text: str) -> list[Stretch]:
    """The moves of one job's text, cut at all that is no MOVL; a stretch begins where the one before ended."""
    positions = {
        int(number): np.array([float(word) for word in words.split(",")])[[0, 1, 2, 5]]
        for number, words in re.findall(r"^C(\d{5})=(\S+)$", text.replace("\r", ""), re.MULTILINE)
    }
    found: list[Stretch] = []
    here: np.ndarray | None = None
    open_ = False
    for line in text.replace("\r", "").partition("\nNOP\n")[2].splitlines():
        if move := re.fullmatch(r"MOV([JL]) C(\d{5}) .*?(?:PL=(\d))?", line):
            at = positions[int(move[2])]
            if move[1] == "L":
                if not open_:
                    assert here is not None
                    found.append(Stretch([here], [0.0]))
                found[-1].poses.append(at)
                found[-1].roundings.append(LEVELS_MM[int(move[3])])
            here, open_ = at, move[1] == "L"
        else:
            open_ = False
    return found


def script_stretches(text: str) -> list[Stretch]:
    """The same of a part of a URScript program; rx, ry, rz are half a turn about an axis that lies flat, at half of Rz."""
    found: list[Stretch] = []
    here, open_ = np.zeros(4), False
    for line in map(str.strip, text.splitlines()):
        if not (move := re.fullmatch(r"move([jl])\(p\[(.*)\], a=.*?(?:, r=(.*))?\)", line)):
            open_ = False
            continue
        x, y, z, rx, ry, rz = map(float, move[2].split(","))
        assert abs(np.hypot(rx, ry) - np.pi) < 1e-4
        assert rz == 0.0
        at = np.array([1000.0 * x, 1000.0 * y, 1000.0 * z, np.degrees(2.0 * np.arctan2(ry, rx))])
        if move[1] == "l":
            if not open_:
                found.append(Stretch([here], [0.0]))
            found[-1].poses.append(at)
            found[-1].roundings.append(1000.0 * float(move[3]))
        here, open_ = at, move[1] == "l"
    return found


def moves(text: str) -> int:
    """How many moves of any kind a text has."""
    return len(re.findall(r"^ *(?:MOV[A-Z] |move[a-z]\()", text, re.MULTILINE))


def signals(text: str) -> list[str]:
    """What a job tells and asks, in order, its moves as "-"."""
    lines = [line for line in text.replace("\r", "").partition("\nNOP\n")[2].splitlines() if line[:1] not in "'"]
    words = ["-" if line.startswith("MOV") else line for line in lines]
    return [word for at, word in enumerate(words) if word != "-" or words[at - 1 : at] != ["-"]]


def farthest(points: np.ndarray, line: np.ndarray) -> tuple[float, float]:
    """How far [mm] and by what turn [degrees] points (n, 4) are off the nearest of a sampled line (m, 4), at the worst."""
    mm, degrees = 0.0, 0.0
    counted = np.array([1.0, 1.0, 1.0, 2.6])  # a degree counts as 2.6 mm in what is nearest
    for point in points:
        gaps = line - point
        gaps[:, 3] = (gaps[:, 3] + 90.0) % 180.0 - 90.0
        nearest = gaps[int(np.argmin(((gaps * counted) ** 2).sum(axis=1)))]
        mm, degrees = max(mm, float(np.linalg.norm(nearest[:3]))), max(degrees, abs(float(nearest[3])))
    return mm, degrees
