"""controller.py SCENE|bus POINT POINT GAIN: the active strut of controller.cpp, in Python.

With a scene, the motion is stepped in this process. With `bus`, the controller pushes the points of a running daemon.
The force on the second point is -GAIN [N s/m] times the speed at which the distance of the points grows, and the force
on the first point is opposite. Exit codes: 0 if the largest speed falls to 1 % within 60 s, 1 if not, 2 for wrong
arguments.
"""

import math
import sys

import freeflex


class Strut:
    def __init__(self, first, second, gain):
        self.points, self.gain = (first, second), gain
        self.largest = 0.0  # [m/s] since the last call of take_largest

    def __call__(self, state):
        a, b = (state.point(name) for name in self.points)
        line = [q - p for p, q in zip(a.position, b.position)]
        length = math.hypot(*line)
        along = [x / length for x in line]
        speed = sum(u * (w - v) for u, v, w in zip(along, a.velocity, b.velocity))
        self.largest = max(self.largest, abs(speed))
        force = [-self.gain * speed * u for u in along]
        # the lease ends the force within 0.2 s if this program dies
        return {"forces": {self.points[0]: [-f for f in force], self.points[1]: force}, "lease": 0.2}

    def take_largest(self):
        largest, self.largest = self.largest, 0.0
        return largest


def main():
    if len(sys.argv) != 5 or not float(sys.argv[4]) > 0.0:
        print(__doc__, file=sys.stderr)
        return 2
    where, strut = sys.argv[1], Strut(sys.argv[2], sys.argv[3], float(sys.argv[4]))
    owner = freeflex.connect() if where == "bus" else freeflex.Plan(where).motion()
    first, second = None, 0
    while second < 60:
        second += 1
        state = freeflex.control(owner, strut, every=0.01, until=float(second))
        largest = strut.take_largest()
        first = first or largest
        if largest <= 0.01 * first:
            print(f"speed along the line: {first:.6f} m/s -> {largest:.6f} m/s after {state.time:.1f} s")
            return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
