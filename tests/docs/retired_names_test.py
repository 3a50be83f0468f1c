#!/usr/bin/env python3
"""retired_names_test.py SOURCE [--list]: checks that no source or document uses an old name of
tests/docs/retired_names.

Each line of that file is an old name and the name that replaced it. --list prints them as a table."""

import os
import re
import sys

# files that may contain old names: the list itself and the changelog
EXEMPT = {"tests/docs/retired_names", "CHANGELOG.md"}
TEXT = (".cpp", ".hpp", ".c", ".h", ".py", ".mjs", ".js", ".sh", ".lcm", ".md", ".txt", ".cmake", ".yaml")


def sources(top):
    for folder, folders, names in os.walk(top):
        folders[:] = [name for name in folders if name[0] != "." and name != "build"]
        for name in names:
            path = os.path.relpath(os.path.join(folder, name), top)
            if path not in EXEMPT and (name.endswith(TEXT) or "." not in name):
                yield path


def main():
    top = sys.argv[1]
    with open(os.path.join(top, "tests/docs/retired_names"), encoding="utf-8") as file:
        pairs = [line.split() for line in file if line.strip() and line[0] != "#"]
    assert all(len(pair) == 2 for pair in pairs), "a line of retired_names is not an old and a new name"
    if "--list" in sys.argv:
        for old, new in pairs:
            print(f"{old:40} {new}")
        return
    renamed = dict(pairs)
    word = re.compile(r"(?<![\w.])(?:" + "|".join(map(re.escape, sorted(renamed, key=len, reverse=True))) + r")(?!\w)")
    found = []
    for path in sources(top):
        with open(os.path.join(top, path), encoding="utf-8", errors="replace") as file:
            for number, line in enumerate(file, 1):
                found += [f"{path}:{number}: {match[0]} is now {renamed[match[0]]}" for match in word.finditer(line)]
    print("\n".join(found) or f"none of {len(renamed)} retired names is in use")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
