// This file makes random structures with links of every kind, and compares the verdicts on their motion with
// a reference at true geometry. The reference is independent of the verdict.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <span>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "tests/motion/particle_positions.hpp"
#include "tests/motion/rung_cases.hpp"
#include "tests/setup/make_scene.hpp"

namespace freeflex::testing {

/// Returns the scene with one stiffness matrix in place of all its links, so that its internal forces are
/// unknown.
inline Scene as_matrix(Scene scene) {
  const Eigen::Index n = 3 * static_cast<Eigen::Index>(scene.points.size());
  Faults faults;
  const auto structure = build_structure(scene, faults);
  Eigen::MatrixXd weighted = structure->shapes;
  for (Eigen::Index i = 0; i < n; ++i) weighted.row(i) *= scene.points[static_cast<std::size_t>(i / 3)].mass;
  const Eigen::MatrixXd K = weighted * structure->omega.cwiseAbs2().asDiagonal() * weighted.transpose() /
                            structure->mass_properties.mass;
  scene.links.clear();
  Link link;
  link.name = "K";
  for (int k = 0; k < static_cast<int>(scene.points.size()); ++k) link.points.push_back(k);
  link.kind = MatrixLink{(0.5 * (K + K.transpose())).sparseView(), false};
  scene.links.push_back(link);
  return scene;
}

class RandomScene {
 public:
  explicit RandomScene(std::uint64_t seed) : engine_(seed) {
    const int kind = integer(0, 5);
    if (kind == 0) make_chain(false);
    if (kind == 1) make_chain(true);
    if (kind == 2) make_ladder();
    if (kind == 3) make_cloud();
    if (kind == 4) make_plates();
    if (kind == 5) make_mixture();
    name_ =
        std::array{"chain", "angles", "ladder", "cloud", "plates", "mixture"}[static_cast<std::size_t>(kind)];
    for (std::size_t i = 0; i < scene_.points.size(); ++i)
      scene_.publication.points.push_back(static_cast<int>(i));
    Faults faults;
    const auto structure = build_structure(scene_, faults);
    EXPECT_FALSE(has_error(faults));
    double lowest = 0.0;
    for (const double omega : structure->omega)
      if (omega > 0.0 && (lowest == 0.0 || omega < lowest)) lowest = omega;
    // if the phase of the fastest mode is larger, the reference takes minutes
    constexpr double kMostPhase = 2e4;  // [rad]
    end_ = std::min(decade(2.0, 30.0) * 2.0 * M_PI / lowest, kMostPhase / structure->omega.maxCoeff());
    scene_.rate = std::clamp(structure->omega.maxCoeff() / 0.5, 20.0 * lowest / 6.28, 5000.0);
    has_matrix_ = kind != 3 && kind != 5 && integer(0, 3) == 0;
    set_motion(lowest, *structure);
    judged_ = has_matrix_ ? as_matrix(scene_) : scene_;
  }
  /// Returns the scene. The scene has a spin, a load and initial modal amplitudes, and its lowest frequency
  /// is some 10 rad/s.
  const Scene& truth() const { return scene_; }
  /// Returns the same scene, or its copy with one stiffness matrix in place of all links.
  const Scene& judged() const { return judged_; }
  double end() const { return std::round(end_ * scene_.rate) / scene_.rate; }
  bool has_rigid_links() const {
    return std::any_of(judged_.links.begin(), judged_.links.end(),
                       [](const Link& link) { return std::holds_alternative<Rigid>(link.kind); });
  }
  bool has_matrix() const { return has_matrix_; }
  std::string name() const { return name_ + std::string(has_matrix_ ? " as matrix" : ""); }

 private:
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine_); }
  double decade(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }
  int integer(int a, int b) { return std::uniform_int_distribution<int>(a, b)(engine_); }
  Eigen::Vector3d direction() {
    std::normal_distribution<double> normal;
    return Eigen::Vector3d(normal(engine_), normal(engine_), normal(engine_)).normalized();
  }
  int add_point(const Eigen::Vector3d& at) { return testing::add_point(scene_, decade(0.5, 2.0), at); }
  void join(std::vector<int> points, const LinkKind& kind) { add_link(scene_, std::move(points), kind); }
  Beam tube() {
    const double EI = decade(200.0, 2000.0);
    return Beam{.EA = EI * decade(30.0, 300.0),
                .GJ = EI * uniform(0.3, 1.0),
                .EI_y = EI,
                .EI_z = EI * uniform(0.7, 1.5),
                .y_axis = Eigen::Vector3d(0.1, 0.2, 1.0)};
  }
  void make_chain(bool of_angles) {
    const int count = integer(4, 7);
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (int k = 0; k < count; ++k) {
      add_point(at);
      at += Eigen::Vector3d(1.0, uniform(-0.4, 0.4), uniform(-0.4, 0.4));
    }
    const Beam beam = tube();
    for (int k = 0; k + 1 < count; ++k)
      join({k, k + 1}, of_angles ? LinkKind(Spring{beam.EA}) : LinkKind(beam));
    if (!of_angles) return;
    for (int k = 0; k + 2 < count; ++k) join({k, k + 1, k + 2}, BendingSpring{beam.EI_y});
    for (int k = 0; k + 3 < count; ++k) join({k, k + 1, k + 2, k + 3}, TorsionSpring{0.3 * beam.EI_y});
  }
  void make_ladder() {
    const int bays = integer(2, 3);
    for (int k = 0; k <= bays; ++k)
      for (const double y : {0.0, 1.0}) add_point({1.0 * k, y, uniform(-0.2, 0.2)});
    const Beam beam = tube();
    for (int k = 0; k <= bays; ++k) join({2 * k, 2 * k + 1}, beam);
    for (int k = 0; k < bays; ++k)
      for (const int side : {0, 1}) join({2 * k + side, 2 * k + 2 + side}, beam);
  }
  void make_plates() {
    const int bays = integer(1, 3);
    for (int k = 0; k <= bays; ++k)
      for (const double y : {0.0, 1.0}) add_point({1.0 * k, y, uniform(-0.1, 0.1)});
    const double thickness = 0.02;
    const Plate plate{
        .E = 12.0 * decade(50.0, 500.0) / std::pow(thickness, 3), .nu = 0.3, .thickness = thickness};
    for (int k = 0; k < bays; ++k) {
      join({2 * k, 2 * k + 2, 2 * k + 1}, plate);
      join({2 * k + 1, 2 * k + 2, 2 * k + 3}, plate);
    }
  }
  // Makes a ladder with the remaining kinds of link. Its first bay is rigid, and a rigid link, bars and a
  // dashpot are at its end.
  void make_mixture() {
    make_ladder();
    const int last = static_cast<int>(scene_.points.size()) - 1;
    scene_.links.erase(scene_.links.begin());
    join({0, 1, 2}, Rigid{});
    const int tip =
        add_point(scene_.points[static_cast<std::size_t>(last)].position + Eigen::Vector3d(0.7, 0.1, 0.2));
    join({last, tip}, Rigid{});
    for (const int to : {last - 1, last - 2, last - 3}) join({tip, to}, Bar{decade(1e3, 1e4)});
    join({0, last}, Dashpot{decade(1.0, 10.0)});
  }
  void make_cloud() {
    const int count = integer(5, 8);
    while (static_cast<int>(scene_.points.size()) < count) {
      const Eigen::Vector3d at(uniform(-2.0, 2.0), uniform(-0.6, 0.6), uniform(-0.6, 0.6));
      bool is_free = true;
      for (const PointMass& other : scene_.points) is_free = is_free && (other.position - at).norm() > 0.6;
      if (is_free) add_point(at);
    }
    for (int a = 0; a < count; ++a)
      for (int b = a + 1; b < count; ++b) join({a, b}, Spring{decade(1e3, 1e4)});
  }
  void set_motion(double lowest, const Structure& structure) {
    const double mass = structure.mass_properties.mass,
                 size = structure.mass_properties.r.colwise().norm().maxCoeff();
    scene_.initial.angular_velocity = decade(1e-3, 0.4) * lowest * direction();
    if (integer(0, 3) == 0) scene_.initial.angular_velocity.setZero();
    const double amplitude = size * decade(1e-5, 1e-3);
    const auto first = static_cast<Eigen::Index>(structure.mechanisms.size());
    const Eigen::VectorXd V = amplitude * (uniform(-1.0, 1.0) * structure.shapes.col(first) +
                                           uniform(-1.0, 1.0) * structure.shapes.col(first + 1));
    for (int i = 0; i < static_cast<int>(scene_.points.size()); ++i)
      scene_.initial.points.push_back({i, V.segment<3>(3 * Eigen::Index{i}), Eigen::Vector3d::Zero()});
    if (integer(0, 2) == 0) return;
    Load load;
    // the local axes of a point within a matrix differ from those of its joint in the original scene
    load.axes = std::array{Axes::kWorld, Axes::kBody,
                           Axes::kLocal}[static_cast<std::size_t>(integer(0, has_matrix_ ? 1 : 2))];
    load.forces = {{integer(0, static_cast<int>(scene_.points.size()) - 1),
                    mass * lowest * lowest * size * decade(1e-5, 2e-2) * direction()}};
    if (load.axes != Axes::kLocal && integer(0, 1) == 0) load.history = PulseHistory{0.0, 0.3 * end_};
    scene_.loads = {load};
  }

  std::mt19937_64 engine_;
  Scene scene_, judged_;
  bool has_matrix_ = false;
  double end_ = 0.0;
  const char* name_ = "";
};

/// Holds the number of verdicts and the numbers of wrong verdicts among them.
struct VerdictCounts {
  int all = 0, good = 0, false_good = 0, harmless = 0, false_outside = 0;
  int close = 0, comparable = 0;  // number of estimates within a factor 1.3 of an error of 1e-3 to 0.3
  double worst_good = 0.0;        // [-] largest JudgedError::error with the verdict `good`
};

/// Returns sqrt(sum m V.V / M).
inline double rms_over_mass(const Scene& scene, const Eigen::Matrix3Xd& V) {
  const Eigen::VectorXd mass = masses_of(scene);
  return std::sqrt((V.colwise().squaredNorm() * mass)(0) / mass.sum());
}
/// Largest number of steps of the reference for one motion. The longest motion that the reference completed
/// took 364,824 steps. A structure that flutters until it whirls took 500,000 steps for half of its simulated
/// time.
inline constexpr long kMostSteps = 500'000;
/// Returns the elastic displacements at true geometry [m] (3 x points), or nullopt if the reference fails or
/// needs more than kMostSteps.
inline std::optional<Eigen::Matrix3Xd> true_displacements(const Scene& scene, double end) {
  std::string error;
  const auto system = make_true_geometry(scene, error);
  EXPECT_TRUE(system) << error;
  if (!system) return std::nullopt;
  const double times[] = {end};
  ReferenceOptions options;
  options.max_steps = kMostSteps;
  const ReferenceRun run = integrate(*system, times, options);
  if (run.error.empty()) return elastic_of(scene, run.states.at(0).p_W);
  std::printf("%s\n", run.error.c_str());
  return std::nullopt;
}

/// Holds the level and the estimate of the verdict on a motion, and the true error of the motion.
struct JudgedError {
  double error = 0.0, estimate = 0.0, own = 0.0;  // [-] over max(scale of the verdict, true |V|)
  Verdict::Level level = Verdict::Level::kGood;
};
/// \param first  commands of the first tick
/// \param whole  the scene of the truth, with particles in place of bodies; nullptr: `scene`
inline JudgedError compare_verdict(Scene scene, Fidelity rung, double end,
                                   const std::optional<Eigen::Matrix3Xd>& truth,
                                   std::span<const ForceCommand> first = {}, const Scene* whole = nullptr) {
  scene.fidelity = rung;
  publish_everything(scene);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  EXPECT_TRUE(structure);
  const auto plan = make_plan(scene, *structure, faults);
  EXPECT_TRUE(plan) << (faults.empty() ? "" : faults.back().message);
  Motion motion(*plan);
  // the last tick that is judged, so that estimate and truth are of the same time
  const auto ticks = std::llround(end * scene.rate);
  bool is_fine = true;
  for (std::int64_t k = 0; k < ticks && is_fine; ++k)
    is_fine = motion.advance(k == 0 ? first : std::span<const ForceCommand>()).status == StepStatus::kOk;
  const Verdict& verdict = motion.verdict();
  const Scene& particles = whole != nullptr ? *whole : scene;
  const double scale = std::max(verdict.scale, truth ? rms_over_mass(particles, *truth) : 0.0);
  double off = HUGE_VAL;
  if (truth && is_fine) {
    const Eigen::Matrix3Xd p_W = particle_positions(particles, scene, *plan, motion.state());
    off = rms_over_mass(particles, elastic_of(particles, p_W) - *truth);
  }
  const JudgedError judged{off / scale, verdict.error.deformation / scale, verdict.own_error / scale,
                           verdict.level};
  std::printf("    %-11s %8.2f s: error %.2e of the scale, estimate %.2e, own %.1e, %s\n", name_of(rung), end,
              judged.error, judged.estimate, judged.own, describe(*plan, verdict).c_str());
  return judged;
}

inline void judge_scene(std::uint64_t seed, VerdictCounts& counts) {
  const RandomScene random(seed);
  const Scene& scene = random.truth();
  // if even the reference fails, no verdict may be `good`
  const auto truth = true_displacements(scene, random.end());
  for (const Fidelity rung : {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled}) {
    std::printf("%llu %s\n", static_cast<unsigned long long>(seed), random.name().c_str());
    const JudgedError judged = compare_verdict(random.judged(), rung, random.end(), truth);
    const bool is_good = judged.level == Verdict::Level::kGood,
               is_outside = judged.level == Verdict::Level::kOutside;
    ++counts.all;
    counts.good += is_good;
    counts.false_good += is_good && judged.error > 0.05;
    counts.harmless += judged.error < 0.01;
    counts.false_outside += is_outside && judged.error < 0.01;
    const bool is_comparable = !random.has_matrix() && judged.error > 1e-3 && judged.error < 0.3;
    counts.comparable += is_comparable;
    counts.close +=
        is_comparable && judged.estimate < 1.3 * judged.error && judged.error < 1.3 * judged.estimate;
    if (is_good) counts.worst_good = std::max(counts.worst_good, judged.error);
  }
}

inline void expect_true_verdicts(const VerdictCounts& counts) {
  std::printf(
      "%d verdicts, %d good, largest error of them %.1e; %d of %d harmless ones outside; %d of %d estimates "
      "within 1.3\n",
      counts.all, counts.good, counts.worst_good, counts.false_outside, counts.harmless, counts.close,
      counts.comparable);
  EXPECT_EQ(counts.false_good, 0);
  EXPECT_LE(counts.false_outside, 0.01 * counts.harmless);
  EXPECT_GE(counts.close, 0.95 * counts.comparable);
  EXPECT_GT(counts.good, counts.all / 10);
}

}  // namespace freeflex::testing
