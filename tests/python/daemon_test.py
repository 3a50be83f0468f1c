"""Python programs that read the messages of a daemon and push its points."""

import contextlib
import io
import os
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

import freeflex
from freeflex import bus as lcm
from freeflex.damp import damp

SOURCE = os.environ["FREEFLEX_SOURCE"]
BIN = os.environ["FREEFLEX_BIN"]
SWING = os.path.join(SOURCE, "tools", "examples", "swing.yaml")
SATELLITE = os.path.join(SOURCE, "service", "scenes", "satellite.yaml")
BOOM = os.path.join(SOURCE, "service", "scenes", "boom.yaml")


def stepped(daemon, ticks):
    """Returns a listen() that steps the daemon between two states, so that delays of the machine have no effect."""
    listen = daemon.listen

    def listen_and_step(*arguments, **options):
        while True:
            tick = daemon.step(ticks).tick
            for _ in listen(*arguments, **options):
                if daemon.points is not None and daemon.points.tick >= tick:
                    break
            yield

    return listen_and_step


class Started:
    """Runs freeflexd with these arguments and stops it at the end."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([os.path.join(BIN, "freeflexd"), *arguments, "--log-level", "error", "--socket",
                                         "none"])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(10)


def blocks(heading):
    """Returns the Python programs under a heading of tools/python/README.md."""
    with open(os.path.join(SOURCE, "tools", "python", "README.md"), encoding="utf-8") as file:
        section = file.read().split(heading + "\n", 1)[1].split("\n## ", 1)[0]
    return [part.split("```", 1)[0] for part in section.split("```python\n")[1:]]


class Daemon(unittest.TestCase):
    def scene(self, folder, text):
        path = os.path.join(folder, "scene.yaml")
        with open(BOOM, encoding="utf-8") as file, open(path, "w", encoding="utf-8") as to:
            to.write(file.read() + text)
        return path

    def test_lockstep_gives_the_motion_of_the_plan_to_the_bit(self):
        with tempfile.TemporaryDirectory() as folder:
            path = self.scene(folder, "rate: 1000\npublish: {state: 1000, points: {rate: 1000, of: all}}\n")
            twin = freeflex.Plan(path).motion()
            with Started(path, "--time", "lockstep"), freeflex.connect() as daemon:
                self.assertEqual(daemon.scene.name, "boom")
                self.assertEqual(daemon.scene.plan_fingerprint, twin.plan.fingerprint)
                self.assertEqual(list(daemon.scene.frequencies), list(twin.plan.frequencies))
                for names in ("points", "links", "groups", "wheels"):
                    self.assertEqual(getattr(daemon.scene, names), getattr(twin.plan, names))
                self.assertEqual(daemon.scene.listed["point"][0].mass, 40.0)
                ack = daemon.push({"tip": (0.0, 0.0, 10.0)}, duration=0.05)
                self.assertEqual(ack.reason, 0)
                twin.push({"tip": (0.0, 0.0, 10.0)}, duration=0.05)
                for _ in range(200):
                    here, there = daemon.step(), twin.step()
                    self.assertEqual((here.tick, here.time), (there.tick, there.time))
                    for name in freeflex.state.VECTORS:
                        self.assertEqual(list(getattr(here, name)), list(getattr(there, name)), name)
                    for one, other in zip(here.point("tip"), there.point("tip")):
                        self.assertEqual(list(one), list(other))
                shape = daemon.shape(0)
                self.assertEqual(list(shape[daemon.index("point", "tip")]), list(twin.plan.shape("tip")[0]))
                with self.assertRaises(freeflex.Rejected) as caught:
                    daemon.push({"tip": (float("inf"), 0, 0)}, duration=1.0)
                self.assertEqual(caught.exception.ack.reason, 14)
                with self.assertRaisesRegex(LookupError, "tip"):
                    daemon.push({"tipp": (0, 0, 1)}, duration=1.0)
                daemon.stop()

    def test_the_example_damps_like_the_example_in_cpp(self):
        with Started(SWING, "--time", "lockstep"), freeflex.connect() as daemon:
            daemon.listen = stepped(daemon, 10)
            first, last = damp(daemon, "a", "b", 4.0, seconds=8.0)
        self.assertAlmostEqual(first, 0.083837, delta=0.002)  # amplitude 2 cm at 1 Hz, read 100 times a second
        self.assertLess(last, 0.01 * first)

    def test_the_documented_daemon_and_recording_programs_run(self):
        out = io.StringIO()
        with Started(BOOM, "--until", "6"), contextlib.redirect_stdout(out):
            exec(blocks("## A daemon")[0], {})
        lines = out.getvalue().splitlines()
        self.assertRegex(lines[0], "^boom [0-9.]+$")
        self.assertRegex(lines[-1], "^6000 ")
        with tempfile.TemporaryDirectory() as folder:
            recording = os.path.join(folder, "flight.log")
            subprocess.run([os.path.join(BIN, "freeflex"), "run", BOOM, "--until", "0.5", "--out", recording], check=True,
                           stdout=subprocess.DEVNULL)
            out = io.StringIO()
            with contextlib.redirect_stdout(out):
                exec(blocks("## Recordings")[0].replace("flight.log", recording), {"freeflex": freeflex})
            self.assertRegex(out.getvalue().splitlines()[-1], r"^500 \[")

    def test_the_documented_loop_ends_at_its_tick(self):
        program, = blocks("## Lockstep")
        with Started(BOOM, "--time", "lockstep"):
            names = {"freeflex": freeflex, "controller": lambda state: {"forces": {"tip": (0, 0, 1)}, "lease": 0.05}}
            exec(program, names)
            self.assertEqual(names["state"].tick, 10000)
            with freeflex.connect() as daemon:
                self.assertEqual((daemon.tick, daemon.status().tick, daemon.state.tick), (10000, 10000, 10000))

    def test_a_step_returns_its_own_state_at_any_publication_rate(self):
        with tempfile.TemporaryDirectory() as folder:
            path = self.scene(folder, "publish: {state: 1, points: {rate: 1, of: [tip]}}\n")
            twin = freeflex.Plan(path).motion()
            # two million ticks take longer than the timeout, but the daemon still publishes
            with Started(path, "--time", "lockstep"), freeflex.connect() as daemon:
                daemon.timeout = 1.0
                for ticks in (1, 7, 1, 1000, 2_000_000, 3):
                    here, there = daemon.step(ticks), twin.step(ticks)
                    self.assertEqual((here.tick, list(here.q)), (there.tick, list(there.q)))
                    self.assertEqual(list(here.point("tip").velocity), list(there.point("tip").velocity))
                with self.assertRaisesRegex(LookupError, "'hub' is not published; list it under publish"):
                    here.point("hub")
                daemon.step()
                with self.assertRaisesRegex(RuntimeError, "the state is of tick 2001012"):
                    daemon.state.point("tip") and here.point("tip")

    def test_a_step_without_a_published_state_is_reported(self):
        with tempfile.TemporaryDirectory() as folder:
            path = self.scene(folder, "publish: {state: 0}\n")
            with Started(path, "--time", "lockstep"), freeflex.connect() as daemon:
                with self.assertRaisesRegex(freeflex.StepError, "holds at tick 5, but publishes no state; set "
                                            "publish: {state: RATE} in the scene"):
                    daemon.step(5)

    def test_a_step_that_another_client_ends_is_reported(self):
        with Started(BOOM, "--time", "lockstep"), freeflex.connect() as daemon, freeflex.connect() as other:
            def hold():
                while other.tick == 0:
                    other.status()
                other.hold()

            worker = threading.Thread(target=hold)
            worker.start()
            with self.assertRaisesRegex(freeflex.StepError, "before tick 1000000000, because it was held or reset by another"):
                daemon.step(1_000_000_000)
            worker.join()
        with Started(BOOM, "--time", "lockstep", "--until", "0.05"), freeflex.connect() as daemon:
            with self.assertRaisesRegex(freeflex.Gone, "ended before tick 100"):
                daemon.step(100)

    def test_a_controller_gives_the_same_motion_with_and_without_daemon(self):
        names = {}
        exec(blocks("## A controller")[0], names)
        motion = freeflex.Plan(SATELLITE).motion()
        here = freeflex.control(motion, names["hold"], every=0.1, until=5.0)
        with Started(SATELLITE, "--time", "lockstep"), freeflex.connect() as daemon:
            there = freeflex.control(daemon, names["hold"], every=0.1, until=5.0)
            self.assertEqual((here.tick, there.tick), (5000, 5000))
            for name in freeflex.state.VECTORS:
                self.assertEqual(list(getattr(here, name)), list(getattr(there, name)), name)
            self.assertEqual(here.wheel("spin_x"), there.wheel("spin_x"))
            self.assertNotEqual(here.wheel("spin_z"), 0.0)

    def test_the_documented_controller_works_and_survives_a_restart(self):
        controller, on_daemon, in_process = blocks("## A controller")
        self.assertLessEqual(sum(bool(line.strip()) for line in (controller + on_daemon).splitlines()), 20)
        names = {"__name__": "document"}
        exec(f"{controller}\nimport os\nos.chdir({SOURCE!r})\n{in_process}", names)
        here = names["state"]
        with subprocess.Popen([sys.executable, "-W", "error", "-c", controller + on_daemon + "print(list(state.attitude))"],
                              stdout=subprocess.PIPE, text=True) as program:
            # in lockstep the result does not depend on the speed of the program; the first daemon ends before the program
            with Started(SATELLITE, "--time", "lockstep", "--until", "3") as first:
                self.assertEqual(first.process.wait(60), 0)
            with Started(SATELLITE, "--time", "lockstep"):
                out, _ = program.communicate(timeout=60)
        self.assertEqual(program.returncode, 0)
        self.assertEqual(out, f"{list(here.attitude)}\n")
        # a torque of the scene rotates the satellite about z; the controller reduces this rotation
        free = freeflex.Plan(SATELLITE).motion().step(20000)
        self.assertGreater(abs(free.attitude[3]), 0.03)
        self.assertLess(abs(here.attitude[3]), 0.3 * abs(free.attitude[3]))

    def test_a_controller_continues_after_a_restart_of_the_daemon(self):
        with Started(BOOM, "--until", "0.5", "--hold") as first, freeflex.connect() as daemon:
            sessions = {}

            def count(state):
                sessions[state.session] = sessions.get(state.session, 0) + 1
                if len(sessions) == 2 and state.time > 0.3:
                    raise StopIteration
                return {"forces": {"tip": (0, 0, 0.1)}, "lease": 0.2}

            def restart():
                first.process.wait(60)
                with Started(BOOM):
                    is_over.wait(60)

            is_over, restarts = threading.Event(), threading.Thread(target=restart)
            restarts.start()
            daemon.run()
            with self.assertRaises(StopIteration):
                freeflex.control(daemon, count, every=0.1)
            # the new session accepts commands with the names of its scene
            ack = daemon.push({"tip": (0, 0, 0.1)}, lease=0.2)
            is_over.set()
            restarts.join()
            self.assertEqual((len(sessions), ack.session), (2, list(sessions)[1]))

    def test_after_a_reset_nothing_of_the_previous_epoch_is_returned(self):
        with tempfile.TemporaryDirectory() as folder:
            path = self.scene(folder, "publish: {state: 1000, points: {rate: 1000, of: [tip]}}\n")
            with Started(path, "--time", "lockstep"), freeflex.connect() as daemon:
                daemon.step(2000).point("tip")
                daemon.reset()
                self.assertTrue(daemon.points is None or daemon.points.epoch == 1)
                state = daemon.state
                self.assertEqual((state.epoch, state.tick, state.time), (1, 2000, 0.0))
                state.point("tip")
                times = []
                last = freeflex.control(daemon, lambda state: times.append(state.time), every=0.1, until=1.0)
                self.assertEqual((len(times), times[0], last.tick), (10, 0.0, 3000))
                daemon.reset()
                daemon.reset()
                self.assertEqual(daemon.state.epoch, 3)
            with Started(path), freeflex.connect() as daemon:
                self.assertEqual(daemon.state.epoch, 0)
                daemon.reset()
                self.assertEqual(next(daemon.listen("STATE", timeout=10)).epoch, 1)
                self.assertEqual(daemon.status().epoch, 1)

    def test_errors_of_the_controller_are_raised(self):
        def refuse(error):
            def controller(state):
                calls.append(state.tick)
                raise error

            return controller

        errors = (TimeoutError("of a socket of its own"), freeflex.Gone("of another daemon"), OSError("of a file"),
                  freeflex.Rejected(freeflex.ack_t(reason=3, text="by another daemon")))
        for more in ("--time", "lockstep"), ():
            with Started(BOOM, *more), freeflex.connect() as daemon:
                for error in errors:
                    calls = []
                    with self.assertRaises(type(error)) as caught:
                        freeflex.control(daemon, refuse(error), every=0.1, until=1e6)
                    self.assertIs(caught.exception, error)
                    self.assertEqual(len(calls), 1)

    def test_a_controller_that_reads_points_survives_a_restart(self):
        with tempfile.TemporaryDirectory() as folder:
            path = self.scene(folder, "publish: {state: 1000, points: {rate: 1000, of: [tip]}}\n")
            sessions, daemons = [], contextlib.ExitStack()

            def start():
                return daemons.enter_context(Started(path, "--time", "lockstep"))

            def read(state):
                sessions.append(state.session)
                if len(sessions) == 2:
                    raise StopIteration
                first.process.send_signal(signal.SIGTERM)
                first.process.wait(60)
                start()
                daemon.points = None  # the points of this state never arrive
                state.point("tip")

            with daemons:
                first = start()
                with freeflex.connect() as daemon, self.assertRaises(StopIteration):
                    freeflex.control(daemon, read, every=0.1, until=1e6)
            self.assertEqual(len(set(sessions)), 2)

    def test_a_request_for_more_states_than_are_published_warns(self):
        calls = []

        def controller(state):
            calls.append(state.tick)
            if len(calls) == 10:
                raise StopIteration

        with Started(BOOM), freeflex.connect() as daemon:
            with self.assertWarnsRegex(RuntimeWarning, r"every=0.001 s asks for 1000 states per simulated second, but the daemon "
                                       r"publishes [0-9.]+, so .*publish: {state: 1000} in the scene, or start freeflexd with --time "
                                       "lockstep") as caught:
                with self.assertRaises(StopIteration):
                    freeflex.control(daemon, controller, every=0.001)
            self.assertEqual(caught.filename, __file__)
            with self.assertRaisesRegex(ValueError, "every 0.00037 s is 0.37 ticks at 1000 Hz"):
                freeflex.control(daemon, controller, every=0.00037)

    def test_a_second_thread_in_a_daemon_is_refused(self):
        with Started(BOOM, "--time", "lockstep"), freeflex.connect() as daemon:
            calls = (daemon.step, lambda: daemon.push(slot=1), daemon.hold, daemon.reset, daemon.receive, daemon.status,
                     lambda: daemon.shape(0), lambda: next(daemon.listen("STATE")))
            results, is_in, is_over = [], threading.Event(), threading.Event()
            daemon.timeout = 60.0
            receive = daemon.bus.receive

            def wait(timeout):  # keeps the first thread in its step until the second is refused
                is_in.set()
                is_over.wait(60)
                return receive(timeout)

            daemon.bus.receive = wait
            worker = threading.Thread(target=lambda: results.append(daemon.step(3).tick))
            worker.start()
            is_in.wait(60)
            for call in calls:
                with self.assertRaisesRegex(freeflex.Busy, r"another thread uses this Daemon; connect\(\) in each thread"):
                    call()
            is_over.set()
            worker.join()
            daemon.bus.receive = receive
            self.assertEqual(results, [3])
            for _ in daemon.listen("STATUS", timeout=10):  # calls within the loop do not count as a second thread
                self.assertEqual(daemon.step().tick, 4)
                break

    def test_rejections_use_the_names_of_the_python_interface(self):
        with Started(BOOM), freeflex.connect() as daemon:
            while daemon.tick == 0:
                daemon.status()
            for times, text in (({"lease": 70.0}, "held_too_long: lease is 70000 ticks, but may be at most 60000 from the bus "),
                                ({"duration": 70.0}, "held_too_long: duration is 70000 ticks, "),
                                ({"duration": 1.0, "at_tick": 0}, "late: at_tick 0 has passed, .*None, or late=\"take\"")):
                with self.assertRaisesRegex(freeflex.Rejected, text):
                    daemon.push({"tip": (0, 0, 1)}, **times)
            with self.assertRaisesRegex(freeflex.Rejected, r"wrong_mode: .*call daemon.hold\(\) first, or start freeflexd with "
                                        "--time lockstep"):
                daemon.step()
            with self.assertRaisesRegex(LookupError, "there is no kind 'points'; it must be one of point, link, group, wheel"):
                daemon.index("points", "tip")
            with self.assertRaisesRegex(TypeError, "'tip': '0.1' is text, but must be a number"):
                daemon.push({"tip": ("0.1", 0, 0)}, duration=1.0)
        for call in daemon.step, daemon.status, lambda: daemon.push(slot=1), lambda: next(daemon.listen()):
            with self.assertRaisesRegex(ValueError, r"the connection to the bus is closed; connect\(\) again"):
                call()

    def test_a_step_accepts_the_same_ticks_as_a_motion(self):
        motion = freeflex.Plan(BOOM).motion()
        with Started(BOOM, "--time", "lockstep"), freeflex.connect() as daemon:
            for ticks in -1, 1.5, 2**64, "1", None:
                texts = []
                for owner in daemon, motion:
                    with self.assertRaises(ValueError) as caught:
                        owner.step(ticks)
                    texts.append(str(caught.exception))
                self.assertEqual(texts[0], texts[1])
            for ticks, tick in ((0, 0), (5, 5), (0, 5)):
                self.assertEqual((daemon.step(ticks).tick, motion.step(ticks).tick), (tick, tick))

    def test_a_controller_without_states_is_reported(self):
        with tempfile.TemporaryDirectory() as folder:
            path = self.scene(folder, "publish: {state: 0}\n")
            with Started(path), freeflex.connect() as daemon:
                daemon.timeout = 0.5
                with self.assertRaisesRegex(freeflex.StepError, "no STATE of a running daemon came within 0.5 s"):
                    freeflex.control(daemon, lambda state: None, every=0.1)

    def test_commands_need_the_key_that_the_daemon_requires(self):
        with tempfile.TemporaryDirectory() as folder:
            keys = os.path.join(folder, "strut.key")
            subprocess.run([os.path.join(BIN, "freeflex"), "keygen", "strut", "-o", keys], check=True,
                           stdout=subprocess.DEVNULL)
            path = self.scene(folder, "rate: 500\n")
            with Started(path, "--hold", "--keys", keys):
                with freeflex.connect(key=keys) as daemon:
                    self.assertEqual(daemon.push({"tip": (0, 0, 1)}, duration=0.1).reason, 0)
                    daemon.run()
                with freeflex.connect(timeout=2.0) as stranger:
                    with self.assertRaises(freeflex.Rejected) as caught:
                        stranger.push({"tip": (0, 0, 1)}, duration=0.1)
                    self.assertEqual(caught.exception.ack.reason, 29)

    def test_the_client_follows_a_new_session(self):
        with freeflex.Bus() as witness:
            with Started(BOOM, "--hold"):
                daemon = freeflex.connect()
                session = daemon.session
                self.assertEqual(daemon.scene.name, "boom")
            with Started(SWING, "--hold"):
                while daemon.session == session:
                    daemon.status()
                self.assertEqual(daemon.scene.name, "swing")
                daemon.close()
            self.assertIsNotNone(witness.receive(0.0))

    def test_packets_that_crash_liblcm_are_ignored(self):
        hostile = [b"", b"LC02", struct.pack(">II", 0x4C433032, 1), struct.pack(">II", 0x4C433032, 1) + b"NO_END",
                   # a fragment whose offset and size overflow 32 bits, and one shorter than its header
                   struct.pack(">IIIIHH", 0x4C433033, 1, 100, 0xFFFFFFF0, 1, 3) + b"x" * 64,
                   struct.pack(">IIII", 0x4C433033, 1, 100, 0), struct.pack(">II", 0x4C433032, 2) + b"\xff\0abc",
                   lcm.pack("FREEFLEX_STATUS", b"short"),
                   lcm.pack("FREEFLEX_STATUS", freeflex.status_t.FINGERPRINT.to_bytes(8, "big") + b"\xff" * 4)]
        with Started(BOOM), freeflex.connect() as daemon, \
                socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for _ in range(50):
                for packet in hostile:
                    sender.sendto(packet, ("239.255.76.67", 7667))
            before = daemon.tick
            while daemon.tick <= before + 200:
                daemon.status()
            self.assertGreaterEqual(daemon.num_undecodable, 1)

    def test_pages_that_claim_very_many_pages_are_ignored(self):
        with Started(BOOM), freeflex.connect() as daemon, lcm.Bus() as stranger:
            self.assertGreater(len(daemon.scene.points), 0)
            for k in range(200):
                for suffix, kind in (("LOADS", freeflex.loads_t), ("POINTS", freeflex.points_t),
                                     ("SCENE", freeflex.scene_t), ("SHAPES", freeflex.shapes_t)):
                    stranger.send(f"FREEFLEX_{suffix}", kind(session=daemon.session, page=k, num_pages=2**31 - 1).encode())
            daemon.push(slot=9)  # the answer arrives after all these pages
            for pages in (daemon._load_pages, daemon._point_pages, daemon._scene_pages, daemon._shape_pages):
                self.assertLess(len(pages._pages), 2)
            self.assertIsNotNone(next(daemon.listen("POINTS", timeout=10), None))

    def test_text_that_is_not_utf8_is_read_with_replacements(self):
        with Started(BOOM), freeflex.connect() as daemon, lcm.Bus() as stranger:
            statuses = daemon.listen("STATUS", timeout=10)
            status = next(statuses)
            status.fault = "tipXY"
            stranger.send("FREEFLEX_STATUS", status.encode().replace(b"tipXY", b"tip\xc3("))
            fault = next((status.fault for status in statuses if status.fault), None)
            self.assertEqual(fault, "tip\ufffd(")

    def test_a_missing_daemon_is_reported(self):
        with self.assertRaisesRegex(TimeoutError, "no STATUS came on NOBODY_STATUS; is freeflexd running"):
            freeflex.connect("NOBODY", timeout=0.2)
        with freeflex.Daemon(freeflex.Bus(), "NOBODY") as daemon, freeflex.Daemon(freeflex.Bus(), "NOBODY") as other:
            self.assertNotEqual(daemon.sender, other.sender)
            with self.assertRaisesRegex(LookupError, "there is no channel 'STAT'"):
                list(daemon.listen("STAT", timeout=0.1))
        with self.assertRaisesRegex(ValueError, "not a bus"):
            freeflex.connect(url="udpm://127.0.0.1:7667")


if __name__ == "__main__":
    unittest.main()
