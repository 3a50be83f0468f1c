#!/usr/bin/env python3
"""names.py COMMIT: lists the files that moved and the tests that were renamed, added or dropped since COMMIT.

Exit 1 if a test of COMMIT is neither in the working tree nor in RENAMED.
"""

import re
import subprocess
import sys

# tests that have another name now
RENAMED = {
    "Cause.TheCauseForAnOldPlanFileStatesThatTheFileIsOld": "Cause.TheCauseForAPlanWithoutTablesStatesThatItHasNone",
    "PlanBytes.PlansOfVersions5And7AreAccepted": "PlanBytes.PlansOfOtherVersionsAreRefusedWithARemedy",
}


def git(*arguments):
    return subprocess.run(["git", *arguments], capture_output=True, text=True, check=False).stdout.splitlines()


def tests(*where):
    lines = git("grep", "-hoE", r"^TEST(_F|_P)?\(\w+, \w+", *where, "--", "tests/*.cpp")
    return {".".join(re.search(r"\((\w+), (\w+)", line).groups()) for line in lines}


def main():
    commit = sys.argv[1]
    for line in git("diff", "-M60%", "--diff-filter=R", "--name-status", commit):
        _, old, new = line.split("\t")
        print(f"moved    {old} -> {new}")
    before, now = tests(commit), tests()
    dropped = sorted(before - now)
    for name in dropped:
        print(f"renamed  {name} -> {RENAMED[name]}" if name in RENAMED else f"DROPPED  {name}")
    for name in sorted(now - before - set(RENAMED.values())):
        print(f"added    {name}")
    print(f"{len(before)} tests before, {len(now)} now")
    sys.exit(any(name not in RENAMED for name in dropped))


if __name__ == "__main__":
    main()
