#!/usr/bin/env python3
"""rooms.py TREE: checks which rooms of the code include headers of which other rooms.

A room is a file, or a folder with its subfolders, unless a subfolder is a room of its own. Every file may include
headers of its own room. The table lists the other rooms that a room may use. An entry that no file uses is an error
too, so that the table stays as short as it can be.
"""

import pathlib
import re
import sys

TABLE = {
    # core: words, limits, indices
    "core": [],
    "core/step": ["core"],
    "core/plan.hpp": ["core", "core/error", "core/step"],
    "core/error": ["core/plan.hpp", "core/step"],
    "core/motion": ["core/error", "core/plan.hpp", "core/step"],
    "core/scene": ["core"],
    "core/structure": ["core", "core/scene"],
    "core/plan": ["core", "core/error", "core/motion", "core/plan.hpp", "core/scene", "core/step", "core/structure"],
    "core/steady": ["core", "core/error", "core/plan", "core/step", "core/structure"],
    "core/paper": ["core", "core/structure"],
    # service
    "messages": [],
    "service/io/scene": ["core", "core/plan", "core/plan.hpp", "core/scene", "core/structure"],
    "service/io/wire": ["core", "core/plan.hpp", "core/step", "messages"],
    "service": ["core", "core/error", "core/motion", "core/plan", "core/plan.hpp", "core/step", "messages",
                "service/io/scene", "service/io/wire"],
    "service/campaign": ["core", "core/motion", "core/plan", "core/scene", "core/step", "core/structure", "messages",
                         "service/io/scene", "service/io/wire"],
    "service/client": ["core", "messages", "service", "service/io/wire"],
    "service/c": ["core/motion", "core/plan", "core/step", "service", "service/campaign", "service/io/scene",
                  "service/io/wire"],
    # tools
    "tools/terminal": ["core/plan.hpp", "service", "service/io/scene"],
    "tools/bus": ["core", "core/error", "core/motion", "core/plan", "core/plan.hpp", "core/step", "messages", "service",
                  "service/client", "service/io/scene", "service/io/wire", "tools/terminal"],
    "tools/campaign": ["core/plan", "messages", "service/c", "service/campaign", "service/io/scene", "service/io/wire",
                       "tools/bus", "tools/terminal"],
    "tools/control": ["core", "core/plan", "core/plan.hpp", "core/step", "service/io/scene", "service/io/wire"],
    "tools/examples": ["service/client"],
    "tools/plot": ["core/step", "service/io/wire", "tools/terminal"],
    "tools/view": ["core", "core/plan", "core/plan.hpp", "core/scene", "core/step", "core/structure", "messages",
                   "service/io/scene", "service/io/wire", "tools/bus", "tools/terminal"],
    "tools/cli": ["core", "core/error", "core/motion", "core/paper", "core/plan", "core/plan.hpp", "core/scene",
                  "core/steady", "core/step", "core/structure", "messages", "service", "service/campaign",
                  "service/io/scene", "service/io/wire", "tools/bus", "tools/campaign", "tools/control", "tools/plot",
                  "tools/terminal", "tools/verification/reference", "tools/verification/report",
                  "tools/verification/stability", "tools/view"],
    "tools/verification/reference": ["core", "core/scene", "core/step", "core/structure"],
    "tools/verification/report": ["core", "core/error", "core/motion", "core/plan", "core/plan.hpp", "core/scene",
                                  "core/step", "core/structure", "tools/terminal", "tools/verification/reference"],
    "tools/verification/stability": ["core/error", "core/motion", "core/plan", "core/scene", "core/step",
                                     "core/structure", "service", "service/io/wire", "tools/terminal",
                                     "tools/verification/reference", "tools/verification/report"],
}
TREE = pathlib.Path(sys.argv[1])
SUFFIXES = (".cpp", ".hpp", ".h")


def room_of(path):
    """Returns the room of a file, or None outside the table. The rooms `core` and `service` have no subfolders."""
    if "/" not in path.partition("/")[2] and path.split(".")[0] not in TABLE and path not in TABLE:
        return path.partition("/")[0] if path.partition("/")[0] in TABLE else None
    matches = [room for room in TABLE if "/" in room and
               (path == room or path.split(".")[0] == room or path.startswith(room + "/"))]
    return max(matches, key=len, default=None)


def main():
    used, wrong = {room: set() for room in TABLE}, []
    for path in sorted(TREE.rglob("*")):
        name = path.relative_to(TREE).as_posix()
        if path.suffix not in SUFFIXES or not name.startswith(("core/", "messages/", "service/", "tools/")):
            continue
        room = room_of(name)
        if room is None:
            wrong.append(f"{name} is in no room of the table")
            continue
        for number, line in enumerate(path.read_text().splitlines(), 1):
            include = re.match(r'#include "((?:core|messages|service|tools|tests)/[^"]+)"', line)
            if not include:
                continue
            other = room_of(include[1])
            if other == room:
                continue
            if other not in TABLE[room]:
                wrong.append(f"{name}:{number}: {room} may not include {include[1]} of {other}")
            used[room].add(other)
    for room, others in TABLE.items():
        wrong += [f"the table allows {room} to use {other}, but no file does" for other in others
                  if other not in used[room]]
    print("\n".join(wrong) if wrong else f"{len(TABLE)} rooms include only what the table allows")
    if "--print" in sys.argv:
        print("\n".join(f'"{room}": {sorted(others)}' for room, others in used.items()))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
