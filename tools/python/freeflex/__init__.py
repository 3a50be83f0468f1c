"""freeflex in Python: daemons on the bus, recordings, and plans stepped in this process.

    import freeflex
    with freeflex.connect() as daemon:                     # a running freeflexd
        daemon.push({"tip": (0.0, 0.0, 10.0)}, duration=0.5)
        for state in daemon.listen("STATE", timeout=2.0):
            print(state.tick, state.position)

    for event, message in freeflex.log.messages("recording.log"):
        ...

    motion = freeflex.Plan("boom.yaml").motion()           # without a daemon
    state = motion.step(1000)
    print(state.position, state.point("tip").position)

Everything is in SI units, vectors in world axes unless a docstring says body axes, quaternions scalar first.
`python3 -m freeflex` has examples. The messages' fields: help(freeflex.messages).
"""

from freeflex import blocks, log, messages
from freeflex.bus import Bus
from freeflex.campaign import Campaign
from freeflex.client import Daemon, Gone, Rejected, connect
from freeflex.codec import DecodeError, Message
from freeflex.controller import control
from freeflex.description import Scene
from freeflex.keys import Key
from freeflex.log import LogError, events
from freeflex.messages import TYPES
from freeflex.plan import Motion, Plan, explain
from freeflex.state import Busy, State, StepError
from freeflex.version import __version__

globals().update(TYPES)

__all__ = ["Bus", "Busy", "Campaign", "Daemon", "DecodeError", "Gone", "Key", "LogError", "Message", "Motion", "Plan", "Rejected",
           "Scene", "State", "StepError", "__version__", "blocks", "connect", "control", "events", "explain", "log",
           "messages", *TYPES]
