"""Client of a daemon on the bus: receives the daemon's messages, pushes and steps it."""

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
#: terms of the protocol in a daemon's texts, and the terms of this package that replace them
_TERMS = [(re.compile(wire), here) for wire, here in (
    ("give a later tick, -1, or late_policy 1", "give a later tick, None, or late=\"take\""),
    (r"\bstart_tick\b", "at_tick"),
    (r"^(lease|duration)_ticks is (\d+), but", r"\1 is \2 ticks, but"),
    (r"\b(lease|duration)_ticks\b", r"\1"),
    ("send HOLD first$", "call daemon.hold() first, or start freeflexd with --time lockstep"),
    ("send STEP$", "call daemon.step()"))]


class Rejected(RuntimeError):
    """The daemon rejected a command. `ack` is the daemon's answer; its text uses the terms of the protocol."""

    def __init__(self, ack):
        text = ack.text
        for wire, here in _TERMS:
            text = wire.sub(here, text)
        name = REASONS[ack.reason] if 0 <= ack.reason < len(REASONS) else str(ack.reason)
        super().__init__(f"{name}: {text}")
        self.ack = ack


class Gone(RuntimeError):
    """The daemon has ended, or another daemon has replaced it. `session`: session of the daemon that ended."""

    def __init__(self, text="", session=None):
        super().__init__(text)
        self.session = session


_NO_STATE = "set publish: {state: RATE} in the scene"
_REPEATED = 2.0  # [s] a holding daemon repeats its state once a second, so certainly within this time


def _alone(method):
    """Returns the method with a check: while one thread uses the Daemon, any other thread gets a Busy."""
    @functools.wraps(method)
    def alone(self, *arguments, **options):
        if not self._user.acquire(blocking=False):
            raise Busy("another thread uses this Daemon; connect() in each thread, or have them take turns")
        try:
            return method(self, *arguments, **options)
        finally:
            self._user.release()

    return alone


def connect(prefix="FREEFLEX", *, url=None, sender=None, key=None, timeout=5.0):
    """Returns the Daemon with this prefix, after its first STATUS. TimeoutError: no STATUS came.

    `key`: a Key or the path of a key file, for daemons that require keys. `sender`: the unique name of this controller;
    default: the id of the key, without a key a random name. `timeout` [s]: longest wait for an answer.
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
    """A State of a daemon. `message` has all other fields of its state_t, such as `epoch`."""

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
    """Keeps the latest messages of a daemon, and sends commands to it. Receives only during calls of its methods.

    `session`; `tick`: the newest tick received; `last_status`: the last STATUS received (about ten come a second, so
    use `tick`, `state` or `status()` for the present tick); `points`, `loads`: the last complete tick, None before the
    first; `num_undecodable`: number of damaged messages on the daemon's channels. If another daemon replaces this one
    on the prefix, `session` changes with the new daemon's first STATUS and everything else is reset.

    Only one thread may use a Daemon at a time. Busy: another thread waits for a message or an answer in one of its
    methods.
    """

    def __init__(self, bus, prefix="FREEFLEX", *, sender=None, key=None, timeout=5.0):
        self.bus, self.prefix, self.timeout = bus, prefix, timeout
        self.key = Key.read(key) if isinstance(key, (str, os.PathLike)) else key
        self.sender = self.key.id if self.key else sender or f"python-{os.getpid()}-{secrets.token_hex(3)}"
        self.session, self.last_status = 0, None
        self.num_undecodable = 0
        self._sequence = time.time_ns() // 1000
        self._user = threading.RLock()  # held by the thread that uses this; methods call each other
        self._forget()

    def _forget(self):
        self._gaps = collections.deque(maxlen=2)  # [ticks] distances between the last states received
        self._least_epoch = 0  # messages of earlier epochs are ignored: they precede a reset() by this Daemon
        self._state = self.points = self.loads = self._scene = self._shape = None
        self._scene_pages, self._point_pages, self._load_pages, self._shape_pages = Pages(), Pages(), Pages(), Pages()

    # ---- receiving

    @_alone
    def receive(self, timeout=None):
        """Returns the next message of this daemon as (suffix of its channel, message); None if none comes within
        `timeout` [s]."""
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
        """Yields messages as they come, for example listen("STATE", "ACK"); without arguments, from all channels. Ends
        if none comes for `timeout` [s]. LookupError: there is no such channel."""
        for suffix in suffixes:
            if suffix not in CHANNELS:
                raise LookupError(f"there is no channel {suffix!r}; it must be one of {', '.join(CHANNELS)}")
        while (received := self._next(lambda suffix, _: not suffixes or suffix in suffixes, timeout)) is not None:
            yield received

    def status(self):
        """Returns the next STATUS that is neither older than `tick` nor older than the last reset(). TimeoutError: none
        comes."""
        status = self._next(lambda suffix, m: suffix == "STATUS" and m.tick >= self.tick and m.epoch >= self._least_epoch,
                            self.timeout)
        if status is None:
            raise TimeoutError(f"no STATUS came on {self.prefix}_STATUS; is freeflexd running, with --prefix {self.prefix}, on "
                               f"{self.bus.url}?")
        return status

    @property
    def tick(self):
        """Returns the newest tick received in this session."""
        return max(heard.tick for heard in (self._state, self.last_status) if heard is not None)

    @property
    def state(self):
        """Returns the last State of this session since the last reset(); if there is none, waits for one. TimeoutError:
        none comes."""
        end = time.monotonic() + self.timeout
        while self._state is None:
            if self.receive(max(0.0, end - time.monotonic())) is None:
                raise TimeoutError(f"no STATE came on {self.prefix}_STATE within {self.timeout:g} s; {_NO_STATE}")
        return self._state

    @property
    def rate(self):
        """Returns the ticks per simulated second [Hz]."""
        return self.last_status.rate

    @property
    def scene(self):
        """Returns the Listing of names and indices; the first call requests it. TimeoutError: it does not come."""
        if self._scene is None:
            # without a required key, the daemon ignores the request, but it sends the scene once a second
            self._send(self._control(messages.control_t.SCENE))
            end = time.monotonic() + self.timeout
            while self._scene is None and self._next(lambda *_: True, end - time.monotonic()) is not None:
                pass
        if self._scene is None:
            raise TimeoutError(f"no complete scene came on {self.prefix}_SCENE within {self.timeout:g} s; is the daemon still running?")
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
        """Replaces the loads in a slot of this sender; without loads, clears the slot. Returns the ack.

        `forces` {point: (x, y, z)} [N]; `torques` {point: (x, y, z)} [N m] on bodies; `wrenches` {group: (force,
        torque)}; `wheels` {wheel: torque} [N m] of motors; by name or index. `axes`: "world" or "body". Give exactly
        one of `duration` [s], after which the loads end, and `lease` [s], within which the push must be renewed. Both
        are at most `commands: max_hold` of the scene, 60 s by default. `at_tick`: tick at which the loads begin;
        default: at once. `late`: if that tick has passed, "reject" rejects the push and "take" begins at once.
        Rejected: the daemon refuses the push. TimeoutError: no answer came. Gone: another daemon has replaced the one
        that the command was for.
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
        """Advances a holding daemon by a number of ticks. Returns the State after the last tick; for 0 ticks, the
        present State.

        Waits while messages of the daemon come. Rejected: the daemon refuses the command. StepError: the daemon reached
        the last tick but publishes no state, or it holds before the last tick because of a fault, a hold or a reset.
        Gone: the daemon has ended. TimeoutError: messages stopped coming.
        """
        ticks = whole("ticks", ticks, 0, 2**63 - 1)
        start = self._answered(self._control(messages.control_t.STEP, ticks)) if ticks else self.status()
        session, target, num_holding, give_up = self.session, start.tick + ticks, 0, None
        while self._state is None or self._state.tick < target:
            heard = self.receive(self.timeout)
            if heard is None:
                raise TimeoutError(f"nothing is heard on {self.prefix}_* for {self.timeout:g} s, so tick {target} is not reached")
            suffix, status = heard
            if suffix != "STATUS" or status.mode == status.RUNNING:
                continue
            if self.session != session or status.mode == status.STOPPED and status.tick < target:
                raise Gone(f"the daemon ended before tick {target}", session)
            if status.tick >= target:  # the state at this tick is on its way, or will be repeated
                give_up = give_up or time.monotonic() + _REPEATED
                if time.monotonic() > give_up:
                    raise StepError(f"the daemon holds at tick {status.tick}, but publishes no state; {_NO_STATE}")
                continue
            num_holding += 1  # one STATUS may have been sent before the step was accepted, so two are needed
            if num_holding > 2:
                raise StepError(f"the daemon holds at tick {status.tick}, before tick {target}, because "
                                + (status.fault or "it was held or reset by another"))
        return self._state

    def run(self):
        """Lets the ticks follow the clock."""
        return self._answered(self._control(messages.control_t.RUN))

    def hold(self):
        """Holds the daemon at its tick."""
        return self._answered(self._control(messages.control_t.HOLD))

    @_alone
    def reset(self):
        """Resets the daemon to the initial state, in a new epoch. Messages of earlier epochs are no longer returned;
        `state` waits for the new epoch."""
        epochs = [heard.epoch for heard in (self._state, self.last_status) if heard is not None]
        epoch = max(self._least_epoch, *epochs) + 1
        ack = self._answered(self._control(messages.control_t.RESET))
        self._least_epoch = epoch
        for name in "_state", "points", "loads":
            if (heard := getattr(self, name)) is not None and heard.epoch < epoch:
                setattr(self, name, None)
        return ack

    def stop(self):
        """Ends the daemon cleanly."""
        return self._answered(self._control(messages.control_t.STOP))

    @_alone
    def shape(self, mode):
        """Returns a mode shape: {index of a point: displacement [-] per elastic coordinate, body axes}. Modes are
        numbered from 0, as in a state's `q`."""
        self._shape = None
        self._answered(self._control(messages.control_t.SHAPES, mode + 1))
        end = time.monotonic() + self.timeout
        while self._shape is None or self._shape[0] != mode + 1:
            if self.receive(max(0.0, end - time.monotonic())) is None:
                raise TimeoutError(f"mode {mode} is not complete within {self.timeout:g} s")
        return self._shape[1]

    def index(self, kind, name):
        """Returns the index of the point, link, group or wheel with this name; an index is returned unchanged.
        LookupError: unknown."""
        check_kind(kind)
        return name if isinstance(name, int) else self.scene.index(kind, name)

    def _read_of(self, state, kind, name):
        index = self.index("point" if kind == "body" else kind, name)
        if kind == "link":
            links = self._complete_of(state, "loads", "LOADS").links
            if index in links:
                return vector(links[index])
            raise LookupError(f"the forces of link {name!r} are not published; list it under publish: loads: of in the scene")
        points = self._complete_of(state, "points", "POINTS")
        table, of = {"point": (points.points, PointState), "body": (points.bodies, BodyState),
                     "group": (points.groups, GroupPose)}[kind]
        if index not in table:
            raise LookupError(f"{kind} {name!r} is not published" + (" or has no attitude" if kind == "body" else "")
                              + "; list it under publish: points: of in the scene")
        return of(*(vector(getattr(table[index], field)) for field in of._fields))

    @_alone
    def _complete_of(self, state, name, suffix):
        """Returns POINTS or LOADS of a state's tick; waits until they come."""
        when, end, is_heard = (state.epoch, state.tick), time.monotonic() + self.timeout, False
        while (whole := getattr(self, name)) is None or (whole.epoch, whole.tick) < when:
            if state.session != self.session:
                raise Gone("the daemon of this state has ended", state.session)
            if self.receive(max(0.0, end - time.monotonic())) is None or time.monotonic() > end:
                if not is_heard or self.last_status.mode == self.last_status.STOPPED:
                    raise Gone("the daemon of this state has ended, or is not heard", state.session)
                raise TimeoutError(f"no complete {suffix} of tick {state.tick} came within {self.timeout:g} s; set the rate of "
                                   f"publish: {name} in the scene to the rate of the state")
            is_heard = True
        if (whole.epoch, whole.tick) != when:
            raise RuntimeError(f"the state is of tick {state.tick}, but the newest {suffix} are of tick {whole.tick}; read "
                               f"them before the next state arrives, and set the rate of publish: {name} in the scene "
                               "to the rate of the state")
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
            raise Gone("another daemon has replaced the one that the command was for", session)
        if ack is None:
            raise TimeoutError(f"no answer came within {self.timeout:g} s; the command was lost, the daemon has ended, or it does "
                               "not know the tag of the command")
        if ack.reason != 0:
            raise Rejected(ack)
        return ack

    def close(self):
        """Leaves the bus; the daemon continues."""
        self.bus.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
