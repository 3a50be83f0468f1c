"""Plans and motions in this process, without a daemon, through the C interface (freeflex.h)."""

import collections
import ctypes
import os
import threading

from freeflex.description import Scene
from freeflex.location import LIBRARY
from freeflex.scene import check_kind, index_in, indices_of
from freeflex.state import BodyState, Busy, GroupPose, PointState, Push, State, StepError, vector, whole

#: levels of a verdict: how far a motion can be trusted
LEVELS = ("good", "watch", "outside", "not judged")

_POINT, _LINK, _GROUP, _WHEEL, _MODE = range(5)
_KINDS = {"point": _POINT, "link": _LINK, "group": _GROUP, "wheel": _WHEEL}
_NO_MEMORY, _BUSY = 4, 7
_WITH_VERDICT = 1
_LONGEST = 4096  # largest number of values of a link
_PIECE = 10000  # largest number of ticks in one call of the C library

#: level: one of LEVELS; cause; error, scale: the estimated error of the displacements and the scale it is compared with
#[m]; tick: the last one that was judged
Verdict = collections.namedtuple("Verdict", "level cause error scale tick")
#: estimated errors of a motion at `tick`, the last one that was judged (-1: none): position [m], attitude [rad],
#: deformation [m]; shadow [m]: by how much the motion with which this one is compared may itself be wrong
Errors = collections.namedtuple("Errors", "tick position attitude deformation shadow")
#: one effect that a motion lacks: name, largest deformation [m], attitude [rad] and position [m], remedy
Effect = collections.namedtuple("Effect", "name deformation attitude position remedy")
#: [J]
Energy = collections.namedtuple("Energy", "kinetic_rigid kinetic_elastic potential")


_IN_USE = "another thread steps this motion; give each thread a copy() of its own, or have them take turns"


class _Setting(ctypes.Structure):
    _fields_ = [("path", ctypes.c_char_p), ("value", ctypes.c_char_p)]


class _Load(ctypes.Structure):
    _fields_ = [("kind", ctypes.c_int32), ("index", ctypes.c_int32), ("force", ctypes.c_double * 3),
                ("torque", ctypes.c_double * 3)]


class _State(ctypes.Structure):
    _fields_ = [("tick", ctypes.c_int64), ("time", ctypes.c_double), ("position", ctypes.c_double * 3),
                ("attitude", ctypes.c_double * 4), ("velocity", ctypes.c_double * 3),
                ("angular_velocity", ctypes.c_double * 3), ("angular_momentum", ctypes.c_double * 3)]


class _Verdict(ctypes.Structure):
    _fields_ = [("tick", ctypes.c_int64), ("level", ctypes.c_int32), ("unused", ctypes.c_int32),
                ("error", ctypes.c_double), ("scale", ctypes.c_double), ("cause", ctypes.c_char * 256)]


class _Errors(ctypes.Structure):
    _fields_ = [("tick", ctypes.c_int64), ("position", ctypes.c_double), ("attitude", ctypes.c_double),
                ("deformation", ctypes.c_double), ("shadow", ctypes.c_double)]


class _Effect(ctypes.Structure):
    _fields_ = [("name", ctypes.c_char * 64), ("deformation", ctypes.c_double), ("attitude", ctypes.c_double),
                ("position", ctypes.c_double), ("remedy", ctypes.c_char * 128)]


_PROGRESS = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_double)
_library = None


def _signatures(c):
    """Returns {name: (result, arguments)} of the C functions. A result of type int is an error code."""
    plan, motion, out, doubles = c.c_void_p, c.c_void_p, c.POINTER(c.c_void_p), c.POINTER(c.c_double)
    size, settings = c.c_size_t, c.POINTER(_Setting)
    return {
        "version": (c.c_char_p, []), "last_error": (c.c_char_p, []),
        "plan_open_with": (c.c_int, [c.c_char_p, settings, size, _PROGRESS, c.c_void_p, out]),
        "plan_open_text": (c.c_int, [c.c_char_p, c.c_char_p, c.c_char_p, settings, size, _PROGRESS, c.c_void_p, out]),
        "plan_free": (None, [plan]),
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
        "motion_state": (c.c_int, [motion, c.POINTER(_State), c.c_void_p, c.c_void_p, size, c.c_void_p, size]),
        "motion_point": (c.c_int, [motion, c.c_int32, doubles]), "motion_body": (c.c_int, [motion, c.c_int32, doubles]),
        "motion_group": (c.c_int, [motion, c.c_int32, doubles]),
        "motion_link": (c.c_int, [motion, c.c_int32, doubles, size, c.POINTER(size)]),
        "motion_energy": (None, [motion, doubles]),
        "motion_verdict": (c.c_int, [motion, c.POINTER(_Verdict)]),
        "motion_worst_verdict": (c.c_int, [motion, c.POINTER(_Verdict)]),
        "motion_errors": (c.c_int, [motion, c.POINTER(_Errors)]),
        "random_normal": (c.c_double, [c.c_uint64, c.c_uint64, c.c_uint64]),
        "campaign_open": (c.c_int, [c.c_char_p, out]), "campaign_free": (None, [c.c_void_p]),
        "campaign_cases": (c.c_int64, [c.c_void_p]), "campaign_variables": (c.c_int32, [c.c_void_p]),
        "campaign_run": (c.c_int, [c.c_void_p, c.c_int64, c.POINTER(c.c_char_p), c.c_void_p, c.POINTER(c.c_char_p), doubles]),
        "campaign_trace": (c.c_int, [c.c_void_p, c.c_int64, c.c_char_p, c.c_void_p, c.c_char_p, c.POINTER(c.c_char_p)]),
        "explain": (c.c_int, [c.c_char_p, c.c_char_p, c.c_char_p, settings, size, c.c_double, c.POINTER(_Effect), size,
                              c.POINTER(size)]),
    }


def _find_library():
    """Returns the path of the C library: FREEFLEX_LIBRARY if it is set, else the library that was built or installed
    with this package, else a name that the loader searches for."""
    if named := os.environ.get("FREEFLEX_LIBRARY"):
        return named
    path = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), LIBRARY))
    return path if os.path.exists(path) else os.path.basename(LIBRARY)


def library():
    """Returns the C library. StepError: it was not found."""
    global _library
    if _library is None:
        name = _find_library()
        try:
            loaded = ctypes.CDLL(name)
        except OSError as error:
            raise StepError(f"the library of freeflex cannot be loaded ({error}); install freeflex, or name the library in FREEFLEX_LIBRARY") from None
        for function, (result, arguments) in _signatures(ctypes).items():
            bound = getattr(loaded, "freeflex_" + function, None)
            if bound is None:
                raise StepError(f"{name} has no freeflex_{function}, so it is not the C library of this freeflex; name another in FREEFLEX_LIBRARY")
            bound.restype, bound.argtypes = result, arguments
            setattr(loaded, function, bound)
        _library = loaded
    return _library


def _check(code):
    if code == 0:
        return
    if code == _BUSY:
        raise Busy(_IN_USE)
    raise (MemoryError if code == _NO_MEMORY else StepError)(library().last_error().decode(errors="replace").strip())


def _read(sizes, function, *arguments):
    """Returns the vectors, of the given sizes, that a C function writes one after the other."""
    values = (ctypes.c_double * sum(sizes))()
    _check(function(*arguments, values))
    ends = [sum(sizes[:k + 1]) for k in range(len(sizes))]
    return [vector(values[end - size:end]) for size, end in zip(sizes, ends)]


class Plan:
    """A plan, set up from a scene or plan file, a dict, a Scene, or `text` (YAML or JSON) with the `folder` of the
    files that it names. Any number of motions may be made from it.

    `name`, `rate` [Hz], `mass` [kg], `fingerprint` (the same number as in the messages), `warnings`; `points`, `links`,
    `groups`, `wheels`: indices by name, in the order of the scene; `frequencies` [Hz] of the elastic modes, in the
    order of a state's `q`. StepError: every fault of the scene, with its line. MemoryError: the set-up needs more
    memory than there is.

    `progress(what, fraction)` is called during a long set-up; an exception in it ends the set-up.
    """

    def __init__(self, source=None, progress=None, *, text=None, folder=None):
        scene = source if isinstance(source, Scene) else Scene(source, text=text, folder=folder)
        c, handle, raised = library(), ctypes.c_void_p(), []

        def ask(_, what, done):
            try:
                if progress:
                    progress(what.decode(), done)
            except BaseException as error:  # C code cannot pass exceptions, so this is passed as an error code
                raised.append(error)
            return len(raised)

        settings = [_Setting(path.encode(), value.encode()) for path, value in scene.settings.items()]
        rest = (_Setting * len(settings))(*settings), len(settings), _PROGRESS(ask), None, ctypes.byref(handle)
        if scene.path is not None:
            code = c.plan_open_with(scene.path, *rest)
        else:
            code = c.plan_open_text(scene.text.encode(), scene.name.encode(), scene.folder, *rest)
        if raised:
            if code == 0:
                c.plan_free(handle)
            raise raised[0]
        _check(code)
        self._handle, self._is_borrowed = handle, False
        self._describe(handle)

    def _describe(self, handle):
        c = library()
        self.name, self.warnings = c.plan_name(handle).decode(), c.plan_warnings(handle).decode().splitlines()
        self.rate, self.mass = c.plan_rate(handle), c.plan_mass(handle)
        self._indices = {kind: indices_of((k, c.plan_name_of(handle, number, k).decode())
                                          for k in range(c.plan_count(handle, number)))
                         for kind, number in _KINDS.items()}
        self.points, self.links, self.groups, self.wheels = (self._indices[kind] for kind in _KINDS)
        self.num_points, self.num_modes = c.plan_count(handle, _POINT), c.plan_count(handle, _MODE)
        self.num_wheels = c.plan_count(handle, _WHEEL)
        values = (ctypes.c_double * self.num_modes)()
        _check(c.plan_frequencies(handle, values, len(values)))
        self.frequencies = vector(values[:])

    @classmethod
    def _borrowed(cls, handle):
        """Returns a Plan that reads an existing handle and does not free it."""
        plan = cls.__new__(cls)
        plan._handle, plan._is_borrowed = handle, True
        plan._describe(handle)
        return plan

    @property
    def fingerprint(self):
        """Returns the same number as in the messages."""
        return library().plan_fingerprint(self._handle)

    def motion(self, with_verdict=False):
        """Returns a Motion at the initial state. `with_verdict`: the motion computes verdicts on its accuracy, whose
        time `freeflex plan` gives."""
        handle = ctypes.c_void_p()
        _check(library().motion_new(self._handle, _WITH_VERDICT if with_verdict else 0, ctypes.byref(handle)))
        return Motion(self, handle)

    def shape(self, point):
        """Returns the elastic displacement [-] of a point for each mode, body axes: a list of vectors."""
        values = (ctypes.c_double * (3 * self.num_modes))()
        _check(library().plan_shape(self._handle, self.index("point", point), values, len(values)))
        return [vector(values[3 * k:3 * k + 3]) for k in range(self.num_modes)]

    def rest(self):
        """Returns the rest positions [m] of the points, body axes from the centre of mass: a list of vectors."""
        values = (ctypes.c_double * (3 * self.num_points))()
        _check(library().plan_rest(self._handle, values, len(values)))
        return [vector(values[3 * k:3 * k + 3]) for k in range(self.num_points)]

    def index(self, kind, name):
        """Returns the index of the point, link, group or wheel with this name; an index is returned unchanged.
        LookupError: unknown."""
        check_kind(kind)
        if isinstance(name, int):
            return whole(kind, name, 0, 2**31 - 1)
        return index_in(self._indices[kind], kind, name)

    def __del__(self):
        handle = self.__dict__.pop("_handle", None)
        if handle and not self._is_borrowed:
            library().plan_free(handle)


class MotionState(State):
    """A State of a Motion."""

    def __init__(self, motion, handle, version):
        self._fields, self._arrays, self._version, self._owner = _State(), motion._Arrays(), version, motion
        fields, arrays, plan = self._fields, self._arrays, motion.plan
        _check(library().motion_state(handle, fields, ctypes.byref(arrays), ctypes.byref(arrays, 8 * plan.num_modes),
                                      plan.num_modes, ctypes.byref(arrays, 16 * plan.num_modes), plan.num_wheels))
        self.tick, self.time = fields.tick, fields.time

    def _values(self, name):
        n = self._owner.plan.num_modes
        ends = {"q": (0, n), "q_dot": (n, 2 * n), "wheel_momentum": (2 * n, None)}
        return self._arrays[slice(*ends[name])] if name in ends else getattr(self._fields, name)[:]


class Motion:
    """A motion of a plan. `plan`; `rate` [Hz] and `index(kind, name)` are those of the plan.

    Only one thread may use a Motion at a time. Busy: another thread steps it.
    """

    def __init__(self, plan, handle, is_borrowed=False):
        self.plan, self._handle, self._is_borrowed = plan, handle, is_borrowed
        self.rate, self.index = plan.rate, plan.index
        self._steps, self._version = threading.Lock(), 0
        self._Arrays = ctypes.c_double * (2 * plan.num_modes + plan.num_wheels)  # q, q_dot, momenta of wheels

    @property
    def handle(self):
        """Returns the handle for the C interface. Busy: another thread steps the motion. That applies also while the
        other thread is between two C calls."""
        if self._steps.locked():
            raise Busy(_IN_USE)
        return self._handle

    def step(self, ticks=1):
        """Advances by a number of ticks. Returns the State after them. StepError: the next state would not be finite;
        the motion stays at the last finite state."""
        ticks = whole("ticks", ticks, 0, 2**63 - 1)
        if not self._steps.acquire(blocking=False):
            raise Busy(_IN_USE)
        try:
            self._version += 1
            while True:  # advances in pieces, so that Ctrl-C takes effect
                piece = min(ticks, _PIECE)
                _check(library().motion_step(self._handle, piece))
                ticks -= piece
                if ticks == 0:
                    return MotionState(self, self._handle, self._version)
        finally:
            self._steps.release()

    @property
    def state(self):
        """Returns the present State."""
        return MotionState(self, self.handle, self._version)

    def push(self, forces=None, *, torques=None, wrenches=None, wheels=None, axes="world", slot=0, duration=None,
             lease=None):
        """Replaces the loads in a slot, from the next step on; without loads, clears the slot.

        `forces` {point: (x, y, z)} [N]; `torques` {point: (x, y, z)} [N m] on bodies; `wrenches` {group: (force,
        torque)}; `wheels` {wheel: torque} [N m] of motors; by name or index. `axes`: "world" or "body". Give exactly
        one of `duration` [s], after which the loads end, and `lease` [s], within which the push must be renewed. Both
        are at most `commands: max_hold` of the scene, 60 s by default. StepError: a daemon would reject the push, or
        256 pushes already wait for the next step.
        """
        push = Push(self.index, self.rate, forces, torques=torques, wrenches=wrenches, wheels=wheels, axes=axes,
                    slot=slot, duration=duration, lease=lease)
        none = (0.0, 0.0, 0.0)
        loads = [_load("point", k, f, none) for k, f in push.forces]
        loads += [_load("point", k, none, t) for k, t in push.torques]
        loads += [_load("group", k, f, t) for k, f, t in push.wrenches]
        loads += [_load("wheel", k, none, (t, 0.0, 0.0)) for k, t in push.wheels]
        _check(library().motion_push(self.handle, push.slot, push.axes, (_Load * len(loads))(*loads), len(loads),
                                     push.duration_ticks or push.lease_ticks))

    def reset(self):
        """Resets to the initial state and removes all pushes; the loads of the scene stay. The count of ticks
        continues."""
        library().motion_reset(self.handle)
        self._version += 1

    def copy(self):
        """Returns a new motion in the same state."""
        handle = ctypes.c_void_p()
        _check(library().motion_copy(self.handle, ctypes.byref(handle)))
        return Motion(self.plan, handle)

    @property
    def tick(self):
        """Returns the number of the next step."""
        return library().motion_tick(self.handle)

    @property
    def time(self):
        """Returns the time [s] since the last reset."""
        return library().motion_time(self.handle)

    def _read_of(self, state, kind, name):
        if state._version != self._version:
            raise RuntimeError(f"the motion is at tick {self.tick}; read from the state of tick {state.tick} before the "
                               "next step")
        c, index = library(), self.index("point" if kind == "body" else kind, name)
        if kind == "point":
            return PointState(*_read((3, 3, 3, 3), c.motion_point, self.handle, index))
        if kind == "body":
            return BodyState(*_read((4, 3), c.motion_body, self.handle, index))
        if kind == "group":
            return GroupPose(*_read((3, 4, 3, 3), c.motion_group, self.handle, index))
        values, count = (ctypes.c_double * _LONGEST)(), ctypes.c_size_t()
        _check(c.motion_link(self.handle, index, values, _LONGEST, ctypes.byref(count)))
        return vector(values[:count.value])

    @property
    def energy(self):
        """Returns the present Energy."""
        values = (ctypes.c_double * 3)()
        library().motion_energy(self.handle, values)
        return Energy(*values)

    @property
    def verdict(self):
        """Returns the present Verdict on the accuracy of the motion. StepError: the motion was made without
        verdicts."""
        return self._verdict(library().motion_verdict)

    @property
    def worst_verdict(self):
        """Returns the worst Verdict since the last reset."""
        return self._verdict(library().motion_worst_verdict)

    @property
    def errors(self):
        """Returns the estimated Errors of the motion. StepError: the motion was made without verdicts."""
        read = _Errors()
        _check(library().motion_errors(self.handle, ctypes.byref(read)))
        return Errors(read.tick, read.position, read.attitude, read.deformation, read.shadow)

    def _verdict(self, function):
        read = _Verdict()
        _check(function(self.handle, ctypes.byref(read)))
        # LEVELS ends with "not judged", so that the index -1, FREEFLEX_NOT_JUDGED, gives it
        return Verdict(LEVELS[read.level], read.cause.decode(errors="replace"), read.error, read.scale, read.tick)

    def __del__(self):
        handle = self.__dict__.pop("_handle", None)
        if handle and not self._is_borrowed:
            library().motion_free(handle)


def explain(source=None, seconds=1.0, *, text=None, folder=None):
    """Runs a scene without commands for `seconds`, beside better plans of it, and returns the Effects that its motion
    lacks, the largest deformation first. The scene is given as for Plan. StepError: faults of the scene, or nothing
    judges its motion."""
    scene = source if isinstance(source, Scene) else Scene(source, text=text, folder=folder)
    settings = [_Setting(path.encode(), value.encode()) for path, value in scene.settings.items()]
    effects, count = (_Effect * 8)(), ctypes.c_size_t()
    of_text = None if scene.path is not None else scene.text.encode()
    _check(library().explain(scene.path, of_text, None if scene.path is not None else scene.folder,
                             (_Setting * len(settings))(*settings), len(settings), seconds, effects, len(effects),
                             ctypes.byref(count)))
    return [Effect(each.name.decode(), each.deformation, each.attitude, each.position, each.remedy.decode())
            for each in effects[:count.value]]


def random_normal(seed, stream, index):
    """Returns a random number of the standard normal distribution, which depends only on the arguments, whole numbers
    from 0 to 2^64 - 1."""
    return library().random_normal(seed, stream, index)


def _load(kind, index, force, torque):
    return _Load(_KINDS[kind], index, tuple(force), tuple(torque))
