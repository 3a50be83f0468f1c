"""Campaigns with controllers: in Python, in a library and as a program."""

import csv
import os
import re
import shutil
import subprocess
import tempfile
import textwrap
import unittest

from freeflex import Campaign, StepError

BIN = os.environ["FREEFLEX_BIN"]

SCENE = """
points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]
links: {name: s, spring: [a, b], stiffness: 50}
initial: {points: {a: {displacement: [-0.001, 0, 0]}, b: {displacement: [0.001, 0, 0]}}}
commands: {max_hold: 100}
"""

CAMPAIGN = """
scene: pair.yaml
cases: 12
until: 3
vary:
  - {name: gain, path: controller.gain, uniform: [0.5, 5]}
  - {name: k, path: links.s.stiffness, uniform: [40, 60]}
controller: {CONTROLLER, parameters: {gain: 1}}
measure:
  - {name: end, of: point.b.displacement, take: rms, from: 2}
"""

PYTHON = """
from freeflex import blocks

def make(case):
    gain, noise = case.parameters["gain"], blocks.Noise(case, 1, 1e-6, 1e-9)
    late, held, rounded = blocks.Delay(0.013), blocks.Sampled(0.02), blocks.Quantized(1e-7)
    limited, wheel, thruster = blocks.Saturation(0.08), blocks.Wheel(0.07, 5.0), blocks.Thruster(1.0, 0.01, 1e-6)
    def control(state):
        a, b = state.point("a"), state.point("b")
        slow = held(state.time, late(state.time, a.velocity[0]))
        speed = rounded(noise(b.velocity[0]) - a.velocity[0]) + 1e-3 * slow
        force = wheel(limited(-gain * speed), 0.0) + 1e-3 * thruster(abs(slow))
        return {"forces": {"a": (-force, 0, 0), "b": (force, 0, 0)}, "duration": 0.01}
    return control
"""

LIBRARY = r"""
#include <freeflex.h>
#include <freeflex_blocks.hpp>
#include <cmath>
#include <cstring>
#include <stdexcept>

using namespace freeflex::blocks;
struct Self {
  double gain;
  Noise noise;
  Delay<> late{0.013};
  Sampled<> held{0.02};
  Quantized rounded{1e-7};
  Saturation limited{0.08};
  Wheel wheel{0.07, 5.0};
  Thruster thruster{1.0, 0.01, 1e-6};
};

extern "C" int freeflex_controller_begin(const freeflex_plan *, const freeflex_case *of, void **self, char *reason) {
  if (of->number == 7) throw std::runtime_error("no plan for seven");
  for (size_t k = 0; k < of->num_parameters; ++k)
    if (std::strcmp(of->parameters[k].name, "gain") == 0) {
      *self = new Self{of->parameters[k].value, {of->seed, 1, 1e-6, 1e-9}};
      return 0;
    }
  std::strcpy(reason, "no gain");
  return 1;
}
extern "C" int freeflex_controller_act(void *given, freeflex_motion *motion, char *reason) {
  Self &self = *static_cast<Self *>(given);
  freeflex_point a, b;
  freeflex_motion_point(motion, 0, &a);
  freeflex_motion_point(motion, 1, &b);
  const double time = freeflex_motion_time(motion);
  const double slow = self.held(time, self.late(time, a.velocity[0]));
  const double speed = self.rounded(self.noise(b.velocity[0]) - a.velocity[0]) + 1e-3 * slow;
  const double force = self.wheel(self.limited(-self.gain * speed), 0.0) + 1e-3 * self.thruster(std::abs(slow));
  const freeflex_load loads[] = {{FREEFLEX_POINT, 0, {-force, 0, 0}, {0, 0, 0}}, {FREEFLEX_POINT, 1, {force, 0, 0}, {0, 0, 0}}};
  if (freeflex_motion_push(motion, 0, FREEFLEX_WORLD, loads, 2, 10) == FREEFLEX_OK) return 0;
  std::strncpy(reason, freeflex_last_error(), FREEFLEX_REASON_SIZE - 1);
  return 1;
}
extern "C" void freeflex_controller_end(void *self) { delete static_cast<Self *>(self); }
"""

PROGRAM = """
import os
import freeflex

gain = float(os.environ["FREEFLEX_PARAMETER_gain"])

def control(state):
    a, b = state.point("a"), state.point("b")
    force = -gain * (b.velocity[0] - a.velocity[0])
    return {"forces": {"a": (-force, 0, 0), "b": (force, 0, 0)}, "duration": 0.01}

with freeflex.connect() as daemon:
    try:
        freeflex.control(daemon, control, every=0.01, until=1e9)
    except (freeflex.Gone, freeflex.StepError, TimeoutError):
        pass
"""


class Controllers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.write("pair.yaml", SCENE)

    def write(self, name, text):
        with open(os.path.join(self.folder, name), "w") as file:
            file.write(textwrap.dedent(text))

    def campaign(self, *arguments):
        return subprocess.run([f"{BIN}/freeflex", "campaign", *arguments], cwd=self.folder, capture_output=True, text=True)

    def run_campaign(self, controller, text=CAMPAIGN):
        self.write("c.yaml", text.replace("CONTROLLER", controller))
        ran = self.campaign("run", "c.yaml")
        self.assertEqual(ran.returncode, 0, ran.stderr + self.log())
        with open(os.path.join(self.folder, "c.results/cases.csv")) as file:
            return list(csv.DictReader(file))

    def log(self):
        path = os.path.join(self.folder, "c.results/workers.log")
        return open(path).read() if os.path.exists(path) else ""

    def test_python_damps(self):
        self.write("damp.py", PYTHON)
        rows = self.run_campaign("python: damp.py, every: 0.01")
        self.assertEqual(len(rows), 12)
        for row in rows:
            self.assertEqual(row["outcome"], "passed", row["message"])
            # exp(-gain t): the pair of dashpots of 2 gain on a reduced mass of 1/2 decays with the rate gain
            self.assertLess(float(row["end"]), 0.001 * 2.718281828 ** (-1.8 * float(row["gain"])) + 1e-6)
        rerun = self.campaign("rerun", "c.yaml", "3")
        self.assertEqual(rerun.returncode, 0, rerun.stderr)
        replay = subprocess.run([f"{BIN}/freeflex", "replay", "c.results/case-3.log"], cwd=self.folder, capture_output=True)
        self.assertEqual(replay.returncode, 0, replay.stderr)
        # the commands of the recording, on a scene with the values of its case, give the same motion
        shutil.copy(os.path.join(self.folder, "c.results/case-3.commands.log"), os.path.join(self.folder, "three.log"))
        self.write("d.yaml", f"""
            scene: pair.yaml
            cases: 2
            until: 3
            commands: three.log
            set: {{links.s.stiffness: {rows[3]["k"]}}}
            measure:
              - {{name: end, of: point.b.displacement, take: rms, from: 2}}
        """)
        ran = self.campaign("run", "d.yaml")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        with open(os.path.join(self.folder, "d.results/cases.csv")) as file:
            self.assertEqual([row["end"] for row in csv.DictReader(file)], [rows[3]["end"]] * 2)

    def test_a_library_gives_the_bits_of_python(self):
        self.write("damp.py", PYTHON)
        in_python = [row for row in self.run_campaign("python: damp.py, every: 0.01") if row["case"] != "7"]
        self.write("damp.cpp", LIBRARY)
        source = os.environ["FREEFLEX_SOURCE"]
        subprocess.run(["g++", "-std=c++17", "-shared", "-fPIC", "-O1", "-ffp-contract=off", "-I", f"{source}/service/c", "damp.cpp", "-o", "damp.so",
                        "-L", f"{BIN}/../service/c", "-lfreeflex", f"-Wl,-rpath,{BIN}/../service/c"], cwd=self.folder, check=True)
        subprocess.run(["rm", "-r", "c.results"], cwd=self.folder, check=True)
        in_library = self.run_campaign("library: damp.so, every: 0.01")
        self.assertEqual((in_library[7]["outcome"], in_library[7]["message"]), ("controller", "no plan for seven"))
        self.assertEqual([row for row in in_library if row["case"] != "7"], in_python)

    def test_a_controller_that_raises_is_named(self):
        self.write("bad.py", """
            def make(case):
                def control(state):
                    if case.number % 3 == 0 and state.time > 1:
                        raise ValueError("too late")
                return control
        """)
        rows = self.run_campaign("python: bad.py, every: 0.1")
        for row in rows:
            if int(row["case"]) % 3 == 0:
                self.assertEqual(row["outcome"], "controller")
                self.assertEqual(row["message"], "ValueError: too late (bad.py, line 5)")
            else:
                self.assertEqual(row["outcome"], "passed")

    def test_a_controller_that_dies_or_hangs_costs_its_case_only(self):
        self.write("bad.py", """
            import os, signal, time
            def make(case):
                if case.number == 2:
                    os.kill(os.getpid(), signal.SIGKILL)
                if case.number == 5:
                    time.sleep(1000)
                return lambda state: None
        """)
        rows = self.run_campaign("python: bad.py, every: 0.1", CAMPAIGN + "time_limit: 2\n")
        outcomes = {row["case"]: (row["outcome"], row["message"]) for row in rows if row["outcome"] != "passed"}
        self.assertEqual(outcomes, {
            "2": ("crashed", "its process ended by signal Killed"),
            "5": ("hung", "the case did not end within 2 s of wall clock (time_limit)")})

    def test_the_shipped_campaign_runs(self):
        campaign = f"{os.environ['FREEFLEX_SOURCE']}/service/scenes/campaigns/pointing.yaml"
        ran = self.campaign("run", campaign, "--shard", "0/2500", "--out", "pointing")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("2 cases: 2 passed", self.campaign("status", campaign, "--out", "pointing").stdout)

    def test_a_controller_may_go_to_another_folder(self):
        self.write("go.py", """
            import os
            def make(case):
                os.chdir("/")
                return lambda state: None
        """)
        for row in self.run_campaign("python: go.py, every: 0.1"):
            self.assertEqual(row["outcome"], "passed", row["message"])

    def test_the_row_of_a_shrunk_case_has_its_own_values_if_the_process_ends(self):
        self.write("die.py", """
            import os
            def make(case):
                if case.parameters["gain"] > 2.75:
                    os._exit(3)
                return lambda state: None
        """)
        rows = self.run_campaign("python: die.py, every: 0.1")
        case = next(row["case"] for row in rows if row["outcome"] == "crashed")
        shrunk = self.campaign("shrink", "c.yaml", case).stdout.splitlines()
        # nominal gain: 2.75; the value that fails stands in both lines
        gain = next(line for line in shrunk if line.startswith("  gain: ")).split()[1]
        self.assertEqual(shrunk[-1].split(",")[:4], [case, "crashed", gain, "50"])

    def test_a_campaign_is_run_only_with_what_it_names(self):
        self.write("damp.py", PYTHON)
        self.write("c.yaml", CAMPAIGN.replace("CONTROLLER", "python: damp.py, every: 0.01"))
        path = os.path.join(self.folder, "c.yaml")
        with self.assertRaisesRegex(StepError, "the campaign names a controller, but none is given"):
            Campaign(path).run(0)

    def test_a_controller_without_make_is_refused_at_once(self):
        self.write("bad.py", "x = 1\n")
        self.write("c.yaml", CAMPAIGN.replace("CONTROLLER", "python: bad.py, every: 0.1"))
        ran = self.campaign("run", "c.yaml")
        self.assertEqual(ran.returncode, 1)
        self.assertIn("a worker did not get ready", ran.stderr)
        self.assertIn("has no function make(case)", self.log())

    def test_a_planted_instability_is_found_counted_and_shrunk(self):
        # The force is held for 0.1 s, so the speed v of the centre of mass becomes (1 - 0.1 gain) v: it grows where the
        # gain is above 20, which is the quantile of 0.99 of its distribution.
        self.write("hold.py", """
            def make(case):
                gain = case.parameters["gain"]
                def control(state):
                    force = -gain * state.velocity[2]
                    return {"forces": {"a": (0, 0, force), "b": (0, 0, force)}, "duration": 0.1}
                return control
        """)
        self.write("c.yaml", """
            scene: pair.yaml
            cases: 2000
            until: 2
            set: {initial.velocity: [0, 0, 0.01], rate: 100}
            vary:
              - {name: k, path: links.s.stiffness, lognormal: {median: 50, log_sd: 0.3}}
              - {name: gain, path: controller.gain, normal: {mean: 15, sd: 2.149292}}
              - {name: vy, path: initial.velocity.2, uniform: [-0.1, 0.1]}
            controller: {python: hold.py, every: 0.1, parameters: {gain: 15}}
            measure: {name: speed, of: vz, take: final, fail_above: 0.01, fail_below: -0.01}
        """)
        ran = self.campaign("run", "c.yaml")
        self.assertEqual(ran.returncode, 0, ran.stderr + self.log())
        with open(os.path.join(self.folder, "c.results/cases.csv")) as file:
            rows = list(csv.DictReader(file))
        failed = [row for row in rows if row["outcome"] == "failed"]
        self.assertEqual([row["case"] for row in failed], [row["case"] for row in rows if float(row["gain"]) > 20])
        low, high = map(float, re.search(r"\(([0-9.e-]+) to ([0-9.e-]+) %", ran.stdout).groups())
        self.assertTrue(0.2 < low < 1 < high < 2, ran.stdout)
        for row in failed[:3]:
            shrunk = self.campaign("shrink", "c.yaml", row["case"])
            self.assertEqual(shrunk.returncode, 0, shrunk.stderr)
            found = re.search(r"not nominal: 1 value of 3\n  gain: ([0-9.]+) \(nominal 15, ", shrunk.stdout)
            self.assertTrue(found, shrunk.stdout)
            # the bisection ends within 0.001 of the distance of the case from the nominal gain
            self.assertLess(20, float(found[1]))
            self.assertLess(float(found[1]), 20 + 0.001 * (float(row["gain"]) - 15))

    def test_a_program_on_a_bus_of_its_own(self):
        self.write("damp.py", PROGRAM)
        rows = self.run_campaign("program: [python3, damp.py]", CAMPAIGN.replace("cases: 12", "cases: 3"))
        for row in rows:
            self.assertEqual(row["outcome"], "passed", row["message"])
            self.assertLess(float(row["end"]), 0.001 * 2.718281828 ** (-1.8 * float(row["gain"])) + 1e-6)
        # another program gives other results, so these are not mixed
        self.write("damp.py", PROGRAM + "\n")
        changed = self.campaign("run", "c.yaml")
        self.assertEqual(changed.returncode, 2)
        self.assertIn("belongs to another campaign, or to an earlier state of its files", changed.stderr)

    def test_a_program_that_does_not_exist_is_refused_at_once(self):
        self.write("c.yaml", CAMPAIGN.replace("CONTROLLER", "program: [no-such-program]"))
        ran = self.campaign("run", "c.yaml")
        self.assertEqual(ran.returncode, 1)
        self.assertIn("there is no program 'no-such-program' that can be run", ran.stderr)
        self.assertFalse(os.path.exists(os.path.join(self.folder, "c.results/cases.csv")))

    def test_a_program_without_a_route_for_the_bus_is_refused_at_once(self):
        self.write("damp.py", PROGRAM)
        self.write("c.yaml", CAMPAIGN.replace("CONTROLLER", "program: [python3, damp.py]"))
        ran = subprocess.run(["unshare", "-n", f"{BIN}/freeflex", "campaign", "run", "c.yaml"], cwd=self.folder,
                             capture_output=True, text=True)
        self.assertEqual(ran.returncode, 1)
        self.assertIn("there is no route for multicast", ran.stderr)

    def test_a_program_that_ends_early_or_reads_the_standard_input_costs_its_case_only(self):
        self.write("bad.py", """
            import os, sys
            sys.stdin.read()
            sys.exit(3)
        """)
        rows = self.run_campaign("program: [python3, bad.py]", CAMPAIGN.replace("cases: 12", "cases: 2"))
        for row in rows:
            self.assertEqual((row["outcome"], row["message"]),
                             ("controller", "the program ended with exit code 3 before the end of the case"))


if __name__ == "__main__":
    unittest.main()
