"""Time of a tick from Python: for a plan of 306 modes with 1 or 1000 ticks per call, and for a daemon in lockstep. Prints
medians of five runs. Run it in a private network with PYTHONPATH, FREEFLEX_BIN and FREEFLEX_SOURCE as for the tests."""

import os
import statistics
import subprocess
import tempfile
import time

import freeflex

SCENE = os.path.join(os.environ["FREEFLEX_SOURCE"], "service", "scenes", "truss104.yaml")
BOOM = """rate: 1000
points: [{name: a, mass: 2, at: [0, 0, 0]}, {name: b, mass: 2, at: [1, 0, 0]}]
links: [{spring: [a, b], stiffness: 40}]
publish: {state: 1000}
"""


def median(seconds, count):
    return statistics.median(seconds) / count


def plan(ticks, calls):
    motion, times = freeflex.Plan(SCENE).motion(), []
    for _ in range(5):
        start = time.perf_counter()
        for _ in range(calls):
            motion.step(ticks)
        times.append(time.perf_counter() - start)
    return median(times, ticks * calls)


def lockstep(pushes, count=2000):
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "pair.yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(BOOM)
        daemon = subprocess.Popen([os.path.join(os.environ["FREEFLEX_BIN"], "freeflexd"), path, "--time", "lockstep",
                                   "--log-level", "error", "--socket", "none"])
        times = []
        with freeflex.connect() as client:
            for _ in range(5):
                start = time.perf_counter()
                for _ in range(count):
                    client.step()
                    if pushes:
                        client.push({"b": (0.0, 0.0, 1.0)}, lease=0.05)
                times.append(time.perf_counter() - start)
            client.stop()
        daemon.wait()
        return median(times, count)


def main():
    one, many = plan(1, 20000), plan(1000, 50)
    print(f"plan of 306 modes, a tick a call      {1e6 * one:8.2f} us a tick")
    print(f"                   1000 ticks a call  {1e6 * many:8.2f} us a tick")
    print(f"lockstep           step alone         {1 / lockstep(False):8.0f} steps a second")
    print(f"                   step and push      {1 / lockstep(True):8.0f} steps a second")


if __name__ == "__main__":
    main()
