"""Plans stepped from Python, compared with `freeflex run` of the same scene."""

import csv
import json
import os
import subprocess
import sys
import tempfile
import threading
import unittest

import freeflex

SOURCE = os.environ["FREEFLEX_SOURCE"]
BOOM = os.path.join(SOURCE, "service", "scenes", "boom.yaml")
SATELLITE = os.path.join(SOURCE, "service", "scenes", "satellite.yaml")
FREEFLEX = os.path.join(os.environ["FREEFLEX_BIN"], "freeflex")


class Plans(unittest.TestCase):
    def test_the_motion_agrees_with_freeflex_run(self):
        with tempfile.TemporaryDirectory() as folder:
            table = os.path.join(folder, "boom.csv")
            run = subprocess.run([FREEFLEX, "run", BOOM, "--until", "2", "--out", table, "--json"], check=True,
                                 capture_output=True, text=True)
            with open(table, encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
        motion = freeflex.Plan(BOOM).motion(with_verdict=True)
        for row in rows:
            state = motion.step(int(row["tick"]) - motion.tick)
            self.assertEqual([float(row[key]) for key in ("x", "y", "z", "qw", "qx", "qy", "qz")],
                             [*state.position, *state.attitude])
            self.assertEqual([float(row[f"q{k + 1}"]) for k in range(len(state.q))], list(state.q))
        self.assertGreater(len(rows), 10)
        result = json.loads(run.stdout)
        self.assertEqual(motion.verdict.level, freeflex.plan.LEVELS[result["validity"]])
        self.assertEqual(motion.verdict.error, result["deformation_error"])
        self.assertEqual(motion.errors.position, result["position_error"])
        self.assertEqual(motion.errors.attitude, result["attitude_error"])
        self.assertEqual(motion.verdict.tick, result["judged_tick"])

    def test_a_wheel_rotates_the_satellite_and_keeps_the_momentum(self):
        plan = freeflex.Plan(SATELLITE)
        motion = plan.motion()
        before = list(motion.state.angular_momentum)
        wheel = next(iter(plan.wheels))
        motion.push(wheels={wheel: 0.1}, duration=1.0)
        state = motion.step(round(plan.rate))
        self.assertAlmostEqual(state.wheel(wheel), 0.1, delta=1e-12)
        # the torque of the motor is internal, so only the loads of the scene change the angular momentum; they also act on `twin`
        twin = plan.motion().step(round(plan.rate))
        for a, b, start in zip(state.angular_momentum, twin.angular_momentum, before):
            self.assertAlmostEqual(a, b, delta=1e-12 + 1e-3 * abs(start))
        self.assertGreater(max(abs(x - y) for x, y in zip(state.angular_velocity, twin.angular_velocity)), 1e-6)

    def test_a_push_keeps_its_impulse_whatever_its_duration(self):
        for ticks in (0.4, 1.0, 1.4, 2.5, 100.0):
            motion = freeflex.Plan(BOOM).motion()
            motion.push({"tip": (0.0, 6.0, 0.0)}, duration=ticks / 1000.0)
            whole = freeflex.Plan(BOOM).motion()
            whole.push({"tip": (0.0, 6.0, 0.0)}, duration=1e-3)
            speed, of_one = motion.step(200).velocity[1], whole.step(200).velocity[1]
            self.assertAlmostEqual(speed / of_one, ticks, places=12)

    def test_copies_are_independent(self):
        plan = freeflex.Plan(BOOM)
        first = plan.motion()
        first.push({"tip": (0.0, 1.0, 0.0)}, duration=0.01)
        first.step(20)
        second = first.copy()
        second.push({"tip": (0.0, 1.0, 0.0)}, lease=0.01)
        one, other = first.step(30), second.step(30)
        self.assertEqual(one.tick, other.tick)
        self.assertNotEqual(list(one.point("tip").position), list(other.point("tip").position))
        del plan
        first.step(1)

    def test_invalid_arguments_are_reported(self):
        with self.assertRaisesRegex(freeflex.StepError, "nowhere"):
            freeflex.Plan("/nowhere.yaml")
        motion = freeflex.Plan(BOOM).motion()
        with self.assertRaisesRegex(LookupError, "tip"):
            motion.push({"tipp": (0, 0, 1)}, duration=1)
        with self.assertRaisesRegex(freeflex.StepError, "point 44 does not exist; the scene has points 0 to 3"):
            motion.push({44: (0, 0, 1)}, duration=1)
        with self.assertRaisesRegex(ValueError, "three components"):
            motion.push({"tip": (0, 1)}, duration=1)
        for times in ({}, {"duration": 1, "lease": 1}):
            with self.assertRaisesRegex(ValueError, "duration=S, after which it ends, or lease=S"):
                motion.push({"tip": (0, 0, 1)}, **times)
        with self.assertRaisesRegex(freeflex.StepError, "has no inertia and takes no torque"):
            motion.push({"tip": (0, 0, 1)}, torques={"hub": (0, 0, 1)}, duration=1)
        for times in ({"duration": 60.001}, {"lease": 70}):
            with self.assertRaisesRegex(freeflex.StepError, r"ticks, but may last at most 60000 \('commands: max_hold' of the scene"):
                motion.push({"tip": (0, 0, 1)}, **times)
        motion.push({"tip": (0, 0, 1)}, lease=60)
        for loads in ({"forces": {"tip": ("0.1", 0, 0)}}, {"forces": {"tip": "123"}}, {"wrenches": {0: ("123", (0, 0, 0))}},
                      {"wheels": {0: "1"}}):
            with self.assertRaisesRegex(TypeError, "is text, but must be a number"):
                motion.push(**loads, duration=1)
        for name in ("tip", 3):
            with self.assertRaisesRegex(LookupError, "there is no kind 'points'; it must be one of point, link, group, wheel"):
                motion.index("points", name)
        for every, text in ((0.00037, "0.37 ticks at 1000 Hz, .* every=0.001 is"), (0.0025, "2.5 ticks")):
            with self.assertRaisesRegex(ValueError, text):
                freeflex.control(motion, lambda state: None, every=every, until=1.0)
        freeflex.control(motion, lambda state: None, every=0.3333, until=0.1)
        with self.assertRaisesRegex(freeflex.StepError, "has no verdict"):
            motion.verdict
        with self.assertRaisesRegex(ValueError, "zero byte"):
            freeflex.Plan(BOOM + "\0")

    def test_an_invalid_library_is_reported(self):
        for library, text in (("/nowhere.so", "install freeflex"), ("libc.so.6", "not the C library of this")):
            done = subprocess.run([sys.executable, "-m", "freeflex", "step", BOOM, "1"], capture_output=True, text=True,
                                  env=os.environ | {"FREEFLEX_LIBRARY": library}, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn(text, done.stderr)
            self.assertNotIn("Traceback", done.stderr)


    def test_a_recording_without_the_prefix_is_reported(self):
        with tempfile.TemporaryDirectory() as folder:
            log = os.path.join(folder, "a.log")
            subprocess.run([FREEFLEX, "run", BOOM, "--until", "0.1", "--out", log], check=True, capture_output=True)
            for prefix, code, text in (("FREEFLEX", 0, "FREEFLEX_STATE"), ("OTHER", 2, "holds no message of OTHER")):
                done = subprocess.run([sys.executable, "-m", "freeflex", "--prefix", prefix, "log", log], check=False,
                                      capture_output=True, text=True)
                self.assertEqual(done.returncode, code)
                self.assertIn(text, done.stdout + done.stderr)


class States(unittest.TestCase):
    def test_states_do_not_change_when_the_motion_steps(self):
        motion = freeflex.Plan(BOOM).motion()
        motion.push({"tip": (0.0, 0.0, 10.0)}, duration=0.1)
        states = [motion.step(10) for _ in range(5)]
        self.assertEqual([state.tick for state in states], [10, 20, 30, 40, 50])
        heights = [state.position[2] for state in states]
        self.assertEqual(heights, sorted(set(heights)))
        self.assertEqual(states[-1].time, 0.05)

    def test_points_are_read_only_from_the_newest_state(self):
        motion = freeflex.Plan(BOOM).motion()
        state = motion.step(10)
        state.point("tip")
        motion.step(1)
        with self.assertRaisesRegex(RuntimeError, "is at tick 11; read from the state of tick 10"):
            state.point("tip")
        state = motion.state
        motion.reset()  # the tick does not change, so it cannot identify the state
        with self.assertRaises(RuntimeError):
            state.point("tip")

    def test_vectors_are_arrays_if_numpy_is_installed(self):
        state = freeflex.Plan(BOOM).motion().state
        try:
            import numpy
        except ImportError:
            self.assertIsInstance(state.position, tuple)
            self.assertIsInstance(state.point("tip").position, tuple)
        else:
            self.assertIsInstance(state.position, numpy.ndarray)
            self.assertIsInstance(state.point("tip").position, numpy.ndarray)


class Threads(unittest.TestCase):
    """Two threads use one motion: one of the calls fails, and the motion is that of the other call alone."""

    def both(self, motion, call):
        """Steps in another thread while this thread repeats its call until the call is refused. Returns the ticks of the steps."""
        results, start = [], threading.Event()

        def work():
            start.set()
            for _ in range(20):
                try:
                    results.append(motion.step(20000).tick)
                except freeflex.Busy:
                    results.append(None)

        worker = threading.Thread(target=work)
        worker.start()
        start.wait()
        refused = 0
        while worker.is_alive():
            try:
                call(motion)
            except freeflex.Busy as busy:
                self.assertIn("copy()", str(busy))
                refused += 1
        worker.join()
        self.assertGreater(refused, 0)
        return results

    def test_reads_and_pushes_are_refused_while_another_thread_steps(self):
        plan = freeflex.Plan(BOOM)
        for call in (lambda m: m.push({"tip": (0, 0, 0)}, duration=1), lambda m: m.state, lambda m: m.copy(),
                     lambda m: m.tick, lambda m: m.energy):
            motion = plan.motion()
            # a reader may enter between two steps, so a step may be refused too
            steps = self.both(motion, call)
            self.assertEqual(motion.tick, 20000 * sum(tick is not None for tick in steps))

    def test_two_threads_that_step_execute_each_tick_once(self):
        motion, taken = freeflex.Plan(BOOM).motion(), []

        def step(which):
            try:
                which.step(5000)
                taken.append(5000)
            except freeflex.Busy:
                taken.append(0)
                raise

        self.both(motion, step)
        self.assertEqual(motion.tick % 5000, 0)
        self.assertGreaterEqual(motion.tick, sum(taken))

    def test_threads_with_copies_are_independent(self):
        first = freeflex.Plan(BOOM).motion()
        copies, results = [first.copy() for _ in range(4)], []
        threads = [threading.Thread(target=lambda m=m: results.append(list(m.step(20000).q))) for m in copies]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(results, [list(first.step(20000).q)] * 4)


class Memory(unittest.TestCase):
    def test_too_many_pushes_without_a_step_are_refused(self):
        motion = freeflex.Plan(BOOM).motion()
        for _ in range(256):
            motion.push({"tip": (0, 0, 1)}, duration=1.0)
        with self.assertRaisesRegex(freeflex.StepError, "256 pushes wait for the next step, which is the largest number allowed"):
            motion.push({"tip": (0, 0, 2)}, duration=1.0)
        motion.step()
        motion.push({"tip": (0, 0, 2)}, duration=1.0)
        twin = motion.plan.motion()
        twin.push({"tip": (0, 0, 1)}, duration=1.0)
        twin.step()
        twin.push({"tip": (0, 0, 2)}, duration=1.0)
        self.assertEqual(list(motion.step(50).q), list(twin.step(50).q))


class Traps(unittest.TestCase):
    def test_names_are_in_the_order_of_the_scene(self):
        plan = freeflex.Plan(SATELLITE)
        self.assertEqual(list(plan.points.values()), list(range(plan.num_points)))
        motion = plan.motion()
        motion.push(wheels={"spin_z": 0.2}, duration=5.0)
        momenta = dict(zip(plan.wheels, motion.step(1000).wheel_momentum))
        self.assertAlmostEqual(momenta["spin_z"], 0.2, places=12)
        self.assertEqual(momenta["spin_x"], 0.0)

    def test_numbers_that_do_not_fit_are_refused(self):
        motion = freeflex.Plan(BOOM).motion()
        for call in (lambda: motion.step(2**64 + 5), lambda: motion.step(-1), lambda: motion.step(1.5),
                     lambda: motion.push({"tip": (0, 0, 1)}, slot=2**32, duration=1),
                     lambda: motion.push({2**32: (0, 0, 1)}, duration=1),
                     lambda: motion.push({"tip": (0, 0, 1)}, duration=0),
                     lambda: motion.push({"tip": (0, 0, 1)}, duration=float("nan")),
                     lambda: motion.push({"tip": (0, 0, 1)}, axes="local", duration=1)):
            with self.assertRaises((ValueError, freeflex.StepError)):
                call()
        self.assertEqual(motion.tick, 0)


if __name__ == "__main__":
    unittest.main()
