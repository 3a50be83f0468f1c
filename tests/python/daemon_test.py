"""A daemon on the bus, heard and pushed from Python."""

import os
import signal
import socket
import struct
import subprocess
import tempfile
import unittest

import freeflex
from freeflex import bus as lcm
from freeflex.damp import damp

SOURCE = os.environ["FREEFLEX_SOURCE"]
BIN = os.environ["FREEFLEX_BIN"]
SWING = os.path.join(SOURCE, "tests", "tools", "controller", "swing.yaml")
BOOM = os.path.join(SOURCE, "service", "scenes", "boom.yaml")


class Started:
    """freeflexd with some options, stopped at the end."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen([os.path.join(BIN, "freeflexd"), *arguments, "--log-level", "error", "--socket",
                                         "none"])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(10)


class Daemon(unittest.TestCase):
    def scene(self, folder, text):
        path = os.path.join(folder, "scene.yaml")
        with open(BOOM, encoding="utf-8") as file, open(path, "w", encoding="utf-8") as to:
            to.write(file.read() + text)
        return path

    def test_lockstep_is_the_motion_of_the_plan_to_the_bit(self):
        with tempfile.TemporaryDirectory() as folder:
            path = self.scene(folder, "rate: 1000\npublish: {state: 1000, points: {rate: 1000, of: all}}\n")
            twin = freeflex.Plan(path).motion()
            with Started(path, "--time", "lockstep"), freeflex.connect() as daemon:
                self.assertEqual(daemon.scene.name, "boom")
                self.assertEqual(daemon.scene.plan_fingerprint, twin.plan.fingerprint)
                self.assertEqual([daemon.scene.frequencies[k + 1] for k in range(len(twin.plan.frequencies))],
                                 list(twin.plan.frequencies))
                ack = daemon.push({"tip": (0.0, 0.0, 10.0)}, duration=0.05)
                self.assertEqual(ack.reason, 0)
                twin.push({"tip": (0.0, 0.0, 10.0)}, ticks=50)
                for _ in range(200):
                    state = daemon.step()
                    twin.step()
                    self.assertEqual(state.tick, twin.tick)
                    self.assertEqual(list(state.q), list(twin.elastic[0]))
                    self.assertEqual(list(state.position), list(twin.frame.position))
                for points in daemon.listen("POINTS", timeout=2.0):
                    if daemon.points is not None and daemon.points.tick == twin.tick:
                        break
                tip = daemon.points.points[daemon.scene.point("tip")]
                self.assertEqual(list(tip.velocity), list(twin.point("tip").velocity))
                shape = daemon.shape(1)
                self.assertEqual(len(shape), 4)
                with self.assertRaises(freeflex.Rejected) as caught:
                    daemon.push({"tip": (float("inf"), 0, 0)}, duration=1.0)
                self.assertEqual(caught.exception.ack.reason, 14)
                with self.assertRaisesRegex(LookupError, "tip"):
                    daemon.push({"tipp": (0, 0, 1)}, duration=1.0)
                daemon.stop()

    def test_the_example_damps_as_that_in_cpp_does(self):
        with Started(SWING), freeflex.connect() as daemon:
            first, last = damp(daemon, "a", "b", 4.0, seconds=8.0)
        self.assertAlmostEqual(first, 0.083837, delta=0.002)  # amplitude 2 cm at 1 Hz, seen 100 times a second
        self.assertLess(last, 0.01 * first)

    def test_the_controller_of_the_document_holds_the_satellite(self):
        with open(os.path.join(SOURCE, "tools", "python", "README.md"), encoding="utf-8") as file:
            program = file.read().split("## A controller", 1)[1].split("```python\n", 1)[1].split("```", 1)[0]
        self.assertLessEqual(sum(bool(line.strip()) for line in program.splitlines()), 20)
        satellite = os.path.join(SOURCE, "service", "scenes", "satellite.yaml")
        free = freeflex.Plan(satellite).motion()
        free.step(20000)
        with Started(satellite, "--time", "scaled=8", "--until", "20"), freeflex.Bus() as witness:
            names = {}
            try:
                exec(program, names)  # until nothing is heard any more
            except TimeoutError:  # nor answered
                pass
            last = names["state"]
            self.assertGreater(last.tick, 19000)
            self.assertIsNotNone(witness.receive(0.0))
        # the scene's own torque turns it by z; the controller turns it back
        self.assertGreater(abs(free.frame.attitude[3]), 0.03)
        self.assertLess(abs(last.attitude[3]), 0.3 * abs(free.frame.attitude[3]))

    def test_commands_under_a_key(self):
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

    def test_a_new_session_is_taken_up(self):
        with freeflex.Bus() as witness:
            with Started(BOOM, "--hold"):
                daemon = freeflex.connect()
                session = daemon.session
                self.assertEqual(daemon.scene.name, "boom")
            with Started(SWING, "--hold"):
                for status in daemon.listen("STATUS", timeout=10.0):
                    if status.session != session:
                        break
                self.assertEqual(daemon.scene.name, "swing")
                daemon.close()
            self.assertIsNotNone(witness.receive(0.0))

    def test_packets_that_kill_liblcm_are_let_by(self):
        hostile = [b"", b"LC02", struct.pack(">II", 0x4C433032, 1), struct.pack(">II", 0x4C433032, 1) + b"NO_END",
                   # a fragment whose offset and size wrap 32 bits, and one shorter than its head
                   struct.pack(">IIIIHH", 0x4C433033, 1, 100, 0xFFFFFFF0, 1, 3) + b"x" * 64,
                   struct.pack(">IIII", 0x4C433033, 1, 100, 0), struct.pack(">II", 0x4C433032, 2) + b"\xff\0abc",
                   lcm.pack("FREEFLEX_STATUS", b"short"),
                   lcm.pack("FREEFLEX_STATUS", freeflex.status_t.FINGERPRINT.to_bytes(8, "big") + b"\xff" * 4)]
        with Started(BOOM), freeflex.connect() as daemon, \
                socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for _ in range(50):
                for packet in hostile:
                    sender.sendto(packet, ("239.255.76.67", 7667))
            before = daemon.status.tick
            for status in daemon.listen("STATUS", timeout=5.0):
                if status.tick > before + 200:
                    break
            self.assertGreater(daemon.status.tick, before + 200)
            self.assertGreaterEqual(daemon.num_undecodable, 1)

    def test_nobody_there_is_said(self):
        with self.assertRaisesRegex(TimeoutError, "no STATUS on NOBODY_STATUS: is freeflexd there"):
            freeflex.connect("NOBODY", timeout=0.2)
        with freeflex.Daemon(freeflex.Bus(), "NOBODY") as daemon, freeflex.Daemon(freeflex.Bus(), "NOBODY") as other:
            self.assertNotEqual(daemon.sender, other.sender)
            with self.assertRaisesRegex(LookupError, "no channel 'STAT'"):
                list(daemon.listen("STAT", timeout=0.1))
        with self.assertRaisesRegex(ValueError, "not a bus"):
            freeflex.connect(url="udpm://127.0.0.1:7667")


if __name__ == "__main__":
    unittest.main()
