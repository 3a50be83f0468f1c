"""Recordings: what they hold, and damage; keys: the same seal as libsodium's."""

import ctypes
import ctypes.util
import os
import struct
import tempfile
import unittest

import freeflex
from freeflex import log, messages


def event(number, utime, channel, payload):
    name = channel.encode()
    return struct.pack(">IqqII", 0xEDA1DA01, number, utime, len(name), len(payload)) + name + payload


class Recordings(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = os.path.join(self.folder.name, "log")

    def tearDown(self):
        self.folder.cleanup()

    def write(self, *parts):
        with open(self.path, "wb") as file:
            file.write(b"".join(parts))

    def test_hold_messages_in_order(self):
        states = [messages.state_t(tick=k, q=[0.1 * k], q_dot=[0.0]) for k in range(3)]
        self.write(*(event(k, 10 * k, "FREEFLEX_STATE", state.encode()) for k, state in enumerate(states)),
                   event(3, 40, "OTHER_STATE", b"of another"), event(4, 50, "FREEFLEX_NEW", b"unknown"))
        self.assertEqual([e.channel for e in freeflex.events(self.path)],
                         ["FREEFLEX_STATE"] * 3 + ["OTHER_STATE", "FREEFLEX_NEW"])
        self.assertEqual([message for _, message in log.messages(self.path)], states)

    def test_damage_is_told_with_its_place(self):
        whole = event(0, 0, "FREEFLEX_STATE", messages.state_t().encode())
        for size in range(1, len(whole)):
            self.write(whole, whole[:size])
            with self.assertRaisesRegex(freeflex.LogError, "ends within an event"):
                list(freeflex.events(self.path))
        self.write(whole, b"x" + whole)
        with self.assertRaisesRegex(freeflex.LogError, f"no event at byte {len(whole)}"):
            list(freeflex.events(self.path))
        self.write(event(0, 7, "FREEFLEX_STATE", b"not a state"))
        with self.assertRaisesRegex(freeflex.LogError, "FREEFLEX_STATE at 7 us: not a state_t"):
            list(log.messages(self.path))


class Keys(unittest.TestCase):
    def test_seal_is_libsodiums(self):
        sodium = ctypes.CDLL(ctypes.util.find_library("sodium") or "libsodium.so.23")
        key = freeflex.Key("strut", bytes(range(32)))
        command = messages.force_t(session=5, sequence=7, forces=[messages.point_force_t(point=1, force=(1, 2, 3))])
        for channel in ("FREEFLEX_FORCE", "X_FORCE"):
            sealed = key.seal(command, channel)
            envelope = messages.envelope_t.decode(sealed)
            self.assertEqual((envelope.key_id, envelope.session, envelope.sequence), ("strut", 5, 7))
            self.assertEqual(messages.force_t.decode(envelope.body).sender, "strut")
            tagged = struct.pack(">I", len(channel)) + channel.encode() + sealed[:-32]
            tag = ctypes.create_string_buffer(32)
            sodium.crypto_auth(tag, tagged, ctypes.c_ulonglong(len(tagged)), key.secret)
            self.assertEqual(tag.raw, sealed[-32:])

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "key")
            with open(path, "w", encoding="utf-8") as file:
                file.write("# a comment\nid: strut\nsecret: " + "0f" * 32 + "\n")
            key = freeflex.Key.read(path)
            self.assertEqual((key.id, key.secret), ("strut", b"\x0f" * 32))
            self.assertNotIn("0f0f", repr(key).replace("\\x", ""))
            with open(path, "w", encoding="utf-8") as file:
                file.write("id: strut\nsecret: short\n")
            with self.assertRaisesRegex(ValueError, "freeflex keygen"):
                freeflex.Key.read(path)


if __name__ == "__main__":
    unittest.main()
