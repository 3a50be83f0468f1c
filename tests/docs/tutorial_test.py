#!/usr/bin/env python3
"""tutorial_test.py SOURCE BUILD: runs every command of tools/docs/tutorial.md in order, as a reader would paste them.

A block of `text` after commands shows their output: its numbers must agree to 2 % and 0.002, and `...` stands for
omitted lines. The command that builds the programs is not run, but its targets must exist. A recording in which
lcm-logger lost messages is made again, as the tutorial says."""

import os
import re
import subprocess
import sys
import tempfile

NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def steps_of(text):
    """Yields (commands, expected) for each block of `sh`; expected is None if no `text` follows."""
    for block in text.split("```sh\n")[1:]:
        commands, rest = block.split("```", 1)
        match = re.match(r"\n```text\n(.*?)```", rest, flags=re.S)
        yield commands, match[1] if match else None


def agree(expected, printed):
    """Returns whether two lines have the same words, and numbers that agree."""
    if NUMBER.sub("#", expected).split() != NUMBER.sub("#", printed).split():
        return False
    pairs = zip(NUMBER.findall(expected), NUMBER.findall(printed))
    return all(abs(float(a) - float(b)) <= 0.002 + 0.02 * abs(float(a)) for a, b in pairs)


def missing_line(expected, printed):
    """Returns the first expected line that is not printed in order, or "" if all lines are."""
    lines = iter(printed.splitlines())
    for line in expected.splitlines():
        if line.strip() == "...":
            continue
        if not any(agree(line, other) for other in lines):
            return line
    return ""


def paste(shell, commands, number):
    """Runs a block in the shell. Returns its exit code and its output."""
    mark = f"end of block {number}:"
    shell.stdin.write(f"{commands}\necho; echo {mark} $?\n")
    shell.stdin.flush()
    printed = ""
    for line in shell.stdout:
        if line.startswith(mark):
            return int(line.split()[-1]), printed
        printed += line
    sys.exit(f"block {number} ended the shell:\n{commands}\n{printed}")


def main():
    source, build = (os.path.abspath(path) for path in sys.argv[1:])
    with open(os.path.join(source, "tools/docs/tutorial.md"), encoding="utf-8") as file:
        steps = list(steps_of(file.read()))
    build_line, steps = steps[0][0], steps[1:]
    assert build_line.startswith("tools/build release "), build_line
    programs = {"freeflexd": "bin/freeflexd", "freeflex_cli": "bin/freeflex", "freeflex_c": "service/c/libfreeflex.so.1",
                "freeflex_python": "python/freeflex/__init__.py"}
    for target in build_line.split()[2:]:
        assert target in programs, f"{target} is not known to this test"
        assert os.path.exists(os.path.join(build, programs[target])), f"{programs[target]} is not built"
    with tempfile.TemporaryDirectory() as top:
        # a copy of the tree as the reader has it; its builds are in another folder
        for name in ("tools", "service"):
            os.symlink(os.path.join(source, name), os.path.join(top, name))
        os.mkdir(os.path.join(top, "build"))
        os.symlink(build, os.path.join(top, "build", "release"))
        shell = subprocess.Popen(["bash"], cwd=top, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT, text=True)
        recording = ""
        for number, (commands, expected) in enumerate(steps, 2):
            code, printed = paste(shell, commands, number)
            if "lcm-logger" in commands:
                recording = commands
            for _ in range(4):
                if "lost in transit" not in printed and "log incomplete" not in printed:
                    break
                paste(shell, recording, number)
                code, printed = paste(shell, commands, number)
            if code != 0:
                sys.exit(f"block {number} failed with exit code {code}:\n{commands}\n{printed}")
            if expected and (line := missing_line(expected, printed)):
                sys.exit(f"block {number} does not print the line\n{line}\nbut\n{printed}")
        shell.stdin.close()
        shell.wait()
    print(f"{len(steps)} blocks of commands ran and printed what the tutorial shows")


if __name__ == "__main__":
    main()
