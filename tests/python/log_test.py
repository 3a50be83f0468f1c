"""Recordings: contents and damage. Keys: the seal agrees with that of libsodium."""

import ctypes
import ctypes.util
import os
import struct
import subprocess
import sys
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

    def test_messages_are_read_in_order(self):
        states = [messages.state_t(tick=k, q=[0.1 * k], q_dot=[0.0]) for k in range(3)]
        self.write(*(event(k, 10 * k, "FREEFLEX_STATE", state.encode()) for k, state in enumerate(states)),
                   event(3, 40, "OTHER_STATE", b"of another"), event(4, 50, "FREEFLEX_NEW", b"unknown"))
        self.assertEqual([e.channel for e in freeflex.events(self.path)],
                         ["FREEFLEX_STATE"] * 3 + ["OTHER_STATE", "FREEFLEX_NEW"])
        self.assertEqual([message for _, message in log.messages(self.path)], states)

    def hear(self, reader, *arguments):
        """Returns the events that a reader yields, and the LogError that ends the reading."""
        found = []
        with self.assertRaises(freeflex.LogError) as caught:
            for each in reader(self.path, *arguments):
                found.append(each)
        return found, caught.exception

    def test_a_cut_recording_gives_complete_events_and_the_position(self):
        first, second = (event(k, k, "FREEFLEX_STATE", messages.state_t(tick=k).encode()) for k in range(2))
        for size in range(1, len(second)):
            self.write(first, second[:size])
            found, error = self.hear(freeflex.events)
            self.assertEqual([each.number for each in found], [0])
            there = f"{size} of 28 bytes" if size < 28 else f"{size} of {len(second)} bytes"
            self.assertRegex(str(error), f"damaged at byte {len(first)}: the file ends within an event, after {there}")
            self.assertEqual([each[:2] for each in error.damage], [(len(first), len(first) + size)])
            self.assertEqual([message.tick for _, message in self.hear(log.messages)[0]], [0])

    def test_damage_loses_its_event_and_the_event_before(self):
        whole = [event(k, k, "FREEFLEX_STATE", messages.state_t(tick=k).encode()) for k in range(5)]
        at = len(whole[0])
        self.write(*whole[:2], b"x" + whole[2][1:], *whole[3:])
        found, error = self.hear(freeflex.events)
        self.assertEqual([each.number for each in found], [0, 3, 4])
        self.assertEqual([each[:2] for each in error.damage], [(at, 3 * at)])
        self.assertRegex(str(error), f"damaged at byte {at}: no event follows at byte {2 * at}; nothing is read from there "
                                     f"to byte {3 * at}")
        # a length that covers the next event
        longer = bytearray(whole[1])
        longer[24:28] = struct.pack(">i", len(whole[1]) - 28 - len("FREEFLEX_STATE") + len(whole[2]))
        self.write(whole[0], bytes(longer), *whole[2:])
        found, error = self.hear(freeflex.events)
        self.assertEqual([each.number for each in found], [0, 2, 3, 4])
        self.assertRegex(str(error), f"its lengths include the next event, at byte {2 * at}")

    def test_a_recording_appended_to_a_cut_recording_is_read(self):
        whole = [event(k, k, "FREEFLEX_STATE", messages.state_t(tick=k).encode()) for k in range(3)]
        self.write(*whole[:2], whole[2][:50], *whole)
        found, error = self.hear(freeflex.events)
        self.assertEqual([each.number for each in found], [0, 1, 0, 1, 2])
        self.assertEqual([each[:2] for each in error.damage], [(2 * len(whole[0]), 2 * len(whole[0]) + 50)])

    def test_a_recording_within_a_message_is_not_taken_for_events(self):
        inner = b"".join(event(k, k, "FREEFLEX_STATE", messages.state_t().encode()) for k in range(1, 3))
        outer = [event(k, k, "FILE", inner) for k in range(5, 9)]
        self.write(*outer)
        self.assertEqual(len(list(freeflex.events(self.path))), 4)
        self.write(outer[0], outer[1], b"x" + outer[2][1:], outer[3])
        found, _ = self.hear(freeflex.events)
        self.assertEqual([each.number for each in found], [5, 8])

    def test_an_invalid_message_is_reported_after_the_valid_ones(self):
        state = messages.state_t(tick=4)
        self.write(event(0, 7, "FREEFLEX_STATE", b"not a state"), event(1, 8, "FREEFLEX_STATE", state.encode()))
        found, error = self.hear(log.messages)
        self.assertEqual([message for _, message in found], [state])
        self.assertRegex(str(error), "FREEFLEX_STATE at 7 us: the bytes are not a state_t")

    def test_another_kind_of_file_is_refused(self):
        self.write(b"tick,time\n0,0\n")
        found, error = self.hear(freeflex.events)
        self.assertEqual(found, [])
        self.assertRegex(str(error), "is not a recording of lcm-logger")
        self.write()
        self.assertEqual(list(freeflex.events(self.path)), [])

    def test_the_command_prints_complete_events_and_reports_damage(self):
        whole = event(0, 0, "FREEFLEX_STATE", messages.state_t(tick=3).encode())
        self.write(whole, whole[:40])
        done = subprocess.run([sys.executable, "-m", "freeflex", "log", self.path], capture_output=True, text=True,
                              check=False)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stdout, "FREEFLEX_STATE +1 messages of ticks 3 to 3")
        self.assertRegex(done.stderr, f"damaged at byte {len(whole)}")


class Keys(unittest.TestCase):
    def test_the_seal_agrees_with_libsodium(self):
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

    def test_key_files_are_read_or_refused(self):
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
