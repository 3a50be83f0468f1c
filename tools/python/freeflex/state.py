"""State and push for both a daemon and a motion in this process.

Vectors are numpy arrays if numpy is installed, else tuples.
"""

import collections
import operator

try:
    from numpy import array as vector
except ImportError:
    vector = tuple

AXES = ("world", "body")
#: fields of a State that are vectors, with the names of state_t
VECTORS = ("position", "attitude", "velocity", "angular_velocity", "angular_momentum", "q", "q_dot", "wheel_momentum")

#: position [m], velocity [m/s] and acceleration just before the tick [m/s^2] in world axes; elastic displacement [m] in
#body axes
PointState = collections.namedtuple("PointState", "position velocity acceleration displacement")
#: attitude of a point that has inertia or an offset; angular velocity [rad/s] in the point's axes
BodyState = collections.namedtuple("BodyState", "attitude angular_velocity")
#: centre of mass [m], attitude, velocity [m/s], angular velocity [rad/s, body axes]
GroupPose = collections.namedtuple("GroupPose", "position attitude velocity angular_velocity")


class StepError(RuntimeError):
    """A plan or a step was refused or failed; the text gives the reason."""


class Busy(RuntimeError):
    """Another thread uses the motion or the Daemon at this moment."""


class State:
    """The motion at one tick, of a daemon or of a Motion, with the same names for both.

    `tick`; `time` [s] since the last reset; `position` [m], `velocity` [m/s] of the centre of mass, world axes;
    `attitude`, a quaternion w x y z from body to world axes; `angular_velocity` [rad/s], body axes;
    `angular_momentum` [kg m^2/s] about the centre of mass, world axes; `q` [m], `q_dot` [m/s]: all elastic
    coordinates, in the order of `frequencies`; `wheel_momentum` [N m s], in the order of the scene.

    These fields do not change. The methods work only while this is the newest state. RuntimeError: the daemon or Motion
    is at another tick.
    """

    def __init__(self, owner, tick, time):
        self.tick, self.time, self._owner = tick, time, owner

    def __getattr__(self, name):
        if name not in VECTORS:
            raise AttributeError(f"a state has no {name!r}; there are tick, time, {', '.join(VECTORS)}")
        value = self.__dict__[name] = vector(self._values(name))
        return value

    def point(self, name):
        """Returns the PointState of a point, by name or index. With a daemon, the scene must publish the point; with a
        Motion, the scene must publish, push or load the point."""
        return self._owner._read_of(self, "point", name)

    def body(self, name):
        """Returns the BodyState of a point that has inertia or an offset."""
        return self._owner._read_of(self, "body", name)

    def group(self, name):
        """Returns the GroupPose of a group."""
        return self._owner._read_of(self, "group", name)

    def link(self, name):
        """Returns the forces of a published link; messages/README.md, section 7, lists them for each kind of link."""
        return self._owner._read_of(self, "link", name)

    def wheel(self, name):
        """Returns the momentum [N m s] of a wheel about its axis."""
        return self.wheel_momentum[self._owner.index("wheel", name)]

    def __repr__(self):
        return f"{type(self).__name__}(tick={self.tick}, " + ", ".join(f"{name}={list(getattr(self, name))}"
                                                                       for name in VECTORS) + ")"


class Push:
    """Checks the arguments of push(), and converts names to indices and seconds to ticks.

    `index(kind, name)` finds an index; `rate` [Hz] of the ticks. ValueError: a wrong argument.
    """

    def __init__(self, index, rate, forces=None, *, torques=None, wrenches=None, wheels=None, axes="world", slot=0,
                 duration=None, lease=None):
        self.forces = [(index("point", k), _three(k, f)) for k, f in (forces or {}).items()]
        self.torques = [(index("point", k), _three(k, t)) for k, t in (torques or {}).items()]
        self.wrenches = [(index("group", k), _three(k, f), _three(k, t)) for k, (f, t) in (wrenches or {}).items()]
        self.wheels = [(index("wheel", k), _number(k, t)) for k, t in (wheels or {}).items()]
        if axes not in AXES:
            raise ValueError(f"axes is {axes!r}, but must be one of {', '.join(AXES)}")
        self.axes, self.slot = AXES.index(axes), whole("slot", slot, 0, 63)
        has_loads = bool(self.forces or self.torques or self.wrenches or self.wheels)
        if has_loads and (duration is None) == (lease is None):
            raise ValueError("a push needs either duration=S, after which it ends, or lease=S, within which it is renewed")
        self.duration_ticks = ticks_of("duration", duration, rate) if duration is not None else 0
        self.lease_ticks = ticks_of("lease", lease, rate) if lease is not None else 0
        if duration is not None and abs(duration * rate - self.duration_ticks) > 1e-6:
            self._scale(duration * rate / self.duration_ticks)

    def _scale(self, factor):
        """Scales the loads of a push that lasts a whole number of ticks, so that its impulse is as requested."""
        self.forces = [(i, [factor * x for x in f]) for i, f in self.forces]
        self.torques = [(i, [factor * x for x in t]) for i, t in self.torques]
        self.wrenches = [(i, [factor * x for x in f], [factor * x for x in t]) for i, f, t in self.wrenches]
        self.wheels = [(i, factor * t) for i, t in self.wheels]


def _three(name, values):
    if len(values) != 3:
        raise ValueError(f"{name!r} does not have three components; give x, y and z of the force or torque")
    return [_number(name, x) for x in values]


def _number(name, value):
    if isinstance(value, (str, bytes)):
        raise TypeError(f"{name!r}: {value!r} is text, but must be a number")
    return float(value)


def ticks_of(what, seconds, rate):
    """Returns the nearest number of ticks, at least one. ValueError: the time is not positive."""
    if not 0.0 < seconds < 1e9:
        raise ValueError(f"{what} is {seconds!r} s, but must be a time above 0 and below 1e9 s")
    return max(1, round(seconds * rate))


def whole(what, value, least, most):
    """Returns a whole number within bounds. ValueError: any other value."""
    try:
        if least <= (number := operator.index(value)) <= most:
            return number
    except TypeError:
        pass
    raise ValueError(f"{what} is {value!r}, but must be a whole number from {least} to {most}")
