// Conversion of a plan to bytes and back. One list of fields serves for writing and reading.
#include "core/plan/file/plan_bytes.hpp"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <type_traits>

#include "core/step/rigid/principal.hpp"

namespace freeflex {
namespace {

// "FFPLAN" and two bytes that text-mode transfers change
constexpr std::array<char, 8> kMagic{'F', 'F', 'P', 'L', 'A', 'N', '\r', '\n'};
static_assert(std::string_view(kMagic.data(), kMagic.size()).starts_with(kPlanMark));
constexpr std::uint32_t kVersion = 16;
constexpr std::size_t kHeaderSize = 8 + 4 + 8 + 8;  // magic, version, content length, checksum

// T is U or const U
template <typename T, typename U>
concept Is = std::is_same_v<std::remove_const_t<T>, U>;

// Converts to any type. Used to count the members of an aggregate.
struct Anything {
  template <typename T>
  operator T() const;
};

// Returns the number of members of an aggregate. This is the largest number of values that can initialise the
// aggregate.
template <typename T, typename... Values>
consteval std::size_t num_members() {
  if constexpr (requires { T{Values{}..., Anything{}}; })
    return num_members<T, Values..., Anything>();
  else
    return sizeof...(Values);
}

// Returns a base of a plan, with the constness of the plan.
template <typename Base, typename T>
auto& part(T& plan) {
  if constexpr (std::is_const_v<T>)
    return static_cast<const Base&>(plan);
  else
    return static_cast<Base&>(plan);
}

// Writes or reads all members of T, in the order of the file. Does not compile if a member is missing.
template <typename T, typename Archive, typename... Fields>
void all_of(Archive& archive, Fields&... fields) {
  static_assert(sizeof...(Fields) == num_members<T>(), "a member is missing from the file or is in it twice");
  (archive(fields), ...);
}

template <typename Archive, Is<Propagator::Lanes> T>
void fields(Archive& archive, T& p) {
  all_of<Propagator::Lanes>(archive, p.c_qq, p.c_qv, p.l_qq, p.l_qv, p.w_q0, p.w_q1, p.c_vq, p.c_vv, p.l_vq,
                            p.l_vv, p.w_v0, p.w_v1);
}

template <typename Archive, Is<Propagator::UndampedLanes> T>
void fields(Archive& archive, T& p) {
  all_of<Propagator::UndampedLanes>(archive, p.c_qq, p.c_qv, p.l_qq, p.l_qv, p.w_q0, p.w_q1, p.c_vq, p.l_vq,
                                    p.w_v0, p.w_v1);
}

template <typename Archive, Is<Propagator> T>
void fields(Archive& archive, T& p) {
  all_of<Propagator>(archive, p.lanes, p.undamped);
}

template <typename Archive, Is<PlanFeature> T>
void fields(Archive& archive, T& p) {
  all_of<PlanFeature>(archive, p.feature, p.is_left_out, p.count, p.why, p.error, p.relative_error,
                      p.link_error, p.error_per_force, p.relative_error_per_force, p.link_error_per_force);
}

template <typename Archive, Is<CommandScope> T>
void fields(Archive& archive, T& s) {
  all_of<CommandScope>(archive, s.lacks_rotation, s.lacks_out_of_plane, s.normal_B, s.R_WB);
}

template <typename Archive, Is<PlanPoint> T>
void fields(Archive& archive, T& p) {
  all_of<PlanPoint>(archive, p.name, p.mass, p.r, p.row, p.pushable);
}

template <typename Archive, Is<PlanLink> T>
void fields(Archive& archive, T& l) {
  all_of<PlanLink>(archive, l.name, l.type, l.points);
}

template <typename Archive, Is<PlanGroup> T>
void fields(Archive& archive, T& g) {
  all_of<PlanGroup>(archive, g.name, g.points, g.mass, g.centre, g.inverse_inertia, g.torque_rank, g.line);
}

template <typename Archive, Is<PlanParticles> T>
void fields(Archive& archive, T& p) {
  all_of<PlanParticles>(archive, p.all, p.of_groups, p.attitude_points, p.rotation_rows);
}

template <typename Archive, Is<LoadPattern> T>
void fields(Archive& archive, T& p) {
  all_of<LoadPattern>(archive, p.force_W, p.moment_W, p.has_world, p.num_direct, p.direct_row,
                      p.direct_force_W, p.uses_table, p.table, p.force_B, p.torque_B, p.has_body, p.Q_B,
                      p.sums, p.wheel_torques);
}

template <typename Archive, Is<PlanFollower::Neighbour> T>
void fields(Archive& archive, T& n) {
  all_of<PlanFollower::Neighbour>(archive, n.point, n.turn);
}

template <typename Archive, Is<PlanFollower> T>
void fields(Archive& archive, T& f) {
  all_of<PlanFollower>(archive, f.row, f.r, f.force_B, f.rotation_rows, f.neighbours);
}

template <typename Archive, Is<PlanFeedback> T>
void fields(Archive& archive, T& f) {
  all_of<PlanFeedback>(archive, f.name, f.row, f.r, f.q_rows, f.q_dot_rows, f.Q_rows);
}

template <typename Archive, Is<PlanModalCoupling> T>
void fields(Archive& archive, T& c) {
  all_of<PlanModalCoupling>(archive, c.path, c.damping_rows, c.num_damping, c.modes, c.columns,
                            c.load_columns, c.num_impulses, c.impulse_q_rows, c.impulse_q_dot_rows,
                            c.impulse_out);
}

template <typename Archive, Is<PlanBar> T>
void fields(Archive& archive, T& b) {
  all_of<PlanBar>(archive, b.link, b.first, b.second, b.stiffness, b.damping, b.length, b.direction);
}

template <typename Archive, Is<PlanBodyRotation> T>
void fields(Archive& archive, T& t) {
  all_of<PlanBodyRotation>(archive, t.first, t.count, t.point, t.centre, t.offset, t.rows);
}

template <typename Archive, Is<PlanOffset> T>
void fields(Archive& archive, T& o) {
  all_of<PlanOffset>(archive, o.mass, o.offset, o.rows);
}

template <typename Archive, Is<PlanKinetics> T>
void fields(Archive& archive, T& k) {
  all_of<PlanKinetics>(archive, k.form, k.moments, k.num_tables, k.tables, k.body_rotations, k.offsets);
}

template <typename Archive, Is<BeamConstants> T>
void fields(Archive& archive, T& b) {
  all_of<BeamConstants>(archive, b.length, b.axial, b.torsion, b.symmetric, b.antisymmetric, b.shear,
                        b.skew_bow);
}

template <typename Archive, Is<PlateConstants> T>
void fields(Archive& archive, T& p) {
  all_of<PlateConstants>(archive, p.axis_x, p.axis_y, p.first, p.second, p.gradients, p.membrane, p.bending,
                         p.curvature);
}

template <typename Archive, Is<AngleConstants> T>
void fields(Archive& archive, T& a) {
  all_of<AngleConstants>(archive, a.form, a.stiffness, a.rest_sine, a.rest_cosine);
}

template <typename Archive, Is<PlanLinkEnd> T>
void fields(Archive& archive, T& e) {
  all_of<PlanLinkEnd>(archive, e.joint, e.released);
}

template <typename Archive, Is<PlanTrueBeam> T>
void fields(Archive& archive, T& b) {
  all_of<PlanTrueBeam>(archive, b.link, b.points, b.ends, b.span, b.axes, b.constants);
}

template <typename Archive, Is<PlanTruePlate> T>
void fields(Archive& archive, T& p) {
  all_of<PlanTruePlate>(archive, p.link, p.points, p.ends, p.axes, p.constants);
}

template <typename Archive, Is<PlanTrueAngle> T>
void fields(Archive& archive, T& a) {
  all_of<PlanTrueAngle>(archive, a.link, a.points, a.constants, a.num_rows, a.rows, a.sign);
}

template <typename Archive, Is<PlanJoints> T>
void fields(Archive& archive, T& j) {
  all_of<PlanJoints>(archive, j.num_joints, j.num_rotations, j.of_points, j.rows, j.order, j.starts, j.below,
                     j.lower, j.inverse_pivots, j.idle);
}

template <typename Archive, Is<MatrixConstants> T>
void fields(Archive& archive, T& m) {
  all_of<MatrixConstants>(archive, m.has_rotations, m.stiffness, m.arms, m.inverse, m.line, m.turn_weight);
}

template <typename Archive, Is<PlanTrueMatrix> T>
void fields(Archive& archive, T& m) {
  all_of<PlanTrueMatrix>(archive, m.link, m.points, m.ends, m.constants);
}

template <typename Archive, Is<PlanTrueLinks> T>
void fields(Archive& archive, T& l) {
  all_of<PlanTrueLinks>(archive, l.beams, l.plates, l.angles, l.matrices, l.joints);
}

template <typename Archive, Is<PlanTurningBody> T>
void fields(Archive& archive, T& b) {
  all_of<PlanTurningBody>(archive, b.mass, b.centre, b.inertia, b.rows, b.first, b.count);
}

template <typename Archive, Is<PlanTurning> T>
void fields(Archive& archive, T& t) {
  all_of<PlanTurning>(archive, t.bodies, t.points, t.of_points, t.of_carriers, t.of_attitudes);
}

template <typename Archive, Is<PlanCurveLink> T>
void fields(Archive& archive, T& l) {
  all_of<PlanCurveLink>(archive, l.points, l.joints, l.direction, l.length, l.skew_bow);
}

template <typename Archive, Is<PlanCurvePlate> T>
void fields(Archive& archive, T& p) {
  all_of<PlanCurvePlate>(archive, p.points, p.gradients);
}

template <typename Archive, Is<PlanCurve> T>
void fields(Archive& archive, T& c) {
  all_of<PlanCurve>(archive, c.links, c.plates, c.modes, c.is_axial, c.weights, c.stiff, c.is_filtered,
                    c.filter);
}

template <typename Archive, Is<PlanCoupled> T>
void fields(Archive& archive, T& c) {
  all_of<PlanCoupled>(archive, c.functions, c.bars, c.links, c.turning, c.curve, c.strain_times,
                      c.damps_true_strains, c.beta, c.substep_phase, c.num_substeps, c.kinetics);
}

template <typename Archive, Is<LoadSums> T>
void fields(Archive& archive, T& s) {
  all_of<LoadSums>(archive, s.force_W, s.force_B, s.group_force_W, s.group_torque_W, s.group_force_B,
                   s.group_torque_B, s.torque_W, s.torque_B, s.wheel_torques);
}

template <typename Archive, Is<PlanWheel> T>
void fields(Archive& archive, T& w) {
  all_of<PlanWheel>(archive, w.name, w.attitude_index, w.axis, w.momentum);
}

template <typename Archive, Is<PlanTorque> T>
void fields(Archive& archive, T& t) {
  all_of<PlanTorque>(archive, t.attitude_index, t.torque_B);
}

template <typename Archive, Is<PlanStiffening> T>
void fields(Archive& archive, T& s) {
  all_of<PlanStiffening>(archive, s.modes, s.components, s.rows, s.shares);
}

template <typename Archive, Is<PlanRung> T>
void fields(Archive& archive, T& r) {
  all_of<PlanRung>(archive, r.rung, r.position, r.attitude, r.elastic, r.is_finite, r.meets);
}

template <typename Archive, Is<ShadowModes> T>
void fields(Archive& archive, T& m) {
  all_of<ShadowModes>(archive, m.numbers, m.projection);
}

template <typename Archive, Is<PlanShadow> T>
void fields(Archive& archive, T& s) {
  all_of<PlanShadow>(archive, s.plan, s.ticks, s.substeps, s.horizon_ticks, s.every, s.delay_ticks, s.modes);
}

template <typename Archive, Is<PlanVerdict> T>
void fields(Archive& archive, T& v) {
  all_of<PlanVerdict>(archive, v.is_off, v.horizon, v.share, v.longest_step, v.shadows, v.tolerance, v.shared,
                      v.shared_text, v.fast_loads, v.lowest_omega);
}

template <typename Archive, Is<PlanHistory> T>
void fields(Archive& archive, T& h) {
  all_of<PlanHistory>(archive, h.name, h.kind, h.pulse_start, h.pulse_duration, h.start_tick, h.end_tick,
                      h.frequency, h.phase, h.times, h.values, h.pattern, h.followers, h.stiffening,
                      h.torques);
}

template <typename Archive, Is<PlanLinkOutput> T>
void fields(Archive& archive, T& o) {
  all_of<PlanLinkOutput>(archive, o.link, o.num_rows, o.first_row, o.first_rate_row, o.first_load_row);
}

template <typename Archive, Is<JointState> T>
void fields(Archive& archive, T& j) {
  all_of<JointState>(archive, j.rotation, j.angle);
}

template <typename Archive, Is<PlanInitial> T>
void fields(Archive& archive, T& i) {
  all_of<PlanInitial>(archive, i.p_WB, i.v_WB, i.q_WB, i.w_B, i.q, i.q_dot, i.joints);
}

template <typename Archive, Is<CommandLimits> T>
void fields(Archive& archive, T& l) {
  all_of<CommandLimits>(archive, l.max_age, l.sender_share, l.max_hold);
}

template <typename Archive, Is<PlanStartValue> T>
void fields(Archive& archive, T& s) {
  all_of<PlanStartValue>(archive, s.first_node, s.node, s.weights);
}

template <typename Archive, Is<PlanPoints> T>
void fields(Archive& archive, T& p) {
  all_of<PlanPoints>(archive, p.steps, p.ticks, p.pieces, p.columns, p.accuracy, p.first, p.second,
                     p.stiffness, p.inverse_square, p.tension, p.damping, p.inverse_mass, p.share, p.noise,
                     p.resolved, p.starts, p.spacing, p.num_nodes, p.weights);
}

template <typename Archive, Is<PlanFrame> T>
void fields(Archive& archive, T& f) {
  all_of<PlanFrame>(archive, f.mass, f.rigid_freedoms, f.p_SB, f.inertia, f.inverse_inertia, f.line,
                    f.principal, f.gravity_W, f.attractor_mu, f.attractor_W, f.has_gravity, f.has_rotation);
}

template <typename Archive, Is<PlanModes> T>
void fields(Archive& archive, T& m) {
  all_of<PlanModes>(archive, m.num_elastic, m.num_moving, m.num_padded, m.omega, m.decay, m.has_damping,
                    m.propagator, m.modal_coupling, m.coupled, m.mode_numbers, m.mechanisms);
}

template <typename Archive, Is<PlanLoads> T>
void fields(Archive& archive, T& l) {
  all_of<PlanLoads>(archive, l.has_spin_load, l.field_rows, l.field_stiffening, l.command_stiffening,
                    l.histories, l.feedbacks, l.scope);
}

template <typename Archive, Is<PlanRows> T>
void fields(Archive& archive, T& r) {
  all_of<PlanRows>(archive, r.points, r.links, r.groups, r.particles, r.wheels, r.rows, r.eckart_rows,
                   r.link_rows, r.link_outputs);
}

template <typename Archive, Is<StepPlan> T>
void fields(Archive& archive, T& p) {
  all_of<StepPlan>(archive, part<PlanFrame>(p), part<PlanModes>(p), part<PlanLoads>(p), part<PlanRows>(p),
                   p.period, p.fidelity, p.initial, p.fallback, p.fallback_modes, p.points_method);
}

template <typename Archive, Is<PlanService> T>
void fields(Archive& archive, T& s) {
  all_of<PlanService>(archive, s.rates, s.status_rate, s.published_points, s.published_groups, s.force_limit,
                      s.torque_limit);
}

template <typename Archive, Is<PlanIntegration> T>
void fields(Archive& archive, T& i) {
  all_of<PlanIntegration>(archive, i.why_modes, i.on_modes, i.on_points, i.after_change);
}

template <typename Archive, Is<PlanReport> T>
void fields(Archive& archive, T& r) {
  all_of<PlanReport>(archive, r.features, r.tolerance, r.horizon, r.tried_rungs, r.integration,
                     r.frequency_accuracy, r.conditioning);
}

// The fingerprint covers the members up to PlanService.
template <typename Archive, Is<Plan> T>
void fields(Archive& archive, T& p) {
  all_of<Plan>(archive, p.name, p.scene_hash, part<StepPlan>(p), part<PlanService>(p), p.command_limits,
               p.verdict, part<PlanReport>(p));
}

template <typename T>
concept Scalar = std::is_arithmetic_v<T> || std::is_enum_v<T>;

template <typename T>
using BitsOf = std::conditional_t<sizeof(T) == 1, std::uint8_t,
                                  std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>;

// Appends values, least significant byte first.
class Writer {
 public:
  // This member is not written, because it is computed from other members.
  void operator()(const PlanPrincipal&) {}
  template <typename T>
  void operator()(const T& value) {
    if constexpr (Scalar<T>) {
      const auto bits = static_cast<std::uint64_t>(std::bit_cast<BitsOf<T>>(value));
      for (std::size_t i = 0; i < sizeof(T); ++i)
        bytes_.push_back(static_cast<std::byte>(bits >> (8 * i) & 0xff));
    } else {
      fields(*this, value);
    }
  }
  void operator()(const std::string& text) { sequence(text); }
  template <typename T, typename Allocator>
  void operator()(const std::vector<T, Allocator>& values) {
    sequence(values);
  }
  template <typename T, std::size_t N>
  void operator()(const std::array<T, N>& values) {
    for (const T& each : values) (*this)(each);
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  template <typename Sequence>
  void sequence(const Sequence& values) {
    (*this)(static_cast<std::uint64_t>(values.size()));
    for (const auto& each : values) (*this)(each);
  }
  std::vector<std::byte> bytes_;
};

// Reads values from the front of the bytes. After the first failure, leaves all values unchanged.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  void operator()(PlanPrincipal&) {}
  template <typename T>
  void operator()(T& value) {
    if constexpr (Scalar<T>) {
      scalar(value);
    } else {
      fields(*this, value);
    }
  }
  void operator()(std::string& text) { sequence(text); }
  template <typename T, typename Allocator>
  void operator()(std::vector<T, Allocator>& values) {
    if constexpr (std::is_same_v<T, StepPlan> || std::is_same_v<T, PlanShadow>)
      nested(values);
    else
      sequence(values);
  }
  template <typename T, std::size_t N>
  void operator()(std::array<T, N>& values) {
    for (T& each : values) (*this)(each);
  }
  bool is_good() const { return error_.empty(); }
  std::size_t num_left() const { return bytes_.size(); }
  const std::string& error() const { return error_; }

 private:
  // Reads the plans within a plan. These inner plans may not contain further plans.
  template <typename T>
  void nested(std::vector<T>& plans) {
    if (is_nested_) {
      std::uint64_t count = 0;
      scalar(count);
      if (count != 0) fail("a plan that is stored inside this plan contains a further plan");
      return;
    }
    is_nested_ = true;
    sequence(plans);
    is_nested_ = false;
  }

  template <Scalar T>
  void scalar(T& value) {
    if (bytes_.size() < sizeof(T)) fail("it ends in the middle of a value");
    if (!is_good()) return;
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) bits |= static_cast<std::uint64_t>(bytes_[i]) << (8 * i);
    bytes_ = bytes_.subspan(sizeof(T));
    if constexpr (std::is_same_v<T, bool>) {
      if (bits > 1) fail("a flag is neither 0 nor 1");
      value = bits == 1;
    } else {
      value = std::bit_cast<T>(static_cast<BitsOf<T>>(bits));
    }
  }

  // An element takes at least one byte, and a number takes its size. A count that the remaining bytes cannot
  // hold is therefore found before memory is allocated.
  template <typename Sequence>
  void sequence(Sequence& values) {
    using T = typename Sequence::value_type;
    constexpr std::size_t kSmallest = Scalar<T> ? sizeof(T) : 1;
    std::uint64_t count = 0;
    scalar(count);
    if (is_good() && count > bytes_.size() / kSmallest)
      fail("a count is larger than the remaining bytes allow");
    values.clear();
    for (std::uint64_t i = 0; i < count && is_good(); ++i) {
      values.push_back({});
      (*this)(values.back());
    }
  }

  void fail(const char* what) {
    if (error_.empty()) error_ = what;
  }

  std::span<const std::byte> bytes_;
  std::string error_;
  bool is_nested_ = false;
};

}  // namespace

std::vector<std::byte> plan_to_bytes(const Plan& plan) {
  Writer writer;
  writer(plan);
  const std::vector<std::byte> content = writer.take();
  Writer header;
  header(kMagic);
  header(kVersion);
  header(static_cast<std::uint64_t>(content.size()));
  header(static_cast<std::uint64_t>(XXH3_64bits(content.data(), content.size())));
  std::vector<std::byte> bytes = header.take();
  bytes.insert(bytes.end(), content.begin(), content.end());
  return bytes;
}

std::optional<Plan> plan_from_bytes(std::span<const std::byte> bytes, std::string& error) {
  const auto refuse = [&](const std::string& why) {
    error = why;
    return std::nullopt;
  };
  std::array<char, 8> magic{};
  std::uint32_t version = 0;
  std::uint64_t length = 0, checksum = 0;
  Reader header(bytes.first(std::min(bytes.size(), kHeaderSize)));
  header(magic);
  if (!header.is_good() || magic != kMagic)
    return refuse(
        "the file is not a plan, because its first bytes are not those of a plan; name a file that freeflex "
        "compile wrote");
  header(version);
  header(length);
  header(checksum);
  if (!header.is_good()) return refuse("the plan is cut off in its header; compile the scene again");
  if (version != kVersion)
    return refuse("the plan has version " + std::to_string(version) + ", but this program reads version " +
                  std::to_string(kVersion) + "; compile the scene again");
  const std::span<const std::byte> content = bytes.subspan(kHeaderSize);
  if (content.size() < length)
    return refuse("the plan is cut off after " + std::to_string(content.size()) + " of " +
                  std::to_string(length) + " bytes; compile the scene again");
  if (content.size() > length)
    return refuse(std::to_string(content.size() - length) +
                  (content.size() - length == 1 ? " byte follows" : " bytes follow") +
                  " the end of the plan; compile the scene again");
  if (XXH3_64bits(content.data(), content.size()) != checksum)
    return refuse("the plan is damaged, because its checksum does not match; compile the scene again");

  std::optional<Plan> plan(std::in_place);
  Reader reader(content);
  reader(*plan);
  if (!reader.is_good())
    return refuse("the plan is inconsistent, because " + reader.error() + "; compile the scene again");
  if (reader.num_left() > 0)
    return refuse("the plan is inconsistent, because " + std::to_string(reader.num_left()) +
                  (reader.num_left() == 1 ? " byte belongs" : " bytes belong") +
                  " to no field; compile the scene again");
  set_principal(*plan);
  for (PlanShadow& shadow : plan->verdict.shadows) set_principal(shadow.plan);
  if (const std::string why = find_inconsistency(*plan); !why.empty())
    return refuse("the plan is inconsistent, because " + why + "; compile the scene again");
  return plan;
}

std::uint64_t plan_fingerprint(const Plan& plan) {
  Writer writer;
  writer(plan.name);
  writer(plan.scene_hash);
  writer(part<StepPlan>(plan));
  writer(part<PlanService>(plan));
  const std::vector<std::byte> content = writer.take();
  return XXH3_64bits(content.data(), content.size());
}

}  // namespace freeflex
