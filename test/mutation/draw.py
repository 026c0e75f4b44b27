"""Which breaks are made: drawn by a seed from all that the operators find in the rooms' sources."""

import hashlib
import pathlib
from typing import NamedTuple

import operators

# A room's sources are the *.cpp below src/ROOM, without those of rooms inside it, and a kernel's
# headers, which are its code.
PHYSICS = (
    "base",
    "episode",
    "robots",
    "robots/bipedal_walker",
    "robots/hopper",
    "robots/mujoco",
    "robots/walker2d",
)
ROS = ("agents", "client", "description", "nodes", "replay", "ros", "server", "wire")
# Not compiled here, or for no test to see: for other processors.
OTHERS = ("kernel_neon",)


class Side(NamedTuple):
    """Breaks of half of the code, as they are drawn: one of each line, and all."""

    name: str
    breaks: list
    every: list


def sources_of(root, room):
    folder = pathlib.Path(root, "src", room)
    files = [*folder.rglob("*.cpp"), *folder.glob("kernel/*.h")]
    inner = [f"/src/{other}/" for other in PHYSICS if other.startswith(f"{room}/")]
    return [file for file in sorted(files) if not any(n in str(file) for n in (*OTHERS, *inner))]


def order(seed, breaks):
    """By a hash of the seed and the break's words: a changed line moves no other."""
    return sorted(breaks, key=lambda each: hashlib.sha256(f"{seed} {each.id}".encode()).digest())


def draw(root, seed, rooms=()):
    """The two sides, of `rooms` alone where some are named."""
    sides = []
    for name, known in (("physics", PHYSICS), ("ROS", ROS)):
        found = []
        for room in known:
            if rooms and room not in rooms:
                continue
            for file in sources_of(root, room):
                path = file.relative_to(root).as_posix()
                found += operators.breaks_of(path, file.read_text(encoding="utf-8"))
        lines = {}
        for each in order(seed, found):
            lines.setdefault((each.path, each.number), each)
        sides.append(Side(name, [*lines.values()], found))
    return sides


def room_of(a_break):
    rooms = [room for room in (*PHYSICS, *ROS) if a_break.path.startswith(f"src/{room}/")]
    return max(rooms, key=len)
