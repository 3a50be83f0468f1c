"""Points the satellite with its two wheels: a proportional and derivative law about the axes x and z of the body."""

from freeflex import blocks

WHEELS = {"spin_x": (0, 64.0, 720.0), "spin_z": (2, 64.0, 720.0)}  # axis, gain [N m/rad], gain [N m s/rad]


def make(case):
    tracker = blocks.Noise(case, sensor=1, sd=2e-5)
    gyro = blocks.Noise(case, sensor=2, sd=2e-5)
    late = blocks.Delay(case.parameters["delay"])
    wheel = blocks.Wheel(max_torque=0.2, max_momentum=12.0)
    gain = case.parameters["gain"]
    order = case.plan.wheels

    def control(state):
        w, *v = state.attitude
        angles = tracker([2.0 * x / w for x in v])
        angles, spin = late(state.time, (angles, gyro(state.angular_velocity)))
        torques = {}
        for name, (axis, by_angle, by_spin) in WHEELS.items():
            # the torque on the wheel is opposite to that on the body
            wanted = gain * (by_angle * angles[axis] + by_spin * spin[axis])
            torques[name] = wheel(wanted, state.wheel_momentum[order[name]])
        return {"wheels": torques, "lease": 1.0}

    return control
