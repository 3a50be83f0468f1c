"""LCM's UDP multicast without liblcm, because some packets crash liblcm's receiver.

Every message of freeflex fits in one datagram. Fragments of larger messages and all other datagrams are ignored.
"""

import os
import socket
import struct
import time
import urllib.parse

DEFAULT_URL = "udpm://239.255.76.67:7667?ttl=0"
_HEAD = struct.Struct(">II")
_SHORT = 0x4C433032  # magic number of a message in one datagram
_LARGEST = 65499
_LONGEST_CHANNEL = 63
_BUFFER = 4 << 20  # [bytes] receive buffer requested from the kernel


def pack(channel, data, sequence=0):
    """Returns the datagram of one message. ValueError: LCM does not allow the channel name or the size."""
    name = channel.encode("ascii")
    if not 0 < len(name) <= _LONGEST_CHANNEL or b"\0" in name:
        raise ValueError(f"channel {channel!r} must have 1 to {_LONGEST_CHANNEL} characters")
    if len(name) + 1 + len(data) > _LARGEST:
        raise ValueError(f"the message has {len(data)} bytes on {channel}, but one datagram holds at most {_LARGEST - len(name) - 1}")
    return _HEAD.pack(_SHORT, sequence & 0xFFFFFFFF) + name + b"\0" + data


def unpack(datagram):
    """Returns (channel, data) of a datagram; None if it is not a message."""
    if len(datagram) < 10 or _HEAD.unpack_from(datagram)[0] != _SHORT:
        return None
    end = datagram.find(b"\0", 8, 8 + _LONGEST_CHANNEL + 1)
    if end <= 8:
        return None
    try:
        return datagram[8:end].decode("ascii"), datagram[end + 1:]
    except UnicodeDecodeError:
        return None


def _parse(url):
    parts = urllib.parse.urlsplit(url)
    try:
        group, port = socket.inet_aton(parts.hostname or ""), parts.port
        ttl = int(urllib.parse.parse_qs(parts.query).get("ttl", ["0"])[0])
        if parts.scheme == "udpm" and port and 224 <= group[0] < 240 and 0 <= ttl <= 255:
            return parts.hostname, port, ttl
    except (OSError, ValueError):
        pass
    raise ValueError(f"{url!r} is not a bus; give udpm://GROUP:PORT?ttl=N with a multicast group, as {DEFAULT_URL}")


class Bus:
    """Connects to the bus. `url` is an LCM URL; default LCM_DEFAULT_URL, else LCM's default."""

    def __init__(self, url=None):
        self.url = url or os.environ.get("LCM_DEFAULT_URL") or DEFAULT_URL
        group, port, ttl = _parse(self.url)
        self._to = (group, port)
        self._sequence = 0
        #: number of datagrams that were not messages
        self.num_ignored = 0
        self._in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._in.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._in.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
            # binds to the address of the group, so unicast packets do not arrive
            self._in.bind((group, port))
            self._in.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                                socket.inet_aton(group) + socket.inet_aton("0.0.0.0"))
            self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
            self._out.connect(self._to)
        except OSError as error:
            self.close()
            raise OSError(error.errno, f"{self.url}: {error.strerror}; multicast needs a route. To use LCM "
                          "on this machine alone, run\n  sudo ip link set lo up multicast on\n"
                          "  sudo ip route add 239.0.0.0/8 dev lo") from None

    def send(self, channel, data):
        """Sends one message, as bytes. OSError: the network refuses the message. ValueError: the bus was closed."""
        self._check_open()
        self._sequence += 1
        self._out.send(pack(channel, data, self._sequence))

    def receive(self, timeout=None):
        """Returns the next message as (channel, bytes); None if none comes within `timeout` [s]. Without a timeout,
        waits until one comes. ValueError: the bus was closed."""
        self._check_open()
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            self._in.settimeout(None if end is None else max(0.0, end - time.monotonic()))
            try:
                datagram = self._in.recv(65536)
            except (TimeoutError, BlockingIOError):
                return None
            if (message := unpack(datagram)) is not None:
                return message
            self.num_ignored += 1
            if end is not None and time.monotonic() > end:
                return None

    def _check_open(self):
        if self._in.fileno() < 0:
            raise ValueError("the connection to the bus is closed; connect() again")

    def fileno(self):
        """Returns the descriptor of the receiving socket, for select."""
        return self._in.fileno()

    def close(self):
        """Leaves the bus."""
        self._in.close()
        self._out.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
