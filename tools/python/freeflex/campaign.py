"""Cases of a campaign with a controller in Python.

A file that a campaign names under `controller: python` has a function make(case). It is called at the start of each case
and returns the controller, a function that gets a State at each multiple of `every` and returns the arguments of push()
as a dict, or None for no push:

    def make(case):
        gain = case.parameters["gain"]
        return lambda state: {"forces": {"tip": [-gain * v for v in state.point("tip").velocity]}, "lease": 1.0}
"""

import ctypes
import importlib.util
import os
import sys
import traceback

from freeflex.plan import Motion, Plan, StepError, _check, library

_REASON_SIZE = 256


class _Parameter(ctypes.Structure):
    _fields_ = [("name", ctypes.c_char_p), ("value", ctypes.c_double)]


class _Case(ctypes.Structure):
    _fields_ = [("number", ctypes.c_int64), ("seed", ctypes.c_uint64), ("parameters", ctypes.POINTER(_Parameter)),
                ("num_parameters", ctypes.c_size_t)]


_Reason = ctypes.POINTER(ctypes.c_char)
_Begin = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(_Case), ctypes.POINTER(ctypes.c_void_p), _Reason)
_Act = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, _Reason)
_End = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


class _Controller(ctypes.Structure):
    _fields_ = [("begin", _Begin), ("act", _Act), ("end", _End)]


class Case:
    """What a controller is told of its case: `number`; `seed` for random numbers; `parameters` by name; `plan`."""

    def __init__(self, number, seed, parameters, plan):
        self.number, self.seed, self.parameters, self.plan = number, seed, parameters, plan


def load(path):
    """Returns the function make of a Python file. StepError: the file has none."""
    spec = importlib.util.spec_from_file_location("freeflex_controller", path)
    if spec is None:
        raise StepError(f"{path} is not a Python file; its name must end with .py")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, os.path.dirname(os.path.abspath(path)))
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    if not callable(getattr(module, "make", None)):
        raise StepError(f"{path} has no function make(case)")
    return module.make


class Campaign:
    """A campaign file. `num_cases`; run() runs single cases in this process. `make`: makes the controller of a case."""

    def __init__(self, path, make=None):
        self._make, self._handle = make, ctypes.c_void_p()
        _check(library().campaign_open(os.fsencode(path), ctypes.byref(self._handle)))
        self.num_cases = library().campaign_cases(self._handle)
        self._calls = _Controller(_Begin(self._begin), _Act(self._act), _End(self._end))
        self._case = self._motion = self._control = None

    def _arguments(self):
        return ctypes.byref(self._calls) if self._make else None

    def run(self, number, values=None):
        """Returns the row of a case as text, and the seconds of its set-up and run. `values`: a text for each variable in
        place of those that are drawn."""
        row, seconds, texts = ctypes.c_char_p(), (ctypes.c_double * 2)(), None
        if values is not None:
            count = library().campaign_variables(self._handle)
            if len(values) != count:
                raise ValueError(f"there are {len(values)} values, but the campaign has {count} variables")
            texts = (ctypes.c_char_p * len(values))(*(value.encode() for value in values))
        _check(library().campaign_run(self._handle, number, texts, self._arguments(), ctypes.byref(row), seconds))
        return row.value.decode(errors="replace"), tuple(seconds)

    def trace(self, number, scene, log):
        """Runs a case on a scene file that has its values, and writes the pushes to a log. Returns the row."""
        row = ctypes.c_char_p()
        _check(library().campaign_trace(self._handle, number, os.fsencode(scene), self._arguments(), os.fsencode(log),
                                        ctypes.byref(row)))
        return row.value.decode(errors="replace")

    def _guarded(self, reason, call):
        try:
            call()
            return 0
        except BaseException as error:  # C code cannot pass exceptions; the row says what it was
            traceback.print_exc()
            package = os.path.dirname(os.path.abspath(__file__))
            places = [f for f in traceback.extract_tb(error.__traceback__)
                      if os.path.dirname(os.path.abspath(f.filename)) != package]
            where = f" ({os.path.basename(places[-1].filename)}, line {places[-1].lineno})" if places else ""
            said, place = f"{type(error).__name__}: {error}".encode(errors="replace"), where.encode(errors="replace")
            said = said[:max(0, _REASON_SIZE - 1 - len(place))].decode(errors="ignore").encode()  # no half characters
            text = (said + place)[:_REASON_SIZE - 1]
            ctypes.memmove(reason, text + b"\0", len(text) + 1)
            return 1

    def _begin(self, plan, case, _, reason):
        def call():
            told = case.contents
            parameters = {told.parameters[k].name.decode(): told.parameters[k].value for k in range(told.num_parameters)}
            self._case = Case(told.number, told.seed, parameters, Plan._borrowed(ctypes.c_void_p(plan)))
            self._control = self._make(self._case)
        return self._guarded(reason, call)

    def _act(self, _, motion, reason):
        def call():
            if self._motion is None:
                self._motion = Motion(self._case.plan, ctypes.c_void_p(motion), is_borrowed=True)
            self._motion._version += 1  # states of earlier calls are too old to be read
            if (push := self._control(self._motion.state)) is not None:
                self._motion.push(**push)
        return self._guarded(reason, call)

    def _end(self, _):
        self._case = self._motion = self._control = None

    def __del__(self):
        if handle := self.__dict__.pop("_handle", None):
            library().campaign_free(handle)
