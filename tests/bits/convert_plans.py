#!/usr/bin/env python3
"""convert_plans.py FILE.plan [RECORDING.log FINGERPRINT]: rewrites a saved plan of version 5 to 8 as version 9, number by number.

No number is computed anew, except for the checksum and the fingerprint. In the recording, FINGERPRINT, the
old one of the plan, is replaced by the new one. The script prints how many numbers it read and wrote, and how many
fingerprints it replaced.
"""

import ctypes
import struct
import sys

xxhash = ctypes.CDLL("libxxhash.so.0")
xxhash.XXH3_64bits.restype = ctypes.c_uint64
MAGIC = b"FFPLAN\r\n"
KINDS = ["spring", "bar", "beam", "matrix", "bending", "torsion", "plate", "rigid", "dashpot"]


def checksum(content):
    return xxhash.XXH3_64bits(bytes(content), ctypes.c_size_t(len(content)))


# d, i, q, Q, B: numbers; s: text; a list: a sequence; a tuple: an array; a name: a structure
D3, D4, D6, D9 = ("d", 3), ("d", 4), ("d", 6), ("d", 9)
LANE = ("d", 8)
LANES = [(name, LANE) for name in "c_qq c_qv l_qq l_qv w_q0 w_q1 c_vq c_vv l_vq l_vv w_v0 w_v1".split()]
OLD = {
    "Lanes": LANES,
    "Undamped": [field for field in LANES if field[0] not in ("c_vv", "l_vv")],
    "Propagator": [("lanes", ["Lanes"]), ("undamped", ["Undamped"])],
    "Feature": [("feature", "i"), ("is_left_out", "B"), ("count", "i"), ("why", "s"), ("error", "d"),
                ("relative_error", "d"), ("link_error", "d"), ("error_per_force", "d"),
                ("relative_error_per_force", "d"), ("link_error_per_force", "d")],
    "Scope": [("lacks_rotation", "B"), ("lacks_out_of_plane", "B"), ("normal_B", D3), ("R_WB", D9)],
    "Point": [("name", "s"), ("mass", "d"), ("r", D3), ("row", "i"), ("pushable", "B")],
    "Link": [("name", "s"), ("kind", "s"), ("points", ["i"])],
    "Group": [("name", "s"), ("points", ["i"]), ("mass", "d"), ("centre", D3), ("inverse_inertia", D9),
              ("torque_rank", "i"), ("line", D3)],
    "Particles": [("all", ["Point"]), ("of_groups", [["i"]]), ("attitude_points", ["i"]), ("rotation_rows", ["d"])],
    "TorqueSums": [("W", [D3]), ("B", [D3])],
    "WheelTorques": [("torque", ["d"])],
    "Sums": [("force_W", [D3]), ("force_B", [D3]), ("group_force_W", [D3]), ("group_torque_W", [D3]),
             ("group_force_B", [D3]), ("group_torque_B", [D3]), ("torque", "TorqueSums"), ("wheels", "WheelTorques")],
    "Pattern": [("force_W", D3), ("moment_W", ("d", 27)), ("has_world", "B"), ("num_direct", "i"),
                ("direct_row", ("i", 3)), ("direct_force_W", (D3, 3)), ("uses_table", "B"), ("table", ["d"]),
                ("force_B", D3), ("torque_B", D3), ("has_body", "B"), ("Q_B", ["d"]), ("sums", "Sums"),
                ("wheels", "WheelTorques")],
    "Follower": [("row", "i"), ("r", D3), ("force_B", D3), ("rotation_rows", ["d"])],
    "Torque": [("attitude_index", "i"), ("torque_B", D3)],
    "Torques": [("all", ["Torque"])],
    "Stiffening": [("modes", ["i"]), ("rows", ["d"])],
    "Feedback": [("name", "s"), ("row", "i"), ("r", D3), ("q_rows", ["d"]), ("q_dot_rows", ["d"]), ("Q_rows", ["d"])],
    "ModalCoupling": [("path", "i"), ("damping_rows", ["d"]), ("num_damping", "i"), ("modes", ["i"]),
                      ("columns", ["d"]), ("load_columns", ["d"]), ("num_impulses", "i"), ("impulse_q_rows", ["d"]),
                      ("impulse_q_dot_rows", ["d"]), ("impulse_out", ["d"])],
    "Bar": [("link", "i"), ("first", "i"), ("second", "i"), ("stiffness", "d"), ("damping", "d"), ("length", "d"),
            ("direction", D3)],
    "BodyRotation": [("first", "i"), ("count", "i"), ("centre", D3), ("offset", D3), ("rows", ["d"])],
    "Offset": [("mass", "d"), ("offset", D3), ("rows", ["d"])],
    "Kinetics": [("form", "i"), ("moments", ["d"]), ("num_tables", "i"), ("tables", ["d"]),
                 ("body_rotations", ["BodyRotation"]), ("offsets", ["Offset"])],
    "Coupled": [("functions", ["d"]), ("bars", ["Bar"]), ("substep_phase", "d"), ("num_substeps", "i"),
                ("kinetics", "Kinetics")],
    "Wheel": [("name", "s"), ("attitude_index", "i"), ("axis", D3), ("momentum", "d"), ("gyroscopic", ["d"])],
    "Wheels": [("all", ["Wheel"])],
    "Rung": [("rung", "i"), ("position", "d"), ("attitude", "d"), ("elastic", "d"), ("is_finite", "B"), ("meets", "B")],
    "Shadow": [("kind", "i"), ("substeps", "i"), ("plan", "Plan")],
    "History": [("name", "s"), ("kind", "i"), ("pulse_start", "d"), ("pulse_duration", "d"), ("start_tick", "q"),
                ("end_tick", "q"), ("frequency", "d"), ("phase", "d"), ("times", ["d"]), ("values", ["d"]),
                ("pattern", "Pattern"), ("followers", ["Follower"]), ("stiffening", "Stiffening"),
                ("torques", "Torques")],
    "LinkOutput": [("link", "i"), ("num_rows", "i"), ("first_row", "i"), ("first_rate_row", "i"),
                   ("first_load_row", "i")],
    "Initial": [("p_WB", D3), ("v_WB", D3), ("q_WB", D4), ("w_B", D3), ("q", ["d"]), ("q_dot", ["d"])],
    "Budget": [("horizon", "d"), ("horizon_ticks", "q"), ("shadows", ["Shadow"])],
    "CommandLimits": [("max_age", "d"), ("sender_share", "d"), ("max_hold", "d")],
    "Bodies": [("push_rows", ["d"]), ("inner_load", "d"), ("unquantified_factor", ["d"]), ("load_sizes", ["d"])],
    "Quartic": [("forms", ["d"])],
    "Named": [("links", ["i"]), ("left_out", ["i"]), ("left_out_frequency", ["d"])],
    "Unmodelled": [("is_known", "B"), ("is_rigid", "B"), ("has_unquantified", "B"), ("lacks_modes", "B"),
                   ("tolerance", "d"), ("fast_loads", ["i"]), ("num_judged", "i"), ("pairs", [("i", 2)]),
                   ("load_rows", ["d"]), ("rate_rows", ["d"]), ("spin_rows", ["d"]), ("coriolis_rows", ["d"]),
                   ("coriolis_transfer", ["d"]), ("spin_loads", ["d"]), ("spin_left_out", ["d"]),
                   ("root_quartic", ["d"]), ("num_shadowed", "i"), ("left_out", "d"), ("inertia_rows", ["d"]),
                   ("load_arms", ["d"]), ("shadow_rows", ["d"]), ("left_out_rows", ["d"]), ("left_out_spin", ["d"]),
                   ("bodies", "Bodies"), ("quartic", "Quartic"), ("named", "Named")],
    "Plan": [("name", "s"), ("scene_hash", "Q"), ("period", "d"), ("mass", "d"), ("rigid_freedoms", "i"), ("p_SB", D3),
             ("inertia", D9), ("inverse_inertia", D9), ("line", D3), ("gravity_W", D3), ("attractor_mu", "d"),
             ("attractor_W", D3), ("num_elastic", "i"), ("num_moving", "i"), ("num_padded", "i"), ("omega", ["d"]),
             ("decay", ["d"]), ("frequency_accuracy", "d"), ("conditioning", "d"), ("propagator", "Propagator"),
             ("modal_coupling", "ModalCoupling"), ("coupled", "Coupled"), ("fidelity", "i"), ("has_spin_load", "B"),
             ("field_rows", ["d"]), ("points", ["Point"]), ("links", ["Link"]), ("groups", ["Group"]),
             ("rows", ["d"]), ("eckart_rows", ["d"]), ("link_rows", ["d"]), ("link_outputs", ["LinkOutput"]),
             ("mechanisms", [["i"]]), ("histories", ["History"]), ("feedbacks", ["Feedback"]), ("force_limit", "d"),
             ("torque_limit", "d"), ("command_limits", "CommandLimits"), ("initial", "Initial"), ("state_rate", "d"),
             ("points_rate", "d"), ("loads_rate", "d"), ("status_rate", "d"), ("published_points", ["i"]),
             ("published_groups", ["i"]), ("has_damping", "B"), ("has_gravity", "B"), ("has_rotation", "B"),
             ("features", ["Feature"]), ("tolerance", "d"), ("horizon", "d"), ("mode_numbers", ["i"]),
             ("scope", "Scope"), ("fallback_modes", ["i"]), ("fallback", ["Plan"]), ("tried_rungs", ["Rung"]),
             ("budget", "Budget"), ("unmodelled", "Unmodelled"), ("particles", "Particles"), ("wheels", "Wheels")],
}
# structures that old versions lack, and the first version that has them
SINCE = {"Unmodelled": 6, "Stiffening": 6, "Particles": 7, "Bodies": 7, "Quartic": 7, "TorqueSums": 7, "Wheels": 7,
         "WheelTorques": 7, "Torques": 7, "Kinetics": 7, "Named": 8}
LIMITS = {"max_age": 1.0, "sender_share": 0.25, "max_hold": 60.0}


class Reader:
    def __init__(self, content, version):
        self.content, self.version, self.at, self.numbers = content, version, 0, 0

    def read(self, kind):
        if isinstance(kind, list):
            return [self.read(kind[0]) for _ in range(self.read("count"))]
        if isinstance(kind, tuple):
            return [self.read(kind[0]) for _ in range(kind[1])]
        if kind == "s":
            size = self.read("count")
            self.at += size
            return self.content[self.at - size:self.at]
        if kind in OLD:
            return self.structure(kind)
        size = {"d": 8, "i": 4, "q": 8, "Q": 8, "B": 1, "count": 8}[kind]
        value = bytes(self.content[self.at:self.at + size])  # numbers stay bytes, so no bit can change
        assert len(value) == size
        self.at += size
        if kind == "count":
            return struct.unpack("<Q", value)[0]
        self.numbers += 1
        return value

    def structure(self, kind):
        if kind == "CommandLimits" and self.version < 8:
            limits = {name: struct.pack("<d", value) for name, value in LIMITS.items()}
            if self.version >= 6:
                limits["max_age"], limits["sender_share"] = self.read("d"), self.read("d")
            return limits
        if self.version < SINCE.get(kind, 0):
            return {name: self.empty(of) for name, of in OLD[kind]}
        return {name: self.read(of) for name, of in OLD[kind]}

    def empty(self, kind):
        if isinstance(kind, list):
            return []
        if isinstance(kind, tuple):
            return [self.empty(kind[0]) for _ in range(kind[1])]
        if kind in OLD:
            return {name: self.empty(of) for name, of in OLD[kind]}
        return bytes({"d": 8, "i": 4, "q": 8, "Q": 8, "B": 1}[kind])


def count(values):
    return struct.pack("<Q", len(values))


class Writer:
    def __init__(self):
        self.bytes, self.numbers = bytearray(), 0

    def write(self, value, kind):
        if isinstance(kind, (list, tuple)):
            if isinstance(kind, list):
                self.bytes += count(value)
            for each in value:
                self.write(each, kind[0])
        elif kind == "s":
            self.bytes += count(value) + value
        elif kind in NEW:
            for name, of in NEW[kind]:
                self.write(value[name], of)
        else:
            self.bytes += value
            self.numbers += 1


def split(names):
    """Returns fields of the old plan by their names."""
    fields = dict(OLD["Plan"])
    return [(name, fields[name]) for name in names.split()]


NEW = {name: fields for name, fields in OLD.items() if name not in
       ("TorqueSums", "WheelTorques", "Torques", "Wheels", "Quartic", "Plan")}
NEW["Link"] = [("name", "s"), ("type", "i"), ("points", ["i"])]
NEW["Sums"] = OLD["Sums"][:6] + [("torque_W", [D3]), ("torque_B", [D3]), ("wheel_torques", ["d"])]
NEW["Pattern"] = OLD["Pattern"][:-1] + [("wheel_torques", ["d"])]
NEW["History"] = OLD["History"][:-1] + [("torques", ["Torque"])]
NEW["Wheel"] = OLD["Wheel"][:-1]
NEW["Unmodelled"] = OLD["Unmodelled"][:-2] + [("quartic_forms", ["d"]), ("gyroscopic", ["d"]),
                                              ("error_per_force", "d"), ("named", "Named")]
NEW["Shadow"] = OLD["Shadow"][:-1] + [("plan", "StepPlan")]
NEW["StepPlan"] = (
    split("mass rigid_freedoms p_SB inertia inverse_inertia line gravity_W attractor_mu attractor_W has_gravity "
          "has_rotation")
    + split("num_elastic num_moving num_padded omega decay has_damping propagator modal_coupling coupled mode_numbers "
            "mechanisms")
    + split("has_spin_load field_rows histories feedbacks scope")
    + split("points links groups particles") + [("wheels", ["Wheel"])]
    + split("rows eckart_rows link_rows link_outputs")
    + split("period fidelity initial") + [("fallback", ["StepPlan"]), ("fallback_modes", ["i"])])
SERVICE = split("state_rate points_rate loads_rate status_rate published_points published_groups force_limit "
                "torque_limit")
NEW["Fingerprinted"] = split("name scene_hash") + NEW["StepPlan"] + SERVICE
NEW["Rest"] = (split("command_limits unmodelled") + [("fallback_unmodelled", ["Unmodelled"])]
               + split("budget features tolerance horizon tried_rungs frequency_accuracy conditioning"))


def rename(plan):
    """Changes a plan in place to the names and places of version 9."""
    for link in plan["links"]:
        link["type"] = struct.pack("<i", KINDS.index(link["kind"].decode()))
    for history in plan["histories"]:
        pattern = history["pattern"]
        pattern["wheel_torques"] = pattern["wheels"]["torque"]
        sums = pattern["sums"]
        sums["torque_W"], sums["torque_B"] = sums["torque"]["W"], sums["torque"]["B"]
        sums["wheel_torques"] = sums["wheels"]["torque"]
        history["torques"] = history["torques"]["all"]
    plan["wheels"] = plan["wheels"]["all"]
    unmodelled = plan["unmodelled"]
    unmodelled["quartic_forms"] = unmodelled["quartic"]["forms"]
    unmodelled["gyroscopic"] = [value for wheel in plan["wheels"] for value in wheel["gyroscopic"]]
    errors = [feature["error_per_force"] for feature in plan["features"]] or [bytes(8)]
    unmodelled["error_per_force"] = max(errors, key=lambda value: struct.unpack("<d", value)[0])
    for fallback in plan["fallback"]:
        rename(fallback)
    plan["fallback_unmodelled"] = [fallback["unmodelled"] for fallback in plan["fallback"]]
    for shadow in plan["budget"]["shadows"]:
        rename(shadow["plan"])


def main():
    path = sys.argv[1]
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == MAGIC
    version, length, check = struct.unpack("<IQQ", data[8:28])
    content = data[28:]
    assert 5 <= version <= 8 and len(content) == length and checksum(content) == check
    reader = Reader(content, version)
    plan = reader.read("Plan")
    assert reader.at == len(content), "bytes are left"
    rename(plan)
    writer = Writer()
    writer.write(plan, "Fingerprinted")
    fingerprint = checksum(writer.bytes)
    writer.write(plan, "Rest")
    with open(path, "wb") as file:
        file.write(MAGIC + struct.pack("<IQQ", 9, len(writer.bytes), checksum(writer.bytes)) + writer.bytes)
    print(f"{path}: version {version} to 9, {reader.numbers} numbers read, {writer.numbers} written, "
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
