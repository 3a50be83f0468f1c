"""Plans and their motion in this process, by the C interface (freeflex.h), without a daemon.

Vectors are arrays of numpy where it is installed, else tuples.
"""

import collections
import ctypes
import os

from freeflex.scene import index_in

try:
    from numpy import array as _vector
except ImportError:
    _vector = tuple

AXES = ("world", "body")
#: words of a motion: how far it can be trusted
WORDS = ("good", "watch", "outside")

_POINT, _LINK, _GROUP, _WHEEL, _MODE = range(5)
_KINDS = {"point": _POINT, "link": _LINK, "group": _GROUP, "wheel": _WHEEL}
_WITH_WORD = 1
_LONGEST = 4096  # values of a link
_PIECE = 10000  # ticks of one call

#: centre of mass [m], attitude, velocity [m/s], angular velocity [rad/s, body axes], angular momentum [kg m^2/s]
Frame = collections.namedtuple("Frame", "position attitude velocity angular_velocity angular_momentum")
#: [m], [m/s], [m/s^2] in world axes, elastic displacement [m] in body axes
PointState = collections.namedtuple("PointState", "position velocity acceleration displacement")
#: attitude of a point with inertia, its rate [rad/s] in its own axes
BodyState = collections.namedtuple("BodyState", "attitude angular_velocity")
#: centre of mass [m], attitude, velocity [m/s], angular velocity [rad/s, body axes]
GroupPose = collections.namedtuple("GroupPose", "position attitude velocity angular_velocity")
#: one of WORDS, its cause, the estimate of the displacements' error and what it is judged against [m]
Word = collections.namedtuple("Word", "word cause error scale tick")
#: [J]
Energy = collections.namedtuple("Energy", "kinetic_rigid kinetic_elastic potential")


class StepError(RuntimeError):
    """What the C interface refused; the text says why."""


def _whole(what, value, least, most):
    """A whole number that C takes as it is. ValueError of any other."""
    if not isinstance(value, int) or not least <= value <= most:
        raise ValueError(f"{what} {value!r}, must be a whole number from {least} to {most}")
    return value


class _Load(ctypes.Structure):
    _fields_ = [("kind", ctypes.c_int32), ("index", ctypes.c_int32), ("force", ctypes.c_double * 3),
                ("torque", ctypes.c_double * 3)]


class _Word(ctypes.Structure):
    _fields_ = [("tick", ctypes.c_int64), ("word", ctypes.c_int32), ("unused", ctypes.c_int32),
                ("error", ctypes.c_double), ("scale", ctypes.c_double), ("cause", ctypes.c_char * 256)]


_PROGRESS = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double)
_library = None


def _signatures(c):
    """name -> (result, arguments); int results are codes unless listed as numbers."""
    plan, motion, out, doubles = c.c_void_p, c.c_void_p, c.POINTER(c.c_void_p), c.POINTER(c.c_double)
    size = c.c_size_t
    return {
        "version": (c.c_char_p, []), "last_error": (c.c_char_p, []),
        "plan_open": (c.c_int, [c.c_char_p, _PROGRESS, c.c_void_p, out]), "plan_free": (None, [plan]),
        "plan_warnings": (c.c_char_p, [plan]), "plan_name": (c.c_char_p, [plan]),
        "plan_fingerprint": (c.c_int64, [plan]), "plan_rate": (c.c_double, [plan]), "plan_mass": (c.c_double, [plan]),
        "plan_count": (c.c_int32, [plan, c.c_int]), "plan_name_of": (c.c_char_p, [plan, c.c_int, c.c_int32]),
        "plan_frequencies": (c.c_int, [plan, doubles, size]), "plan_rest": (c.c_int, [plan, doubles, size]),
        "plan_shape": (c.c_int, [plan, c.c_int32, doubles, size]),
        "motion_new": (c.c_int, [plan, c.c_uint, out]), "motion_copy": (c.c_int, [motion, out]),
        "motion_free": (None, [motion]), "motion_reset": (None, [motion]),
        "motion_step": (c.c_int, [motion, c.c_int64]),
        "motion_push": (c.c_int, [motion, c.c_int, c.c_int, c.POINTER(_Load), size, c.c_int64]),
        "motion_tick": (c.c_int64, [motion]), "motion_time": (c.c_double, [motion]),
        "motion_frame": (None, [motion, doubles]),
        "motion_elastic": (c.c_int, [motion, doubles, doubles, size, c.POINTER(size)]),
        "motion_point": (c.c_int, [motion, c.c_int32, doubles]), "motion_body": (c.c_int, [motion, c.c_int32, doubles]),
        "motion_group": (c.c_int, [motion, c.c_int32, doubles]),
        "motion_link": (c.c_int, [motion, c.c_int32, doubles, size, c.POINTER(size)]),
        "motion_wheels": (c.c_int, [motion, doubles, size]), "motion_energy": (None, [motion, doubles]),
        "motion_word": (c.c_int, [motion, c.POINTER(_Word)]), "motion_worst_word": (c.c_int, [motion, c.POINTER(_Word)]),
    }


def library():
    """The C library: that of FREEFLEX_LIBRARY, else libfreeflex.so.1. StepError when there is none."""
    global _library
    if _library is None:
        name = os.environ.get("FREEFLEX_LIBRARY") or "libfreeflex.so.1"
        try:
            loaded = ctypes.CDLL(name)
        except OSError as error:
            raise StepError(f"{error}: install freeflex, or name the library in FREEFLEX_LIBRARY") from None
        for function, (result, arguments) in _signatures(ctypes).items():
            bound = getattr(loaded, "freeflex_" + function, None)
            if bound is None:
                raise StepError(f"{name} has no freeflex_{function}: it is not the C library of this freeflex")
            bound.restype, bound.argtypes = result, arguments
            setattr(loaded, function, bound)
        _library = loaded
    return _library


def _check(code):
    if code != 0:
        raise StepError(library().last_error().decode(errors="replace").strip())


def _read(sizes, function, *arguments, is_checked=True):
    """Vectors of such sizes that a function writes one behind the other."""
    values = (ctypes.c_double * sum(sizes))()
    code = function(*arguments, values)
    if is_checked:
        _check(code)
    ends = [sum(sizes[:k + 1]) for k in range(len(sizes))]
    return [_vector(values[end - size:end]) for size, end in zip(sizes, ends)]


class Plan:
    """A scene or plan file, set up. Any number of motions may be made of it.

    `name`, `rate` [Hz], `mass` [kg], `fingerprint` (as the messages have it), `warnings`; `points`, `links`, `groups`, `wheels`: indices by
    name, in the order of the scene; `frequencies` [Hz] of the elastic modes, which count from 0 here. StepError: every fault of the scene, with its line.

    `progress(what, share)` is called during a long set-up; what it raises ends it.
    """

    def __init__(self, path, progress=None):
        c, handle, raised = library(), ctypes.c_void_p(), []

        def ask(_, what, done):
            try:
                if progress:
                    progress(what.decode(), done)
            except BaseException as error:  # crosses C as a code
                raised.append(error)
            return len(raised)

        if b"\0" in os.fsencode(path):
            raise ValueError(f"{path!r} is no path: it holds a zero byte")
        code = c.plan_open(os.fsencode(path), _PROGRESS(ask), None, ctypes.byref(handle))
        if raised:
            if code == 0:
                c.plan_free(handle)
            raise raised[0]
        _check(code)
        self._handle = handle
        self.name, self.warnings = c.plan_name(handle).decode(), c.plan_warnings(handle).decode().splitlines()
        self.rate, self.mass = c.plan_rate(handle), c.plan_mass(handle)
        self.fingerprint = c.plan_fingerprint(handle)
        self._indices = {}
        for kind, number in _KINDS.items():
            names = [c.plan_name_of(handle, number, k).decode() for k in range(c.plan_count(handle, number))]
            indices = self._indices[kind] = {}
            for k, name in enumerate(names):
                indices.setdefault(name, k)  # the first of a name
        self.points, self.links, self.groups, self.wheels = (self._indices[kind] for kind in _KINDS)
        self.num_points, self.num_modes = c.plan_count(handle, _POINT), c.plan_count(handle, _MODE)
        self.num_wheels = c.plan_count(handle, _WHEEL)
        values = (ctypes.c_double * self.num_modes)()
        _check(c.plan_frequencies(handle, values, len(values)))
        self.frequencies = _vector(values[:])

    def motion(self, with_word=False):
        """A Motion at the initial state. `with_word`: it judges how far it can be trusted, at a few microseconds a
        tick."""
        handle = ctypes.c_void_p()
        _check(library().motion_new(self._handle, _WITH_WORD if with_word else 0, ctypes.byref(handle)))
        return Motion(self, handle)

    def shape(self, point):
        """[-] elastic displacement of a point, body axes, by each mode: a list of vectors."""
        values = (ctypes.c_double * (3 * self.num_modes))()
        _check(library().plan_shape(self._handle, self.index("point", point), values, len(values)))
        return [_vector(values[3 * k:3 * k + 3]) for k in range(self.num_modes)]

    def rest(self):
        """[m] places of the points at rest, body axes from the centre of mass: a list of vectors."""
        values = (ctypes.c_double * (3 * self.num_points))()
        _check(library().plan_rest(self._handle, values, len(values)))
        return [_vector(values[3 * k:3 * k + 3]) for k in range(self.num_points)]

    def index(self, kind, name):
        """Index of a point, link, group or wheel by its name; an index is itself. LookupError: none of it."""
        if isinstance(name, int):
            return _whole(kind, name, 0, 2**31 - 1)
        return index_in(self._indices[kind], kind, name)

    def __del__(self):
        if handle := self.__dict__.pop("_handle", None):
            library().plan_free(handle)


class Motion:
    """A motion of a plan. `plan`."""

    def __init__(self, plan, handle):
        self.plan, self._handle = plan, handle

    def step(self, ticks=1):
        """Advances by so many ticks. StepError: the next state would not be finite; it stands at the last that is."""
        ticks = _whole("ticks", ticks, 0, 2**63 - 1)
        while True:  # in pieces, so that Ctrl-C is heard
            piece = min(ticks, _PIECE)
            _check(library().motion_step(self._handle, piece))
            ticks -= piece
            if ticks == 0:
                return

    def push(self, forces=None, *, torques=None, wrenches=None, wheels=None, axes="world", slot=0, ticks=0):
        """Puts loads into a slot in place of what was there, from the next step on; without any clears it.

        `forces` {point: (x, y, z)} [N], `torques` {point: (x, y, z)} [N m] on points with inertia, `wrenches`
        {group: (force, torque)}, `wheels` {wheel: torque} [N m] of motors; by name or index. `axes`: "world" or
        "body". `ticks`: how long; 0: until another push takes their place.
        """
        none, loads = (0.0, 0.0, 0.0), []
        for name, force in (forces or {}).items():
            loads.append(self._load("point", name, force, none))
        for name, torque in (torques or {}).items():
            loads.append(self._load("point", name, none, torque))
        for name, (force, torque) in (wrenches or {}).items():
            loads.append(self._load("group", name, force, torque))
        for name, torque in (wheels or {}).items():
            loads.append(self._load("wheel", name, none, (torque, 0.0, 0.0)))
        if axes not in AXES:
            raise ValueError(f"axes {axes!r}, must be one of {', '.join(AXES)}")
        slot, ticks = _whole("slot", slot, 0, 63), _whole("ticks", ticks, 0, 2**63 - 1)
        _check(library().motion_push(self._handle, slot, AXES.index(axes), (_Load * len(loads))(*loads),
                                     len(loads), ticks))

    def _load(self, kind, name, force, torque):
        if len(force) != 3 or len(torque) != 3:
            raise ValueError(f"{kind} {name!r}: a force and a torque have three components")
        index = self.plan.index(kind, name)
        return _Load(_KINDS[kind], index, (ctypes.c_double * 3)(*force), (ctypes.c_double * 3)(*torque))

    def reset(self):
        """Back to the initial state, without loads but the scene's own. The tick goes on."""
        library().motion_reset(self._handle)

    def copy(self):
        """Another motion that stands where this one does."""
        handle = ctypes.c_void_p()
        _check(library().motion_copy(self._handle, ctypes.byref(handle)))
        return Motion(self.plan, handle)

    @property
    def tick(self):
        """Number of the next step."""
        return library().motion_tick(self._handle)

    @property
    def time(self):
        """[s] since the last reset."""
        return library().motion_time(self._handle)

    @property
    def frame(self):
        """Motion of the body as a whole: a Frame."""
        return Frame(*_read((3, 4, 3, 3, 3), library().motion_frame, self._handle, is_checked=False))

    @property
    def elastic(self):
        """(q [m], q_dot [m/s]) of the elastic modes."""
        count = ctypes.c_size_t()
        library().motion_elastic(self._handle, None, None, 0, ctypes.byref(count))
        q, q_dot = (ctypes.c_double * count.value)(), (ctypes.c_double * count.value)()
        _check(library().motion_elastic(self._handle, q, q_dot, count.value, None))
        return _vector(q[:]), _vector(q_dot[:])

    def point(self, name):
        """A PointState, of a point that the scene publishes, pushes or loads."""
        return PointState(*_read((3, 3, 3, 3), library().motion_point, self._handle, self.plan.index("point", name)))

    def body(self, name):
        """A BodyState, of a point that has inertia."""
        return BodyState(*_read((4, 3), library().motion_body, self._handle, self.plan.index("point", name)))

    def group(self, name):
        """A GroupPose."""
        return GroupPose(*_read((3, 4, 3, 3), library().motion_group, self._handle, self.plan.index("group", name)))

    def link(self, name):
        """Forces of a published link, by its kind (messages/README.md, section 7)."""
        values, count = (ctypes.c_double * _LONGEST)(), ctypes.c_size_t()
        _check(library().motion_link(self._handle, self.plan.index("link", name), values, _LONGEST, ctypes.byref(count)))
        return _vector(values[:count.value])

    @property
    def wheels(self):
        """[N m s] momenta of the wheels about their axes."""
        values = (ctypes.c_double * self.plan.num_wheels)()
        _check(library().motion_wheels(self._handle, values, len(values)))
        return _vector(values[:])

    @property
    def energy(self):
        """An Energy."""
        return Energy(*(float(x[0]) for x in _read((1, 1, 1), library().motion_energy, self._handle, is_checked=False)))

    @property
    def word(self):
        """How far the motion can be trusted now: a Word. StepError of a motion without one."""
        return self._word(library().motion_word)

    @property
    def worst_word(self):
        """The worst Word since the last reset."""
        return self._word(library().motion_worst_word)

    def _word(self, function):
        word = _Word()
        _check(function(self._handle, ctypes.byref(word)))
        return Word(WORDS[word.word], word.cause.decode(errors="replace"), word.error, word.scale, word.tick)

    def __del__(self):
        if handle := self.__dict__.pop("_handle", None):
            library().motion_free(handle)
