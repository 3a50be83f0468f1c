"""Scenes from a dict and from text, and values that are set by path."""

import contextlib
import io
import json
import os
import tempfile
import unittest

import freeflex

SOURCE = os.environ["FREEFLEX_SOURCE"]
SCENES = os.path.join(SOURCE, "service", "scenes")
BOOM = os.path.join(SCENES, "boom.yaml")
PAIR = {"name": "pair", "rate": 1000,
        "points": [{"name": "a", "mass": 2, "at": [0, 0, 0]}, {"name": "b", "mass": 2, "at": (1.0, 0, 0)}],
        "links": [{"name": "spring", "spring": ["a", "b"], "stiffness": 40}]}


class Scenes(unittest.TestCase):
    def test_a_dict_gives_its_scene(self):
        plan = freeflex.Plan(PAIR)
        self.assertEqual((plan.name, plan.mass, plan.points), ("pair", 4.0, {"a": 0, "b": 1}))
        # two masses of 2 kg on 40 N/m have the reduced mass of 1 kg and the frequency sqrt(40 N/m / 1 kg) / (2 pi)
        self.assertAlmostEqual(plan.frequencies[0], 40 ** 0.5 / 6.283185307179586, places=12)
        self.assertEqual(list(freeflex.Plan(text=json.dumps(PAIR)).frequencies), list(plan.frequencies))

    def test_text_gives_the_scene_of_its_file(self):
        with open(BOOM, encoding="utf-8") as file:
            text = file.read()
        here, there = freeflex.Plan(text=text).motion(), freeflex.Plan(BOOM).motion()
        self.assertEqual(list(here.step(1500).q), list(there.step(1500).q))

    def test_files_that_a_text_names_are_found_in_its_folder(self):
        path = os.path.join(SCENES, "truss104.yaml")
        with open(path, encoding="utf-8") as file:
            text = file.read()
        self.assertEqual(freeflex.Plan(text=text, folder=SCENES).mass, freeflex.Plan(path).mass)
        with tempfile.TemporaryDirectory() as folder, self.assertRaisesRegex(freeflex.StepError, "truss104_points.csv"):
            freeflex.Plan(text=text, folder=folder)

    def test_a_value_set_by_path_acts_like_that_value_in_a_file(self):
        scene = freeflex.Scene(BOOM)
        scene["points.hub.mass"] = 80
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "boom.yaml")
            with open(BOOM, encoding="utf-8") as file, open(path, "w", encoding="utf-8") as to:
                to.write(file.read().replace("mass: 40,", "mass: 80,"))
            expected = freeflex.Plan(path)
        plan = freeflex.Plan(scene)
        self.assertEqual(plan.mass, expected.mass)
        self.assertEqual(list(plan.frequencies), list(expected.frequencies))
        self.assertEqual(scene["points.hub.mass"], 80)
        del scene["points.hub.mass"]
        self.assertEqual(freeflex.Plan(scene).mass, plan.mass - 40)

    def test_values_are_set_in_a_dict_and_a_text(self):
        for scene in (freeflex.Scene(PAIR), freeflex.Scene(text=json.dumps(PAIR))):
            scene["points.b.mass"] = 3.5
            scene["points.b.at"] = [2, 0, 0]
            plan = freeflex.Plan(scene)
            self.assertEqual(plan.mass, 5.5)
            self.assertAlmostEqual(plan.rest()[1][0] - plan.rest()[0][0], 2.0, places=12)

    def test_the_last_value_of_a_path_applies(self):
        scene = freeflex.Scene(PAIR)
        for mass in (3, -1, 5):
            scene["points.b.mass"] = mass
        self.assertEqual(freeflex.Plan(scene).mass, 7.0)

    def test_a_refused_value_is_reported(self):
        scene = freeflex.Scene(BOOM)
        scene["points.hub.mass"] = -1
        with self.assertRaisesRegex(freeflex.StepError, "points.hub.mass = -1.*mass is -1 kg, but must be"):
            freeflex.Plan(scene)
        scene["points.hub.mass"] = 40
        scene["points.hubb.mass"] = 41
        with self.assertRaisesRegex(freeflex.StepError, "points.hubb.mass = 41.*hub"):
            freeflex.Plan(scene)
        with self.assertRaisesRegex(freeflex.StepError, "<dict>.*mass is -2 kg, but must be"):
            freeflex.Plan(PAIR | {"points": [{"name": "a", "mass": -2, "at": [0, 0, 0]}]})
        with self.assertRaisesRegex(freeflex.StepError, "<text>:1:"):
            freeflex.Plan(text="points: 3")

    def test_the_documented_programs_run(self):
        with open(os.path.join(SOURCE, "tools", "python", "README.md"), encoding="utf-8") as file:
            section = file.read().split("## Plans\n", 1)[1].split("\n## ", 1)[0]
        blocks = [part.split("```", 1)[0] for part in section.split("```python\n")[1:]]
        names, out, here = {"freeflex": freeflex}, io.StringIO(), os.getcwd()
        os.chdir(SCENES)
        try:
            with contextlib.redirect_stdout(out):
                for block in blocks:
                    exec(block, names)
        finally:
            os.chdir(here)
        lines = out.getvalue().splitlines()[-3:]
        masses, frequencies = zip(*((float(word) for word in line.split()) for line in lines))
        self.assertEqual(masses, (20, 40, 80))
        # a heavier hub lowers the frequency
        self.assertEqual(list(frequencies), sorted(frequencies, reverse=True))
        self.assertEqual(names["pair"].mass, 4.0)

    def test_invalid_arguments_are_refused_before_the_set_up(self):
        for arguments in ({}, {"source": BOOM, "text": "points: []"}, {"source": BOOM, "folder": "."},
                          {"source": {"points": {1, 2}}}, {"source": {"rate": float("nan")}}, {"source": BOOM + "\0"},
                          {"text": "a: \0"}):
            with self.assertRaises(ValueError):
                freeflex.Plan(**arguments)
        scene = freeflex.Scene(BOOM)
        for path, value in (("", 1), ("rate", float("inf")), ("rate", object()), (3, 1)):
            with self.assertRaises(ValueError):
                scene[path] = value
        with self.assertRaises(KeyError):
            scene["rate"]


if __name__ == "__main__":
    unittest.main()
