"""Recordings of lcm-logger.

    for event, message in freeflex.log.messages("flight.log"):
        ...

Of a recording that is damaged, or cut by a full disk, all events that are whole come first, then a LogError that tells
what is missing. So the body of the loop sees what there is, and a program that takes it for all ends with an error.
"""

import collections
import os
import struct

from freeflex import messages as types
from freeflex.codec import DecodeError

#: one event: its number, when the logger received it [us], channel, bytes
Event = collections.namedtuple("Event", "number utime channel data")

_HEAD = struct.Struct(">4sqqii")
_SYNC = b"\xed\xa1\xda\x01"
_MOST_NAME = 999  # [bytes] of a channel
_BLOCK = 1 << 16  # [bytes]
_NO_EVENT = "no event starts here"

#: a stretch of a recording of which nothing is read: its bytes from begin to before end, and why
Damage = collections.namedtuple("Damage", "begin end reason")

#: types by the suffix of their channel
CHANNELS = {
    "FORCE": types.force_t, "CONTROL": types.control_t, "ACK": types.ack_t, "APPLIED": types.applied_t,
    "STATE": types.state_t, "POINTS": types.points_t, "LOADS": types.loads_t, "STATUS": types.status_t,
    "SCENE": types.scene_t, "SHAPES": types.shapes_t,
}
_SEALED = ("FORCE", "CONTROL")


class LogError(ValueError):
    """A recording that is damaged; the text tells where. `damage` holds a Damage for each stretch that was passed over."""

    def __init__(self, text, damage=()):
        super().__init__(text)
        self.damage = tuple(damage)


class _Flaw(Exception):
    """Why there is no whole event at a place."""


class _Reader:
    """Events of a file, by their place. An event is believed when another or the end of the file follows it."""

    def __init__(self, file):
        self.file = file
        self.size = os.fstat(file.fileno()).st_size
        self.number = None  # of the last whole event

    def take(self, at):
        """The event at a byte, and where it ends. _Flaw: it is not whole."""
        self.file.seek(at)
        head = self.file.read(_HEAD.size)
        if head[:4] != _SYNC[:len(head)]:
            raise _Flaw(_NO_EVENT)
        if len(head) < _HEAD.size:
            raise _Flaw(f"the file ends within an event, of whose header {len(head)} of {_HEAD.size} bytes are there")
        _, number, utime, name_size, size = _HEAD.unpack(head)
        if not 0 < name_size <= _MOST_NAME or size < 0:
            raise _Flaw("an event with impossible lengths")
        end = at + _HEAD.size + name_size + size
        if end > self.size:
            raise _Flaw(f"the file ends within an event, of which {self.size - at} of {end - at} bytes are there")
        body, after = self.file.read(name_size + size), self.file.read(4)
        if after != _SYNC[:len(after)]:
            raise _Flaw(f"no event follows at byte {end}")
        inner = self._next_within(body, number)
        if inner is not None:
            raise _Flaw(f"its lengths take in the next event, at byte {at + _HEAD.size + inner}")
        return Event(number, utime, body[:name_size].decode("latin-1"), body[name_size:]), end

    @staticmethod
    def _next_within(body, number):
        inner = body.find(_SYNC)
        while inner >= 0 and inner + _HEAD.size <= len(body):
            _, found, _, name_size, size = _HEAD.unpack_from(body, inner)
            if found == number + 1 and 0 < name_size <= _MOST_NAME and 0 <= size <= len(body) - inner - _HEAD.size - name_size:
                return inner
            inner = body.find(_SYNC, inner + 1)
        return None

    def find(self, at):
        """Where the next whole event begins, from a byte on; the end of the file when there is none."""
        while at + _HEAD.size < self.size:
            self.file.seek(at)
            block = self.file.read(_BLOCK)
            within = block.find(_SYNC)
            while within >= 0:
                try:
                    number = self.take(at + within)[0].number
                    # numbers rise, or begin anew where a second recording was appended; those of a recording
                    # within a message are its own
                    if self.number is None or number == 0 or number > self.number:
                        return at + within
                except _Flaw:
                    pass
                within = block.find(_SYNC, within + 1)
            at += max(len(block) - 3, 1)
        return self.size

    def events(self, damage):
        at = 0
        while at < self.size:
            try:
                event, end = self.take(at)
            except _Flaw as flaw:
                end = self.find(at + 1)
                damage.append(Damage(at, end, str(flaw)))
                at = end
                continue
            self.number, at = event.number, end
            yield event


def events(path):
    """The whole events of a recording, in its order; then LogError when anything of it is not whole."""
    damage = []
    with open(path, "rb") as file:
        reader = _Reader(file)
        yield from reader.events(damage)
    if damage:
        first, rest = damage[0], len(damage) - 1
        if first.begin == 0 and first.reason == _NO_EVENT and reader.number is None:
            raise LogError(f"{path} is no recording of lcm-logger", damage)
        until = "on" if first.end == reader.size else f"to byte {first.end}"
        more = f", and at {rest} more place{'s' if rest > 1 else ''}" if rest else ""
        raise LogError(f"{path} is damaged at byte {first.begin}: {first.reason}; nothing is read from there "
                       f"{until}{more}", damage)


def decode(channel, data, prefix="FREEFLEX"):
    """The message on a channel of a daemon with this prefix; None of any other. DecodeError when it is damaged."""
    suffix = channel.removeprefix(prefix + "_") if channel.startswith(prefix + "_") else None
    if suffix not in CHANNELS:
        return None
    if suffix in _SEALED and data[:8] == types.envelope_t._head:
        return types.envelope_t.decode(data)
    return CHANNELS[suffix].decode(data)


def messages(path, prefix="FREEFLEX"):
    """(event, message) of what a recording has of the daemon with this prefix, of all that is whole; then LogError when
    an event or a message is not."""
    first, count, damaged = "", 0, None
    try:
        for event in events(path):
            try:
                message = decode(event.channel, event.data, prefix)
            except DecodeError as error:
                first, count = first or f"{event.channel} at {event.utime} us: {error}", count + 1
                continue
            if message is not None:
                yield event, message
    except LogError as error:
        damaged = error
    if count:
        text = (f"{damaged}; " if damaged else f"{path}: ") + first + (f", and {count - 1} more" if count > 1 else "")
        raise LogError(text, damaged.damage if damaged else ())
    if damaged:
        raise damaged
