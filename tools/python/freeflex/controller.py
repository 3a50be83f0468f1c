"""One controller for a daemon on the bus and for a motion in this process."""

import time
import warnings

from freeflex.client import Daemon, Gone, Rejected
from freeflex.state import StepError, ticks_of

_WRONG_SESSION, _EPOCH_ENDED, _TOO_OLD = 3, 24, 28


def control(owner, controller, *, every, until=None, patience=60.0):
    """Calls `controller(state)` every so many seconds of simulated time and pushes what it returns: the arguments of
    push() by name, as a dict, or None for no push. Returns the last State, the first at or after `until` [s].

    A Motion, and a daemon in lockstep, are stepped from one call to the next. Of any other daemon each published state
    that reaches the next multiple of `every` is taken, so a state that comes late or is lost delays one call alone; such
    a daemon may do without `until`, and Ctrl-C ends the controller. When the daemon ends and another takes its place on
    the prefix, the controller goes on with that one. TimeoutError: none came within `patience` [s] of wall clock. What the
    controller raises comes out.

    ValueError: `every` is not within 1 % of a number of ticks. RuntimeWarning: a daemon that is not in lockstep publishes
    states less often than `every`, so the controller is called at their rate.
    """
    if isinstance(owner, Daemon):
        return _control_daemon(owner, controller, every, until, patience)
    if until is None:
        raise ValueError("a motion in this process needs until=S, or it would be stepped for ever")
    return _step_through(owner, controller, every, until)


def _period(every, rate):
    """[ticks] between two calls. ValueError: further than 1 % from what was asked for."""
    ticks = ticks_of("every", every, rate)
    if abs(ticks - every * rate) > 0.01 * every * rate:
        raise ValueError(f"every {every!r} s is {every * rate:.6g} ticks at {rate:g} Hz, must be within 1 % of a whole "
                         f"number of ticks: every={ticks / rate:.9g} is the nearest")
    return ticks


def _step_through(owner, controller, every, until):
    ticks, state = _period(every, owner.rate), owner.state
    while until is None or state.time < until:
        if (push := controller(state)) is not None:
            owner.push(**push)
        state = owner.step(ticks)
    return state


def _control_daemon(daemon, controller, every, until, patience):
    raised = []  # by the controller, unless it read a state whose daemon has ended

    def call(state):
        try:
            return controller(state)
        except (Gone, Rejected, TimeoutError) as error:
            if not isinstance(error, Gone) or error.session != state.session:
                raised.append(error)
            raise

    while True:
        try:
            is_lockstep = daemon.last_status.time_mode == "lockstep"
            return (_step_through if is_lockstep else _listen_through)(daemon, call, every, until)
        except (Gone, Rejected, TimeoutError) as error:
            if raised or isinstance(error, Rejected) and error.ack.reason != _WRONG_SESSION:
                raise
        _wait_for_daemon(daemon, patience)


def _listen_through(daemon, controller, every, until):
    ticks, session, epoch, last = _period(every, daemon.rate), daemon.session, None, None
    is_judged, gaps = False, daemon._gaps
    gaps.clear()
    for state in daemon.listen("STATE", timeout=daemon.timeout):
        if not is_judged and len(gaps) == gaps.maxlen:  # a state that was lost makes one of them longer
            is_judged = True
            if min(gaps) > ticks:
                _warn_of_rate(every, daemon.rate, min(gaps))
        if until is not None and state.time >= until:
            return state
        if state.epoch == epoch and state.tick // ticks <= last // ticks:
            continue
        epoch, last = state.epoch, state.tick
        if (push := controller(state)) is None:
            continue
        try:
            daemon.push(**push)
        except Rejected as rejected:
            # of another epoch, or decided too late: the next state tells what to do
            if rejected.ack.reason not in (_EPOCH_ENDED, _TOO_OLD):
                raise
    status = daemon.status()
    if status.session == session and status.mode not in (status.STARTING, status.STOPPED):
        raise StepError(f"no STATE within {daemon.timeout:g} s of a daemon that is heard: have the scene publish it, publish: "
                        "{state: RATE}, or give connect() a longer timeout")
    raise Gone("another daemon has taken its place", session)


def _warn_of_rate(every, rate, gap):
    warnings.warn(f"every={every!r} s asks for {1 / every:.6g} states per simulated second, the daemon publishes "
                  f"{rate / gap:.6g}: the controller is called at that rate. Publish states at a higher rate, publish: "
                  f"{{state: {min(1 / every, rate):.6g}}}, or start freeflexd with --time lockstep", RuntimeWarning,
                  stacklevel=5)


def _wait_for_daemon(daemon, patience):
    end = time.monotonic() + patience
    while True:
        try:
            if daemon.status().mode != daemon.last_status.STOPPED:
                return
        except TimeoutError:
            if time.monotonic() >= end:
                raise
