#!/usr/bin/env python3
"""convert_plans.py FILE.plan [RECORDING.log FINGERPRINT]: rewrites a saved plan of version 15 as version 16.

No number is computed anew, except for the checksum. Version 16 adds the integration of points, which the plans do not have.
The fingerprint covers it, so it changes. In the recording, FINGERPRINT, an old one of the plan, is replaced by the new one.
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
    "ShadowModes": [("numbers", ["i"]), ("projection", ["d"])],
    "Shadow": [("plan", "StepPlan"), ("ticks", "i"), ("substeps", "i"), ("horizon_ticks", "q"), ("every", "q"),
               ("delay_ticks", "q"), ("modes", ("ShadowModes", 2))],
    "Verdict": [("is_off", "B"), ("horizon", "d"), ("share", "d"), ("longest_step", "d"), ("shadows", ["Shadow"]),
                ("tolerance", "d"), ("shared", "i"), ("shared_text", "s"), ("fast_loads", ["i"]), ("lowest_omega", "d")],
    "History": [("name", "s"), ("kind", "i"), ("pulse_start", "d"), ("pulse_duration", "d"), ("start_tick", "q"),
                ("end_tick", "q"), ("frequency", "d"), ("phase", "d"), ("times", ["d"]), ("values", ["d"]),
                ("pattern", "Pattern"), ("followers", ["Follower"]), ("stiffening", "Stiffening"),
                ("torques", ["Torque"])],
    "LinkOutput": [("link", "i"), ("num_rows", "i"), ("first_row", "i"), ("first_rate_row", "i"),
                   ("first_load_row", "i")],
    "Initial": [("p_WB", D3), ("v_WB", D3), ("q_WB", D4), ("w_B", D3), ("q", ["d"]), ("q_dot", ["d"]),
                ("joints", "JointState")],
    "CommandLimits": [("max_age", "d"), ("sender_share", "d"), ("max_hold", "d")],
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
REST = [("command_limits", "CommandLimits"), ("verdict", "Verdict"), ("features", ["Feature"]), ("tolerance", "d"),
        ("horizon", "d"), ("tried_rungs", ["Rung"]), ("frequency_accuracy", "d"), ("conditioning", "d")]
FIELDS["Fingerprinted"] = [("name", "s"), ("scene_hash", "Q")] + FIELDS["StepPlan"] + SERVICE
FIELDS["Rest"] = REST
# The bytes that version 16 adds, each after a member of version 15. After fallback_modes: steps, ticks, pieces, columns,
# accuracy, eight empty sequences, noise, resolved, starts, spacing, num_nodes and weights of PlanPoints. After tried_rungs:
# why_modes, on_modes, on_points and after_change of PlanIntegration
ADDED = {"fallback_modes": struct.pack("<iiiid8QddQiiQ", 0, 1, 1, 2, 0.0, *[0] * 8, 0.0, 0.0, 0, 1, 0, 0),
         "tried_rungs": struct.pack("<Qddd", 0, 0.0, 0.0, 0.0)}


class Converter:
    """Copies a plan, and replaces what is new."""

    def __init__(self, content):
        self.content, self.at, self.out, self.numbers = content, 0, bytearray(), 0

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
        elif kind == "s":
            self.take(self.count())
        elif kind in FIELDS:
            for name, of in FIELDS[kind]:
                self.copy(of)
                self.out += ADDED.get(name, b"")
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
    assert version == 15 and len(content) == length and checksum(content) == check
    converter = Converter(content)
    converter.copy("Fingerprinted")
    fingerprint = checksum(converter.out)
    converter.copy("Rest")
    assert converter.at == len(content), "bytes are left"
    with open(path, "wb") as file:
        file.write(MAGIC + struct.pack("<IQQ", 16, len(converter.out), checksum(converter.out)) + converter.out)
    print(f"{path}: version 15 to 16, {converter.numbers} numbers read, {len(converter.out) - length} bytes added, "
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
