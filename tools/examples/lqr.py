"""lqr.py SCENE|bus: damps the panels of the satellite with a linear-quadratic regulator for its wheels.

Makes a linear model of service/scenes/satellite.yaml with `freeflex export`, designs the regulator with scipy, and runs it
on a motion in this process or, with `bus`, on a running daemon (then SCENE in the environment names its scene). The wheels
reach the modes of the model. Others, such as the symmetric flapping that the scene's thruster excites, decay by their own
damping. Exit codes: 0 if the rotation and the modes of the model come to rest within 120 s, 1 if not. Needs numpy and scipy
(python3-scipy).
"""

import os
import subprocess
import sys
import tempfile

import numpy
import scipy.linalg

import freeflex

WHEELS = ("spin_z", "spin_x")
PERIOD = 0.05  # [s] of the controller
TORQUE = 0.2  # [N m] largest of a motor


def export_model(scene, outputs, modes):
    """Returns A, B, C and the names of the states, of a model with the modes that the wheels move most."""
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "model.npz")
        subprocess.run([os.environ.get("FREEFLEX", "freeflex"), "export", scene, "--state-space", file,
                        "--in", ",".join(f"wheel.{name}.torque" for name in WHEELS), "--out", outputs,
                        "--modes", str(modes)], check=True, stdout=subprocess.DEVNULL)
        with numpy.load(file) as read:
            return read["A"], read["B"], read["C"], list(read["states"])


def design(scene):
    """Returns the gains, and the names of the states that they multiply."""
    A, B, _, states = export_model(scene, "rz,rx,point.l41.d", modes=4)
    # position and the rotation about y are not controlled, and the momenta of the wheels follow from the rest
    kept = [k for k, name in enumerate(states) if name in ("rx", "rz", "wx", "wz") or name[0] == "q"]
    A, B = A[numpy.ix_(kept, kept)], B[kept]
    states = [states[k] for k in kept]
    cost = {"rx": 1e2, "rz": 1e2, "wx": 1e3, "wz": 1e3}
    Q = numpy.diag([cost.get(name, 1e5) for name in states])
    P = scipy.linalg.solve_continuous_are(A, B, Q, 10.0 * numpy.eye(B.shape[1]))
    gains = B.T @ P / 10.0
    slowest = max(numpy.linalg.eigvals(A - B @ gains).real)
    print(f"{len(states)} states; the slowest closed-loop motion decays with {-slowest:.3g} 1/s")
    return gains, states


def read_states(state, names):
    """Returns the numbers of the model's states from a State."""
    w, *v = state.attitude
    at = {"rx": 2.0 * v[0] / w, "rz": 2.0 * v[2] / w, "wx": state.angular_velocity[0], "wz": state.angular_velocity[2]}
    for name in names:
        if name.startswith("q_dot"):
            at[name] = state.q_dot[int(name[5:]) - 1]
        elif name.startswith("q"):
            at[name] = state.q[int(name[1:]) - 1]
    return numpy.array([at[name] for name in names])


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    where = sys.argv[1]
    scene = os.environ.get("SCENE", "service/scenes/satellite.yaml") if where == "bus" else where
    gains, names = design(scene)
    speeds = []

    def control(state):
        x = read_states(state, names)
        speeds.append(max(abs(rate) for name, rate in zip(names, x) if name.startswith("q_dot")))
        torques = numpy.clip(-gains @ x, -TORQUE, TORQUE)
        return {"wheels": dict(zip(WHEELS, map(float, torques))), "lease": 1.0}

    owner = freeflex.connect() if where == "bus" else freeflex.Plan(where).motion()
    state = freeflex.control(owner, control, every=PERIOD, until=120.0)
    turned, largest = numpy.abs(read_states(state, ("rx", "rz"))).max(), max(speeds)
    passive = freeflex.Plan(scene).motion()
    left = read_states(passive.step(round(120.0 / PERIOD) * round(PERIOD * passive.plan.rate)), names)
    print(f"largest modal speed {largest:.3g} m/s, at the end {speeds[-1]:.3g} m/s; turned by {turned:.3g} rad")
    alone = max(abs(rate) for name, rate in zip(names, left) if name.startswith("q_dot"))
    print(f"without the regulator {alone:.3g} m/s at the end")
    return 0 if speeds[-1] < 0.01 * largest and turned < 1e-3 else 1


if __name__ == "__main__":
    sys.exit(main())
