"""What a daemon and a motion in this process have in common: the state at one tick, and how a push is said.

Vectors are arrays of numpy where it is installed, else tuples.
"""

import collections
import operator

try:
    from numpy import array as vector
except ImportError:
    vector = tuple

AXES = ("world", "body")
#: fields of a State that are vectors, as state_t has them
VECTORS = ("position", "attitude", "velocity", "angular_velocity", "angular_momentum", "q", "q_dot", "wheel_momentum")

#: [m], [m/s], [m/s^2] in world axes, the last just before the tick; elastic displacement [m] in body axes
PointState = collections.namedtuple("PointState", "position velocity acceleration displacement")
#: attitude of a point that has inertia or an offset, its rate [rad/s] in its own axes
BodyState = collections.namedtuple("BodyState", "attitude angular_velocity")
#: centre of mass [m], attitude, velocity [m/s], angular velocity [rad/s, body axes]
GroupPose = collections.namedtuple("GroupPose", "position attitude velocity angular_velocity")


class StepError(RuntimeError):
    """A plan or a step that was refused, or that failed; the text says why."""


class Busy(RuntimeError):
    """A motion or a Daemon that another thread uses at this moment."""


class State:
    """The motion at one tick, of a daemon or of a Motion: the same names for both.

    `tick`; `time` [s] since the last reset; `position` [m], `velocity` [m/s] of the centre of mass, world axes;
    `attitude`, a quaternion w x y z from body to world axes; `angular_velocity` [rad/s], body axes;
    `angular_momentum` [kg m^2/s] about the centre of mass, world axes; `q` [m], `q_dot` [m/s]: all elastic
    coordinates, in the order of `frequencies`; `wheel_momentum` [N m s], in the order of the scene.

    These stay as they are. What the methods read belongs to the newest state alone: RuntimeError once its owner is at
    another tick.
    """

    def __init__(self, owner, tick, time):
        self.tick, self.time, self._owner = tick, time, owner

    def __getattr__(self, name):
        if name not in VECTORS:
            raise AttributeError(f"a state has no {name!r}; there are tick, time, {', '.join(VECTORS)}")
        value = self.__dict__[name] = vector(self._values(name))
        return value

    def point(self, name):
        """The PointState of a point, by name or index. A daemon: of a point that the scene publishes; a Motion: of one
        that the scene publishes, pushes or loads."""
        return self._owner._read_of(self, "point", name)

    def body(self, name):
        """The BodyState of a point that has inertia or an offset."""
        return self._owner._read_of(self, "body", name)

    def group(self, name):
        """The GroupPose of a group."""
        return self._owner._read_of(self, "group", name)

    def link(self, name):
        """Forces of a published link, by its kind (messages/README.md, section 7)."""
        return self._owner._read_of(self, "link", name)

    def wheel(self, name):
        """[N m s] momentum of a wheel about its axis."""
        return self.wheel_momentum[self._owner.index("wheel", name)]

    def __repr__(self):
        return f"{type(self).__name__}(tick={self.tick}, " + ", ".join(f"{name}={list(getattr(self, name))}"
                                                                       for name in VECTORS) + ")"


class Push:
    """What push() is given, checked: indices in place of names, ticks in place of seconds.

    `index(kind, name)` finds an index, `rate` [Hz] has the ticks of a second. ValueError: what no push may have.
    """

    def __init__(self, index, rate, forces=None, *, torques=None, wrenches=None, wheels=None, axes="world", slot=0,
                 duration=None, lease=None):
        self.forces = [(index("point", k), _three(k, f)) for k, f in (forces or {}).items()]
        self.torques = [(index("point", k), _three(k, t)) for k, t in (torques or {}).items()]
        self.wrenches = [(index("group", k), _three(k, f), _three(k, t)) for k, (f, t) in (wrenches or {}).items()]
        self.wheels = [(index("wheel", k), _number(k, t)) for k, t in (wheels or {}).items()]
        if axes not in AXES:
            raise ValueError(f"axes {axes!r}, must be one of {', '.join(AXES)}")
        self.axes, self.slot = AXES.index(axes), whole("slot", slot, 0, 63)
        has_loads = bool(self.forces or self.torques or self.wrenches or self.wheels)
        if has_loads and (duration is None) == (lease is None):
            raise ValueError("a push needs duration=S, after which it ends, or lease=S, within which it is renewed, and not "
                             "both")
        self.duration_ticks = ticks_of("duration", duration, rate) if duration is not None else 0
        self.lease_ticks = ticks_of("lease", lease, rate) if lease is not None else 0
        if duration is not None and abs(duration * rate - self.duration_ticks) > 1e-6:
            self._scale(duration * rate / self.duration_ticks)

    def _scale(self, share):
        """A push acts in whole ticks, with so much of its force that the impulse is kept."""
        self.forces = [(i, [share * x for x in f]) for i, f in self.forces]
        self.torques = [(i, [share * x for x in t]) for i, t in self.torques]
        self.wrenches = [(i, [share * x for x in f], [share * x for x in t]) for i, f, t in self.wrenches]
        self.wheels = [(i, share * t) for i, t in self.wheels]


def _three(name, values):
    if len(values) != 3:
        raise ValueError(f"{name!r}: a force and a torque have three components")
    return [_number(name, x) for x in values]


def _number(name, value):
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{name!r}: {value!r} is text, must be a number")
    return float(value)


def ticks_of(what, seconds, rate):
    """The nearest number of ticks, at least one. ValueError: no time."""
    if not 0.0 < seconds < 1e9:
        raise ValueError(f"{what} {seconds!r} s, must be a time above 0 and below 1e9 s")
    return max(1, round(seconds * rate))


def whole(what, value, least, most):
    """A whole number within bounds. ValueError of any other."""
    try:
        if least <= (number := operator.index(value)) <= most:
            return number
    except TypeError:
        pass
    raise ValueError(f"{what} {value!r}, must be a whole number from {least} to {most}")
