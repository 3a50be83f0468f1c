"""Plans stepped from Python, beside `freeflex run` of the same scene."""

import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest

import freeflex

SOURCE = os.environ["FREEFLEX_SOURCE"]
BOOM = os.path.join(SOURCE, "service", "scenes", "boom.yaml")
SATELLITE = os.path.join(SOURCE, "service", "scenes", "satellite.yaml")
FREEFLEX = os.path.join(os.environ["FREEFLEX_BIN"], "freeflex")


class Plans(unittest.TestCase):
    def test_the_motion_is_that_of_freeflex_run(self):
        with tempfile.TemporaryDirectory() as folder:
            table = os.path.join(folder, "boom.csv")
            run = subprocess.run([FREEFLEX, "run", BOOM, "--until", "2", "--out", table, "--json"], check=True,
                                 capture_output=True, text=True)
            with open(table, encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
        motion = freeflex.Plan(BOOM).motion(with_word=True)
        for row in rows:
            motion.step(int(row["tick"]) - motion.tick)
            frame, (q, _) = motion.frame, motion.elastic
            self.assertEqual([float(row[key]) for key in ("x", "y", "z", "qw", "qx", "qy", "qz")],
                             [*frame.position, *frame.attitude])
            self.assertEqual([float(row[f"q{k + 1}"]) for k in range(len(q))], list(q))
        self.assertGreater(len(rows), 10)
        result = json.loads(run.stdout)
        self.assertEqual(motion.word.word, freeflex.plan.WORDS[result["validity"]])
        self.assertEqual(motion.word.error, result["error"])

    def test_a_satellite_turns_by_its_wheel(self):
        plan = freeflex.Plan(SATELLITE)
        motion = plan.motion()
        before = list(motion.frame.angular_momentum)
        wheel = next(iter(plan.wheels))
        motion.push(wheels={wheel: 0.1}, ticks=round(plan.rate))
        motion.step(round(plan.rate))
        self.assertAlmostEqual(motion.wheels[plan.wheels[wheel]], 0.1, delta=1e-12)
        # a motor is within: the whole keeps its momentum, less what loads of the scene give
        twin = plan.motion()
        twin.step(round(plan.rate))
        for a, b, start in zip(motion.frame.angular_momentum, twin.frame.angular_momentum, before):
            self.assertAlmostEqual(a, b, delta=1e-12 + 1e-3 * abs(start))
        self.assertGreater(max(abs(x - y) for x, y in zip(motion.frame.angular_velocity,
                                                          twin.frame.angular_velocity)), 1e-6)

    def test_copies_part(self):
        plan = freeflex.Plan(BOOM)
        first = plan.motion()
        first.push({"tip": (0.0, 1.0, 0.0)}, ticks=10)
        first.step(20)
        second = first.copy()
        second.push({"tip": (0.0, 1.0, 0.0)}, ticks=10)
        first.step(30)
        second.step(30)
        self.assertEqual(first.tick, second.tick)
        self.assertNotEqual(list(first.point("tip").position), list(second.point("tip").position))
        del plan
        first.step(1)

    def test_what_cannot_be_is_said(self):
        with self.assertRaisesRegex(freeflex.StepError, "nowhere"):
            freeflex.Plan("/nowhere.yaml")
        motion = freeflex.Plan(BOOM).motion()
        with self.assertRaisesRegex(LookupError, "tip"):
            motion.push({"tipp": (0, 0, 1)})
        with self.assertRaisesRegex(freeflex.StepError, "point 44, the scene has 0 to 3"):
            motion.push({44: (0, 0, 1)})
        with self.assertRaisesRegex(ValueError, "three components"):
            motion.push({"tip": (0, 1)})
        with self.assertRaisesRegex(freeflex.StepError, "has no inertia and takes no torque"):
            motion.push({"tip": (0, 0, 1)}, torques={"hub": (0, 0, 1)})
        with self.assertRaisesRegex(freeflex.StepError, "without a word"):
            motion.word
        with self.assertRaisesRegex(ValueError, "zero byte"):
            freeflex.Plan(BOOM + "\0")

    def test_a_library_that_is_none_is_said(self):
        for library, text in (("/nowhere.so", "install freeflex"), ("libc.so.6", "not the C library of this")):
            done = subprocess.run([sys.executable, "-m", "freeflex", "step", BOOM, "1"], capture_output=True, text=True,
                                  env=os.environ | {"FREEFLEX_LIBRARY": library}, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn(text, done.stderr)
            self.assertNotIn("Traceback", done.stderr)


    def test_a_recording_that_has_nothing_of_the_prefix_is_said(self):
        with tempfile.TemporaryDirectory() as folder:
            log = os.path.join(folder, "a.log")
            subprocess.run([FREEFLEX, "run", BOOM, "--until", "0.1", "--out", log], check=True, capture_output=True)
            for prefix, code, text in (("FREEFLEX", 0, "FREEFLEX_STATE"), ("OTHER", 2, "holds nothing of OTHER")):
                done = subprocess.run([sys.executable, "-m", "freeflex", "--prefix", prefix, "log", log], check=False,
                                      capture_output=True, text=True)
                self.assertEqual(done.returncode, code)
                self.assertIn(text, done.stdout + done.stderr)


class Traps(unittest.TestCase):
    def test_names_are_in_the_order_of_the_scene(self):
        plan = freeflex.Plan(SATELLITE)
        self.assertEqual(list(plan.points.values()), list(range(plan.num_points)))
        motion = plan.motion()
        motion.push(wheels={"spin_z": 0.2})
        motion.step(1000)
        momenta = dict(zip(plan.wheels, motion.wheels))
        self.assertAlmostEqual(momenta["spin_z"], 0.2, places=12)
        self.assertEqual(momenta["spin_x"], 0.0)

    def test_numbers_that_do_not_fit_are_refused(self):
        motion = freeflex.Plan(BOOM).motion()
        for call in (lambda: motion.step(2**64 + 5), lambda: motion.step(-1), lambda: motion.step(1.5),
                     lambda: motion.push({"tip": (0, 0, 1)}, slot=2**32), lambda: motion.push({2**32: (0, 0, 1)}),
                     lambda: motion.push({"tip": (0, 0, 1)}, axes="local")):
            with self.assertRaises((ValueError, freeflex.StepError)):
                call()
        self.assertEqual(motion.tick, 0)


if __name__ == "__main__":
    unittest.main()
