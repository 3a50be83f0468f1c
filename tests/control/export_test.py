"""freeflex export, modes --bode and modes --hold on the command line, and the worked examples of control design."""

import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy
    import scipy.io
except ImportError as error:
    raise unittest.SkipTest(f"{error} (tools/install-packages all)")

BIN, SOURCE = os.environ["FREEFLEX_BIN"], os.environ["FREEFLEX_SOURCE"]
PAIR = """
points: [{name: a, mass: 2, at: [0, 0, 0]}, {name: b, mass: 2, at: [1, 0, 0]}]
links: {name: s, spring: [a, b], stiffness: 50, viscous: 0.002}
"""
SATELLITE = f"{SOURCE}/service/scenes/satellite.yaml"


class LinearModels(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        with open(f"{self.folder}/pair.yaml", "w") as file:
            file.write(PAIR)

    def freeflex(self, *words, code=0):
        ran = subprocess.run([f"{BIN}/freeflex", *words], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(ran.returncode, code, ran.stdout + ran.stderr)
        return ran.stdout if code == 0 else ran.stderr

    def export(self, file):
        return self.freeflex("export", "pair.yaml", "--state-space", file, "--in", "point.b.fx", "--out", "point.b.x,point.b.ax")

    def test_the_three_files_hold_the_same_model(self):
        for file in ("m.npz", "m.mat", "m.csv"):
            self.export(file)
        npz, mat = numpy.load(f"{self.folder}/m.npz"), scipy.io.loadmat(f"{self.folder}/m.mat")
        for name in "ABCD":
            numpy.testing.assert_array_equal(npz[name], mat[name])
        self.assertEqual([name.strip() for name in mat["states"]], list(npz["states"]))
        self.assertEqual(list(npz["outputs"]), ["point.b.x", "point.b.ax"])
        with open(f"{self.folder}/m.csv") as file:
            rows = list(csv.reader(file))
        self.assertEqual(rows[0][1:], [*npz["states"], *npz["inputs"]])
        numbers = numpy.array([[float(x) for x in row[1:]] for row in rows[1:]])
        numpy.testing.assert_array_equal(numbers, numpy.block([[npz["A"], npz["B"]], [npz["C"], npz["D"]]]))
        # b moves by its share of the rigid motion and of the vibration of sqrt(50) rad/s
        s = 3j
        k = 50 * (1 + 0.002 * s)
        found = (npz["C"] @ numpy.linalg.solve(s * numpy.eye(len(npz["A"])) - npz["A"], npz["B"]) + npz["D"])[:, 0]
        exact = (2 * s * s + k) / (2 * s * s * (2 * s * s + 2 * k))
        self.assertLess(abs(found[0] / exact - 1), 1e-12)
        self.assertLess(abs(found[1] / (s * s * exact) - 1), 1e-12)

    def test_wrong_ports_and_files_are_refused(self):
        export = ("export", "pair.yaml", "--out", "x", "--state-space")
        self.assertIn("the scene has no point 'nothing'", self.freeflex(*export, "m.npz", "--in", "point.nothing.fx", code=2))
        self.assertIn("NAME.npz", self.freeflex(*export, "m.txt", "--in", "point.b.fx", code=2))
        self.assertIn("--hold", self.freeflex("modes", "pair.yaml", "--hold", "a", "--plot", "x.svg", code=2))
        self.assertIn("INPUT:OUTPUT", self.freeflex("modes", "pair.yaml", "--bode", "x", code=2))

    def test_bode_and_hold(self):
        told = json.loads(self.freeflex("modes", "pair.yaml", "--bode", "point.b.fx:point.b.x", "--plot", "bode.svg", "--json"))
        (mode,) = told["modes"]
        # the mode has half of b's motion: q'' + 0.1 q' + 50 q = F / 4 in the displacement of b
        self.assertAlmostEqual(mode["gain"], 0.25 / 50, delta=1e-15)
        self.assertAlmostEqual(mode["hankel"], mode["gain"] / (4 * mode["damping_ratio"]), delta=1e-12)
        with open(f"{self.folder}/bode.svg") as file:
            self.assertIn("</svg>", file.read())
        held = json.loads(self.freeflex("modes", "pair.yaml", "--hold", "a", "--json"))
        self.assertAlmostEqual(held["modes"][-1]["frequency"], 5 / (2 * numpy.pi), delta=1e-12)
        self.assertAlmostEqual(held["modes"][-1]["effective_mass"][0], 2.0, delta=1e-12)
        self.assertIn("sum of all modes", self.freeflex("modes", "pair.yaml", "--hold", "a"))

    def example(self, name, *words):
        environment = os.environ | {"FREEFLEX": f"{BIN}/freeflex", "SCENE": SATELLITE}
        ran = subprocess.run([sys.executable, f"{SOURCE}/tools/examples/{name}", *words], cwd=self.folder, capture_output=True,
                             text=True, env=environment)
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        return ran.stdout

    def test_a_regulator_from_the_model_damps_the_satellite(self):
        self.assertIn("largest modal speed", self.example("lqr.py", SATELLITE))

    def test_the_regulator_damps_the_satellite_on_the_daemon(self):
        daemon = subprocess.Popen([f"{BIN}/freeflexd", SATELLITE, "--time", "lockstep", "--log-level", "error", "--socket", "none"])
        try:
            self.assertEqual(self.example("lqr.py", "bus"), self.example("lqr.py", SATELLITE))
        finally:
            daemon.terminate()
            daemon.wait(30)

    def test_a_notch_makes_the_pointing_loop_stable(self):
        printed = self.example("margins.py", SATELLITE)
        self.assertIn("without a filter: unstable", printed)
        self.assertIn("with a notch: stable", printed)


if __name__ == "__main__":
    unittest.main()
