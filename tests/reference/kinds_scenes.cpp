// The random structures of `kinds.hpp`.
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/scene/bodies.hpp"
#include "tests/reference/kinds.hpp"
#include "tests/reference/structures.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tests/setup/condense.hpp"
#include "tests/support/mixed_structures.hpp"

namespace freeflex::testing {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

double lowest_frequency(const Structure& structure) {
  return *std::find_if(structure.omega.begin(), structure.omega.end(), [](double w) { return w > 0.0; });
}

// Rotates the structure and pushes points 0 and 2 along axes of the world.
void push_and_spin(Scene& scene, Random& random, double speed) {
  const double lowest = std::clamp(lowest_frequency(build(scene)), 8.0, 20.0);
  scene.initial.angular_velocity = 0.3 * speed * lowest * random.vector();
  const double force = 0.06 * speed * lowest * lowest;
  push(scene, 0, Axes::kWorld, force * random.vector());
  scene.loads.back().history = SineHistory{0.7 * lowest / (2.0 * M_PI), 0.4};
  push(scene, 2, Axes::kWorld, force * random.vector());
  scene.loads.back().history = PulseHistory{0.1, 0.1};
}

// Rotates and pushes the structure, and gives it elastic velocities of its lowest six modes.
void kick(Scene& scene, Random& random, double speed) {
  const Structure structure = build(scene);
  const double lowest = lowest_frequency(structure);
  const auto count = static_cast<Eigen::Index>(scene.points.size());
  VectorXd V = VectorXd::Zero(3 * count);
  Eigen::Index first = 0;
  while (structure.omega[first] == 0.0) ++first;
  for (Eigen::Index l = first; l < std::min(first + 6, structure.omega.size()); ++l)
    V += random.one() * lowest / structure.omega[l] * structure.shapes.col(l).head(3 * count);
  const double size = structure.mass_properties.r.colwise().norm().maxCoeff();
  V *= 0.01 * speed * size * std::sqrt(static_cast<double>(count)) / V.norm();
  for (int i = 0; i < count; ++i)
    scene.initial.points.push_back(
        {i, Vector3d::Zero(), std::max(lowest, 8.0) * V.segment<3>(3 * Eigen::Index{i})});
  push_and_spin(scene, random, speed);
}

Specimen moving(Scene scene, Random& random, double speed = 1.0) {
  kick(scene, random, speed);
  return {scene};
}

// Eight points near the corners of a box, all joined by springs and bars.
Scene box(Random& random) {
  Scene scene;
  for (int i = 0; i < 8; ++i)
    add_point(scene, 1.0 + 0.4 * random.one(),
              Vector3d(2.0 * (i % 2), 1.6 * (i / 2 % 2), 1.2 * (i / 4)) + 0.2 * random.vector());
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) {
      const double stiffness = 2e2 * std::pow(10.0, 1.0 + random.one());
      if ((i + j) % 2 == 0)
        add_link(scene, j, i,
                 Bar{stiffness * (scene.points[index(i)].position - scene.points[index(j)].position).norm()});
      else
        add_link(scene, j, i, Spring{stiffness});
    }
  return scene;
}

Specimen springs(Random& random) { return moving(box(random), random); }

Specimen dashpots(Random& random) {
  Scene scene = box(random);
  for (int i = 0; i < 6; ++i) add_link(scene, i, i + 2, Dashpot{5.0 + 4.0 * random.one()});
  return moving(scene, random);
}

// A zigzag of beams along directions that no axis of the scene has, with a side arm.
Scene beams(Random& random, const std::function<void(Beam&)>& change = {}) {
  Scene scene;
  for (int i = 0; i < 7; ++i)
    add_point(scene, 1.0 + 0.3 * random.one(), Vector3d(i, 0.3 * (i % 2), 0.0) + 0.3 * random.vector());
  add_point(scene, 1.0, Vector3d(3.0, 1.0, 0.4) + 0.2 * random.vector());
  for (int i = 0; i < 7; ++i) {
    Beam beam{.EA = 2e5, .GJ = 300.0, .EI_y = 300.0, .EI_z = 300.0};
    if (change) change(beam);
    add_link(scene, i < 6 ? i : 3, i + 1, beam);
  }
  return scene;
}

Specimen plain_beams(Random& random) { return moving(beams(random), random); }

Specimen shear_beams(Random& random) {
  return moving(beams(random,
                      [&](Beam& beam) {
                        beam.GA_y = 1500.0 * (1.5 + random.one());
                        beam.GA_z = 1500.0 * (1.5 + random.one());
                      }),
                random);
}

// Each beam has its own roll about its chord, and its two bending stiffnesses differ tenfold.
Specimen rolled_beams(Random& random) {
  return moving(beams(random,
                      [&](Beam& beam) {
                        beam.EI_y = 100.0 * (1.2 + random.one());
                        beam.EI_z = 10.0 * beam.EI_y;
                        beam.y_axis = random.vector();
                      }),
                random);
}

// Three ends release rotations: about one axis, about two, and about all three.
Specimen hinges(Random& random) {
  Scene scene = beams(random);
  std::get<Beam>(scene.links[1].kind).released[1] = {false, true, false};
  std::get<Beam>(scene.links[3].kind).released[0] = {false, true, true};
  // this beam closes a triangle with links 2 and 6
  add_link(
      scene, 2, 7,
      Beam{.EA = 2e5, .GJ = 300.0, .EI_y = 300.0, .EI_z = 300.0, .released = {{{true, true, true}, {}}}});
  return moving(scene, random, 0.3);
}

Specimen spread_beams(Random& random) {
  Scene scene = beams(random, [&](Beam& beam) { beam.mass_per_length = 0.8 + 0.3 * random.one(); });
  kick(scene, random, 1.0);
  return {scene, Truth::kFine};
}

// The velocity varies linearly along a bar, so the mass matrix of all bars is constant in space. The
// reference solves with it.
Specimen spread_bars(Random& random) {
  Scene scene = box(random);
  for (Link& link : scene.links)
    if (Bar* bar = std::get_if<Bar>(&link.kind)) bar->mass_per_length = 0.3 + 0.2 * random.one();
  push_and_spin(scene, random, 1.0);
  const auto n = static_cast<Eigen::Index>(scene.points.size());
  MatrixXd M = MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) M(i, i) = scene.points[static_cast<std::size_t>(i)].mass;
  Scene lumped = scene;
  for (Link& link : lumped.links) {
    Bar* bar = std::get_if<Bar>(&link.kind);
    if (bar == nullptr) continue;
    const int i = link.points[0], j = link.points[1];
    const double mass =
        bar->mass_per_length * (scene.points[index(i)].position - scene.points[index(j)].position).norm();
    M(i, i) += mass / 3.0, M(j, j) += mass / 3.0, M(i, j) += mass / 6.0, M(j, i) += mass / 6.0;
    lumped.points[index(i)].mass += 0.5 * mass, lumped.points[index(j)].mass += 0.5 * mass;
    bar->mass_per_length = 0.0;
  }
  const MatrixXd inverse = M.inverse();
  return {scene, Truth::kForces, lumped, [inverse](CartesianSystem& system) {
            system.change_forces = [inverse, mass = system.mass](double, const Matrix3Xd&, const Matrix3Xd&,
                                                                 Eigen::Ref<Matrix3Xd> force) {
              force = (force * inverse * mass.asDiagonal()).eval();
            };
          }};
}

// A sheet that is not flat, so that its plates meet at angles.
Specimen plates(Random& random) {
  Scene scene;
  for (int i = 0; i < 9; ++i)
    add_point(scene, 1.0 + 0.3 * random.one(), Vector3d(i % 3, i / 3, 0.0) + 0.15 * random.vector());
  for (const int corner : {0, 1, 3, 4}) {
    const Plate plate{5e5, 0.3, 0.08};
    add_link(scene, {corner, corner + 1, corner + 4}, plate);
    add_link(scene, {corner, corner + 4, corner + 3}, plate);
  }
  return moving(scene, random);
}

Scene zigzag(Random& random) {
  Scene scene;
  for (int i = 0; i < 7; ++i)
    add_point(scene, 1.0 + 0.3 * random.one(),
              Vector3d(i, 0.6 * (i % 2), 0.5 * (i / 2 % 2)) + 0.2 * random.vector());
  for (int i = 0; i < 6; ++i) add_link(scene, i, i + 1, Spring{2e4});
  return scene;
}

Specimen bending_springs(Random& random) {
  Scene scene = zigzag(random);
  for (int i = 0; i < 5; ++i) add_link(scene, {i, i + 1, i + 2}, BendingSpring{300.0});
  for (int i = 0; i < 4; ++i) add_link(scene, i, i + 3, Spring{60.0});
  return moving(scene, random);
}

Specimen torsion_springs(Random& random) {
  Scene scene = zigzag(random);
  for (int i = 0; i < 5; ++i) add_link(scene, i, i + 2, Spring{500.0});
  for (int i = 0; i < 4; ++i) add_link(scene, {i, i + 1, i + 2, i + 3}, TorsionSpring{100.0});
  return moving(scene, random);
}

Specimen rigid_bodies(Random& random) {
  Scene scene = bodies(random);
  kick(scene, random, 1.0);
  return {scene};
}

// Two rigid bodies of four point masses each, joined by a chain of beams. In the scene, the first point of
// each body has all its mass and inertia. The other points are absent, or massless.
Specimen craft(Random& random, bool has_massless_points) {
  Scene points;
  const Vector3d corners[] = {{0.0, 0.0, 0.0}, {0.6, 0.0, 0.1}, {0.1, 0.5, 0.0}, {0.0, 0.1, 0.5}};
  const Vector3d at[] = {{0.0, 0.0, 0.0}, {4.0, 0.4, -0.2}};
  const auto corner = [&](int body, int k) {
    add_point(points, 1.5 + 0.5 * random.one(), at[body] + corners[k] + 0.1 * random.vector());
  };
  for (const int body : {0, 1}) corner(body, 0);
  for (int i = 1; i < 4; ++i)
    add_point(points, 0.8, Vector3d(i + 0.2, 0.3 * (i % 2), 0.1 * i) + 0.1 * random.vector());
  for (const int body : {0, 1})
    for (const int k : {1, 2, 3}) corner(body, k);
  const std::vector<int> members[] = {{0, 5, 6, 7}, {1, 8, 9, 10}};
  const int joints[] = {has_massless_points ? 5 : 0, has_massless_points ? 8 : 1};
  const Beam beam{1e5, 300.0, 200.0, 400.0, {0.1, 0.9, -0.2}};
  for (const auto& [i, j] : {std::pair{joints[0], 2}, {2, 3}, {3, 4}, {4, joints[1]}})
    add_link(points, i, j, beam);
  if (has_massless_points) add_link(points, 6, 3, Spring{3e2});
  for (const auto& body : members) add_link(points, body, Rigid{});
  Scene scene = points;
  for (const auto& body : members) {
    PointMass& first = scene.points[index(body[0])];
    double mass = 0.0;
    Vector3d centre = Vector3d::Zero();
    for (const int i : body) {
      mass += points.points[index(i)].mass;
      centre += points.points[index(i)].mass * points.points[index(i)].position;
    }
    centre /= mass;
    Matrix3d second = Matrix3d::Zero();
    for (const int i : body) {
      const Vector3d d = points.points[index(i)].position - centre;
      second += points.points[index(i)].mass * d * d.transpose();
      scene.points[index(i)].mass = 0.0;
    }
    first.mass = mass;
    first.offset = centre - first.position;
    first.inertia = second.trace() * Matrix3d::Identity() - second;
  }
  if (!has_massless_points) {
    scene.links.resize(4);
    scene.points.resize(5);
  }
  push_and_spin(scene, random, 0.8);
  points.initial = scene.initial;
  points.loads = scene.loads;
  return {scene, Truth::kCopy, points};
}

Specimen inertia(Random& random) { return craft(random, false); }
Specimen massless_points(Random& random) { return craft(random, true); }

// A free wheel on the first body, and a wheel with a motor on the second. The moment of a wheel on its body
// is -tau a - w x (h a), h' = tau.
Specimen wheels(Random& random) {
  Specimen specimen = craft(random, false);
  Load motor;
  for (const int k : {0, 1}) {
    Wheel wheel;
    wheel.name = "wheel " + std::to_string(k);
    wheel.point = k;
    wheel.axis = random.vector().normalized();
    wheel.momentum = 4.0 + random.one();
    specimen.scene.wheels.push_back(wheel);
  }
  constexpr double kTorque = 3.0;  // [N m]
  motor.wheels.push_back({1, kTorque});
  specimen.scene.loads.push_back(motor);
  specimen.truth = Truth::kForces;
  specimen.complete = [wheels = specimen.scene.wheels](CartesianSystem& system) {
    const auto frame_of = [&](const std::vector<int>& points) {
      return FittedFrame(points, VectorXd::Ones(4), system.r);
    };
    system.change_forces = [wheels, frames = std::array{frame_of({0, 5, 6, 7}), frame_of({1, 8, 9, 10})}](
                               double t, const Matrix3Xd& x, const Matrix3Xd& v,
                               Eigen::Ref<Matrix3Xd> force) {
      for (std::size_t k = 0; k < 2; ++k) {
        const double torque = k == 1 ? kTorque : 0.0;
        const FittedFrame::Fit fit = frames[k].fit(x);
        const Vector3d h = (wheels[k].momentum + torque * t) * wheels[k].axis;
        frames[k].add_moment(fit, -torque * wheels[k].axis - frames[k].spin(fit, v).cross(h), force);
      }
    };
  };
  return specimen;
}

FittedFrame frame_of_all(const CartesianSystem& system) {
  std::vector<int> all;
  for (int i = 0; i < system.mass.size(); ++i) all.push_back(i);
  return {all, system.mass, system.r};
}

// Adds forces s = A dF/dt, with F the elastic forces along the axes fitted to all points, of which
// `with_axial` includes those of springs and bars   (THEORY 12.114). The rates are differences of order 2.
void add_force_rates(CartesianSystem& system, const MatrixXd& A, bool with_axial) {
  const FittedFrame frame = frame_of_all(system);
  CartesianSystem links = system;
  links.loads.clear();
  links.attractor_mu = 0.0;
  links.spin.setZero();
  if (!with_axial) links.links.clear();
  system.change_forces = [A, frame, links](double, const Matrix3Xd& x, const Matrix3Xd& v,
                                           Eigen::Ref<Matrix3Xd> force) {
    const FittedFrame::Fit fit = frame.fit(x);
    const Matrix3Xd V_dot = frame.rates(fit, v);
    const double step = 1e-5 / std::max(1e-6, V_dot.colwise().norm().maxCoeff());  // [s], to 10 um
    const VectorXd at_rest = VectorXd::Zero(x.size());
    const auto forces_at = [&](double time) {
      const Matrix3Xd e = fit.V + time * V_dot;
      VectorXd a(x.size());
      accelerations(links, 0.0, 0.0, {e.data(), static_cast<std::size_t>(e.size())},
                    {at_rest.data(), static_cast<std::size_t>(e.size())},
                    {a.data(), static_cast<std::size_t>(e.size())});
      return (a.reshaped(3, x.cols()) * links.mass.asDiagonal()).reshaped().eval();
    };
    const VectorXd s = A * (forces_at(step) - forces_at(-step)) / (2.0 * step);
    frame.add_forces(fit, s.reshaped(3, x.cols()), force);
  };
}

Specimen strain_damped_beams(Random& random) {
  Scene scene = beams(random);
  kick(scene, random, 1.0);
  const Scene points = scene;
  scene.damping.beta = 1e-3;
  return {scene, Truth::kForces, points, [](CartesianSystem& system) {
            add_force_rates(system, 1e-3 * MatrixXd::Identity(system.r.size(), system.r.size()), false);
          }};
}

Specimen strain_damped_springs(Random& random) {
  Scene scene = box(random);
  for (Link& link : scene.links) link.viscous = 2e-3 * (1.0 + random.one());
  return moving(scene, random);
}

Specimen modal_damping(Random& random) {
  Scene scene = beams(random);
  kick(scene, random, 1.0);
  const Scene points = scene;
  constexpr double kRatio = 0.02;
  scene.damping.modal_ratio = kRatio;
  return {scene, Truth::kForces, points, [](CartesianSystem& system) {
            const RestModes modes = rest_modes(system);
            const VectorXd mass = system.mass.transpose().replicate<3, 1>().reshaped();
            const VectorXd times = 2.0 * kRatio * modes.omega.cwiseInverse();
            add_force_rates(system,
                            mass.asDiagonal() * modes.shapes * times.asDiagonal() * modes.shapes.transpose(),
                            true);
          }};
}

// The reference finds the displacement of the sensor and its rate in axes fitted to all points.
void add_feedback(CartesianSystem& system, const Feedback& control) {
  const FittedFrame frame = frame_of_all(system);
  system.change_forces = [control, frame](double, const Matrix3Xd& x, const Matrix3Xd& v,
                                          Eigen::Ref<Matrix3Xd> force) {
    const FittedFrame::Fit fit = frame.fit(x);
    force.col(control.point) += fit.R * (control.displacement_gain * fit.V.col(control.sensor) +
                                         control.velocity_gain * frame.rates(fit, v).col(control.sensor));
  };
}

Specimen feedback(Random& random) {
  Scene scene = beams(random);
  Feedback control;
  control.name = "control";
  control.point = 6;
  control.sensor = 1;
  control.displacement_gain = 40.0 * Matrix3d::NullaryExpr([&] { return random.one(); });
  control.velocity_gain =
      -4.0 * Matrix3d::Identity() + 2.0 * Matrix3d::NullaryExpr([&] { return random.one(); });
  kick(scene, random, 1.0);
  Scene points = scene;
  scene.feedbacks.push_back(control);
  return {scene, Truth::kForces, points,
          [control](CartesianSystem& system) { add_feedback(system, control); }};
}

// A sensor and an actuator on two rigid bodies.
Specimen feedback_of_bodies(Random& random) {
  Specimen specimen = craft(random, true);
  Feedback control;
  control.name = "control";
  control.point = 8;
  control.sensor = 6;
  control.displacement_gain = 40.0 * Matrix3d::NullaryExpr([&] { return random.one(); });
  control.velocity_gain = -4.0 * Matrix3d::Identity();
  specimen.scene.feedbacks.push_back(control);
  specimen.truth = Truth::kForces;
  specimen.complete = [control](CartesianSystem& system) { add_feedback(system, control); };
  return specimen;
}

Specimen followers(Random& random) {
  Scene scene = beams(random);
  kick(scene, random, 1.0);
  for (const int point : {0, 5, 7}) push(scene, point, Axes::kLocal, 10.0 * random.vector());
  return {scene};
}

// Free fall past an attractor at 12 sizes of the structure, which turns through 0.4 rad as seen from it.
Specimen attractor(Random& random) {
  Scene scene = beams(random);
  kick(scene, random, 1.0);
  scene.initial.position = 50.0 * random.vector().normalized();
  scene.initial.velocity = 50.0 * random.vector();
  scene.attractor.mu = 1e5;
  return {scene};
}

Specimen matrix_links(Random& random) {
  Scene scene = matrices(random);
  kick(scene, random, 1.0);
  return {scene};
}

// The same blocks, each given by the pseudoinverse of its stiffness.
Specimen flexibility_links(Random& random) {
  Scene scene = matrices(random);
  for (Link& link : scene.links) {
    MatrixLink* matrix = std::get_if<MatrixLink>(&link.kind);
    if (matrix == nullptr) continue;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen{MatrixXd(matrix->matrix)};
    const VectorXd inverse = eigen.eigenvalues().unaryExpr([&](double k) { return k > 1.0 ? 1.0 / k : 0.0; });
    matrix->matrix =
        MatrixXd(eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose()).sparseView();
    matrix->is_flexibility = true;
  }
  kick(scene, random, 1.0);
  return {scene};
}

// Links of all these kinds in one structure. Its rigid link has at least three points: rigid links of two
// points have a test of their own (massless_test).
Specimen mixture(Random& random) {
  Scene scene;
  do scene = random_mixture(static_cast<std::uint64_t>(1e6 * (2.0 + random.one())), 8);
  while (scene.links.back().points.size() < 3);
  return moving(scene, random, 0.5);
}

// Massless points on springs, whose forces balance at every moment.
Specimen massless_nodes(Random& random) {
  Scene scene = box(random);
  for (int k = 0; k < 3; ++k) {
    const int node = add_point(scene, 0.0, Eigen::Vector3d(0.5 + 0.5 * k, 0.8, 0.6) + 0.2 * random.vector());
    for (const int corner : {0, 1, 3, 4, 6, 7})
      add_link(scene, node, corner, Spring{1e3 * (1.2 + random.one())});
  }
  push_and_spin(scene, random, 1.0);
  return {scene};
}

// Rigid links of points on a line, which have no roll   (THEORY 12.118).
Specimen rod_links(Random& random) {
  Scene scene = rods(random);
  kick(scene, random, 1.0);
  return {scene};
}

// Two pairs of beams are superelements over displacements and rotations of three points each. The whole
// structure has the beams.
Specimen superelements(Random& random) {
  const Scene whole = beams(random);
  Scene scene = whole;
  scene.links = {whole.links[2], whole.links[3], whole.links[6]};
  for (const int first : {0, 4}) {
    MatrixXd K = MatrixXd::Zero(18, 18);
    for (const int i : {0, 1}) {
      const Vector3d span =
          scene.points[index(first + i + 1)].position - scene.points[index(first + i)].position;
      const Matrix3d axes = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), span).toRotationMatrix();
      K.block<12, 12>(6 * i, 6 * i) +=
          beam_stiffness(std::get<Beam>(whole.links[index(first + i)].kind), axes, span.norm());
    }
    MatrixLink matrix;
    matrix.has_rotations = true;
    matrix.matrix = K.sparseView();
    add_link(scene, {first, first + 1, first + 2}, matrix);
  }
  Specimen specimen{whole, Truth::kFine};
  kick(specimen.scene, random, 1.0);
  specimen.whole = specimen.scene;
  specimen.scene.links = scene.links;
  return specimen;
}

// Seven beams with the six point masses between them are a superelement with a mass matrix and four inner
// coordinates. The whole structure has the beams.
Specimen mass_matrices(Random& random) {
  Scene whole;
  const Vector3d at[] = {{0.0, 0.0, 0.0}, {1.0, 0.3, 0.0}, {2.0, 0.0, 0.0},
                         {3.0, 0.3, 0.0}, {6.0, 0.3, 0.0}, {3.0, 1.0, 0.4}};
  for (const Vector3d& each : at) add_point(whole, 1.0 + 0.3 * random.one(), each + 0.2 * random.vector());
  const Vector3d first = whole.points[3].position, span = whole.points[4].position - first;
  for (int k = 1; k <= 6; ++k) add_point(whole, 0.3, first + k / 7.0 * span + 0.1 * random.vector());
  const Beam beam{.EA = 2e5, .GJ = 300.0, .EI_y = 300.0, .EI_z = 300.0};
  for (const auto& [i, j] : {std::pair{0, 1}, {1, 2}, {2, 3}, {3, 5}}) add_link(whole, i, j, beam);
  for (const auto& [i, j] : {std::pair{3, 6}, {6, 7}, {7, 8}, {8, 9}, {9, 10}, {10, 11}, {11, 4}})
    add_link(whole, i, j, beam);
  Specimen specimen{condensed(whole, 4, {3, 4}, {0, 1, 2, 3, 4, 5}, 4), Truth::kFine};
  push_and_spin(specimen.scene, random, 1.5);
  whole.initial = specimen.scene.initial;
  whole.loads = specimen.scene.loads;
  specimen.whole = whole;
  return specimen;
}

}  // namespace

// The bounds of the errors are twice the largest that was measured over five structures. That of hinges is
// the largest because parts rotate far about them. The integration has order 4; the bound of 3.5 allows for
// terms of higher order and for the reference.
const std::vector<Kind>& all_kinds() {
  constexpr double kNoOrder = -HUGE_VAL;  // the error does not come from the integration, see below
  static const std::vector<Kind> kinds{
      {"springs and bars", springs, 3e-8, 3.5},
      {"dashpots", dashpots, 6e-8, 3.5},
      {"bars with mass", spread_bars, 2e-8, 3.5},
      {"beams", plain_beams, 5e-7, 3.5},
      {"beams with shear", shear_beams, 8e-7, 3.5},
      {"beams that are stiffer in one plane", rolled_beams, 2e-6, 3.5},
      {"beams with hinges", hinges, 3e-5, 3.5},
      {"beams with mass", spread_beams, 6e-7, 3.5},
      {"plates", plates, 6e-8, 3.5},
      {"bending springs", bending_springs, 8e-8, 3.5},
      {"torsion springs", torsion_springs, 2e-8, 3.5},
      {"rigid links", rigid_bodies, 1.5e-7, 3.5},
      {"rods", rod_links, 8e-7, 3.5},
      {"massless points on springs", massless_nodes, 3e-8, 3.5},
      {"stiffness matrices", matrix_links, 4e-9, 3.5},
      {"flexibility matrices", flexibility_links, 4e-9, 3.5},
      {"superelements", superelements, 5e-7, 3.5},
      // order 4 in four of five structures; in one the error stays at 8e-7 from 1 to 0.5 ms
      {"superelements with mass", mass_matrices, 2e-6, kNoOrder},
      {"beams, plates, angle springs, matrices and bodies", mixture, 5e-7, 3.5},
      {"points with inertia and offset", inertia, 8e-8, 3.5},
      {"massless points on bodies", massless_points, 2e-7, 3.5},
      {"wheels, one with a motor", wheels, 2e-7, 3.5},
      {"springs with damped strain", strain_damped_springs, 1.5e-8, 3.5},
      // the step takes the rates of strains as differences over 5e-6 of the size (THEORY 12.114), which does
      // not depend on the tick
      {"beams with damped strain", strain_damped_beams, 2e-7, kNoOrder},
      {"modal damping", modal_damping, 2e-7, kNoOrder},
      {"feedback", feedback, 4e-7, 3.5},
      // the displacement and the force on a body are those of small rotations, of which the set-up warns
      {"feedback between bodies", feedback_of_bodies, 1e-2, kNoOrder},
      {"follower loads", followers, 1.5e-6, 3.5},
      // the resultant of the attraction on the displaced points is split from the orbit to order 2
      {"attractor", attractor, 8e-7, 1.8}};
  return kinds;
}

}  // namespace freeflex::testing
