"""Recordings of lcm-logger.

    for event, message in freeflex.log.messages("flight.log"):
        ...

If a recording is damaged, or was cut because the disk was full, the loop gets all intact events first and then a
LogError that describes the damage. So a program sees all readable events, and a program that needs a complete recording
ends with an error.
"""

import collections
import os
import struct

from freeflex import messages as types
from freeflex.codec import DecodeError

#: one event: its number, the time at which the logger received it [us], channel, bytes
Event = collections.namedtuple("Event", "number utime channel data")

_HEAD = struct.Struct(">4sqqii")
_SYNC = b"\xed\xa1\xda\x01"
_MOST_NAME = 999  # [bytes] longest name of a channel
_BLOCK = 1 << 16  # [bytes]
_NO_EVENT = "no event starts here"

#: an unreadable range of a recording: the bytes from begin up to, but not including, end, and the reason
Damage = collections.namedtuple("Damage", "begin end reason")

#: message types by the suffix of their channel
CHANNELS = {
    "FORCE": types.force_t, "CONTROL": types.control_t, "ACK": types.ack_t, "APPLIED": types.applied_t,
    "STATE": types.state_t, "POINTS": types.points_t, "LOADS": types.loads_t, "STATUS": types.status_t,
    "SCENE": types.scene_t, "SHAPES": types.shapes_t,
}
_SEALED = ("FORCE", "CONTROL")


class LogError(ValueError):
    """The recording is damaged; the text gives the position. `damage` is a list with a Damage for each range that was
    skipped."""

    def __init__(self, text, damage=()):
        super().__init__(text)
        self.damage = tuple(damage)


class _Flaw(Exception):
    """The reason why there is no intact event at a byte."""


class _Reader:
    """Reads the events of a file at given positions. An event is regarded as intact if another event or the end of the
    file follows it."""

    def __init__(self, file):
        self.file = file
        self.size = os.fstat(file.fileno()).st_size
        self.number = None  # number of the last intact event

    def take(self, at):
        """Returns the event at a byte, and the byte at which it ends. _Flaw: the event is not intact."""
        self.file.seek(at)
        head = self.file.read(_HEAD.size)
        if head[:4] != _SYNC[:len(head)]:
            raise _Flaw(_NO_EVENT)
        if len(head) < _HEAD.size:
            raise _Flaw(f"the file ends within an event, after {len(head)} of {_HEAD.size} bytes of its header")
        _, number, utime, name_size, size = _HEAD.unpack(head)
        if not 0 < name_size <= _MOST_NAME or size < 0:
            raise _Flaw("an event has impossible lengths")
        end = at + _HEAD.size + name_size + size
        if end > self.size:
            raise _Flaw(f"the file ends within an event, after {self.size - at} of {end - at} bytes")
        body, after = self.file.read(name_size + size), self.file.read(4)
        if after != _SYNC[:len(after)]:
            raise _Flaw(f"no event follows at byte {end}")
        inner = self._next_within(body, number)
        if inner is not None:
            raise _Flaw(f"its lengths include the next event, at byte {at + _HEAD.size + inner}")
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
        """Returns the position of the first intact event at or after a byte; the end of the file if there is none."""
        while at + _HEAD.size < self.size:
            self.file.seek(at)
            block = self.file.read(_BLOCK)
            within = block.find(_SYNC)
            while within >= 0:
                try:
                    number = self.take(at + within)[0].number
                    # the numbers of events ascend, or restart if a second recording was appended; a recording inside a
                    # message has numbers of its own
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
    """Yields the intact events of a recording in order. LogError after the last event: a part is damaged."""
    damage = []
    with open(path, "rb") as file:
        reader = _Reader(file)
        yield from reader.events(damage)
    if damage:
        first, rest = damage[0], len(damage) - 1
        if first.begin == 0 and first.reason == _NO_EVENT and reader.number is None:
            raise LogError(f"{path} is not a recording of lcm-logger", damage)
        until = "on" if first.end == reader.size else f"to byte {first.end}"
        more = f", nor at {rest} more place{'s' if rest > 1 else ''}" if rest else ""
        raise LogError(f"{path} is damaged at byte {first.begin}: {first.reason}; nothing is read from there "
                       f"{until}{more}", damage)


def decode(channel, data, prefix="FREEFLEX"):
    """Returns the message on a channel of a daemon with this prefix; None for other channels. DecodeError: the message
    is damaged."""
    suffix = channel.removeprefix(prefix + "_") if channel.startswith(prefix + "_") else None
    if suffix not in CHANNELS:
        return None
    if suffix in _SEALED and data[:8] == types.envelope_t._head:
        return types.envelope_t.decode(data)
    return CHANNELS[suffix].decode(data)


def messages(path, prefix="FREEFLEX"):
    """Yields (event, message) for all intact messages in a recording from the daemon with this prefix. LogError after
    the last one: an event or a message is damaged."""
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
        others = "1 more message is" if count == 2 else f"{count - 1} more messages are"
        text = (f"{damaged}; " if damaged else f"{path}: ") + first + (f", and {others} damaged" if count > 1 else "")
        raise LogError(text, damaged.damage if damaged else ())
    if damaged:
        raise damaged
