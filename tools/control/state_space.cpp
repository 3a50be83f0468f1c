#include "tools/control/state_space.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/index.hpp"
#include "core/plan/modes/modal_coupling.hpp"
#include "service/io/scene/text.hpp"
#include "tools/control/rows.hpp"

namespace freeflex::control {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::string_view kAxes = "xyz";

/// A force on the structure: its resultant, its moment about the centre of mass, its generalized forces on
/// the modes and the constraint shapes, and the torques on the wheels.
struct Effect {
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
  VectorXd Q, wheels;
};

std::string fault_of(const char* kind, const std::string& name, const std::string& why) {
  std::string fault = kind;
  fault += " '";
  fault += name;
  fault += "': ";
  return fault += why;
}

/// A name such as point.hub.fx in parts.
struct Name {
  std::string kind, item, part;
};
std::optional<Name> components_of(const std::string& text) {
  const std::size_t first = text.find('.'), last = text.rfind('.');
  if (first == std::string::npos || first == last) return std::nullopt;
  return Name{text.substr(0, first), text.substr(first + 1, last - first - 1), text.substr(last + 1)};
}

template <class Items>
int find_named(const Items& items, const std::string& name) {
  for (std::size_t k = 0; k < items.size(); ++k)
    if (items[k].name == name) return static_cast<int>(k);
  return -1;
}

/// Makes one model.
class Builder {
 public:
  explicit Builder(const Plan& plan)
      : plan_(plan),
        n_(plan.num_elastic),
        padded_(plan.num_padded),
        num_wheels_(static_cast<Index>(plan.wheels.size())),
        size_(kBodyStates + 2 * n_ + num_wheels_),
        inverse_inertia_(matrix_of(plan.inverse_inertia)) {
    model_.A = MatrixXd::Zero(size_, size_);
    for (const char* name : {"x", "y", "z", "rx", "ry", "rz", "vx", "vy", "vz", "wx", "wy", "wz"})
      model_.states.emplace_back(name);
    for (int mode = 0; mode < n_; ++mode)
      model_.modes.push_back(plan.mode_numbers.empty() ? mode + 1 : plan.mode_numbers[index(mode)]);
    for (const char* letter : {"q", "q_dot"})
      for (const int mode : model_.modes) model_.states.push_back(letter + std::to_string(mode));
    for (const PlanWheel& wheel : plan.wheels) model_.states.push_back("wheel." + wheel.name + ".momentum");
  }

  StateSpaceResult make(const Ports& ports) {
    for (const PlanFeedback& each : plan_.feedbacks)
      if (!each.Q_rows.empty())
        return {std::nullopt,
                "feedback '" + each.name + "' is of the acceleration, which a model cannot have; remove it"};
    if (plan_.initial.w_B != Vec3{})
      return {std::nullopt,
              "the body spins at the start, but the model is about a body at rest; write --set "
              "'initial.angular_velocity=[0,0,0]'"};
    fill_A();
    for (const std::string& input : expanded(ports.inputs, true))
      if (const std::string error = add_input(input); !error.empty())
        return {std::nullopt, fault_of("input", input, error)};
    model_.B.resize(size_, static_cast<Index>(inputs_.size()));
    for (std::size_t k = 0; k < inputs_.size(); ++k)
      model_.B.col(static_cast<Index>(k)) = rate_by(inputs_[k]);
    for (const std::string& output : expanded(ports.outputs, false))
      if (const std::string error = add_output(output); !error.empty())
        return {std::nullopt, fault_of("output", output, error)};
    const auto num_outputs = static_cast<Index>(rows_.size());
    model_.by_state.resize(num_outputs, size_);
    model_.by_rate.resize(num_outputs, size_);
    model_.by_load.resize(num_outputs, model_.B.cols());
    for (Index k = 0; k < num_outputs; ++k) {
      const OutputRow& row = rows_[index(k)];
      model_.by_state.row(k) = row.of_state;
      model_.by_rate.row(k) = row.of_rate;
      for (std::size_t input = 0; input < inputs_.size(); ++input)
        model_.by_load(k, static_cast<Index>(input)) = row.of_load.dot(inputs_[input].Q);
    }
    set_outputs(model_);
    return {std::move(model_), {}};
  }

 private:
  /// An output: of the state, of its rate, and of the generalized forces of the inputs.
  struct OutputRow {
    RowVectorXd of_state, of_rate;
    VectorXd of_load;
  };

  Index q() const { return kBodyStates; }
  Index q_dot() const { return kBodyStates + n_; }

  /// Returns the rate of the state under a force.
  VectorXd rate_by(const Effect& effect) const {
    VectorXd rate = VectorXd::Zero(size_);
    rate.segment<3>(6) = effect.force / plan_.mass;
    rate.segment<3>(9) = inverse_inertia_ * effect.moment;
    rate.segment(q_dot(), n_) = effect.Q.head(n_) / plan_.mass;
    rate.tail(num_wheels_) = effect.wheels;
    return rate;
  }

  void fill_A() {
    MatrixXd& A = model_.A;
    A.block<6, 6>(0, 6).setIdentity();
    A.block(q(), q_dot(), n_, n_).setIdentity();
    for (Index l = 0; l < n_; ++l) {
      A(q_dot() + l, q() + l) = -plan_.omega[index(l)] * plan_.omega[index(l)];
      A(q_dot() + l, q_dot() + l) = plan_.has_damping ? -2.0 * plan_.decay[index(l)] : 0.0;
    }
    // dashpots and feedback on the modes   (THEORY 8.39)
    const CouplingForces coupling = coupling_forces(plan_);
    has_coupling_ = coupling.out.rows() > 0 || !plan_.feedbacks.empty();
    A.block(q_dot(), q(), n_, n_) += coupling.out.transpose() * coupling.by_q;
    A.block(q_dot(), q_dot(), n_, n_) += coupling.out.transpose() * coupling.by_q_dot;
    // feedback on the body
    for (const PlanFeedback& each : plan_.feedbacks)
      for (const auto& [rows, first] : {std::pair(&each.q_rows, q()), std::pair(&each.q_dot_rows, q_dot())}) {
        const MatrixXd by = Eigen::Map<const RowMatrix>(rows->data(), 3, padded_).leftCols(n_);
        A.block(6, first, 3, n_) += by / plan_.mass;
        A.block(9, first, 3, n_) += inverse_inertia_ * cross_matrix(vector_of(each.r)) * by;
      }
    for (const PlanWheel& wheel : plan_.wheels) add_gyroscopic(wheel);
  }

  /// Adds the torque h a x (w + Theta q') of a wheel on its body   (THEORY 8.47). Below the coupled rungs,
  /// Theta q' does not act   (THEORY 16.23).
  void add_gyroscopic(const PlanWheel& wheel) {
    if (wheel.momentum == 0.0) return;
    const Matrix3d by = wheel.momentum * cross_matrix(vector_of(wheel.axis));
    const MatrixXd theta = rotations_of_body(plan_, wheel.attitude_index).leftCols(n_);
    MatrixXd& A = model_.A;
    A.block<3, 3>(9, 9) += inverse_inertia_ * by;
    A.block(q_dot(), 9, n_, 3) += theta.transpose() * by / plan_.mass;
    if (!is_coupled(plan_)) return;
    A.block(9, q_dot(), 3, n_) += inverse_inertia_ * by * theta;
    A.block(q_dot(), q_dot(), n_, n_) += theta.transpose() * by * theta / plan_.mass;
  }

  /// Replaces names that stand for three.
  static std::vector<std::string> expanded(const std::vector<std::string>& names, bool is_input) {
    std::vector<std::string> all;
    for (const std::string& name : names) {
      const auto parts = components_of(name);
      const std::string_view letters = is_input ? "ft" : "pvadrw";
      if (!parts || (parts->kind != "point" && parts->kind != "group") || parts->part.size() != 1 ||
          letters.find(parts->part) == std::string_view::npos) {
        all.push_back(name);
        continue;
      }
      for (const char axis : kAxes)
        all.push_back(name.substr(0, name.size() - 1) + (parts->part == "p" ? "" : parts->part) + axis);
    }
    return all;
  }

  Effect none() const {
    Effect effect;
    effect.Q = VectorXd::Zero(padded_);
    effect.wheels = VectorXd::Zero(num_wheels_);
    return effect;
  }

  std::string add_input(const std::string& name) {
    const auto parts = components_of(name);
    if (!parts)
      return "it must be point.NAME.fx, point.NAME.tx, group.NAME.fx, group.NAME.tx or wheel.NAME.torque";
    Effect effect = none();
    std::string error;
    if (parts->kind == "wheel")
      error = add_motor(*parts, effect);
    else if (parts->part.size() != 2 || (parts->part[0] != 'f' && parts->part[0] != 't') ||
             kAxes.find(parts->part[1]) == std::string_view::npos)
      return "a point or a group has the inputs fx fy fz, tx ty tz";
    else
      error = parts->kind == "point"   ? add_point_force(*parts, effect)
              : parts->kind == "group" ? add_wrench(*parts, effect)
                                       : "it must begin with point, group or wheel";
    if (!error.empty()) return error;
    inputs_.push_back(std::move(effect));
    model_.inputs.push_back(name);
    return {};
  }

  template <class Items>
  static std::string unknown(const std::string& kind, const std::string& name, const Items& items) {
    std::vector<std::string_view> names;
    names.reserve(items.size());
    for (const auto& each : items) names.push_back(each.name);
    return "the scene has no " + kind + " " + io::reader::quote(name) + io::reader::did_you_mean(name, names);
  }

  static Vector3d unit_of(const std::string& part) {
    return Vector3d::Unit(static_cast<Index>(kAxes.find(part.back())));
  }

  void add_force(const Vector3d& r, int row, const Vector3d& force, Effect& effect) const {
    effect.force += force;
    effect.moment += r.cross(force);
    effect.Q += shapes_of_point(plan_, row).transpose() * force;
  }

  std::string add_point_force(const Name& name, Effect& effect) const {
    const int point = find_named(plan_.points, name.item);
    if (point < 0) return unknown("point", name.item, plan_.points);
    const PlanPoint& of = plan_.points[index(point)];
    const Vector3d unit = unit_of(name.part);
    if (name.part[0] == 'f') return add_force(vector_of(of.r), of.row, unit, effect), std::string();
    const int attitude = attitude_index_of(plan_, point);
    if (attitude < 0) return "the point has no inertia and no offset, so it takes no torque";
    effect.moment += unit;
    effect.Q += rotations_of_body(plan_, attitude).transpose() * unit;
    return {};
  }

  /// Distributes a force or a torque over the mass of a group   (THEORY 8.8).
  std::string add_wrench(const Name& name, Effect& effect) const {
    const int group = find_named(plan_.groups, name.item);
    if (group < 0) return unknown("group", name.item, plan_.groups);
    const PlanGroup& of = plan_.groups[index(group)];
    const Vector3d unit = unit_of(name.part);
    const Matrix3d inverse = matrix_of(of.inverse_inertia);
    Vector3d torque = Vector3d::Zero();
    for (const std::int32_t carrier : carriers_of_group(plan_, index(group))) {
      const PlanPoint& mass = mass_point(plan_, carrier);
      if (mass.row < 0) return "the plan does not have the motion of each of its points";
      const Vector3d d = vector_of(mass.r) - vector_of(of.centre);
      const Vector3d force = name.part[0] == 'f' ? Vector3d(mass.mass / of.mass * unit)
                                                 : Vector3d(mass.mass * (inverse * unit).cross(d));
      add_force(vector_of(mass.r), mass.row, force, effect);
      torque += d.cross(force);
    }
    // a part of the torque that is lost is of its size, or a rounding error
    constexpr double kRounding = 1e-6;
    if (name.part[0] == 't' && (torque - unit).norm() > kRounding)
      return "the points of the group are on a line, about which they take no torque";
    return {};
  }

  std::string add_motor(const Name& name, Effect& effect) const {
    const int wheel = find_named(plan_.wheels, name.item);
    if (wheel < 0) return unknown("wheel", name.item, plan_.wheels);
    if (name.part != "torque") return "a wheel has the input torque only";
    const PlanWheel& of = plan_.wheels[index(wheel)];
    effect.wheels[wheel] = 1.0;
    effect.moment -= vector_of(of.axis);
    effect.Q -= rotations_of_body(plan_, of.attitude_index).transpose() * vector_of(of.axis);
    return {};
  }

  OutputRow empty_row() const {
    return {RowVectorXd::Zero(size_), RowVectorXd::Zero(size_), VectorXd::Zero(padded_)};
  }

  std::string add_output(const std::string& name) {
    OutputRow row = empty_row();
    const auto state = std::find(model_.states.begin(), model_.states.end(), name);
    if (state != model_.states.end()) {
      row.of_state[state - model_.states.begin()] = 1.0;
    } else {
      const auto parts = components_of(name);
      if (!parts) return "it must be a state, point.NAME.x, point.NAME.dx, link.NAME.axial or alike";
      std::string error = parts->kind == "point"  ? read_point(*parts, row)
                          : parts->kind == "link" ? read_link(*parts, row)
                                                  : "it must begin with point or link, or be a state";
      if (!error.empty()) return error;
    }
    rows_.push_back(std::move(row));
    model_.outputs.push_back(name);
    return {};
  }

  std::string read_point(const Name& name, OutputRow& row) const {
    const int point = find_named(plan_.points, name.item);
    if (point < 0) return unknown("point", name.item, plan_.points);
    const std::string& part = name.part;
    const char letter = part.size() == 2 ? part[0] : 'p';
    if (part.empty() || part.size() > 2 || kAxes.find(part.back()) == std::string_view::npos ||
        std::string_view("pvadrw").find(letter) == std::string_view::npos)
      return "a point has the outputs x y z, vx .., ax .., dx .., and a body rx .., wx ..";
    const Vector3d unit = unit_of(part);
    const PlanPoint& of = plan_.points[index(point)];
    const bool is_rotation = letter == 'r' || letter == 'w';
    const int attitude = attitude_index_of(plan_, point);
    if (is_rotation && attitude < 0) return "the point has no inertia and no offset, so it has no rotation";
    const RowVectorXd shape =
        unit.transpose() *
        (is_rotation ? rotations_of_body(plan_, attitude) : shapes_of_point(plan_, of.row)).leftCols(n_);
    // displacement: p + theta x r + b q; rotation: theta + Theta q
    RowVectorXd level = RowVectorXd::Zero(size_), rate = level;
    level.segment(q(), n_) = rate.segment(q_dot(), n_) = shape;
    if (letter != 'd') {
      const Eigen::RowVector3d turned =
          is_rotation ? Eigen::RowVector3d(unit) : Eigen::RowVector3d(vector_of(of.r).cross(unit));
      level.segment<3>(3) = rate.segment<3>(9) = turned;
      if (!is_rotation) level.segment<3>(0) = rate.segment<3>(6) = unit;
    }
    (letter == 'a' ? row.of_rate : row.of_state) =
        letter == 'v' || letter == 'w' || letter == 'a' ? rate : level;
    return {};
  }

  std::string read_link(const Name& name, OutputRow& row) const {
    const int link = find_named(plan_.links, name.item);
    if (link < 0) return unknown("link", name.item, plan_.links);
    const auto output = std::find_if(plan_.link_outputs.begin(), plan_.link_outputs.end(),
                                     [link](const PlanLinkOutput& each) { return each.link == link; });
    if (output == plan_.link_outputs.end())
      return "the plan has no forces of this link: on the rung rigid no link has forces, and rigid links "
             "that share a load have no unique ones";
    const bool is_word = output->num_rows == 1 && (name.part == "axial" || name.part == "moment");
    const auto value = is_word ? 1 : io::reader::parse_integer(name.part, 1, output->num_rows).value_or(0);
    if (value == 0) return "the link has the outputs 1 to " + std::to_string(output->num_rows);
    const auto rows = [&](std::int32_t first) {
      return Eigen::Map<const RowVectorXd>(plan_.link_rows.data() + (first + value - 1) * padded_, padded_);
    };
    row.of_state.segment(q(), n_) = rows(output->first_row).head(n_);
    if (output->first_rate_row >= 0)
      row.of_state.segment(q_dot(), n_) = rows(output->first_rate_row).head(n_);
    if (output->first_load_row < 0) return {};
    if (has_coupling_)
      return "the force of a rigid link also depends on the forces of dashpots and feedback, which the model "
             "does not have as inputs; remove them, or choose another output";
    row.of_load = rows(output->first_load_row).transpose();
    return {};
  }

  const Plan& plan_;
  Index n_, padded_, num_wheels_, size_;
  Matrix3d inverse_inertia_;
  bool has_coupling_ = false;  // by dashpots or feedback
  StateSpace model_;
  std::vector<Effect> inputs_;
  std::vector<OutputRow> rows_;
};

}  // namespace

void set_outputs(StateSpace& model) {
  model.C = model.by_state + model.by_rate * model.A;
  model.D = model.by_rate * model.B + model.by_load;
}

StateSpaceResult make_state_space(const Plan& plan, const Ports& ports) { return Builder(plan).make(ports); }

}  // namespace freeflex::control
