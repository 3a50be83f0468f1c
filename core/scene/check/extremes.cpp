#include "core/scene/check/extremes.hpp"

#include <cmath>

#include "core/scene/link_kinds.hpp"

namespace freeflex {
namespace {

// A value of a scene and the position of this value in the input
struct Extreme {
  Origin origin;
  std::string what;  // "link 'q': EA of 1e+308 N"
};

class Search {
 public:
  explicit Search(const Scene& scene) : scene_(scene) {}

  Extreme find() {
    const auto of = [](const char* noun, const auto& items, std::size_t k) {
      return join_text(noun, " ", quoted(items[k].name, static_cast<int>(k)));
    };
    for (std::size_t k = 0; k < scene_.points.size(); ++k) {
      const PointMass& point = scene_.points[k];
      look_at(point.origin, of("point", scene_.points, k));
      take("mass", point.mass, "kg");
      take_large("position", point.position, "m");
    }
    for (std::size_t k = 0; k < scene_.links.size(); ++k) {
      look_at(scene_.links[k].origin, "link " + called(scene_.links[k], static_cast<int>(k)));
      take_link(scene_.links[k]);
    }
    for (std::size_t k = 0; k < scene_.loads.size(); ++k) {
      look_at(scene_.loads[k].origin, of("load", scene_.loads, k));
      take_load(scene_.loads[k]);
    }
    for (std::size_t k = 0; k < scene_.feedbacks.size(); ++k) {
      const Feedback& feedback = scene_.feedbacks[k];
      look_at(feedback.origin, of("feedback", scene_.feedbacks, k));
      take_large("displacement gain", feedback.displacement_gain, "N/m");
      take_large("velocity gain", feedback.velocity_gain, "N s/m");
      take_large("acceleration gain", feedback.acceleration_gain, "N s^2/m");
    }
    take_rest();
    return std::move(extreme_);
  }

 private:
  void look_at(const Origin& origin, std::string who) {
    origin_ = origin;
    who_ = std::move(who);
  }
  void take(const char* what, double value, const char* unit) {
    if (value == 0.0) return;
    const double size = std::abs(std::log(std::abs(value)));
    if (size <= size_ && !extreme_.what.empty()) return;
    size_ = size;
    extreme_ = {origin_, join_text(who_, ": ", what, " of ", value, *unit != 0 ? " " : "", unit)};
  }
  // takes a value only if it is above one in magnitude, for values that cause no overflow if they are small
  void take_large(const char* what, double value, const char* unit) {
    if (std::abs(value) > 1.0) take(what, value, unit);
  }
  template <typename Derived>
  void take_large(const char* what, const Eigen::DenseBase<Derived>& values, const char* unit) {
    for (const double value : values.reshaped()) take_large(what, value, unit);
  }
  void take_link(const Link& link);
  void take_load(const Load& load);
  void take_rest();

  const Scene& scene_;
  Origin origin_;
  std::string who_;
  double size_ = 0.0;
  Extreme extreme_;
};

void Search::take_link(const Link& link) {
  take_large("viscous", link.viscous, "s");
  take_large("loss_factor", link.loss_factor, "");
  for (const LinkValue& each : values_of(link))
    each.harms_if_small ? take(each.what, each.value, each.unit)
                        : take_large(each.what, each.value, each.unit);
  if (const auto* matrix = std::get_if<MatrixLink>(&link.kind))
    take_large("an entry",
               Eigen::Map<const Eigen::VectorXd>(matrix->matrix.valuePtr(), matrix->matrix.nonZeros()),
               matrix->is_flexibility ? "m/N" : "N/m");
}

void Search::take_load(const Load& load) {
  for (const PointLoad& each : load.forces) take_large("force", each.force, "N");
  for (const WheelLoad& each : load.wheels) take_large("torque of a wheel", each.torque, "N m");
  for (const TorqueLoad& each : load.torques) take_large("torque", each.torque, "N m");
  for (const WrenchLoad& each : load.wrenches) {
    take_large("force", each.force, "N");
    take_large("torque", each.torque, "N m");
  }
  if (const auto* sine = std::get_if<SineHistory>(&load.history)) take("frequency", sine->frequency, "Hz");
  if (const auto* table = std::get_if<TableHistory>(&load.history))
    for (const double value : table->values) take_large("value", value, "");
}

void Search::take_rest() {
  const Damping& damping = scene_.damping;
  look_at(damping.origin, "damping");
  take_large("ratio", damping.modal_ratio, "");
  for (const auto& [mode, ratio] : damping.mode_ratios) take_large("ratio", ratio, "");
  take_large("alpha", damping.alpha, "1/s");
  take_large("beta", damping.beta, "s");
  look_at(scene_.attractor.origin, "attractor");
  take_large("mu", scene_.attractor.mu, "m^3/s^2");
  take_large("position", scene_.attractor.position, "m");
  const Initial& initial = scene_.initial;
  look_at(initial.origin, "initial");
  take_large("position", initial.position, "m");
  take_large("velocity", initial.velocity, "m/s");
  take_large("angular velocity", initial.angular_velocity, "rad/s");
  for (const auto& each : initial.points) {
    take_large("displacement", each.displacement, "m");
    take_large("velocity", each.velocity, "m/s");
  }
  for (const auto& each : initial.modes) {
    take_large("q", each.q, "m");
    take_large("q_dot", each.q_dot, "m/s");
  }
}

}  // namespace

void add_overflow(const Scene& scene, const std::string& problem, Faults& faults) {
  const Extreme extreme = Search(scene).find();
  add_error(faults, extreme.origin,
            join_text(extreme.what, " is the most extreme value of the scene, and ", problem,
                      "; check its unit, because values of one "
                      "scene must have compatible sizes in SI units"));
}

}  // namespace freeflex
