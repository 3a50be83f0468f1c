"""python3 -m freeflex.worker CAMPAIGN CONTROLLER: runs cases for `freeflex campaign`, with a controller in Python.

Writes "ready" to file descriptor 3, then reads jobs from the standard input and answers each with a line on file
descriptor 3, as tools/campaign/pool.hpp describes.
"""

import os
import sys

from freeflex.campaign import Campaign, load

_RESULTS = 3  # file descriptor
_TRACE = ">"


def _answer(text):
    rest = text.encode()
    while rest:
        rest = rest[os.write(_RESULTS, rest):]


def main():
    # a controller that reads the standard input must not take the jobs, and processes that it starts must not keep the
    # results open
    jobs = os.fdopen(os.dup(0), encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.set_inheritable(_RESULTS, False)
    try:
        serve(jobs)
    except Exception as error:
        _answer(f"!{type(error).__name__}: {error}".replace("\n", " ") + "\n")
        raise


def serve(jobs):
    campaign = Campaign(sys.argv[1], load(sys.argv[2]))
    _answer("ready\n")
    for job in jobs:
        number, *words = job.rstrip("\n").split("\t")
        if len(words) == 3 and words[0] == _TRACE:
            row, seconds = campaign.trace(int(number), *words[1:]), (0.0, 0.0)
        else:
            row, seconds = campaign.run(int(number), words or None)
        sys.stdout.flush()  # what the controller printed, before the process may be killed
        _answer(f"{row}\t{seconds[0]!r}\t{seconds[1]!r}\n")


if __name__ == "__main__":
    main()
