"""Messages have the same bytes as those of the Python code that lcm-gen generates. Other bytes are refused."""

import glob
import importlib
import os
import random
import re
import string
import subprocess
import sys
import tempfile
import unittest

import freeflex
from freeflex import messages

SIZES = {"int8_t": 8, "int16_t": 16, "int32_t": 32, "int64_t": 64}


class Messages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        files = glob.glob(os.path.join(os.environ["FREEFLEX_SOURCE"], "messages", "*.lcm"))
        subprocess.run([os.environ["LCM_GEN"], "-p", "--ppath", cls.folder.name, *files], check=True)
        sys.path.insert(0, cls.folder.name)
        cls.names = {os.path.basename(file)[:-4] for file in files}
        cls.random = random.Random(20261123)

    @classmethod
    def tearDownClass(cls):
        sys.path.remove(cls.folder.name)
        cls.folder.cleanup()

    @staticmethod
    def theirs(name):
        return getattr(importlib.import_module("freeflex_msgs." + name), name)

    def value(self, kind):
        if kind in SIZES:
            return self.random.randrange(-2 ** (SIZES[kind] - 1), 2 ** (SIZES[kind] - 1))
        if kind == "double":
            return self.random.gauss(0, 1) * 10 ** self.random.uniform(-300, 300)
        return "".join(self.random.choice(string.printable + "äπ漢") for _ in range(self.random.randrange(7)))

    def both(self, name):
        """Returns a message of this package and a message of lcm-gen's class with the same random contents."""
        kind, other = messages.TYPES[name], self.theirs(name)()
        counters = {dims[0] for _, _, dims in kind.FIELDS if dims and isinstance(dims[0], str)}
        fields, counts = {}, {}
        for field, of, dims in kind.FIELDS:
            if field in counters:
                counts[field] = self.random.randrange(5)
                setattr(other, field, counts[field])
                continue

            def fill(sizes):
                if not sizes:
                    if of in messages.TYPES:
                        return self.both(of)
                    value = self.value(of)
                    return value, value
                pairs = [fill(sizes[1:]) for _ in range(sizes[0])]
                return [pair[0] for pair in pairs], [pair[1] for pair in pairs]

            sizes = [counts[size] if isinstance(size, str) else size for size in dims]
            if of == "byte" and dims:
                ours = their = self.random.randbytes(sizes[0])
            else:
                ours, their = fill(sizes)
            fields[field] = ours
            setattr(other, field, their)
        return kind(**fields), other

    def test_the_package_has_the_version_of_the_project(self):
        with open(os.path.join(os.environ["FREEFLEX_SOURCE"], "CMakeLists.txt"), encoding="utf-8") as file:
            self.assertIn(f"project(freeflex VERSION {freeflex.__version__} ", file.read())

    def test_every_type_has_its_fingerprint(self):
        self.assertEqual(set(messages.TYPES), self.names)
        for name, kind in messages.TYPES.items():
            self.assertEqual(kind.FINGERPRINT.to_bytes(8, "big"), self.theirs(name)._get_packed_fingerprint(), name)

    def test_messages_encode_and_decode_as_with_lcm_gen(self):
        for name, kind in messages.TYPES.items():
            for _ in range(100):
                ours, theirs = self.both(name)
                data = theirs.encode()
                self.assertEqual(ours.encode(), data, name)
                self.assertEqual(kind.decode(data).encode(), data, name)
                self.assertEqual(self.theirs(name).decode(ours.encode()).encode(), data, name)

    def test_truncated_and_longer_messages_are_refused(self):
        for name, kind in messages.TYPES.items():
            data = self.both(name)[0].encode()
            for size in range(len(data)):
                with self.assertRaises(freeflex.DecodeError, msg=f"{name} cut to {size}"):
                    kind.decode(data[:size])
            with self.assertRaises(freeflex.DecodeError):
                kind.decode(data + b"\0")

    def test_hostile_bytes_raise_one_kind_of_error_and_reserve_no_memory(self):
        for name, kind in messages.TYPES.items():
            for _ in range(300):
                data = bytearray(self.both(name)[0].encode())
                for _ in range(self.random.randrange(1, 5)):
                    data[self.random.randrange(len(data))] = self.random.choice((0, 1, 127, 128, 255))
                try:
                    kind.decode(bytes(data))
                except freeflex.DecodeError:
                    pass

    def test_values_that_do_not_fit_are_reported(self):
        with self.assertRaisesRegex(ValueError, "slot"):
            messages.force_t(slot=2 ** 40).encode()
        with self.assertRaisesRegex(ValueError, "force has 2 values, but must have 3"):
            messages.point_force_t(force=(1.0, 2.0)).encode()
        with self.assertRaisesRegex(ValueError, "q_dot has 1 entries"):
            messages.state_t(q=[1.0, 2.0], q_dot=[1.0]).encode()
        with self.assertRaisesRegex(ValueError, "must hold point_force_t"):
            messages.force_t(forces=[1]).encode()
        with self.assertRaisesRegex(TypeError, "no field forse"):
            messages.force_t(forse=[])

    def test_the_names_of_reasons_agree_with_the_daemon(self):
        path = os.path.join(os.environ["FREEFLEX_SOURCE"], "service", "io", "wire", "reason.cpp")
        with open(path, encoding="utf-8") as file:
            names = re.findall(r'\{Reason::k\w+, "(\w+)"\}', file.read())
        self.assertEqual(list(freeflex.client.REASONS), names)
        self.assertEqual(str(freeflex.Rejected(freeflex.ack_t(reason=len(names), text="of a later version"))),
                         f"{len(names)}: of a later version")

    def test_the_documentation_gives_the_units(self):
        self.assertIn("[m/s] centre of mass, world axes", messages.state_t.__doc__)
        self.assertEqual(messages.control_t.STEP, 3)


if __name__ == "__main__":
    unittest.main()
