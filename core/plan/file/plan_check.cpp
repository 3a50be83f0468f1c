// This file checks the sizes, indices and ranges of a plan before the plan is stepped.
#include "core/plan/file/plan_check.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/faults.hpp"
#include "core/limits.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/rungs/rungs.hpp"
#include "core/step/loads/loads.hpp"
#include "core/step/rigid/principal.hpp"

namespace freeflex {
namespace {

constexpr std::int32_t kMaxPadded = 1 << 15;  // largest padded number of modes and constraint shapes
constexpr std::size_t kMaxItems = 1U << 20U;

bool is_positive(double value) { return std::isfinite(value) && value > 0.0; }

class PlanCheck {
 public:
  explicit PlanCheck(const StepPlan& plan) : plan_(plan) {}

  std::string find_own() {
    // the rung comes first, because it determines the members that a plan must have
    if (!is_rung(plan_.fidelity)) return error_ = "the rung is of an unknown kind";
    check_body();
    check_modes();
    // the members checked below are indexed by modes and points, so modes and points must be consistent first
    if (error_.empty()) check_propagator();
    if (error_.empty()) check_points();
    if (error_.empty()) check_links();
    if (error_.empty()) check_groups();
    if (error_.empty()) check_histories();
    if (error_.empty()) check_feedbacks();
    if (error_.empty()) check_modal_coupling();
    if (error_.empty()) check_initial();
    if (error_.empty()) error_ = find_rung_inconsistency(plan_);
    if (error_.empty()) check_scope();
    return error_;
  }

  std::string find_in_fallback() {
    check_fallback();
    return error_;
  }

 private:
  void require(bool holds, const std::string& what) {
    if (!holds && error_.empty()) error_ = what;
  }
  // Requires one finite value for each mode, and zero in the padding. The coordinates of ball joints have
  // values in the place of constraint shapes   (THEORY 12.123).
  void require_modal(const Array& values, const std::string& what, bool may_have_joints = false) {
    require(values.size() == num_padded(), what + " does not have one value for each mode");
    require(are_finite(values), what + " is not finite");
    if (!error_.empty()) return;
    const bool has_joints = may_have_joints && !plan_.coupled.turning.bodies.empty();
    const auto end = has_joints ? values.begin() + plan_.num_moving : values.end();
    require(std::all_of(values.begin() + plan_.num_elastic, end, [](double v) { return v == 0.0; }),
            what + " is not zero in the padding");
  }
  // Requires finite rows of num_padded values each.
  void require_rows(const Array& values, std::size_t num_rows, const std::string& what) {
    require(values.size() == num_rows * num_padded(), what + " have the wrong size");
    require(are_finite(values), what + " are not finite");
  }
  std::size_t num_padded() const { return static_cast<std::size_t>(plan_.num_padded); }

  // Requires finite coefficients for kLanes modes, and zero in the padding.
  void check_lane(const Propagator::Lanes::Lane& lane, std::size_t block) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      require(std::isfinite(lane[l]), "the propagator has an entry that is not finite");
      require(block * kLanes + l < static_cast<std::size_t>(plan_.num_elastic) || lane[l] == 0.0,
              "the propagator has an entry in the padding that is not zero");
    }
  }
  void check_body();
  void check_scope();
  void check_fallback();
  void check_modes();
  void check_propagator();
  void check_points();
  void check_links();
  void check_groups();
  void check_pattern(const LoadPattern& pattern, const std::string& who);
  void check_stiffening(const PlanStiffening& stiffening, std::int32_t num_coefficients,
                        const std::string& who);
  void check_histories();
  void check_feedbacks();
  void check_modal_coupling();
  void check_initial();

  const StepPlan& plan_;
  std::size_t num_blocks_ = 0;  // number of blocks of three rows
  std::string error_;
};

void PlanCheck::check_body() {
  require(is_positive(plan_.period), "the period is not > 0");
  require(is_positive(plan_.mass), "the mass is not > 0");
  require(plan_.rigid_freedoms == 6 || plan_.rigid_freedoms == 5 || plan_.rigid_freedoms == 3,
          "the rigid freedoms are not 6, 5 or 3");
  require(are_finite(plan_.p_SB) && are_finite(plan_.inertia) && are_finite(plan_.inverse_inertia) &&
              are_finite(plan_.line) && are_finite(plan_.gravity_W) && are_finite(plan_.attractor_W) &&
              is_at_least(plan_.attractor_mu, 0.0),
          "a property of the rigid body is not finite");
  require(plan_.principal == principal_of(plan_.inverse_inertia),
          "the principal axes are not those of the inertia");
}

void PlanCheck::check_modes() {
  require(plan_.num_elastic >= 0 && plan_.num_elastic <= kMaxPlanElastic,
          "the number of modes is out of range");
  require(plan_.num_moving == pad(plan_.num_elastic) && plan_.num_padded >= plan_.num_moving &&
              plan_.num_padded <= kMaxPadded && plan_.num_padded % kLanes == 0,
          "the padding of the modes is wrong");
  if (!error_.empty()) return;
  require_modal(plan_.omega, "omega");
  require_modal(plan_.decay, "decay");
  const auto is_not_negative = [](double value) { return value >= 0.0; };
  require(std::all_of(plan_.omega.begin(), plan_.omega.end(), is_not_negative), "a frequency is negative");
  require(std::all_of(plan_.decay.begin(), plan_.decay.end(), is_not_negative), "a decay is negative");
}

void PlanCheck::check_propagator() {
  const auto& all = plan_.propagator.lanes;
  const auto& undamped = plan_.propagator.undamped;
  const std::size_t num_lanes = static_cast<std::size_t>(plan_.num_moving) / kLanes;
  require(all.size() == (plan_.has_damping ? num_lanes : 0) &&
              undamped.size() == (plan_.has_damping ? 0 : num_lanes),
          "the propagator does not have one value for each mode");
  require(plan_.has_damping ||
              std::all_of(plan_.decay.begin(), plan_.decay.end(), [](double v) { return v == 0.0; }),
          "a mode decays in a plan without damping");
  for (std::size_t block = 0; block < undamped.size() && error_.empty(); ++block) {
    const Propagator::UndampedLanes& p = undamped[block];
    for (const auto* lane :
         {&p.c_qq, &p.c_qv, &p.l_qq, &p.l_qv, &p.w_q0, &p.w_q1, &p.c_vq, &p.l_vq, &p.w_v0, &p.w_v1})
      check_lane(*lane, block);
  }
  for (std::size_t block = 0; block < all.size() && error_.empty(); ++block) {
    const Propagator::Lanes& p = all[block];
    for (const auto* lane : {&p.c_qq, &p.c_qv, &p.l_qq, &p.l_qv, &p.w_q0, &p.w_q1, &p.c_vq, &p.c_vv, &p.l_vq,
                             &p.l_vv, &p.w_v0, &p.w_v1})
      check_lane(*lane, block);
  }
}

void PlanCheck::check_points() {
  require(!plan_.points.empty() && plan_.points.size() <= kMaxItems, "the number of points is out of range");
  std::set<std::int32_t> rows;
  for (const PlanPoint& point : plan_.points) {
    require(std::isfinite(point.mass) && point.mass >= 0.0 && are_finite(point.r),
            "a point has an invalid mass or position");
    require(point.row >= -1, "a point has a negative row number");
    require(point.row >= 0 || !point.pushable, "a pushable point has no rows");
    if (point.row >= 0) require(rows.insert(point.row).second, "two points share rows");
  }
  for (const PlanPoint& particle : plan_.particles.all) {
    require(is_positive(particle.mass) && are_finite(particle.r),
            "a particle has an invalid mass or position");
    require(particle.row >= 0 && rows.insert(particle.row).second && !particle.pushable,
            "a particle has no rows of its own");
  }
  num_blocks_ = rows.size();
  require(rows.empty() || is_index(*rows.rbegin(), rows.size()), "the rows of points are not contiguous");
  require_rows(plan_.rows, 3 * num_blocks_, "the rows of points");
  const std::vector<std::int32_t>& attitude_points = plan_.particles.attitude_points;
  require(are_indices(attitude_points, plan_.points.size()) &&
              std::adjacent_find(attitude_points.begin(), attitude_points.end(), std::greater_equal<>()) ==
                  attitude_points.end(),
          "points with an attitude do not exist or are out of order");
  require_rows(plan_.particles.rotation_rows, 3 * attitude_points.size(),
               "the rows of points with an attitude");
  require_rows(plan_.eckart_rows, 6, "the Eckart rows");
  const bool has_field = plan_.has_spin_load || plan_.attractor_mu > 0.0;
  require_rows(plan_.field_rows, has_field ? 6 : 0, "the rows of fields");
  check_stiffening(plan_.field_stiffening, 6, "a field");
  check_stiffening(plan_.command_stiffening, static_cast<std::int32_t>(CommandComponents(plan_).count),
                   "the commands");
  require(plan_.command_stiffening.components.empty() || is_coupled(plan_),
          "commands have a geometric stiffness below the coupled rungs");
  for (const PlanWheel& wheel : plan_.wheels)
    require(is_index(wheel.attitude_index, attitude_points.size()) && are_finite(wheel.axis) &&
                std::isfinite(wheel.momentum),
            "a wheel is on a point without an attitude, or has a value that is not finite");
  require(plan_.wheels.size() <= std::size_t{kMaxWheels}, "the plan has too many wheels");
  for (const auto& mechanism : plan_.mechanisms)
    require(are_indices(mechanism, plan_.points.size()), "a mechanism moves a point that does not exist");
  // Mechanisms are the modes of frequency zero. These modes come first.
  const auto *first = plan_.omega.data(), *last = first + plan_.num_elastic;
  const auto num_zero = static_cast<std::size_t>(std::count(first, last, 0.0));
  require(plan_.mechanisms.size() == num_zero,
          "the number of mechanisms is not the number of modes of frequency zero");
  require(std::all_of(first, first + num_zero, [](double omega) { return omega == 0.0; }),
          "a mode of frequency zero comes after a mode of another frequency");
}

void PlanCheck::check_links() {
  require(plan_.links.size() <= kMaxItems, "the plan has too many links");
  for (const PlanLink& link : plan_.links) require(is_link_type(link.type), "a link is of an unknown type");
  for (const PlanLink& link : plan_.links)
    for (const std::int32_t point : link.points)
      require(point == -1 || is_index(point, plan_.points.size()),
              "a link joins a point that does not exist");
  std::size_t num_rows = 0;
  for (const PlanLinkOutput& output : plan_.link_outputs) {
    require(is_index(output.link, plan_.links.size()), "a link output refers to a link that does not exist");
    require(output.num_rows >= 1 && static_cast<std::size_t>(output.num_rows) <= kMaxItems,
            "a link output has no rows or too many");
    const auto follows = [&](std::int32_t first) {
      require(first >= 0 && static_cast<std::size_t>(first) == num_rows,
              "the rows of link outputs do not follow each other");
      if (error_.empty()) num_rows += static_cast<std::size_t>(output.num_rows);
    };
    follows(output.first_row);
    if (output.first_rate_row != -1) follows(output.first_rate_row);
    if (output.first_load_row != -1) follows(output.first_load_row);
    if (!error_.empty()) return;
  }
  require_rows(plan_.link_rows, num_rows, "the rows of links");
}

void PlanCheck::check_groups() {
  require(plan_.groups.size() <= kMaxItems, "the plan has too many groups");
  for (const PlanGroup& group : plan_.groups) {
    require(!group.points.empty() && are_indices(group.points, plan_.points.size()),
            "a group is empty or refers to a point that does not exist");
    if (!error_.empty()) return;
    require(std::all_of(
                group.points.begin(), group.points.end(),
                [&](std::int32_t point) { return plan_.points[static_cast<std::size_t>(point)].row >= 0; }),
            "a point of a group has no mode-shape rows");
    require(is_positive(group.mass) && are_finite(group.centre) && are_finite(group.inverse_inertia) &&
                are_finite(group.line),
            "a property of a group is not finite");
    require(group.torque_rank == 3 || group.torque_rank == 2 || group.torque_rank == 0,
            "the torque rank of a group is not 3, 2 or 0");
  }
  const auto& of_groups = plan_.particles.of_groups;
  require(of_groups.empty() ? plan_.particles.all.empty() : of_groups.size() == plan_.groups.size(),
          "a group has no list of particles");
  for (const auto& masses : of_groups) {
    require(!masses.empty() && are_indices(masses, plan_.points.size() + plan_.particles.all.size()),
            "a group has no mass, or the mass of a point that does not exist");
    if (!error_.empty()) return;
    require(std::all_of(masses.begin(), masses.end(),
                        [&](std::int32_t mass) { return mass_point(plan_, mass).row >= 0; }),
            "a mass of a group has no mode-shape rows");
  }
}

void PlanCheck::check_stiffening(const PlanStiffening& stiffening, std::int32_t num_coefficients,
                                 const std::string& who) {
  const std::size_t n = stiffening.modes.size();
  require(are_ascending(stiffening.modes) && n <= PlanStiffening::kMostModes &&
              are_indices(stiffening.modes, static_cast<std::size_t>(plan_.num_elastic)) &&
              are_indices(stiffening.components, static_cast<std::size_t>(num_coefficients)) &&
              stiffening.rows.size() == stiffening.components.size() * n * pad(n) &&
              (n == 0) == stiffening.components.empty() && are_finite(stiffening.rows) &&
              stiffening.shares.size() == stiffening.components.size() && are_finite(stiffening.shares),
          who + " has a geometric stiffness without one row and column for each of its modes");
}

void PlanCheck::check_pattern(const LoadPattern& pattern, const std::string& who) {
  require(are_finite(pattern.force_W) && are_finite(pattern.moment_W) && are_finite(pattern.force_B) &&
              are_finite(pattern.torque_B),
          who + " has a force or torque that is not finite");
  require(pattern.num_direct >= 0 && pattern.num_direct <= LoadPattern::kMaxDirect,
          who + " has a number of direct points that is out of range");
  for (std::int32_t k = 0; k < pattern.num_direct && error_.empty(); ++k) {
    const auto index = static_cast<std::size_t>(k);
    require(is_index(pattern.direct_row[index], num_blocks_), who + " has a direct point without rows");
    require(are_finite(pattern.direct_force_W[index]), who + " has a direct force that is not finite");
  }
  require((pattern.wheel_torques.empty() || pattern.wheel_torques.size() == plan_.wheels.size()) &&
              are_finite(pattern.wheel_torques),
          who + " does not have one finite torque for each wheel of the plan");
  require_rows(pattern.table, pattern.uses_table ? 9 : 0, "the rows of the table of " + who);
  if (pattern.has_body && !is_coupled(plan_))
    require_rows(pattern.Q_B, 1, "the rows of Q_B of " + who);
  else
    require(pattern.Q_B.empty(), who + " has Q_B, but no load in body axes");
}

void PlanCheck::check_histories() {
  require(plan_.histories.size() <= kMaxItems, "the plan has too many histories");
  for (const PlanHistory& history : plan_.histories) {
    const std::string who = "history '" + history.name + "'";
    require(history.kind >= PlanHistory::Kind::kConstant && history.kind <= PlanHistory::Kind::kTable,
            who + " is of an unknown kind");
    require(is_at_least(history.pulse_start, 0.0) && is_at_least(history.pulse_duration, 0.0) &&
                is_at_least(history.frequency, 0.0) && std::isfinite(history.phase),
            who + " has a parameter out of range");
    require(history.start_tick >= 0 && history.end_tick >= history.start_tick,
            who + " ends before it starts");
    require(history.times.size() == history.values.size(), who +
                                                               " has a table whose columns differ in "
                                                               "length");
    require(history.kind != PlanHistory::Kind::kTable || !history.times.empty(), who + " has an empty table");
    require(are_finite(history.times) && are_finite(history.values), who +
                                                                         " has a table with an entry "
                                                                         "that is not finite");
    require(std::adjacent_find(history.times.begin(), history.times.end(), std::greater_equal<>()) ==
                history.times.end(),
            who + " has times that do not increase");
    check_pattern(history.pattern, who);
    for (const PlanTorque& each : history.torques)
      require(
          is_index(each.attitude_index, plan_.particles.attitude_points.size()) && are_finite(each.torque_B),
          who +
              " has a follower torque on a point without an attitude, or one with a component that is not "
              "finite");
    check_stiffening(history.stiffening, PlanStiffening::kMotors + 1, who);
    for (const PlanFollower& follower : history.followers) {
      require(is_index(follower.row, num_blocks_), who + " has a follower force on a point without rows");
      require(are_finite(follower.r) && are_finite(follower.force_B),
              who + " has a follower force that is not finite");
      require_rows(follower.rotation_rows, 3, "the rows of rotation of a follower force of " + who);
      for (const PlanFollower::Neighbour& each : follower.neighbours)
        require(
            is_index(each.point, plan_.points.size()) && are_finite(each.turn),
            who +
                " has a follower force that turns with a point that does not exist, or by a share that is "
                "not finite");
    }
    if (!error_.empty()) return;
  }
}

void PlanCheck::check_feedbacks() {
  require(plan_.feedbacks.size() <= kMaxItems, "the plan has too many feedbacks");
  for (const PlanFeedback& feedback : plan_.feedbacks) {
    const std::string who = "feedback '" + feedback.name + "'";
    require(is_index(feedback.row, num_blocks_), who + " acts on a point that has no rows");
    require(are_finite(feedback.r), who + " acts at a position that is not finite");
    require_rows(feedback.q_rows, 3, "the rows of q of " + who);
    require_rows(feedback.q_dot_rows, 3, "the rows of q_dot of " + who);
    require_rows(feedback.Q_rows, feedback.Q_rows.empty() ? 0 : 3, "the rows of Q of " + who);
  }
}

void PlanCheck::check_modal_coupling() {
  const PlanModalCoupling& modal_coupling = plan_.modal_coupling;
  require(modal_coupling.path >= PlanModalCoupling::Path::kNone &&
              modal_coupling.path <= PlanModalCoupling::Path::kSplit,
          "the modal coupling is of an unknown kind");
  require(modal_coupling.num_damping >= 0 && modal_coupling.num_impulses >= 0 &&
              static_cast<std::size_t>(modal_coupling.num_damping) <= kMaxItems &&
              static_cast<std::size_t>(modal_coupling.num_impulses) <= kMaxItems,
          "a number of dashpots is out of range");
  if (!error_.empty()) return;
  require_rows(modal_coupling.damping_rows, static_cast<std::size_t>(modal_coupling.num_damping),
               "the rows of dashpots");
  const auto num_impulses = static_cast<std::size_t>(modal_coupling.num_impulses);
  require_rows(modal_coupling.impulse_q_rows, num_impulses, "the rows of coupling impulses");
  require_rows(modal_coupling.impulse_q_dot_rows, num_impulses, "the rows of coupling impulses");
  require_rows(modal_coupling.impulse_out, num_impulses, "the rows of coupling impulses");
  require(are_indices(modal_coupling.modes, static_cast<std::size_t>(plan_.num_elastic)),
          "a coupled mode does not exist or is listed twice");
  const std::size_t num_modes = modal_coupling.modes.size();
  const std::size_t stride = pad(2 * num_modes);
  require(modal_coupling.columns.size() == 4 * num_modes * stride && are_finite(modal_coupling.columns),
          "the propagator of the coupled modes has the wrong size or is not finite");
  require(modal_coupling.load_columns.size() ==
                  (plan_.feedbacks.empty()
                       ? 0
                       : 4 * num_modes * static_cast<std::size_t>(PlanModalCoupling::kLoadRows)) &&
              are_finite(modal_coupling.load_columns),
          "the loads of feedback over a step have the wrong size or are not finite");
}

void PlanCheck::check_initial() {
  const PlanInitial& initial = plan_.initial;
  require(are_finite(initial.p_WB) && are_finite(initial.v_WB) && are_finite(initial.w_B) &&
              are_finite(initial.q_WB),
          "the initial state has a value that is not finite");
  double norm2 = 0.0;
  for (const double component : initial.q_WB) norm2 += component * component;
  require(std::abs(norm2 - 1.0) < 1e-12, "the initial attitude is not a unit quaternion");
  require_modal(initial.q, "the initial q", true);
  require_modal(initial.q_dot, "the initial q_dot", true);
}

void PlanCheck::check_scope() {
  require(
      plan_.mode_numbers.empty() ||
          (plan_.mode_numbers.size() == static_cast<std::size_t>(plan_.num_elastic) &&
           are_ascending(plan_.mode_numbers) && (plan_.num_elastic == 0 || plan_.mode_numbers.front() >= 1)),
      "the numbers of the modes do not ascend from 1");
  require(are_finite(plan_.scope.normal_B) && are_finite(plan_.scope.R_WB),
          "the plane or attitude in the scope of commands is not finite");
  const bool is_rotated = !plan_.feedbacks.empty() || plan_.attractor_mu > 0.0 || plan_.has_spin_load;
  require(plan_.has_rotation || plan_.rigid_freedoms == 3 || !is_rotated,
          "a field or feedback rotates a body that does not rotate");
}

void PlanCheck::check_fallback() {
  require(plan_.fallback.size() <= 1, "there is more than one fallback plan");
  require(plan_.fallback_modes.empty() || !plan_.fallback.empty(),
          "the plan has mode indices, but no fallback plan");
  if (plan_.fallback.empty() || !error_.empty()) return;
  const StepPlan& fallback = plan_.fallback.front();
  if (const std::string why = find_own_inconsistency(fallback); !why.empty())
    return require(false, "in its fallback plan " + why);
  const auto fits = [&](bool holds) { require(holds, "the fallback plan belongs to another structure"); };
  fits(fallback.fallback.empty() && !fallback.scope.lacks_rotation && !fallback.scope.lacks_out_of_plane);
  fits(!is_coupled(plan_) && fallback.fidelity == plan_.fidelity);
  fits(fallback.period == plan_.period && fallback.points.size() == plan_.points.size() &&
       fallback.groups.size() == plan_.groups.size() &&
       fallback.link_outputs.size() == plan_.link_outputs.size() &&
       fallback.histories.size() == plan_.histories.size());
  if (!error_.empty()) return;
  for (std::size_t i = 0; i < plan_.points.size(); ++i)
    fits(fallback.points[i].r == plan_.points[i].r &&
         (fallback.points[i].row >= 0) == (plan_.points[i].row >= 0));
  for (std::size_t k = 0; k < plan_.link_outputs.size(); ++k)
    fits(fallback.link_outputs[k].num_rows == plan_.link_outputs[k].num_rows &&
         fallback.link_outputs[k].link == plan_.link_outputs[k].link);
  require(plan_.fallback_modes.size() == static_cast<std::size_t>(plan_.num_elastic) &&
              are_ascending(plan_.fallback_modes) &&
              are_indices(plan_.fallback_modes, static_cast<std::size_t>(fallback.num_elastic)),
          "the mode indices in the fallback plan are wrong");
}

std::string find_in_service(const Plan& plan) {
  const auto is_rate = [](double rate) { return is_at_least(rate, 0.0); };
  if (!std::ranges::all_of(plan.rates, is_rate) || !is_rate(plan.status_rate))
    return "a publication rate is not >= 0";
  if (!is_at_least(plan.force_limit, 0.0) || !is_at_least(plan.torque_limit, 0.0))
    return "the force limit or the torque limit is not >= 0";
  const CommandLimits& limits = plan.command_limits;
  if (!is_positive(limits.max_age) || !is_positive(limits.sender_share) || limits.sender_share > 1.0 ||
      !is_positive(limits.max_hold))
    return "the limits of commands are out of range";
  if (!are_indices(plan.published_points, plan.points.size())) return "a published point does not exist";
  if (!are_indices(plan.published_groups, plan.groups.size())) return "a published group does not exist";
  if (std::ranges::any_of(plan.published_points,
                          [&](std::int32_t point) { return plan.points[index(point)].row < 0; }))
    return "a published point has no rows";
  return {};
}

std::string find_in_report(const PlanReport& report) {
  for (const PlanRung& tried : report.tried_rungs)
    if (!is_rung(tried.rung)) return "a rung that was tried is of an unknown kind";
  if (!report.features.empty() && report.features.size() != kNumFeatures)
    return "the number of features is wrong";
  for (std::size_t k = 0; k < report.features.size(); ++k) {
    const PlanFeature& feature = report.features[k];
    if (feature.feature != static_cast<Feature>(k) || feature.count < 0)
      return "the features are not in order";
    for (const double error :
         {feature.error, feature.relative_error, feature.link_error, feature.error_per_force,
          feature.relative_error_per_force, feature.link_error_per_force})
      if (!is_at_least(error, 0.0)) return "the error of a feature is not >= 0";
  }
  if (!is_at_least(report.tolerance, 0.0) || !is_at_least(report.horizon, 0.0))
    return "the tolerance or horizon is not >= 0";
  if (!is_at_least(report.frequency_accuracy, 0.0) || !is_at_least(report.conditioning, 0.0))
    return "accuracy or conditioning is not >= 0";
  return {};
}

std::string find_in_fallback(const Plan& plan) {
  if (std::string why = PlanCheck(plan).find_in_fallback(); !why.empty()) return why;
  return {};
}

}  // namespace

std::string find_own_inconsistency(const StepPlan& plan) { return PlanCheck(plan).find_own(); }

std::string find_inconsistency(const Plan& plan) {
  if (std::string why = find_own_inconsistency(plan); !why.empty()) return why;
  if (std::string why = find_in_service(plan); !why.empty()) return why;
  if (std::string why = find_in_report(plan); !why.empty()) return why;
  if (std::string why = find_verdict_inconsistency(plan); !why.empty()) return why;
  return find_in_fallback(plan);
}

}  // namespace freeflex
