"""python3 -m freeflex: useful examples of the package.

    listen [CHANNEL...]      prints the messages of a daemon as they come: STATE STATUS ...
    push POINT FX FY FZ S    pushes a point for S seconds [N]
    damp POINT POINT GAIN    an active strut between two points [N s/m]
    log FILE                 lists the contents of a recording; exit code 3 if it is damaged
    step FILE SECONDS        steps a scene or plan in this process; prints its position and verdict after SECONDS, and
    the worst verdict
"""

import argparse
import collections
import sys

import freeflex
from freeflex.damp import damp


def listen(arguments):
    with freeflex.connect(arguments.prefix, key=arguments.key) as daemon:
        for message in daemon.listen(*arguments.channels):
            print(message, flush=True)


def push(arguments):
    with freeflex.connect(arguments.prefix, key=arguments.key) as daemon:
        ack = daemon.push({arguments.point: arguments.force}, duration=arguments.seconds)
        print(f"accepted at tick {ack.tick}")


def strut(arguments):
    with freeflex.connect(arguments.prefix, key=arguments.key) as daemon:
        first, last = damp(daemon, arguments.first, arguments.second, arguments.gain, arguments.seconds)
    print(f"largest speed along the strut: {first:.6g} m/s in the first second, {last:.6g} m/s in the last")


def log(arguments):
    seen, ticks, damage = collections.Counter(), {}, None
    try:
        for event, message in freeflex.log.messages(arguments.file, arguments.prefix):
            seen[event.channel] += 1
            if hasattr(message, "tick"):
                ticks.setdefault(event.channel, [message.tick, message.tick])[1] = message.tick
    except freeflex.LogError as error:
        damage = error
    if not seen and not damage:
        raise LookupError(f"{arguments.file} holds no message of {arguments.prefix}; check --prefix")
    for channel, count in sorted(seen.items()):
        print(f"{channel:24} {count:9} messages" + (" of ticks {} to {}".format(*ticks[channel])
                                                    if channel in ticks else ""))
    if damage:
        raise damage


def step(arguments):
    motion = freeflex.Plan(arguments.file).motion(with_verdict=True)
    if not 0.0 <= arguments.seconds < 1e9:
        raise ValueError(f"SECONDS is {arguments.seconds} s, but must be a time from 0 to 1e9 s")
    state = motion.step(round(arguments.seconds * motion.rate))
    verdict, worst = motion.verdict, motion.worst_verdict
    print(f"{motion.plan.name}: tick {state.tick}, {state.time:g} s")
    print("position {:.9g} {:.9g} {:.9g} m".format(*state.position))
    print("attitude {:.9g} {:.9g} {:.9g} {:.9g}".format(*state.attitude))
    print(f"verdict  {verdict.level}" + (f": {verdict.cause}" if verdict.cause else ""))
    if worst.level != verdict.level:
        print(f"worst    {worst.level} at tick {worst.tick}: {worst.cause}")


def main():
    parser = argparse.ArgumentParser("python3 -m freeflex", description=__doc__.split("\n", maxsplit=1)[0],
                                     epilog=__doc__.split("\n", 1)[1],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--prefix", default="FREEFLEX", help="first part of the daemon's channel names")
    parser.add_argument("--key", help="key file, for a daemon that requires keys")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name, run, *options):
        command = commands.add_parser(name)
        command.set_defaults(run=run)
        for option, settings in options:
            command.add_argument(option, **settings)

    number = {"type": float}
    add("listen", listen, ("channels", {"nargs": "*"}))
    add("push", push, ("point", {}), ("force", {"nargs": 3, "type": float}), ("seconds", number))
    add("damp", strut, ("first", {}), ("second", {}), ("gain", number), ("--seconds", {"type": float, "default": 20.0}))
    add("log", log, ("file", {}))
    add("step", step, ("file", {}), ("seconds", number))
    arguments = parser.parse_args()
    try:
        arguments.run(arguments)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 1
    except freeflex.Rejected as error:
        print(f"python3 -m freeflex: {error}", file=sys.stderr)
        return 1
    except freeflex.LogError as error:
        print(f"python3 -m freeflex: {error}", file=sys.stderr)
        return 3
    except (LookupError, MemoryError, OSError, RuntimeError, ValueError) as error:
        print(f"python3 -m freeflex: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
