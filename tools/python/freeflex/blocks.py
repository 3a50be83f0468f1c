"""Blocks for controllers: delays, sampling, noise and limits of sensors, wheels and thrusters.

    gyro = blocks.Noise(case, sensor=1, sd=1e-4)
    late = blocks.Delay(0.05)
    wheel = blocks.Wheel(max_torque=0.2, max_momentum=4.0)

    def controller(state):
        spin = late(state.time, gyro(state.angular_velocity))
        return {"wheels": {"spin_z": wheel(30.0 * spin[2], state.wheel_momentum[0])}, "lease": 0.2}

A value is a number or a sequence of numbers. freeflex_blocks.hpp has the same blocks in C++, which give the same bits.
"""

import collections
import math

from freeflex.plan import random_normal


def _each(function, value):
    """Returns the function of a number, or of each number of a sequence."""
    return [function(float(x)) for x in value] if hasattr(value, "__len__") else function(float(value))


class Delay:
    """Gives each value after `delay` [s]: the newest one that is at least that old, at first the first one."""

    def __init__(self, delay):
        if not delay >= 0.0:
            raise ValueError(f"delay is {delay!r} s, but must be >= 0")
        self.delay, self._waiting, self._now = delay, collections.deque(), None

    def __call__(self, time, value):
        # half a nanosecond, because times are multiples of a period that may not be a binary fraction
        self._waiting.append((time + self.delay - 0.5e-9, value))
        if self._now is None:
            self._now = value
        while self._waiting and self._waiting[0][0] <= time:
            self._now = self._waiting.popleft()[1]
        return self._now


class Sampled:
    """Takes a value at multiples of `period` [s] and holds it in between."""

    def __init__(self, period):
        if not period > 0.0:
            raise ValueError(f"period is {period!r} s, but must be > 0")
        self.period, self._number, self._held = period, None, None

    def __call__(self, time, value):
        number = math.floor((time + 0.5e-9) / self.period)
        if number != self._number:
            self._number, self._held = number, value
        return self._held


class Noise:
    """Adds a constant `bias` and normal noise of standard deviation `sd`. The noise depends only on the case, the number
    of the sensor and the number of the call."""

    def __init__(self, case, sensor, sd, bias=0.0):
        if not sd >= 0.0:
            raise ValueError(f"sd is {sd!r}, but must be >= 0")
        self.seed, self.sensor, self.sd, self.bias, self._count = case.seed, sensor, sd, bias, 0

    def __call__(self, value):
        def add(x):
            self._count += 1
            return x + self.bias + self.sd * random_normal(self.seed, self.sensor, self._count - 1)
        return _each(add, value)


class Quantized:
    """Rounds to multiples of `step`."""

    def __init__(self, step):
        if not step > 0.0:
            raise ValueError(f"step is {step!r}, but must be > 0")
        self.step = step

    def __call__(self, value):
        return _each(lambda x: math.floor(x / self.step + 0.5) * self.step if math.isfinite(x) else x, value)


class Saturation:
    """Limits each number to -limit .. limit."""

    def __init__(self, limit):
        if not limit >= 0.0:
            raise ValueError(f"limit is {limit!r}, but must be >= 0")
        self.limit = limit

    def __call__(self, value):
        return _each(lambda x: min(max(x, -self.limit), self.limit), value)


class Wheel:
    """Limits the torque of a motor [N m] to `max_torque`. While the momentum of the wheel is at or beyond `max_momentum`
    [N m s], gives no torque that increases it further."""

    def __init__(self, max_torque, max_momentum=math.inf):
        self.saturation, self.max_momentum = Saturation(max_torque), max_momentum
        if not max_momentum > 0.0:
            raise ValueError(f"max_momentum is {max_momentum!r} N m s, but must be > 0")

    def __call__(self, torque, momentum):
        if torque > 0.0 and momentum >= self.max_momentum or torque < 0.0 and momentum <= -self.max_momentum:
            return 0.0
        return self.saturation(torque)


class Thruster:
    """An on-off thruster of `force` [N], which the demanded mean force over the next `period` [s] turns on for a part of
    that period. It gives nothing for less than `min_on` [s], and keeps what it could not give for the next period.
    Returns how long it is on [s]."""

    def __init__(self, force, period, min_on=0.0):
        if not force > 0.0 or not period > 0.0 or not 0.0 <= min_on <= period:
            raise ValueError(f"force {force!r} N and period {period!r} s must be > 0, and min_on {min_on!r} s from 0 to "
                             "period")
        self.force, self.period, self.min_on, self._owed = force, period, min_on, 0.0

    def __call__(self, demanded):
        wanted = max(demanded, 0.0) * self.period / self.force + self._owed
        on = min(wanted, self.period)
        if on < self.min_on or on <= 0.0:
            on = 0.0
        # what is owed is at most one period, so that a demand beyond the force does not last after its end
        self._owed = min(wanted - on, self.period)
        return on
