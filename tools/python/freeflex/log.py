"""Recordings of lcm-logger."""

import collections
import struct

from freeflex import messages as types
from freeflex.codec import DecodeError

#: one event: its number, when the logger received it [us], channel, bytes
Event = collections.namedtuple("Event", "number utime channel data")

_HEAD = struct.Struct(">IqqII")
_SYNC = 0xEDA1DA01
_MOST = 1 << 26  # [bytes] that an event may have

#: types by the suffix of their channel
CHANNELS = {
    "FORCE": types.force_t, "CONTROL": types.control_t, "ACK": types.ack_t, "APPLIED": types.applied_t,
    "STATE": types.state_t, "POINTS": types.points_t, "LOADS": types.loads_t, "STATUS": types.status_t,
    "SCENE": types.scene_t, "SHAPES": types.shapes_t,
}
_SEALED = ("FORCE", "CONTROL")


class LogError(ValueError):
    """A recording that is damaged; the text says where."""


def events(path):
    """The events of a recording, in its order. LogError at the first place where it is none, or cut."""
    with open(path, "rb") as file:
        at = 0
        while head := file.read(_HEAD.size):
            if len(head) < _HEAD.size:
                raise LogError(f"{path} ends within an event, at byte {at + len(head)}")
            sync, number, utime, name_size, size = _HEAD.unpack(head)
            if sync != _SYNC or name_size > 1000 or size > _MOST:
                raise LogError(f"{path}: no event at byte {at}; it is damaged there, or no recording of lcm-logger")
            body = file.read(name_size + size)
            at += len(head) + len(body)
            if len(body) < name_size + size:
                raise LogError(f"{path} ends within an event, at byte {at}")
            yield Event(number, utime, body[:name_size].decode("latin-1"), body[name_size:])


def decode(channel, data, prefix="FREEFLEX"):
    """The message on a channel of a daemon with this prefix; None of any other. DecodeError when it is damaged."""
    suffix = channel.removeprefix(prefix + "_") if channel.startswith(prefix + "_") else None
    if suffix not in CHANNELS:
        return None
    if suffix in _SEALED and data[:8] == types.envelope_t._head:
        return types.envelope_t.decode(data)
    return CHANNELS[suffix].decode(data)


def messages(path, prefix="FREEFLEX"):
    """(event, message) of what a recording has of the daemon with this prefix. LogError: damage, by its place."""
    for event in events(path):
        try:
            message = decode(event.channel, event.data, prefix)
        except DecodeError as error:
            raise LogError(f"{path}: {event.channel} at {event.utime} us: {error}") from None
        if message is not None:
            yield event, message
