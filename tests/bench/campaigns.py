"""Cases a second of campaigns on the satellite: beside the bare steps of the same cases, in two processes, and beside a
loop over `freeflex run` with a scene file for each case. Run it with PYTHONPATH, FREEFLEX_BIN and FREEFLEX_SOURCE as
for the tests. Times depend on the machine; compare them only within one run."""

import csv
import os
import re
import statistics
import subprocess
import tempfile
import time

import freeflex

FREEFLEX = os.path.join(os.environ["FREEFLEX_BIN"], "freeflex")
SCENE = os.path.join(os.environ["FREEFLEX_SOURCE"], "service", "scenes", "satellite.yaml")
UNTIL = 60  # [s] of a case
CASES = 100
STRUCTURES = "{name: value, path: points.tank.mass, uniform: [20, 36]}"
INITIAL = "{name: value, path: initial.angular_velocity.3, uniform: [-0.003, 0.003]}"


def seconds_of(action):
    start = time.perf_counter()
    result = action()
    return time.perf_counter() - start, result


def write_campaign(folder, name, cases, vary):
    with open(os.path.join(folder, name + ".yaml"), "w", encoding="utf-8") as file:
        file.write(f"scene: {SCENE}\ncases: {cases}\nuntil: {UNTIL}\nset: {{initial: {{angular_velocity: [0, 0, 0]}}}}\n"
                   f"vary: {vary}\nmeasure: {{of: point.l41.x, take: final}}\n")


def run_campaign(folder, name, jobs):
    """Returns the wall time [s], that of set-ups [s] and the rows."""
    out = os.path.join(folder, f"{name}.{jobs}")
    command = [FREEFLEX, "campaign", "run", name + ".yaml", "--jobs", str(jobs), "--out", out]
    seconds, _ = seconds_of(lambda: subprocess.run(command, cwd=folder, check=True, capture_output=True))
    status = subprocess.run([FREEFLEX, "campaign", "status", name + ".yaml", "--out", out], cwd=folder, check=True,
                            capture_output=True, text=True).stdout
    set_up = float(re.search(r"of which ([0-9.e-]+) s are set-up", status)[1])
    with open(os.path.join(out, "cases.csv"), encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    subprocess.run(["rm", "-r", out], check=True)
    return seconds, set_up * len(rows), rows


def bare(rows):
    """Returns the time [s] of the steps of the same cases, each in one call, without their set-up."""
    total = 0.0
    for row in rows:
        scene = freeflex.Scene(SCENE)
        scene["initial"] = {"angular_velocity": [0, 0, float(row["value"])]}
        scene["verdict"] = "off"
        plan = freeflex.Plan(scene)
        motion = plan.motion()
        seconds, state = seconds_of(lambda: motion.step(round(UNTIL * plan.rate)))
        total += seconds
        assert state.point("l41").position[0] == float(row["point.l41.x.final"])
    return total


def by_files(folder, rows):
    """Runs the cases as a script without campaigns would: one scene file and one `freeflex run` for each."""
    with open(SCENE, encoding="utf-8") as file:
        text = file.read()
    for row in rows:
        case = re.sub(r"(name: tank, mass: )[0-9.]+", rf"\g<1>{row['value']}", text)
        case += "\ninitial: {angular_velocity: [0, 0, 0]}\nverdict: off\n"
        path = os.path.join(folder, "case.yaml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(case)
        table = subprocess.run([FREEFLEX, "run", path, "--until", str(UNTIL), "--out", "-"], check=True,
                               capture_output=True, text=True).stdout
        lines = list(csv.DictReader(table.splitlines()))
        assert float(lines[-1]["point.l41.x"]) == float(row["point.l41.x.final"])


def beside_bare_steps(folder):
    """Prints ratios of medians of seven runs in turns."""
    write_campaign(folder, "one", 1, INITIAL)
    write_campaign(folder, "initial", CASES, INITIAL)
    runs = []
    for _ in range(7):
        start, set_up_of_one, _ = run_campaign(folder, "one", 1)
        one, set_up, rows = run_campaign(folder, "initial", 1)
        runs.append((start - set_up_of_one, one, set_up, bare(rows), run_campaign(folder, "initial", 2)[0]))
    start, one, set_up, steps, two = map(statistics.median, zip(*runs))
    print(f"{CASES} cases whose initial state differs, one process: {one:.3g} s, of which set-up {set_up:.2g} s, start and page "
          f"{start:.2g} s")
    print(f"  the rest over the bare steps of the same cases: {100 * ((one - start - set_up) / steps - 1):+.2g} %")
    print(f"  two processes: {one / two:.2f} times as fast; without start and page {(one - start) / (two - start):.2f} times")


def beside_files(folder):
    for cases in (50, 200):
        write_campaign(folder, "structures", cases, STRUCTURES)
        new, set_up, rows = run_campaign(folder, "structures", 2)
        old, _ = seconds_of(lambda: by_files(folder, rows))
        print(f"{cases} cases whose structure differs: campaign in two processes {new:.2g} s (set-up {set_up / cases:.2g} s "
              f"a case), a loop over freeflex run {old:.3g} s")


def main():
    with tempfile.TemporaryDirectory() as folder:
        beside_bare_steps(folder)
        beside_files(folder)


if __name__ == "__main__":
    main()
