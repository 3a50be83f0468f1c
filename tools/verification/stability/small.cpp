// Compares motions of one, two and three points, of mechanisms and of rigid links with textbook solutions.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/scene/link_kinds.hpp"
#include "tools/verification/stability/ride.hpp"
#include "tools/verification/stability/scenes.hpp"

namespace freeflex::tools {
namespace {

/// Returns the largest relative difference between the frequencies of the plan and the exact frequencies, or
/// NaN if the plan has another number of frequencies.
double worst_frequency(const Plan& plan, std::vector<double> exact) {
  std::sort(exact.begin(), exact.end());
  if (index(plan.num_elastic) != exact.size()) return NAN;
  double worst = 0.0;
  for (std::size_t k = 0; k < exact.size(); ++k)
    worst = std::max(worst, std::abs(plan.omega[k] / exact[k] - 1.0));
  return worst;
}

/// Compares the motion of one point with p = p0 + v t + (F / m + g) t^2 / 2.
Outcome one_point(const StabilityOptions& options) {
  Scene scene;
  scene.name = "point";
  add_point(scene, 2.0, {0.5, 0.0, 0.0});
  add_force(scene, 0, {3.0, -1.0, 0.5});
  scene.gravity = {0.0, 0.0, -9.81};
  scene.initial.velocity = {1.0, 2.0, 3.0};
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  if (!ride.run(10'000)) return no_answer("a state is not finite");
  const double t = 10'000 * ride.plan.period;
  const Eigen::Vector3d exact = Eigen::Vector3d(0.5, 0.0, 0.0) + t * scene.initial.velocity +
                                0.5 * t * t * (Eigen::Vector3d(1.5, -0.5, 0.25) + scene.gravity);
  const auto error = [&exact](const Eigen::Matrix3Xd& p) { return (p.col(0) - exact).norm() / exact.norm(); };
  return {
      error(ride.positions_W()), "relative, after 10 s",
      run_peers(scene, 1e-3, 10.0, options, [&](const CartesianState& state) { return error(state.p_W); })};
}

/// Compares the frequency with w = sqrt(k (1/m1 + 1/m2)), and the attitude with a steady rotation about an
/// axis normal to the line.
Outcome two_points(const StabilityOptions&) {
  Scene scene = oscillating_pair(200.0, 1000.0);
  scene.initial.angular_velocity = {0.0, 0.0, 0.7};
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  if (ride.plan.rigid_freedoms != 5) return no_answer("the shape is not recognized as collinear");
  if (!ride.run(10'000)) return no_answer("a state is not finite");
  const double frequency = worst_frequency(ride.plan, {200.0});
  const double half = 0.5 * 0.7 * 10'000 * ride.plan.period;
  const double angle =
      2.0 * std::abs(ride.state().q_WB[0] * std::sin(half) - ride.state().q_WB[3] * std::cos(half));
  return {std::max(frequency, angle), "5 rigid freedoms, 1 mode; larger of frequency and attitude [rad]", {}};
}

/// An equilateral triangle of equal masses has the frequencies sqrt(3 k / m) and, twice, sqrt(3 k / 2 m).
Outcome three_in_a_triangle(const StabilityOptions&) {
  constexpr double kStiffness = 1e4;
  Scene scene;
  scene.name = "triangle";
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0.5, 0.5 * std::sqrt(3.0), 0)})
    add_point(scene, 1.0, p);
  for (int a = 0; a < 3; ++a) add_link(scene, {a, (a + 1) % 3}, Spring{kStiffness});
  const Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  const double twice = std::sqrt(1.5 * kStiffness);
  return {worst_frequency(ride.plan, {twice, twice, std::sqrt(3.0 * kStiffness)}),
          "6 rigid freedoms, 3 modes",
          {}};
}

/// The linear molecule X Y X has the squared frequencies k / m, k (1/m + 2/M) and, twice,
/// 2 k_b (1/m + 2/M) / l^2   (Herzberg 1945, II 4).
Outcome three_on_a_line(const StabilityOptions&) {
  constexpr double kEnd = 16.0, kMiddle = 12.0, kStretching = 1e4, kBending = 300.0;
  Scene scene;
  scene.name = "linear molecule";
  for (int i = 0; i < 3; ++i)
    add_point(scene, i == 1 ? kMiddle : kEnd, 0.5 * i * Eigen::Vector3d(0.36, 0.48, 0.8));
  add_link(scene, {0, 1}, Spring{kStretching});
  add_link(scene, {1, 2}, Spring{kStretching});
  add_link(scene, {0, 1, 2}, BendingSpring{kBending});
  const Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  if (ride.plan.rigid_freedoms != 5) return no_answer("the shape is not recognized as collinear");
  const double both = 1.0 / kEnd + 2.0 / kMiddle, bending = std::sqrt(2.0 * kBending * both / 0.25);
  return {worst_frequency(ride.plan,
                          {std::sqrt(kStretching / kEnd), std::sqrt(kStretching * both), bending, bending}),
          "5 rigid freedoms, 4 modes",
          {}};
}

/// A point that is joined to a stiff truss by one spring moves freely in the directions normal to that
/// spring, so V = v t.
Outcome mechanism(double stiffness_ratio, const StabilityOptions&) {
  Scene scene = stiff_truss(stiffness_ratio, 1.0);
  add_point(scene, 0.5, {2.5, 0.0, 0.0});
  add_link(scene, {8, 12}, Spring{1e3});
  const Eigen::Vector3d line = scene.points[12].position - scene.points[8].position;
  const Eigen::Vector3d across = line.unitOrthogonal();
  scene.initial.points.push_back({12, Eigen::Vector3d::Zero(), 1e-3 * across});
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  const auto zeros =
      std::count(ride.plan.omega.begin(), ride.plan.omega.begin() + ride.plan.num_elastic, 0.0);
  if (zeros != 2 || ride.plan.mechanisms.size() != 2)
    return no_answer(
        format_text("%d modes of frequency 0 were found, but there are 2", static_cast<int>(zeros)));
  const bool is_named = ride.faults_text().find("p12") != std::string::npos;
  if (!is_named) return no_answer("the warning does not name the point: " + ride.faults_text());
  const Array v = ride.state().q_dot;
  if (!ride.run(10'000)) return no_answer("a state is not finite");
  double worst = 0.0, largest = 0.0;
  for (std::size_t l = 0; l < 2; ++l) {
    worst = std::max(worst, std::abs(ride.state().q[l] - v[l] * 10'000 * ride.plan.period));
    largest = std::max(largest, std::abs(ride.state().q[l]));
  }
  return {worst / largest,
          "2 frequencies exactly 0; warned: " + ride.faults_text().substr(0, ride.faults_text().find('\n')),
          {}};
}

/// Five points with ten rigid links, of which nine are independent, and a point on soft springs.
Outcome redundant_links(const StabilityOptions&) {
  Scene scene = nearly_planar(0.5, false);
  for (Link& link : scene.links) link.kind = Rigid{};
  add_point(scene, 1.0, {2.0, 2.0, 2.0});
  for (const int i : {0, 1, 2}) add_link(scene, {i, 5}, Spring{1e3});
  add_force(scene, 5, {1.0, -2.0, 0.5});
  Ride ride(scene);
  if (!ride.has_plan()) return no_answer(ride.faults_text());
  if (ride.faults_text().find("redundant") == std::string::npos)
    return no_answer("there is no message about a redundant link: " + ride.faults_text());
  constexpr int kElastic = 3 * 6 - 6 - 9;
  if (ride.plan.num_elastic != kElastic)
    return no_answer(
        format_text("%d elastic freedoms were found, but there are %d", ride.plan.num_elastic, kElastic));
  if (!ride.run(5'000)) return no_answer("a state is not finite");
  // largest stretch of the rigid links to first order, divided by the largest displacement
  const Eigen::Matrix3Xd V = ride.displacements_B();
  double stretch = 0.0;
  for (const Link& link : scene.links) {
    if (traits_of(link).effect != LinkEffect::kForbids) continue;
    const auto a = link.points[0], b = link.points[1];
    const Eigen::Vector3d u =
        (scene.points[index(b)].position - scene.points[index(a)].position).normalized();
    stretch = std::max(stretch, std::abs(u.dot(V.col(b) - V.col(a))));
  }
  return {stretch / V.cwiseAbs().maxCoeff(),
          "warned: " + ride.faults_text().substr(0, ride.faults_text().find('\n')),
          {}};
}

}  // namespace

void add_small_cases(std::vector<StabilityCase>& cases) {
  const auto add = [&cases](const char* group, const char* name, const char* quantity, double limit,
                            auto run) {
    cases.push_back({group, name, quantity, limit, false, run});
  };
  constexpr const char* kFew = "one to three points";
  add(kFew, "one point, pushed and falling", "position against the parabola, after 10 s", 1e-14, one_point);
  add(kFew, "two points, rotating and vibrating", "frequency and attitude against closed form", 1e-13,
      two_points);
  add(kFew, "three points, a triangle", "worst frequency against closed form", 1e-14, three_in_a_triangle);
  add(kFew, "three points on a line", "worst frequency against closed form", 1e-13, three_on_a_line);
  constexpr const char* kMechanism = "mechanisms and rigid links";
  for (const double ratio : {1.0, 1e8, 1e15})
    cases.push_back({kMechanism, format_text("a point on one spring, stiffness ratio %g", ratio),
                     "free drift against v t, after 10 s", 1e-14, false,
                     [ratio](const StabilityOptions& options) { return mechanism(ratio, options); }});
  add(kMechanism, "ten rigid links of which nine are independent",
      "stretch of rigid links over the deformation", 1e-14, redundant_links);
}

}  // namespace freeflex::tools
