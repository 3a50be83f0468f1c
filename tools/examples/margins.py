"""margins.py SCENE: margins of a pointing loop about x, without and with a notch filter at a panel mode.

The loop is a proportional and derivative law from the rotation of the hub to a wheel, with a delay. The model is made with
`freeflex export`, and the notch is at the mode with the largest peak of `freeflex modes --bode`. Exit codes: 0 if the loop
with the notch is stable, 1 if not. Needs numpy and scipy (python3-scipy).
"""

import json
import os
import subprocess
import sys
import tempfile

import numpy
import scipy.signal

FREEFLEX = os.environ.get("FREEFLEX", "freeflex")
GAIN, RATE_GAIN, DELAY = 25.0, 90.0, 0.5  # [N m/rad], [N m s/rad], [s]


def export_model(scene, torque, angle):
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "model.npz")
        subprocess.run([FREEFLEX, "export", scene, "--state-space", file, "--in", torque, "--out", angle, "--modes", "6"],
                       check=True, stdout=subprocess.DEVNULL)
        with numpy.load(file) as read:
            return read["A"], read["B"], read["C"], read["D"], list(read["states"])


def response(A, B, C, D, omega):
    """Returns the transfer function at angular frequencies [rad/s]."""
    one = numpy.eye(len(A))
    return numpy.array([(C @ numpy.linalg.solve(1j * w * one - A, B) + D)[0, 0] for w in omega])


def crossings(values):
    """Returns the numbers k at which a sequence changes its sign between k and k + 1, and where in between."""
    found = numpy.nonzero(values[:-1] * values[1:] < 0.0)[0]
    return [(k, values[k] / (values[k] - values[k + 1])) for k in found]


def margins(loop):
    """Returns the gain margin [dB] and the phase margin [deg] of the loop that are nearest to instability. If a gain margin is
    below 0 dB, the gain must be lowered by it."""
    gain, phase = 20 * numpy.log10(numpy.abs(loop)), numpy.degrees(numpy.unwrap(numpy.angle(loop)))
    at = lambda values, k, part: values[k] + part * (values[k + 1] - values[k])
    # the phase crosses -180 degrees, or a whole number of turns beside it
    turned = numpy.sin(numpy.radians(phase))
    gains = [-at(gain, k, part) for k, part in crossings(turned) if numpy.cos(numpy.radians(phase[k])) < 0.0]
    phases = [(at(phase, k, part) + 180.0 + 180.0) % 360.0 - 180.0 for k, part in crossings(gain)]
    return min(gains, key=abs, default=numpy.inf), min(phases, key=abs, default=numpy.inf)


def is_stable(A, b, c, numerator, denominator):
    """Tells whether the loop of the plant (A, b, c) and the filter numerator(s) / denominator(s), with a delay as a Pade
    approximation of third order, has closed-loop poles in the left half plane only."""
    delayed = numpy.array([DELAY ** 3, 12 * DELAY ** 2, 60 * DELAY, 120.0])
    early = delayed * [-1, 1, -1, 1]
    E, f, g, h = scipy.signal.tf2ss(numpy.polymul(numerator, early), numpy.polymul(denominator, delayed))
    # plant x' = A x + b u, filter z' = E z + f y, feedback u = -(g z + h y) with y = c x
    closed = numpy.block([[A - b @ h @ c, -b @ g], [f @ c, E]])
    return numpy.linalg.eigvals(closed).real.max() < 1e-9


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    scene, pair = sys.argv[1], ("wheel.spin_x.torque", "point.hub.rx")
    A, B, C, D, states = export_model(scene, *pair)
    shown = subprocess.run([FREEFLEX, "modes", scene, "--bode", ":".join(pair), "--json"], check=True, capture_output=True)
    panel = max(json.loads(shown.stdout)["modes"], key=lambda mode: mode["peak"] or 0.0)
    print(f"the wheel moves mode {panel['mode']} of {panel['frequency']:.3g} Hz most")
    # only rotation about x and the modes: the rest of the body is neither moved nor seen
    kept = [k for k, name in enumerate(states) if name in ("rx", "wx") or name[0] == "q"]
    A, B, C = A[numpy.ix_(kept, kept)], -B[kept], C[:, kept]  # the torque on the body is opposite to that on the wheel
    omega = numpy.geomspace(1e-2, 1e2, 20000)
    plant = response(A, B, C, D, omega)
    at, width, depth = 2 * numpy.pi * panel["frequency"], 0.7, 0.05
    notch = [1, 2 * depth * width * at, at * at], [1, 2 * width * at, at * at]
    # the derivative is filtered far above the loop
    law = [RATE_GAIN, GAIN], [0.01, 1]
    results = []
    for name, (top, bottom) in (("without a filter", law),
                                ("with a notch", (numpy.polymul(law[0], notch[0]), numpy.polymul(law[1], notch[1])))):
        s = 1j * omega
        loop = plant * numpy.polyval(top, s) / numpy.polyval(bottom, s) * numpy.exp(-s * DELAY)
        gain, phase = margins(loop)
        stable = is_stable(A, B, C, top, bottom)
        print(f"{name}: {'stable' if stable else 'unstable'}, gain margin {gain:.1f} dB, phase margin {phase:.1f} deg")
        results.append(stable)
    return 0 if results[-1] else 1


if __name__ == "__main__":
    sys.exit(main())
