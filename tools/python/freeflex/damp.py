"""An active strut: pushes two points along the line between them with forces that oppose the rate of change of their
distance."""

from freeflex.client import Gone, Rejected


def damp(daemon, first, second, gain, seconds=20.0, window=1.0):
    """Damps the relative motion of two points with `gain` [N s/m] for `seconds` of simulated time. Returns the largest
    relative speed [m/s] along their line in the first and in the last `window` [s]."""
    a, b = daemon.index("point", first), daemon.index("point", second)
    rate, start, speeds, tick = daemon.rate, None, [], -1
    for _ in daemon.listen("POINTS", timeout=daemon.timeout):
        if daemon.points is None or daemon.points.tick <= tick:
            continue
        for name, point in ((first, a), (second, b)):
            if point not in daemon.points.points:
                raise LookupError(f"the scene does not publish point {name!r}; list it under publish: points: of")
        tick, one, other = daemon.points.tick, daemon.points.points[a], daemon.points.points[b]
        start = tick if start is None else start
        line = [y - x for x, y in zip(one.position, other.position)]
        length = sum(x * x for x in line) ** 0.5
        speed = sum(x * (w - v) for x, v, w in zip(line, one.velocity, other.velocity)) / length
        speeds.append(((tick - start) / rate, abs(speed)))
        if speeds[-1][0] > seconds:
            break
        force = [-gain * speed * x / length for x in line]
        try:
            daemon.push({second: force, first: [-x for x in force]}, lease=0.2)
        except Gone:  # starts again with the daemon that replaced the first one
            a, b = daemon.index("point", first), daemon.index("point", second)
            rate, start, speeds, tick = daemon.rate, None, [], -1
        except Rejected as rejected:
            if rejected.ack.reason != 3:  # 3 is wrong_session: the STATUS of the new session raises Gone
                raise
    if not speeds:
        raise TimeoutError(f"no complete POINTS came on {daemon.prefix}_POINTS; does the scene publish {first} and {second}?")
    end = speeds[-1][0]
    return max(s for t, s in speeds if t <= window), max(s for t, s in speeds if t >= end - window)
