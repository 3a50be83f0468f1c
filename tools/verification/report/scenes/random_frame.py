#!/usr/bin/env python3
"""random_frame.py BEAMS SEED: prints a scene of 20 points that BEAMS beams join, 19 to 60. The points are near those of a
lattice of 5 x 2 x 2 m. The frame spins and is pushed. frame24.yaml, frame30.yaml and frame40.yaml are of seed 1."""

import itertools
import random
import sys


def main():
    count, seed = int(sys.argv[1]), int(sys.argv[2])
    if not 19 <= count <= 60:
        sys.exit("random_frame.py: BEAMS must be from 19, which join all points, to 60")
    chance = random.Random(seed)
    points = [tuple(c + chance.uniform(-0.15, 0.15) for c in at) for at in itertools.product(range(5), range(2), range(2))]
    pairs = sorted(itertools.combinations(range(20), 2),
                   key=lambda pair: sum((a - b) ** 2 for a, b in zip(points[pair[0]], points[pair[1]])))
    group = list(range(20))  # points that beams join have the same number
    beams = []
    for first, second in pairs:  # the shortest beams that join all points
        if group[first] != group[second]:
            beams.append((first, second))
            group = [group[first] if number == group[second] else number for number in group]
    beams += [pair for pair in pairs if pair not in beams][:count - len(beams)]
    print(f"# A frame of {count} beams between 20 points, by random_frame.py {count} {seed}")
    print(f"name: frame{count}\nrate: 1000\npoints:")
    for number, (x, y, z) in enumerate(points):
        print(f"  - {{name: p{number}, mass: 0.5, at: [{x:.4f}, {y:.4f}, {z:.4f}]}}")
    print("links:")
    for first, second in sorted(beams):
        print(f"  - {{beam: [p{first}, p{second}], EA: 2e5, GJ: 300, EIy: 400, EIz: 400}}")
    print("loads: [{name: push, forces: {p19: [0, 10, 6]}, pulse: {start: 0, duration: 0.1}}]")
    print("initial: {angular_velocity: [0.1, 0.3, 0.5]}")


if __name__ == "__main__":
    main()
