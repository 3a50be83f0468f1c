"""Runs a controller; the same controller works with a daemon on the bus and with a motion in this process."""

import time
import warnings

from freeflex.client import Daemon, Gone, Rejected
from freeflex.state import StepError, ticks_of

_WRONG_SESSION, _EPOCH_ENDED, _TOO_OLD = 3, 24, 28


def control(owner, controller, *, every, until=None, patience=60.0):
    """Calls `controller(state)` at intervals of `every` [s] simulated time and pushes the result: a dict of the
    arguments of push(), or None for no push. Returns the first State at or after `until` [s].

    A Motion, or a daemon in lockstep, is stepped from one call to the next. With any other daemon, each call gets the
    first published state at or after a multiple of `every`, so a late or lost state delays only one call. `until` is
    then optional; Ctrl-C ends the controller. If another daemon replaces the first one on the prefix, the controller
    continues with the new daemon. TimeoutError: no new daemon came within `patience` [s] of wall clock. Exceptions of
    the controller are passed on.

    ValueError: `every` is not within 1 % of a whole number of ticks. RuntimeWarning: a daemon that is not in lockstep
    publishes states less often than once per `every`, so the controller is called at the rate of the states.
    """
    if isinstance(owner, Daemon):
        return _control_daemon(owner, controller, every, until, patience)
    if until is None:
        raise ValueError("a motion in this process needs until=S, or it would run forever")
    return _step_through(owner, controller, every, until)


def _period(every, rate):
    """Returns the interval between two calls [ticks]. ValueError: the interval differs from `every` by more than 1
    %."""
    ticks = ticks_of("every", every, rate)
    if abs(ticks - every * rate) > 0.01 * every * rate:
        raise ValueError(f"every {every!r} s is {every * rate:.6g} ticks at {rate:g} Hz, but must be within 1 % of a whole "
                         f"number of ticks; every={ticks / rate:.9g} is the nearest")
    return ticks


def _step_through(owner, controller, every, until):
    ticks, state = _period(every, owner.rate), owner.state
    while until is None or state.time < until:
        if (push := controller(state)) is not None:
            owner.push(**push)
        state = owner.step(ticks)
    return state


def _control_daemon(daemon, controller, every, until, patience):
    raised = []  # exceptions of the controller, except those about a state whose daemon has ended

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
        if not is_judged and len(gaps) == gaps.maxlen:  # a lost state makes only one of the gaps longer
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
            # the push was of another epoch or too old: the controller decides again at the next state
            if rejected.ack.reason not in (_EPOCH_ENDED, _TOO_OLD):
                raise
    status = daemon.status()
    if status.session == session and status.mode not in (status.STARTING, status.STOPPED):
        raise StepError(f"no STATE of a running daemon came within {daemon.timeout:g} s; set publish: {{state: RATE}} in the "
                        "scene, or give connect() a longer timeout")
    raise Gone("another daemon has replaced this one", session)


def _warn_of_rate(every, rate, gap):
    warnings.warn(f"every={every!r} s asks for {1 / every:.6g} states per simulated second, but the daemon publishes "
                  f"{rate / gap:.6g}, so the controller is called at that rate. Set publish: "
                  f"{{state: {min(1 / every, rate):.6g}}} in the scene, or start freeflexd with --time lockstep",
                  RuntimeWarning, stacklevel=5)


def _wait_for_daemon(daemon, patience):
    end = time.monotonic() + patience
    while True:
        try:
            if daemon.status().mode != daemon.last_status.STOPPED:
                return
        except TimeoutError:
            if time.monotonic() >= end:
                raise
