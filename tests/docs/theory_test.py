#!/usr/bin/env python3
"""theory_test.py SOURCE: compares core/THEORY.md with the code. Each entry has one equation with the number of the entry, and
the entries are in the order of their numbers. Each file in the *Code:* line of an entry exists and cites the number, and
the code has each function that the line names. Each number that the code or the page cites is an entry."""

import os
import re
import sys

# THEORY 3.4, 3.6 to 3.9
CITE = re.compile(r"THEORY((?:,? (?:and |to )?(?:\d+\.\d+|X14\d))+)")
NUMBER = r"\d+\.\d+|X14\d"


def spread(text):
    """Returns the numbers of a citation, with every number of its ranges."""
    numbers = set()
    for first, last in re.findall(rf"({NUMBER})(?: to ({NUMBER}))?", text):
        if not last:
            numbers.add(first)
        elif first[0] == "X":
            numbers |= {f"X{n}" for n in range(int(first[1:]), int(last[1:]) + 1)}
        else:
            (section, one), (_, other) = first.split("."), last.split(".")
            numbers |= {f"{section}.{n}" for n in range(int(one), int(other) + 1)}
    return numbers


def cited_in(path):
    """Returns the numbers that a source file cites. A citation may continue on the next line of a comment."""
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"\s*\n\s*//+ ?", " ", file.read())
    return set().union(*(spread(match[1]) for match in CITE.finditer(text)))


def sources(top):
    for room in ("core", "service", "tools", "tests"):
        for folder, _, names in os.walk(os.path.join(top, room)):
            yield from (os.path.join(folder, name) for name in names if name.endswith((".cpp", ".hpp", ".h")))


def main():
    top, faults = sys.argv[1], []
    with open(os.path.join(top, "core/THEORY.md"), encoding="utf-8") as file:
        page = file.read()
    entries = re.split(rf"^### ({NUMBER}) ", page, flags=re.M)
    numbers = entries[1::2]
    known = set(numbers)
    faults += [f"{number} stands twice" for number in known if numbers.count(number) > 1]
    ordered = [number for number in numbers if number[0] != "X"]
    if ordered != sorted(ordered, key=lambda number: [int(part) for part in number.split(".")]):
        faults.append("the entries are not in the order of their numbers")
    cites, words = {}, set()
    for path in sources(top):
        with open(path, encoding="utf-8") as file:
            words |= set(re.findall(r"\w+", file.read()))
    for number, entry in zip(numbers, entries[2::2]):
        entry = re.split(r"^## ", entry, flags=re.M)[0]
        tags = re.findall(r"\\tag\{([^}]*)\}", entry)
        if number[0] != "X" and tags != [number]:
            faults.append(f"the entry {number} has equations {tags}, must have one, of its number")
        for line in re.findall(r"\*Code:\*((?:.|\n(?!\n|#))*)", entry):
            for name in re.findall(r"`([\w:]+)`", line):
                if name.split("::")[-1] not in words:
                    faults.append(f"{number} names {name}, which is nowhere in the code")
            for name in re.findall(r"`([^`]*/[^`]*)`", line):
                files = [path for path in (os.path.join(top, name + end) for end in (".hpp", ".cpp", ""))
                         if os.path.isfile(path)]
                if not files:
                    faults.append(f"{number} names {name}, which does not exist")
                elif number not in set().union(*(cites.setdefault(path, cited_in(path)) for path in files)):
                    faults.append(f"{number} names {name}, which does not cite it")
    for number in re.findall(rf"\(({NUMBER})\)", page):
        if number not in known and f"Alekseev (1970), ({number})" not in page:
            faults.append(f"the page refers to ({number}), which is no entry")
    for path in sources(top):
        for number in sorted(cited_in(path) - known):
            faults.append(f"{os.path.relpath(path, top)} cites {number}, which is no entry")
    print("\n".join(dict.fromkeys(faults)) or f"{len(numbers)} entries hold")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
