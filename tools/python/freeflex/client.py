"""A daemon on the bus: heard, pushed, stepped."""

import collections
import functools
import os
import re
import secrets
import threading
import time

from freeflex import messages
from freeflex.bus import Bus
from freeflex.codec import DecodeError
from freeflex.keys import Key
from freeflex.log import CHANNELS, decode
from freeflex.scene import MOST_PAGES, Listing, Loads, Pages, Points, check_kind
from freeflex.state import VECTORS, BodyState, Busy, GroupPose, PointState, Push, State, StepError, vector, whole

#: names of ack_t.reason (messages/README.md, section 6)
REASONS = (
    "accepted malformed wrong_type wrong_session bad_sender stale_sequence bad_slot bad_axes bad_timing "
    "too_many_points unknown_point not_pushable unknown_group duplicate_point not_finite over_limit "
    "unreachable_torque late too_far_ahead no_slot_free queue_full bad_control wrong_mode too_many_senders "
    "epoch_ended left_out point_torque no_keys too_old key_required unknown_key bad_tag expired valid_too_long "
    "key_mismatch not_granted over_key_limit too_fast held_too_long cleared").split()
#: words of the protocol in a daemon's text, and what they are called here
_WORDS = [(re.compile(wire), here) for wire, here in (
    ("name a later one, -1, or late_policy 1", "name a later one, None, or late=\"take\""),
    (r"\bstart_tick\b", "at_tick"),
    (r"^(lease|duration)_ticks (\d+), from", r"\1 of \2 ticks, from"),
    (r"\b(lease|duration)_ticks\b", r"\1"),
    ("send HOLD first$", "call daemon.hold() first, or start freeflexd with --time lockstep"),
    ("send STEP$", "call daemon.step()"))]


class Rejected(RuntimeError):
    """A command that the daemon did not take: `ack` is its answer, whose text has the words of the protocol."""

    def __init__(self, ack):
        text = ack.text
        for wire, here in _WORDS:
            text = wire.sub(here, text)
        name = REASONS[ack.reason] if 0 <= ack.reason < len(REASONS) else str(ack.reason)
        super().__init__(f"{name}: {text}")
        self.ack = ack


class Gone(RuntimeError):
    """The daemon has ended, or another has taken its place. `session`: of the daemon that ended."""

    def __init__(self, text="", session=None):
        super().__init__(text)
        self.session = session


_NO_STATE = "have the scene publish it: publish: {state: RATE}"
_REPEATED = 2.0  # [s] within which a daemon that stands repeats its state, which it does once a second


def _alone(method):
    """Returns the method with a Busy for each thread but the one that uses the Daemon."""
    @functools.wraps(method)
    def alone(self, *arguments, **options):
        if not self._turn.acquire(blocking=False):
            raise Busy("another thread uses this Daemon: connect() in each thread, or have them take turns")
        try:
            return method(self, *arguments, **options)
        finally:
            self._turn.release()

    return alone


def connect(prefix="FREEFLEX", *, url=None, sender=None, key=None, timeout=5.0):
    """The daemon with this prefix, once its STATUS came: a Daemon. TimeoutError when none is there.

    `key`: a Key or the path of a key file, for daemons that require one. `sender`: the name of this controller,
    of which there must not be two: chosen at random if not given, with a key its id. `timeout` [s]: how long an
    answer may take.
    """
    bus = Bus(url)
    try:
        daemon = Daemon(bus, prefix, sender=sender, key=key, timeout=timeout)
        daemon.status()
        return daemon
    except BaseException:
        bus.close()
        raise


class DaemonState(State):
    """A State of a daemon, with all other fields of its state_t (`message`), `epoch` among them."""

    def __init__(self, daemon, message):
        super().__init__(daemon, message.tick, message.time)
        self.message = message

    def _values(self, name):
        return getattr(self.message, name)

    def __getattr__(self, name):
        if name in messages.state_t.NAMES and name not in VECTORS:
            return getattr(self.message, name)
        return super().__getattr__(name)


class Daemon:
    """What a daemon says, as it was heard last, and commands to it. Nothing is received but in its methods.

    `session`; `tick`: the newest that was heard of; `last_status`: the STATUS heard last, ten a second or so: where the
    daemon stands now is for `tick`, `state` and `status()`; `points`, `loads`: the last tick that is whole, None before;
    `num_undecodable`: messages on its channels that were damaged. When another daemon takes its place on the prefix,
    `session` changes with its STATUS and all else begins anew.

    It belongs to one thread at a time. Busy: another thread waits for a message or an answer in it.
    """

    def __init__(self, bus, prefix="FREEFLEX", *, sender=None, key=None, timeout=5.0):
        self.bus, self.prefix, self.timeout = bus, prefix, timeout
        self.key = Key.read(key) if isinstance(key, (str, os.PathLike)) else key
        self.sender = self.key.id if self.key else sender or f"python-{os.getpid()}-{secrets.token_hex(3)}"
        self.session, self.last_status = 0, None
        self.num_undecodable = 0
        self._sequence = time.time_ns() // 1000
        self._turn = threading.RLock()  # of the thread that uses this; its methods call each other
        self._forget()

    def _forget(self):
        self._gaps = collections.deque(maxlen=2)  # [ticks] between the last states, whoever took them
        self._least_epoch = 0  # what is of an earlier one came before a reset of this Daemon
        self._state = self.points = self.loads = self._scene = self._shape = None
        self._scene_pages, self._point_pages, self._load_pages, self._shape_pages = Pages(), Pages(), Pages(), Pages()

    # ---- what is heard

    @_alone
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

    def status(self):
        """The next STATUS that is not behind `tick` or a reset(). TimeoutError without one."""
        status = self._next(lambda suffix, m: suffix == "STATUS" and m.tick >= self.tick and m.epoch >= self._least_epoch,
                            self.timeout)
        if status is None:
            raise TimeoutError(f"no STATUS on {self.prefix}_STATUS: is freeflexd there, with --prefix {self.prefix}, on "
                               f"{self.bus.url}?")
        return status

    @property
    def tick(self):
        """The newest tick that was heard of in this session."""
        return max(heard.tick for heard in (self._state, self.last_status) if heard is not None)

    @property
    def state(self):
        """The State heard last in this session and since reset(); waits for the first. TimeoutError without one."""
        end = time.monotonic() + self.timeout
        while self._state is None:
            if self.receive(max(0.0, end - time.monotonic())) is None:
                raise TimeoutError(f"no STATE on {self.prefix}_STATE within {self.timeout:g} s: {_NO_STATE}")
        return self._state

    @property
    def rate(self):
        """[Hz] ticks per simulated second."""
        return self.last_status.rate

    @property
    def scene(self):
        """What indices mean: a Listing. Asks for it the first time. TimeoutError when it does not come."""
        if self._scene is None:
            # without a key that the daemon wants it is not sent at once, but still once a second
            self._send(self._control(messages.control_t.SCENE))
            end = time.monotonic() + self.timeout
            while self._scene is None and self._next(lambda *_: True, end - time.monotonic()) is not None:
                pass
        if self._scene is None:
            raise TimeoutError(f"no whole scene on {self.prefix}_SCENE within {self.timeout:g} s")
        return self._scene

    @_alone
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
            self.last_status = message
        elif message.session != self.session:
            return None
        elif suffix in ("STATE", "POINTS", "LOADS") and message.epoch < self._least_epoch:
            return None
        elif suffix == "STATE":
            if self._state is not None and message.epoch == self._state.epoch and message.tick > self._state.tick:
                self._gaps.append(message.tick - self._state.tick)
            self._state = message = DaemonState(self, message)
        elif suffix in ("POINTS", "LOADS", "SCENE", "SHAPES"):
            self._take_page(suffix, message, len(data))
        return suffix, message

    def _take_page(self, suffix, page, size):
        scene = self._scene
        if suffix == "POINTS":
            most = scene.most_point_pages if scene else MOST_PAGES
            if pages := self._point_pages.add((page.epoch, page.tick, page.num_pages), page, size, most):
                self.points = Points(pages)
        elif suffix == "LOADS":
            most = scene.most_load_pages if scene else MOST_PAGES
            if pages := self._load_pages.add((page.epoch, page.tick, page.num_pages), page, size, most):
                self.loads = Loads(pages)
        elif suffix == "SCENE":
            if pages := self._scene_pages.add((page.num_pages, page.total_elastic), page, size):
                self._scene = Listing(pages)
        elif pages := self._shape_pages.add((page.mode, page.num_pages), page, size):
            self._shape = page.mode, {k: b for one in pages for k, b in zip(one.point, one.shape)}

    # ---- commands

    @_alone
    def push(self, forces=None, *, torques=None, wrenches=None, wheels=None, axes="world", slot=0, duration=None,
             lease=None, at_tick=None, late="reject"):
        """Puts loads into a slot of this sender in the place of what was there; without any clears it. Returns the ack.

        `forces` {point: (x, y, z)} [N]; `torques` {point: (x, y, z)} [N m] on bodies; `wrenches` {group: (force,
        torque)}; `wheels` {wheel: torque} [N m] of motors; by name or index. `axes`: "world" or "body". Exactly one of
        `duration` [s], after which it ends, and `lease` [s], within which it is to be renewed: both at most `commands:
        max_hold` of the scene, 60 s by default. `at_tick`: when, else at once; `late`: "reject", or "take" when that has
        passed. Rejected: not taken. TimeoutError: no answer. Gone: another daemon has taken the place of the one that it
        was meant for.
        """
        push = Push(self.index, self.rate, forces, torques=torques, wrenches=wrenches, wheels=wheels, axes=axes,
                    slot=slot, duration=duration, lease=lease)
        return self._answered(messages.force_t(
            slot=push.slot, axes=push.axes, start_tick=-1 if at_tick is None else at_tick,
            late_policy={"reject": 0, "take": 1}[late], duration_ticks=push.duration_ticks, lease_ticks=push.lease_ticks,
            forces=[messages.point_force_t(point=k, force=f) for k, f in push.forces],
            torques=[messages.point_torque_t(point=k, torque=t) for k, t in push.torques],
            wrenches=[messages.wrench_t(group=k, force=f, torque=t) for k, f, t in push.wrenches],
            wheels=[messages.wheel_torque_t(wheel=k, torque=t) for k, t in push.wheels]))

    @_alone
    def step(self, ticks=1):
        """Advances a daemon that stands by so many ticks. Returns the State of the last of them, once it is there; of 0
        ticks that where it stands.

        However long that takes, as long as the daemon is heard. Rejected: not taken. StepError: it stands at that
        tick, but publishes no state; or before it, for a fault, or because it was held or reset. Gone: it has ended.
        TimeoutError: nothing is heard any more.
        """
        ticks = whole("ticks", ticks, 0, 2**63 - 1)
        start = self._answered(self._control(messages.control_t.STEP, ticks)) if ticks else self.status()
        session, target, num_standing, give_up = self.session, start.tick + ticks, 0, None
        while self._state is None or self._state.tick < target:
            heard = self.receive(self.timeout)
            if heard is None:
                raise TimeoutError(f"nothing is heard on {self.prefix}_* for {self.timeout:g} s: tick {target} is not there")
            suffix, status = heard
            if suffix != "STATUS" or status.mode == status.RUNNING:
                continue
            if self.session != session or status.mode == status.STOPPED and status.tick < target:
                raise Gone(f"the daemon ended before tick {target}", session)
            if status.tick >= target:  # its state is on its way, or is repeated
                give_up = give_up or time.monotonic() + _REPEATED
                if time.monotonic() > give_up:
                    raise StepError(f"the daemon stands at tick {status.tick}, and no state of it comes: {_NO_STATE}")
                continue
            num_standing += 1  # those that were on their way when the step was taken do not count
            if num_standing > 2:
                raise StepError(f"the daemon stands at tick {status.tick}, before tick {target}: "
                                + (status.fault or "it was held or reset by another"))
        return self._state

    def run(self):
        """Ticks follow the clock."""
        return self._answered(self._control(messages.control_t.RUN))

    def hold(self):
        """Stands at its tick."""
        return self._answered(self._control(messages.control_t.HOLD))

    @_alone
    def reset(self):
        """Back to the start, in a new epoch. What is of the epoch before is not returned any more: `state` waits for the
        new one."""
        epochs = [heard.epoch for heard in (self._state, self.last_status) if heard is not None]
        epoch = max(self._least_epoch, *epochs) + 1
        ack = self._answered(self._control(messages.control_t.RESET))
        self._least_epoch = epoch
        for name in "_state", "points", "loads":
            if (heard := getattr(self, name)) is not None and heard.epoch < epoch:
                setattr(self, name, None)
        return ack

    def stop(self):
        """Ends the daemon in order."""
        return self._answered(self._control(messages.control_t.STOP))

    @_alone
    def shape(self, mode):
        """Mode shape: {index of a point: displacement [-] per elastic coordinate, body axes}. Modes count from 0, as in
        a state's `q`."""
        self._shape = None
        self._answered(self._control(messages.control_t.SHAPES, mode + 1))
        end = time.monotonic() + self.timeout
        while self._shape is None or self._shape[0] != mode + 1:
            if self.receive(max(0.0, end - time.monotonic())) is None:
                raise TimeoutError(f"mode {mode} is not whole within {self.timeout:g} s")
        return self._shape[1]

    def index(self, kind, name):
        """Index of a point, link, group or wheel by its name; an index is itself. LookupError: none of it."""
        check_kind(kind)
        return name if isinstance(name, int) else self.scene.index(kind, name)

    def _read_of(self, state, kind, name):
        index = self.index("point" if kind == "body" else kind, name)
        if kind == "link":
            links = self._whole_of(state, "loads", "LOADS").links
            if index in links:
                return vector(links[index])
            raise LookupError(f"the forces of link {name!r} are not published: name it in publish: loads: of")
        points = self._whole_of(state, "points", "POINTS")
        table, of = {"point": (points.points, PointState), "body": (points.bodies, BodyState),
                     "group": (points.groups, GroupPose)}[kind]
        if index not in table:
            raise LookupError(f"{kind} {name!r} is not published" + (" or has no attitude" if kind == "body" else "")
                              + ": name it in publish: points: of")
        return of(*(vector(getattr(table[index], field)) for field in of._fields))

    @_alone
    def _whole_of(self, state, name, suffix):
        """POINTS or LOADS of the tick of a state; waits for them."""
        when, end, is_heard = (state.epoch, state.tick), time.monotonic() + self.timeout, False
        while (whole := getattr(self, name)) is None or (whole.epoch, whole.tick) < when:
            if state.session != self.session:
                raise Gone("the daemon of this state has ended", state.session)
            if self.receive(max(0.0, end - time.monotonic())) is None or time.monotonic() > end:
                if not is_heard or self.last_status.mode == self.last_status.STOPPED:
                    raise Gone("the daemon of this state has ended, or is not heard", state.session)
                raise TimeoutError(f"no whole {suffix} of tick {state.tick} within {self.timeout:g} s: have the scene publish "
                                   f"{name} at the rate of the state")
            is_heard = True
        if (whole.epoch, whole.tick) != when:
            raise RuntimeError(f"the state is of tick {state.tick}, the newest {suffix} of tick {whole.tick}: read what "
                               f"belongs to a state before the next comes, and have the scene publish {name} at the rate "
                               "of the state")
        return whole

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

    @_alone
    def _answered(self, command):
        sequence, session = self._send(command).sequence, self.session
        ack = self._next(lambda suffix, m: self.session != session or (
            suffix == "ACK" and m.sequence == sequence and m.sender == self.sender), self.timeout)
        if self.session != session:
            raise Gone("another daemon has taken the place of the one that the command was meant for", session)
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
