#!/usr/bin/env python3
"""counts.py TREE: prints counts that show how well the code holds together, each with its bound. Exit 1 if a bound is
broken.

The bounds are the values of the day on which a count was last improved; that of the lines of core leaves room for a
feature. Lower a bound when you improve a count. Raise one only for a reason that the commit gives.
"""

import pathlib
import re
import sys

TREE = pathlib.Path(sys.argv[1])
SUFFIXES = (".cpp", ".hpp")


def sources(*folders):
    for folder in folders:
        for path in sorted((TREE / folder).rglob("*")):
            if path.suffix in SUFFIXES:
                yield path


def name_of(path):
    return path.relative_to(TREE).as_posix()


def files_with(pattern, *folders, but=()):
    expression = re.compile(pattern)
    return [name_of(path) for path in sources(*folders)
            if not name_of(path).startswith(but) and expression.search(path.read_text())]


def occurrences(pattern, *folders, but=()):
    expression = re.compile(pattern)
    return [f"{name_of(path)}:{path.read_text().count(chr(10), 0, match.start()) + 1}"
            for path in sources(*folders) if not name_of(path).startswith(but)
            for match in expression.finditer(path.read_text())]


def long_files():
    return [f"{name_of(path)} ({len(path.read_text().splitlines())})" for path in sources("core", "service", "tools")
            if len(path.read_text().splitlines()) > 400]


def long_functions(most=70):
    """Returns the functions of more than `most` lines, from the line with the opening brace to the closing brace."""
    head = re.compile(r"\)( const)?( noexcept)?( override)?( -> [\w:<>*& ]+)? \{$")
    other = re.compile(r"\s*(if|for|while|switch|else|\}|do|return|const auto|auto)\b|.*\]\(|.*= \[")
    text = re.compile(r'"(\\.|[^"\\])*"|\'(\\.|[^\'\\])\'|//.*')
    found = []
    for path in sources("core", "service", "tools"):
        lines = [text.sub("", line) for line in path.read_text().splitlines()]
        for start, line in enumerate(lines):
            if not head.search(line) or other.match(line):
                continue
            depth, end = 0, start
            while end < len(lines):
                depth += lines[end].count("{") - lines[end].count("}")
                if depth <= 0:
                    break
                end += 1
            if end - start + 1 > most:
                found.append(f"{name_of(path)}:{start + 1} ({end - start + 1})")
    return found


def crowded_rooms(most=17):
    rooms = {}
    for path in sources("core"):
        rooms.setdefault(path.parent, []).append(path)
    return [f"{name_of(room)} ({len(files)})" for room, files in rooms.items() if len(files) > most]


# what, places, bound
COUNTS = [
    ("motions put together by hand outside core/step, core/error, core/motion and core/steady",
     occurrences(r"\bmake_workspace\(", "core", "service", "tools",
                 but=("core/step/", "core/error/", "core/motion.", "core/steady/")), 0),
    ("files of the estimate of the error that other rooms include, beside its door",
     files_with(r'#include "core/error/(?!verdict|tables|validity)', "core", "service", "tools",
                but=("core/error/", "core/motion.", "core/plan/explain.", "service/verdict_thread.")), 0),
    ("files of core/step that include core/error", files_with(r'#include "core/error/', "core/step"), 0),
    ("files that ask for a kind of link", files_with(r"get_if<(?!Choice)|holds_alternative<(?!Choice|Normal|LogNormal)", "core", "service", "tools"), 5),
    ("comparisons of a kind of link by its name",
     occurrences(r'kind (==|!=) "(spring|bar|beam|matrix|bending|torsion|plate|rigid|dashpot)"', "core", "service",
                 "tools"), 0),
    ("names of a rung outside core/words.hpp and tools/verification/stability",
     occurrences(r"Fidelity::k[A-Z]", "core", "service", "tools",
                 but=("core/words.hpp", "tools/verification/stability/")), 9),
    ("includes of core/scene in core/plan and core/step",
     occurrences(r'#include "core/scene/', "core/plan", "core/step"), 1),
    ("casts to std::size_t in core, beside index()", occurrences(r"static_cast<std::size_t>", "core"), 108),
    ("rooms of core with more than 17 files", crowded_rooms(), 0),
    ("files of more than 400 lines", long_files(), 15),
    ("functions of more than 70 lines", long_functions(), 0),
    ("lines of core", [""] * sum(len(path.read_text().splitlines()) for path in sources("core")), 38000),
]

failed = False
for what, places, bound in COUNTS:
    print(f"{len(places):6d} (at most {bound:5d})  {what}")
    if len(places) > bound:
        failed = True
    if 0 < len(places) <= 12 or len(places) > bound and len(places) < 60:
        print("".join(f"          {place}\n" for place in places), end="")
sys.exit(1 if failed else 0)
