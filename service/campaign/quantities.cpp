#include "service/campaign/quantities.hpp"

#include <algorithm>
#include <cmath>

#include "core/index.hpp"
#include "service/campaign/numbers.hpp"
#include "service/io/scene/text.hpp"

namespace freeflex::campaign {
namespace {

constexpr std::array<const char*, 16> kBodyParts{"x",  "y",  "z",  "qw", "qx", "qy", "qz", "vx",
                                                 "vy", "vz", "wx", "wy", "wz", "hx", "hy", "hz"};
constexpr std::array<const char*, 16> kPointParts{
    "x",  "y",  "z",  "vx", "vy",       "vz",    "ax",           "ay",
    "az", "dx", "dy", "dz", "distance", "speed", "acceleration", "displacement"};
constexpr std::array<const char*, 4> kErrors{"deformation_error", "attitude_error", "position_error",
                                             "verdict"};
constexpr std::size_t kGroupParts = 13;  // the first of kBodyParts

// returns the place of a text in a list, or -1
template <typename List>
std::int32_t place_in(const List& list, const std::string& text, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k)
    if (text == list[k]) return static_cast<std::int32_t>(k);
  return -1;
}

template <typename Items>
std::int32_t find_named(const Items& items, const std::string& name) {
  for (std::size_t k = 0; k < items.size(); ++k)
    if (items[k].name == name) return static_cast<std::int32_t>(k);
  return -1;
}

// returns the place of an item in a list, to which it is added if it is not there
std::size_t place_of(std::vector<std::int32_t>& list, std::int32_t item) {
  const auto found = std::find(list.begin(), list.end(), item);
  if (found != list.end()) return static_cast<std::size_t>(found - list.begin());
  list.push_back(item);
  return list.size() - 1;
}

double norm_of(const Vec3& v) noexcept { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

// returns the angle of the rotation from one attitude to another [rad], 0 to pi
double angle_between(const Quat& a, const Quat& b) noexcept {
  const double w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const Vec3 v{a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2],
               a[0] * b[2] + a[1] * b[3] - a[2] * b[0] - a[3] * b[1],
               a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]};
  return 2.0 * arc_tangent(norm_of(v), std::abs(w));
}

// returns the value of a mode, given by its place in the fallback plan if there is one
double mode_value(const Plan& plan, const State& state, std::int32_t mode, const Array& values) noexcept {
  if (plan.fallback.empty() || state.uses_fallback) return values[index(mode)];
  const auto found = std::lower_bound(plan.fallback_modes.begin(), plan.fallback_modes.end(), mode);
  if (found == plan.fallback_modes.end() || *found != mode) return 0.0;
  return values[static_cast<std::size_t>(found - plan.fallback_modes.begin())];
}

// returns the number of modes of the scene, also of those that the plan leaves out
std::int64_t count_modes(const Plan& plan) {
  std::int64_t count = plan_of_all_modes(plan).num_elastic;
  for (const PlanFeature& each : plan.features) {
    const bool is_of_modes = each.feature == Feature::kOutOfPlane ||
                             each.feature == Feature::kUnreachedModes || each.feature == Feature::kSmallModes;
    const bool is_in_fallback = !plan.fallback.empty() && each.feature != Feature::kSmallModes;
    if (each.is_left_out && is_of_modes && !is_in_fallback) count += each.count;
  }
  return count;
}

// returns the place of a mode of the scene among all modes that the plan has, or -1
std::int32_t index_of_mode(const Plan& plan, std::int64_t number) {
  const auto& numbers = plan_of_all_modes(plan).mode_numbers;
  if (numbers.empty()) return static_cast<std::int32_t>(number - 1);
  const auto found = std::find(numbers.begin(), numbers.end(), number);
  return found == numbers.end() ? -1 : static_cast<std::int32_t>(found - numbers.begin());
}

std::string list_of(const char* const* first, std::size_t count) {
  std::vector<std::string_view> words(first, first + count);
  return io::reader::join(words);
}

// returns the number of a mode in the text q12 or q_dot12, or 0
std::int64_t mode_of(const std::string& name, const std::string& letter) {
  if (!name.starts_with(letter)) return 0;
  return io::reader::parse_integer(std::string_view(name).substr(letter.size()), 1, 1'000'000).value_or(0);
}

}  // namespace

bool needs_verdict(const std::string& quantity) { return place_in(kErrors, quantity, kErrors.size()) >= 0; }

void Quantities::push(From from, std::size_t index, std::int32_t part) {
  sources_.push_back({from, static_cast<std::int32_t>(index), part});
  values_.push_back(0.0);
}

std::string Quantities::add(const std::string& name, const std::array<double, 4>& reference) {
  if (const std::int32_t part = place_in(kBodyParts, name, kBodyParts.size()); part >= 0) {
    has_spin_ = has_spin_ || (part >= 10 && part < 13);
    return push(From::kBody, 0, part), std::string();
  }
  if (const std::int32_t part = place_in(kErrors, name, kErrors.size()); part >= 0)
    return push(From::kError, 0, part), std::string();
  if (name == "spin") return has_spin_ = true, push(From::kSpin, 0, 0), std::string();
  if (name == "energy") return has_energy_ = true, push(From::kEnergy, 0, 0), std::string();
  if (name == "attitude") {
    references_.push_back({reference[0], reference[1], reference[2], reference[3]});
    return push(From::kAttitude, references_.size() - 1, 0), std::string();
  }
  for (const auto& [letter, part] : {std::pair("q_dot", 1), std::pair("q", 0)})
    if (const std::int64_t mode = mode_of(name, letter); mode > 0) {
      const std::int64_t count = count_modes(*plan_);
      if (mode > count) return "there are " + std::to_string(count) + " modes, so there is no " + name;
      const std::int32_t place = index_of_mode(*plan_, mode);
      // of a mode that the plan leaves out, because nothing moves it
      if (place < 0) return push(From::kZero, 0, 0), std::string();
      return push(From::kMode, static_cast<std::size_t>(place), part), std::string();
    }
  return add_item(name);
}

std::string Quantities::add_item(const std::string& name) {
  const std::size_t first = name.find('.'), last = name.rfind('.');
  const std::string kind = name.substr(0, first);
  if (last == first || last == std::string::npos)
    return "there is no such quantity; examples are attitude, wx, point.NAME.x, point.NAME.displacement, "
           "link.NAME.axial, wheel.NAME.momentum, q1, verdict";
  const std::string item = name.substr(first + 1, last - first - 1), part = name.substr(last + 1);
  const auto unknown = [&](const auto& items) {
    std::vector<std::string_view> names;
    names.reserve(items.size());
    for (const auto& each : items) names.push_back(each.name);
    return "the scene has no " + kind + " " + io::reader::quote(item) + io::reader::did_you_mean(item, names);
  };
  if (kind == "point") {
    const std::int32_t found = find_named(plan_->points, item);
    return found < 0 ? unknown(plan_->points) : add_point(item, found, part);
  }
  if (kind == "group") {
    const std::int32_t found = find_named(plan_->groups, item);
    return found < 0 ? unknown(plan_->groups) : add_group(item, found, part);
  }
  if (kind == "link") {
    const std::int32_t found = find_named(plan_->links, item);
    return found < 0 ? unknown(plan_->links) : add_link(item, found, part);
  }
  if (kind != "wheel") return "it must begin with point, group, link or wheel";
  const std::int32_t found = find_named(plan_->wheels, item);
  if (found < 0) return unknown(plan_->wheels);
  if (part != "momentum") return "a wheel has the quantity momentum only";
  return push(From::kWheel, static_cast<std::size_t>(found), 0), std::string();
}

std::string Quantities::add_point(const std::string& name, std::int32_t point, const std::string& part) {
  const std::int32_t place = place_in(kPointParts, part, kPointParts.size());
  if (place < 0) return "a point has the quantities " + list_of(kPointParts.data(), kPointParts.size());
  if (plan_->points[index(point)].row < 0)
    return "the plan has no rows of point '" + name + "'; add the point to publish: points: of in the scene";
  const std::size_t at = place_of(points_, point);
  point_states_.resize(points_.size());
  return push(From::kPoint, at, place), std::string();
}

std::string Quantities::add_group(const std::string& name, std::int32_t group, const std::string& part) {
  const std::int32_t place = place_in(kBodyParts, part, kGroupParts);
  if (place < 0) return "a group has the quantities " + list_of(kBodyParts.data(), kGroupParts);
  for (const std::int32_t point : plan_->groups[index(group)].points)
    if (plan_->points[index(point)].row < 0)
      return "the plan has no rows of group '" + name + "'; add the group to publish: groups in the scene";
  const std::size_t at = place_of(groups_, group);
  group_poses_.resize(groups_.size());
  return push(From::kGroup, at, place), std::string();
}

std::string Quantities::add_link(const std::string& name, std::int32_t link, const std::string& part) {
  const auto output = std::find_if(plan_->link_outputs.begin(), plan_->link_outputs.end(),
                                   [link](const PlanLinkOutput& each) { return each.link == link; });
  if (output == plan_->link_outputs.end())
    return "the forces of link '" + name +
           "' are not published; add the link to publish: loads: of in the scene";
  const bool is_one = output->num_rows == 1;
  const bool is_word = part == "axial" || part == "moment";
  const std::int64_t value =
      is_one && is_word ? 1 : io::reader::parse_integer(part, 1, output->num_rows).value_or(0);
  if (value == 0)
    return is_one ? "the link has one quantity, axial or moment"
                  : "the link has the quantities 1 to " + std::to_string(output->num_rows);
  const auto number = static_cast<std::int32_t>(output - plan_->link_outputs.begin());
  auto rows =
      std::find_if(links_.begin(), links_.end(), [&](const LinkRows& l) { return l.output == number; });
  if (rows == links_.end()) {
    links_.push_back({number, static_cast<std::int32_t>(link_values_.size()), output->num_rows});
    link_values_.resize(link_values_.size() + index(output->num_rows));
    rows = links_.end() - 1;
  }
  return push(From::kLink, index(rows->first) + static_cast<std::size_t>(value - 1), 0), std::string();
}

void Quantities::read(const Motion& motion) noexcept {
  const Plan& plan = motion.plan();
  const bool reads_points_alone = std::ranges::all_of(
      sources_, [](const Source& each) { return each.from == From::kPoint || each.from == From::kError; });
  const State& state = reads_points_alone ? motion.state_of_points() : motion.state();
  for (std::size_t k = 0; k < points_.size(); ++k) point_states_[k] = read_point(plan, state, points_[k]);
  for (std::size_t k = 0; k < groups_.size(); ++k) group_poses_[k] = read_group(plan, state, groups_[k]);
  for (const LinkRows& link : links_)
    read_link(plan, state, link.output, {link_values_.data() + link.first, index(link.count)});
  if (has_spin_) spin_ = angular_velocity(plan, state);
  if (has_energy_) {
    const Invariants all = read_invariants(plan, state);
    energy_ = all.kinetic_rigid + all.kinetic_elastic + all.potential;
  }
  for (std::size_t k = 0; k < sources_.size(); ++k) values_[k] = value_of(sources_[k], state, motion);
}

double Quantities::value_of(const Source& source, const State& state, const Motion& motion) const noexcept {
  const auto of = static_cast<std::size_t>(source.index), part = static_cast<std::size_t>(source.part);
  switch (source.from) {
    case From::kBody:
      if (part < 3) return state.p_WB[part];
      if (part < 7) return state.q_WB[part - 3];
      if (part < 10) return state.v_WB[part - 7];
      return part < 13 ? spin_[part - 10] : state.H_W[part - 13];
    case From::kAttitude:
      return angle_between(references_[of], state.q_WB);
    case From::kSpin:
      return norm_of(spin_);
    case From::kMode:
      return mode_value(motion.plan(), state, source.index, part == 0 ? state.q : state.q_dot);
    case From::kZero:
      return 0.0;
    case From::kWheel:
      return state.wheel_momentum[of];
    case From::kPoint: {
      const PointState& point = point_states_[of];
      const std::array<const Vec3*, 4> vectors{&point.p_W, &point.v_W, &point.a_W, &point.V_B};
      return part < 12 ? (*vectors[part / 3])[part % 3] : norm_of(*vectors[part - 12]);
    }
    case From::kGroup: {
      const GroupPose& group = group_poses_[of];
      if (part < 3) return group.p_W[part];
      if (part < 7) return group.q_WG[part - 3];
      return part < 10 ? group.v_W[part - 7] : group.w_B[part - 10];
    }
    case From::kLink:
      return link_values_[of];
    case From::kEnergy:
      return energy_;
    case From::kError: {
      const Verdict& verdict = motion.verdict();
      if (part == 3) return static_cast<double>(static_cast<int>(verdict.level));
      return part == 0   ? verdict.error.deformation
             : part == 1 ? verdict.error.attitude
                         : verdict.error.position;
    }
  }
  return 0.0;
}

}  // namespace freeflex::campaign
