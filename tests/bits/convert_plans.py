#!/usr/bin/env python3
"""convert_plans.py FILE.plan [RECORDING.log FINGERPRINT]: rewrites a saved plan of version 14 as version 15.

No number is computed anew, except for the checksum. The tables of the former verdict and error budget, which version 15 does
not have, are left out, and the verdict is off; the tolerance is kept. The fingerprint does not change, because it does not
cover the verdict. In the recording, FINGERPRINT, an old one of the plan, is replaced by the new one.
The script prints how many numbers it read, and how many fingerprints it replaced.
"""

import ctypes
import struct
import sys

xxhash = ctypes.CDLL("libxxhash.so.0")
xxhash.XXH3_64bits.restype = ctypes.c_uint64
MAGIC = b"FFPLAN\r\n"


def checksum(content):
    return xxhash.XXH3_64bits(bytes(content), ctypes.c_size_t(len(content)))


# d, i, q, Q, B: numbers; s: text; a list: a sequence; a tuple: an array; a name: a structure
D3, D4, D9 = ("d", 3), ("d", 4), ("d", 9)
LANE = ("d", 8)
LANES = [(name, LANE) for name in "c_qq c_qv l_qq l_qv w_q0 w_q1 c_vq c_vv l_vq l_vv w_v0 w_v1".split()]
FIELDS = {
    "Lanes": LANES,
    "Undamped": [field for field in LANES if field[0] not in ("c_vv", "l_vv")],
    "Propagator": [("lanes", ["Lanes"]), ("undamped", ["Undamped"])],
    "Feature": [("feature", "i"), ("is_left_out", "B"), ("count", "i"), ("why", "s"), ("error", "d"),
                ("relative_error", "d"), ("link_error", "d"), ("error_per_force", "d"),
                ("relative_error_per_force", "d"), ("link_error_per_force", "d")],
    "Scope": [("lacks_rotation", "B"), ("lacks_out_of_plane", "B"), ("normal_B", D3), ("R_WB", D9)],
    "Point": [("name", "s"), ("mass", "d"), ("r", D3), ("row", "i"), ("pushable", "B")],
    "Link": [("name", "s"), ("type", "i"), ("points", ["i"])],
    "Group": [("name", "s"), ("points", ["i"]), ("mass", "d"), ("centre", D3), ("inverse_inertia", D9),
              ("torque_rank", "i"), ("line", D3)],
    "Particles": [("all", ["Point"]), ("of_groups", [["i"]]), ("attitude_points", ["i"]), ("rotation_rows", ["d"])],
    "Sums": [("force_W", [D3]), ("force_B", [D3]), ("group_force_W", [D3]), ("group_torque_W", [D3]),
             ("group_force_B", [D3]), ("group_torque_B", [D3]), ("torque_W", [D3]), ("torque_B", [D3]),
             ("wheel_torques", ["d"])],
    "Pattern": [("force_W", D3), ("moment_W", ("d", 27)), ("has_world", "B"), ("num_direct", "i"),
                ("direct_row", ("i", 3)), ("direct_force_W", (D3, 3)), ("uses_table", "B"), ("table", ["d"]),
                ("force_B", D3), ("torque_B", D3), ("has_body", "B"), ("Q_B", ["d"]), ("sums", "Sums"),
                ("wheel_torques", ["d"])],
    "Follower": [("row", "i"), ("r", D3), ("force_B", D3), ("rotation_rows", ["d"]),
                 ("neighbours", ["Neighbour"])],
    "Neighbour": [("point", "i"), ("turn", D9)],
    "Torque": [("attitude_index", "i"), ("torque_B", D3)],
    "Stiffening": [("modes", ["i"]), ("components", ["i"]), ("rows", ["d"]), ("shares", ["d"])],
    "Feedback": [("name", "s"), ("row", "i"), ("r", D3), ("q_rows", ["d"]), ("q_dot_rows", ["d"]), ("Q_rows", ["d"])],
    "ModalCoupling": [("path", "i"), ("damping_rows", ["d"]), ("num_damping", "i"), ("modes", ["i"]),
                      ("columns", ["d"]), ("load_columns", ["d"]), ("num_impulses", "i"), ("impulse_q_rows", ["d"]),
                      ("impulse_q_dot_rows", ["d"]), ("impulse_out", ["d"])],
    "Bar": [("link", "i"), ("first", "i"), ("second", "i"), ("stiffness", "d"), ("damping", "d"), ("length", "d"),
            ("direction", D3)],
    "BodyRotation": [("first", "i"), ("count", "i"), ("point", "i"), ("centre", D3), ("offset", D3), ("rows", ["d"])],
    "Offset": [("mass", "d"), ("offset", D3), ("rows", ["d"])],
    "Kinetics": [("form", "i"), ("moments", ["d"]), ("num_tables", "i"), ("tables", ["d"]),
                 ("body_rotations", ["BodyRotation"]), ("offsets", ["Offset"])],
    "BeamConstants": [("scalars", ("d", 3)), ("symmetric", ("d", 2)), ("antisymmetric", ("d", 2)), ("shear", ("d", 2)),
                      ("skew_bow", ("d", 2))],
    "PlateConstants": [("axis_x", D3), ("axis_y", D3), ("first", D3), ("second", D3), ("gradients", ("d", 6)),
                       ("membrane", D3), ("bending", ("d", 81)), ("curvature", ("d", 27))],
    "AngleConstants": [("form", "i"), ("stiffness", "d"), ("rest", ("d", 2))],
    "LinkEnd": [("joint", "i"), ("released", ("i", 3))],
    "TrueBeam": [("link", "i"), ("points", ("i", 2)), ("ends", ("LinkEnd", 2)), ("span", D3), ("axes", D9),
                 ("constants", "BeamConstants")],
    "TruePlate": [("link", "i"), ("points", ("i", 3)), ("ends", ("LinkEnd", 3)), ("axes", D9),
                  ("constants", "PlateConstants")],
    "TrueAngle": [("link", "i"), ("points", ("i", 4)), ("constants", "AngleConstants"), ("num_rows", "i"),
                  ("rows", ("d", 24)), ("sign", "d")],
    "MatrixConstants": [("has_rotations", "B"), ("stiffness", ["d"]), ("arms", [D3]), ("inverse", D9), ("line", D3),
                        ("turn_weight", "d")],
    "TrueMatrix": [("link", "i"), ("points", ["i"]), ("ends", ["LinkEnd"]), ("constants", "MatrixConstants")],
    "Joints": [("num_joints", "i"), ("num_rotations", "i"), ("of_points", ["i"]), ("rows", ["d"]), ("order", ["i"]),
               ("starts", ["i"]), ("below", ["i"]), ("lower", ["d"]), ("inverse_pivots", ["d"]), ("idle", ["d"])],
    "TrueLinks": [("beams", ["TrueBeam"]), ("plates", ["TruePlate"]), ("angles", ["TrueAngle"]), ("matrices", ["TrueMatrix"]),
                  ("joints", "Joints")],
    "RigidBody": [("mass", "d"), ("centre", D3), ("inertia", D9), ("rows", ["d"]), ("first", "i"), ("count", "i")],
    "Turning": [("bodies", ["RigidBody"]), ("points", ["i"]), ("of_points", ["i"]), ("of_carriers", ["i"]),
                ("of_attitudes", ["i"])],
    "CurveLink": [("points", ("i", 2)), ("joints", ("i", 2)), ("direction", D3), ("length", "d"), ("skew_bow", "d")],
    "CurvePlate": [("points", ("i", 3)), ("gradients", ("d", 6))],
    "Curve": [("links", ["CurveLink"]), ("plates", ["CurvePlate"]), ("modes", ["i"]), ("is_axial", ["B"]),
              ("weights", ["d"]), ("stiff", ["i"]), ("is_filtered", "B"), ("filter", ["d"])],
    "JointState": [("rotation", [D4]), ("angle", ["d"])],
    "Coupled": [("functions", ["d"]), ("bars", ["Bar"]), ("links", "TrueLinks"), ("turning", "Turning"),
                ("curve", "Curve"), ("strain_times", ["d"]), ("damps_true_strains", "B"), ("beta", "d"),
                ("substep_phase", "d"), ("num_substeps", "i"),
                ("kinetics", "Kinetics")],
    "Wheel": [("name", "s"), ("attitude_index", "i"), ("axis", D3), ("momentum", "d")],
    "Rung": [("rung", "i"), ("position", "d"), ("attitude", "d"), ("elastic", "d"), ("is_finite", "B"),
             ("meets", "B")],
    "Shadow": [("kind", "i"), ("substeps", "i"), ("plan", "StepPlan")],
    "History": [("name", "s"), ("kind", "i"), ("pulse_start", "d"), ("pulse_duration", "d"), ("start_tick", "q"),
                ("end_tick", "q"), ("frequency", "d"), ("phase", "d"), ("times", ["d"]), ("values", ["d"]),
                ("pattern", "Pattern"), ("followers", ["Follower"]), ("stiffening", "Stiffening"),
                ("torques", ["Torque"])],
    "LinkOutput": [("link", "i"), ("num_rows", "i"), ("first_row", "i"), ("first_rate_row", "i"),
                   ("first_load_row", "i")],
    "Initial": [("p_WB", D3), ("v_WB", D3), ("q_WB", D4), ("w_B", D3), ("q", ["d"]), ("q_dot", ["d"]),
                ("joints", "JointState")],
    "Budget": [("horizon", "d"), ("horizon_ticks", "q"), ("shadows", ["Shadow"])],
    "CommandLimits": [("max_age", "d"), ("sender_share", "d"), ("max_hold", "d")],
    "Bodies": [("push_rows", ["d"]), ("inner_load", "d"), ("unquantified_factor", ["d"]), ("load_sizes", ["d"])],
    "Named": [("links", ["i"]), ("left_out", ["i"]), ("left_out_frequency", ["d"])],
    "Unmodelled": [("is_known", "B"), ("is_rigid", "B"), ("has_unquantified", "B"), ("lacks_modes", "B"),
                   ("tolerance", "d"), ("fast_loads", ["i"]), ("num_judged", "i"), ("pairs", [("i", 2)]),
                   ("load_rows", ["d"]), ("rate_rows", ["d"]), ("spin_rows", ["d"]), ("coriolis_rows", ["d"]),
                   ("coriolis_transfer", ["d"]), ("spin_loads", ["d"]), ("spin_left_out", ["d"]),
                   ("root_quartic", ["d"]), ("num_shadowed", "i"), ("left_out", "d"), ("inertia_rows", ["d"]),
                   ("load_arms", ["d"]), ("shadow_rows", ["d"]), ("left_out_rows", ["d"]), ("left_out_spin", ["d"]),
                   ("bodies", "Bodies"), ("quartic_forms", ["d"]), ("gyroscopic", ["d"]), ("error_per_force", "d"),
                   ("named", "Named"), ("stiffened_rows", ["d"])],
    "StepPlan": [("mass", "d"), ("rigid_freedoms", "i"), ("p_SB", D3), ("inertia", D9), ("inverse_inertia", D9),
                 ("line", D3), ("gravity_W", D3), ("attractor_mu", "d"), ("attractor_W", D3), ("has_gravity", "B"),
                 ("has_rotation", "B"), ("num_elastic", "i"), ("num_moving", "i"), ("num_padded", "i"),
                 ("omega", ["d"]), ("decay", ["d"]), ("has_damping", "B"), ("propagator", "Propagator"),
                 ("modal_coupling", "ModalCoupling"), ("coupled", "Coupled"), ("mode_numbers", ["i"]),
                 ("mechanisms", [["i"]]), ("has_spin_load", "B"), ("field_rows", ["d"]),
                 ("field_stiffening", "Stiffening"), ("command_stiffening", "Stiffening"), ("histories", ["History"]),
                 ("feedbacks", ["Feedback"]), ("scope", "Scope"), ("points", ["Point"]), ("links", ["Link"]),
                 ("groups", ["Group"]), ("particles", "Particles"), ("wheels", ["Wheel"]), ("rows", ["d"]),
                 ("eckart_rows", ["d"]), ("link_rows", ["d"]), ("link_outputs", ["LinkOutput"]), ("period", "d"),
                 ("fidelity", "i"), ("initial", "Initial"), ("fallback", ["StepPlan"]), ("fallback_modes", ["i"])],
}
SERVICE = [("state_rate", "d"), ("points_rate", "d"), ("loads_rate", "d"), ("status_rate", "d"),
           ("published_points", ["i"]), ("published_groups", ["i"]), ("force_limit", "d"), ("torque_limit", "d")]
REST = [("command_limits", "CommandLimits"), ("unmodelled", "Unmodelled"), ("fallback_unmodelled", ["Unmodelled"]),
        ("budget", "Budget"), ("features", ["Feature"]), ("tolerance", "d"), ("horizon", "d"),
        ("tried_rungs", ["Rung"]), ("frequency_accuracy", "d"), ("conditioning", "d")]
FIELDS["Fingerprinted"] = [("name", "s"), ("scene_hash", "Q")] + FIELDS["StepPlan"] + SERVICE
FIELDS["Rest"] = REST
# members that version 15 does not have
DROPPED = ("unmodelled", "fallback_unmodelled", "budget")


def verdict_that_is_off(tolerance):
    """Returns is_off, horizon, share, longest_step, shadows, tolerance, shared, shared_text, fast_loads and lowest_omega."""
    return struct.pack("<BdddQdiQQd", 1, 0.0, 0.2, 0.0, 0, tolerance, 0, 0, 0, 0.0)


class Converter:
    """Copies a plan, and replaces what is new."""

    def __init__(self, content):
        self.content, self.at, self.out, self.numbers, self.tolerance = content, 0, bytearray(), 0, 0.0

    def take(self, size):
        value = bytes(self.content[self.at:self.at + size])
        assert len(value) == size
        self.at += size
        self.out += value
        return value

    def count(self):
        return struct.unpack("<Q", self.take(8))[0]

    def copy(self, kind):
        if isinstance(kind, list):
            for _ in range(self.count()):
                self.copy(kind[0])
        elif isinstance(kind, tuple):
            for _ in range(kind[1]):
                self.copy(kind[0])
        elif kind == "none":
            assert self.count() == 0, "plans with such members are compiled again"
        elif kind == "s":
            self.take(self.count())
        elif kind in FIELDS:
            for name, of in FIELDS[kind]:
                start = len(self.out)
                if kind == "Unmodelled" and name == "tolerance":
                    self.tolerance = struct.unpack_from("<d", self.content, self.at)[0]
                self.copy(of)
                if name in DROPPED:
                    del self.out[start:]
                if name == "budget":
                    self.out += verdict_that_is_off(self.tolerance)
        else:
            self.take({"d": 8, "i": 4, "q": 8, "Q": 8, "B": 1}[kind])
            self.numbers += 1


def main():
    path = sys.argv[1]
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == MAGIC
    version, length, check = struct.unpack("<IQQ", data[8:28])
    content = data[28:]
    assert version == 14 and len(content) == length and checksum(content) == check
    converter = Converter(content)
    converter.copy("Fingerprinted")
    fingerprint = checksum(converter.out)
    converter.copy("Rest")
    assert converter.at == len(content), "bytes are left"
    with open(path, "wb") as file:
        file.write(MAGIC + struct.pack("<IQQ", 15, len(converter.out), checksum(converter.out)) + converter.out)
    print(f"{path}: version 14 to 15, {converter.numbers} numbers read, {length - len(converter.out)} bytes left out, "
          f"fingerprint {fingerprint:016x}")
    if len(sys.argv) == 4:
        old, new = struct.pack(">Q", int(sys.argv[3], 16)), struct.pack(">Q", fingerprint)
        with open(sys.argv[2], "rb") as file:
            log = file.read()
        with open(sys.argv[2], "wb") as file:
            file.write(log.replace(old, new))
        print(f"{sys.argv[2]}: {log.count(old)} fingerprints replaced")


if __name__ == "__main__":
    main()
