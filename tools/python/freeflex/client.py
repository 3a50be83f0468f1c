"""A daemon on the bus: heard, pushed, stepped."""

import os
import secrets
import time

from freeflex import messages
from freeflex.bus import Bus
from freeflex.codec import DecodeError
from freeflex.keys import Key
from freeflex.log import CHANNELS, decode
from freeflex.scene import Loads, Pages, Points, Scene

#: names of ack_t.reason (messages/README.md, section 6)
REASONS = (
    "accepted malformed wrong_type wrong_session bad_sender stale_sequence bad_slot bad_axes bad_timing "
    "too_many_points unknown_point not_pushable unknown_group duplicate_point not_finite over_limit "
    "unreachable_torque late too_far_ahead no_slot_free queue_full bad_control wrong_mode too_many_senders "
    "epoch_ended left_out point_torque no_keys too_old key_required unknown_key bad_tag expired valid_too_long "
    "key_mismatch not_granted over_key_limit too_fast").split()


class Rejected(RuntimeError):
    """A command that the daemon did not take: `ack` is its answer."""

    def __init__(self, ack):
        name = REASONS[ack.reason] if ack.reason < len(REASONS) else str(ack.reason)
        super().__init__(f"{name}: {ack.text}")
        self.ack = ack


def connect(prefix="FREEFLEX", *, url=None, sender=None, key=None, timeout=5.0):
    """The daemon with this prefix, once its STATUS came: a Daemon. TimeoutError when none is there.

    `key`: a Key or the path of a key file, for daemons that require one. `sender`: the name of this controller,
    of which there must not be two: chosen at random if not given, with a key its id. `timeout` [s]: how long an
    answer may take.
    """
    bus = Bus(url)
    try:
        daemon = Daemon(bus, prefix, sender=sender, key=key, timeout=timeout)
        daemon.wait_for_status()
        return daemon
    except BaseException:
        bus.close()
        raise


class Daemon:
    """What a daemon says, as it was heard last, and commands to it. Nothing is received but in its methods.

    `session`; `status`: the last STATUS; `state`: the last STATE; `points`, `loads`: the last tick that is
    whole, None before; `num_undecodable`: messages on its channels that were damaged. When another daemon takes
    its place on the prefix, `session` changes with its STATUS and all else begins anew.
    """

    def __init__(self, bus, prefix="FREEFLEX", *, sender=None, key=None, timeout=5.0):
        self.bus, self.prefix, self.timeout = bus, prefix, timeout
        self.key = Key.read(key) if isinstance(key, (str, os.PathLike)) else key
        self.sender = self.key.id if self.key else sender or f"python-{os.getpid()}-{secrets.token_hex(3)}"
        self.session, self.status = 0, None
        self.num_undecodable = 0
        self._sequence = time.time_ns() // 1000
        self._forget()

    def _forget(self):
        self.state = self.points = self.loads = self._scene = self._shape = None
        self._scene_pages, self._point_pages, self._load_pages, self._shape_pages = Pages(), Pages(), Pages(), Pages()

    # ---- what is heard

    def receive(self, timeout=None):
        """The next message of this daemon, as (suffix of its channel, message): None after `timeout` [s]."""
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            left = None if end is None else end - time.monotonic()
            received = self.bus.receive(None if left is None else max(0.0, left))
            if received is None:
                return None
            if (taken := self._take(*received)) is not None:
                return taken
            if left is not None and left <= 0.0:
                return None

    def listen(self, *suffixes, timeout=None):
        """Messages as they come: listen("STATE", "ACK"), without any of all channels. Ends when none came for
        `timeout` [s]. LookupError: no such channel."""
        for suffix in suffixes:
            if suffix not in CHANNELS:
                raise LookupError(f"no channel {suffix!r}, must be one of {', '.join(CHANNELS)}")
        while (received := self._next(lambda suffix, _: not suffixes or suffix in suffixes, timeout)) is not None:
            yield received

    def wait_for_status(self):
        """The next STATUS. TimeoutError without one."""
        status = self._next(lambda suffix, _: suffix == "STATUS", self.timeout)
        if status is None:
            raise TimeoutError(f"no STATUS on {self.prefix}_STATUS: is freeflexd there, with --prefix {self.prefix}, on "
                               f"{self.bus.url}?")
        return status

    @property
    def scene(self):
        """What indices mean: a Scene. Asks for it the first time. TimeoutError when it does not come."""
        if self._scene is None:
            # without a key that the daemon wants it is not sent at once, but still once a second
            self._send(self._control(messages.control_t.SCENE))
            end = time.monotonic() + self.timeout
            while self._scene is None and self._next(lambda *_: True, end - time.monotonic()) is not None:
                pass
        if self._scene is None:
            raise TimeoutError(f"no whole scene on {self.prefix}_SCENE within {self.timeout:g} s")
        return self._scene

    def _next(self, is_wanted, timeout):
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            left = None if end is None else max(0.0, end - time.monotonic())
            received = self.receive(left)
            if received is None or is_wanted(*received):
                return received[1] if received else None

    def _take(self, channel, data):
        try:
            message = decode(channel, data, self.prefix)
        except DecodeError:
            self.num_undecodable += 1
            return None
        if message is None:
            return None
        suffix = channel[len(self.prefix) + 1:]
        if suffix == "STATUS":
            if message.session != self.session:
                self.session = message.session
                self._forget()
            self.status = message
        elif message.session != self.session:
            return None
        elif suffix == "STATE":
            self.state = message
        elif suffix in ("POINTS", "LOADS", "SCENE", "SHAPES"):
            self._take_page(suffix, message)
        return suffix, message

    def _take_page(self, suffix, page):
        if suffix == "POINTS":
            if pages := self._point_pages.add((page.tick, page.num_pages), page):
                self.points = Points(pages)
        elif suffix == "LOADS":
            if pages := self._load_pages.add((page.tick, page.num_pages), page):
                self.loads = Loads(pages)
        elif suffix == "SCENE":
            if pages := self._scene_pages.add((page.num_pages, page.total_elastic), page):
                self._scene = Scene(pages)
        elif pages := self._shape_pages.add((page.mode, page.num_pages), page):
            self._shape = page.mode, {k: b for one in pages for k, b in zip(one.point, one.shape)}

    # ---- commands

    def push(self, forces=None, *, torques=None, wrenches=None, wheels=None, axes="world", slot=0, duration=None,
             lease=None, at=None, late="reject"):
        """Puts loads into a slot of this sender in the place of what was there; without any clears it. Returns the ack.

        `forces` {point: (x, y, z)} [N]; `torques` {point: (x, y, z)} [N m] on bodies; `wrenches` {group: (force,
        torque)}; `wheels` {wheel: torque} [N m] of motors; by name or index. `axes`: "world" or "body". Exactly one of
        `duration` [s], after which it ends, and `lease` [s], within which it is to be renewed. `at`: the tick, else at
        once; `late`: "reject", or "take" when that has passed. Rejected: not taken. TimeoutError: no answer.
        """
        if axes not in ("world", "body"):
            raise ValueError(f"axes {axes!r}, must be world or body")
        push = messages.force_t(slot=slot, axes={"world": 0, "body": 1}[axes], start_tick=-1 if at is None else at,
                                late_policy={"reject": 0, "take": 1}[late], duration_ticks=self._ticks(duration),
                                lease_ticks=self._ticks(lease))
        push.forces = [messages.point_force_t(point=self._index("point", k), force=list(f))
                       for k, f in (forces or {}).items()]
        push.torques = [messages.point_torque_t(point=self._index("point", k), torque=list(t))
                        for k, t in (torques or {}).items()]
        push.wrenches = [messages.wrench_t(group=self._index("group", k), force=list(f), torque=list(t))
                         for k, (f, t) in (wrenches or {}).items()]
        push.wheels = [messages.wheel_torque_t(wheel=self._index("wheel", k), torque=t)
                       for k, t in (wheels or {}).items()]
        return self._answered(push)

    def step(self, ticks=1):
        """So many ticks of a daemon that stands. Returns the state after them. Rejected, TimeoutError as push."""
        ack = self._answered(self._control(messages.control_t.STEP, ticks))
        end = time.monotonic() + self.timeout
        while self.state is None or self.state.tick < ack.tick + ticks:
            if self.receive(max(0.0, end - time.monotonic())) is None:
                raise TimeoutError(f"no state of tick {ack.tick + ticks} within {self.timeout:g} s: does the scene publish "
                                   "the state?")
        return self.state

    def run(self):
        """Ticks follow the clock."""
        return self._answered(self._control(messages.control_t.RUN))

    def hold(self):
        """Stands at its tick."""
        return self._answered(self._control(messages.control_t.HOLD))

    def reset(self):
        """Back to the start, in a new epoch."""
        return self._answered(self._control(messages.control_t.RESET))

    def stop(self):
        """Ends the daemon in order."""
        return self._answered(self._control(messages.control_t.STOP))

    def shape(self, mode):
        """Mode shape: {index of a point: displacement [-] per elastic coordinate, body axes}. Modes count from 1."""
        self._shape = None
        self._answered(self._control(messages.control_t.SHAPES, mode))
        end = time.monotonic() + self.timeout
        while self._shape is None or self._shape[0] != mode:
            if self.receive(max(0.0, end - time.monotonic())) is None:
                raise TimeoutError(f"mode {mode} is not whole within {self.timeout:g} s")
        return self._shape[1]

    def _index(self, kind, name):
        return name if isinstance(name, int) else self.scene.index(kind, name)

    def _ticks(self, seconds):
        if seconds is None:
            return 0
        if not 0.0 < seconds < 1e9:
            raise ValueError(f"{seconds!r} s, must be a time above 0 and below 1e9 s")
        return max(1, round(seconds * self.status.rate))

    @staticmethod
    def _control(command, count=0):
        return messages.control_t(command=command, count=count)

    def _send(self, command):
        self._sequence += 1
        command.utime = time.time_ns() // 1000
        command.session, command.sender, command.sequence = self.session, self.sender, self._sequence
        channel = f"{self.prefix}_{'FORCE' if isinstance(command, messages.force_t) else 'CONTROL'}"
        self.bus.send(channel, self.key.seal(command, channel) if self.key else command.encode())
        return command

    def _answered(self, command):
        sequence = self._send(command).sequence
        ack = self._next(lambda suffix, m: suffix == "ACK" and m.sequence == sequence and m.sender == self.sender,
                         self.timeout)
        if ack is None:
            raise TimeoutError(f"no answer within {self.timeout:g} s: the command was lost, the daemon has ended, or it does "
                               "not know the tag of the command")
        if ack.reason != 0:
            raise Rejected(ack)
        return ack

    def close(self):
        """Leaves the bus; the daemon goes on."""
        self.bus.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
