// Random motions of structures with every kind of link, body and load, and the errors of the verdicts on
// them. The structures are those of tests/reference/kinds.hpp. The truth is the Cartesian reference, which
// shares no code with the shadow. Header only.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/motion.hpp"
#include "core/scene/bodies.hpp"
#include "core/step/readout.hpp"
#include "tests/motion/particle_positions.hpp"
#include "tests/reference/kinds.hpp"
#include "tests/reference/structures.hpp"
#include "tests/reference/true_geometry.hpp"
#include "tests/support/structures.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::testing {

/// A family of structures whose verdicts are counted together. The structures are those of `kinds` in turn.
struct Family {
  const char* name;
  std::vector<std::string> kinds;  // names of all_kinds(), or "ball joints"
  bool keeps_lowest_modes = false;
};
inline const std::vector<Family>& all_families() {
  static const std::vector<Family> families{
      {"Springs",
       {"springs and bars", "dashpots", "springs with damped strain", "massless points on springs",
        "bending springs", "torsion springs"}},
      {"Frames",
       {"beams", "beams with shear", "beams that are stiffer in one plane", "beams with hinges",
        "follower loads", "modal damping", "beams with damped strain"}},
      {"Plates", {"plates"}},
      {"BodiesAndWheels",
       {"points with inertia and offset", "wheels, one with a motor", "massless points on bodies"}},
      {"RigidLinks",
       {"rigid links", "rods", "ball joints", "beams, plates, angle springs, matrices and bodies"}},
      {"KeptModes", {"springs and bars", "beams", "plates", "points with inertia and offset"}, true},
      {"CondensedSuperelements", {"superelements", "superelements with mass"}},
      {"Attractors", {"attractor"}}};
  return families;
}

/// Returns a random motion of a structure, with the loads and the truth that belong to it.
class RandomMotion {
 public:
  RandomMotion(const Family& family, unsigned seed) : random_(seed) {
    name_ = family.kinds[seed % family.kinds.size()];
    specimen_ = structure_of(name_);
    if (specimen_.whole) specimen_.points = specimen_.whole;
    vary_stiffness();
    const Structure structure = build(specimen_.scene);
    lowest_ = *std::find_if(structure.omega.begin(), structure.omega.end(), [](double w) { return w > 0.0; });
    const double highest = structure.omega.maxCoeff();
    // if the phase of the fastest mode is larger, the reference takes minutes
    constexpr double kMostPhase = 5e3;  // [rad]
    end_ = std::min(decade(2.0, 20.0) * 2.0 * M_PI / lowest_, kMostPhase / highest);
    // a step of each shadow ends at the end, and each coarse tick begins with a fine one
    const double rate = std::clamp(highest / decade(0.3, 3.0), 20.0 * lowest_ / 6.28, 5000.0);
    coarse_ticks_ = 16 * std::max(1LL, std::llround(end_ * lowest_ * decade(2.0, 30.0) / 16.0));
    ticks_ =
        4 * coarse_ticks_ * std::max(1LL, std::llround(end_ * rate / static_cast<double>(4 * coarse_ticks_)));
    scene().rate = static_cast<double>(ticks_) / end_;
    set_motion(structure);
    if (family.keeps_lowest_modes)
      scene().modes.count = integer(3, static_cast<int>(structure.omega.size()) - 1);
    for (int i = 0; i < static_cast<int>(scene().points.size()); ++i) scene().publication.points.push_back(i);
    if (!specimen_.points) return;
    // the scene of the truth moves in the same way
    specimen_.points->initial = scene().initial;
    specimen_.points->loads = scene().loads;
    std::erase_if(specimen_.points->loads, [](const Load& load) { return !load.wheels.empty(); });
  }
  const std::string& name() const { return name_; }
  const Specimen& specimen() const { return specimen_; }
  double end() const { return end_; }  // [s]
  /// Return the number of ticks to the end, and one at which the integration is wrong.
  std::int64_t ticks() const { return ticks_; }
  std::int64_t coarse_ticks() const { return coarse_ticks_; }

 private:
  Scene& scene() { return specimen_.scene; }
  double uniform(double a, double b) { return a + 0.5 * (b - a) * (1.0 + random_.one()); }
  double decade(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }
  int integer(int a, int b) { return std::min(b, static_cast<int>(uniform(a, b + 1.0))); }
  Eigen::Vector3d direction() {
    Eigen::Vector3d v = random_.vector();
    while (v.norm() < 0.1 || v.norm() > 1.0) v = random_.vector();
    return v.normalized();
  }

  Specimen structure_of(const std::string& name) {
    if (name == "ball joints") {
      Scene scene = tree(2.0);
      for (PointMass& each : scene.points) each.mass *= decade(0.5, 2.0), each.position += 0.1 * direction();
      return {scene};
    }
    for (const Kind& kind : all_kinds())
      if (kind.name == name) return kind.make(random_);
    throw std::invalid_argument(name);
  }

  // Multiplies the stiffness of each link by a random factor. All parts of a superelement have the same
  // factor.
  void vary_stiffness() {
    const double all = decade(0.3, 3.0);
    for (std::size_t k = 0; k < scene().links.size(); ++k) {
      const double factor = all * (specimen_.whole ? 1.0 : decade(0.3, 3.0));
      multiply(factor, scene().links[k].kind);
      if (specimen_.points && !specimen_.whole) multiply(factor, specimen_.points->links[k].kind);
    }
    for (std::size_t k = 0; specimen_.whole && k < specimen_.points->links.size(); ++k)
      multiply(all, specimen_.points->links[k].kind);
  }
  static void multiply(double factor, LinkKind& kind) {
    if (auto* spring = std::get_if<Spring>(&kind)) spring->stiffness *= factor;
    if (auto* bar = std::get_if<Bar>(&kind)) bar->EA *= factor;
    if (auto* bending = std::get_if<BendingSpring>(&kind)) bending->stiffness *= factor;
    if (auto* torsion = std::get_if<TorsionSpring>(&kind)) torsion->stiffness *= factor;
    if (auto* plate = std::get_if<Plate>(&kind)) plate->E *= factor;
    if (auto* matrix = std::get_if<MatrixLink>(&kind)) matrix->matrix *= factor;
    if (auto* beam = std::get_if<Beam>(&kind))
      for (double* each : {&beam->EA, &beam->GJ, &beam->EI_y, &beam->EI_z, &beam->GA_y, &beam->GA_z})
        *each *= factor;
  }

  void set_motion(const Structure& structure) {
    mass_ = structure.mass_properties.mass;
    size_ = structure.mass_properties.r.colwise().norm().maxCoeff();
    Initial initial;
    // nearly circular orbits with the period of one at 12 sizes, which do not fall into the attractor
    if (scene().attractor.mu > 0.0) {
      const double factor = decade(1.0, 100.0);
      scene().attractor.mu *= factor * factor * factor;
      initial.position = factor * scene().initial.position;
      const double speed = std::sqrt(scene().attractor.mu / initial.position.norm());  // [m/s]
      initial.velocity = uniform(0.8, 1.2) * speed * initial.position.cross(direction()).normalized();
    }
    if (integer(0, 3) > 0) initial.angular_velocity = decade(1e-3, 0.3) * lowest_ * direction();
    scene().initial = initial;
    const double amplitude = size_ * decade(1e-5, 3e-2);
    // the points of the truth are not those of the scene, if it has bodies
    const bool has_own_points = specimen_.points && specimen_.points->points.size() != scene().points.size();
    if (!has_own_points && specimen_.truth != Truth::kCopy) start_modes(structure, amplitude);
    std::erase_if(scene().loads, [](const Load& load) { return load.wheels.empty(); });
    for (int k = integer(0, 2); k > 0; --k) add_load(amplitude);
    if (specimen_.truth != Truth::kCartesian && scene().loads.empty()) add_load(amplitude);
  }

  // Displaces the lowest modes, or gives them a velocity. The displacements of rigid links are not large.
  void start_modes(const Structure& structure, double amplitude) {
    Eigen::Index first = 0;
    while (structure.omega[first] == 0.0) ++first;
    Eigen::VectorXd V = Eigen::VectorXd::Zero(structure.shapes.rows()), V_dot = V;
    const bool is_displaced = structure.num_constraints == 0 && integer(0, 1) == 0;
    for (Eigen::Index l = first; l < std::min<Eigen::Index>(first + 3, structure.omega.size()); ++l)
      (is_displaced ? V : V_dot) +=
          amplitude * random_.one() * (is_displaced ? 0.1 : structure.omega[l]) * structure.shapes.col(l);
    for (int i = 0; i < static_cast<int>(scene().points.size()); ++i)
      if (scene().points[index(i)].mass > 0.0)
        scene().initial.points.push_back(
            {i, V.segment<3>(3 * Eigen::Index{i}), V_dot.segment<3>(3 * Eigen::Index{i})});
  }

  void add_load(double amplitude) {
    Load load;
    load.name = "load " + std::to_string(scene().loads.size());
    // Points of a superelement have no attitude. The axes of the step and of the truth differ to second order
    // in the rotations of bodies, and so would forces along them.
    const int num_axes = std::ranges::any_of(scene().points, has_attitude) ? 1
                         : specimen_.truth == Truth::kCartesian            ? 3
                                                                           : 2;
    load.axes = std::array{Axes::kWorld, Axes::kBody, Axes::kLocal}[index(integer(0, num_axes - 1))];
    int point = integer(0, static_cast<int>(scene().points.size()) - 1);
    while (scene().points[index(point)].mass == 0.0) --point;
    double force = mass_ * lowest_ * lowest_ * amplitude * decade(0.1, 1.0), span = end_;
    const int history = integer(0, 3);
    const double tick = end_ / static_cast<double>(coarse_ticks_);
    if (history == 1 || history == 2) {
      double start = integer(0, 1) * uniform(0.0, 0.3) * end_;
      span = uniform(0.02, 0.5) * end_;
      if (history == 1) start = std::round(start / tick) * tick, span = std::ceil(span / tick) * tick;
      load.history = PulseHistory{start, span};
    }
    if (history == 3) load.history = SineHistory{decade(0.1, 3.0) * lowest_ / (2.0 * M_PI), random_.one()};
    // a constant load or a pulse is limited, so that the body does not spin far faster than at the start
    else if (scene().attractor.mu == 0.0 || load.axes != Axes::kWorld)
      force = std::min(force, 0.05 * lowest_ * mass_ * size_ / span);
    load.forces = {{point, force * direction()}};
    scene().loads.push_back(load);
  }

  Random random_;
  std::string name_;
  Specimen specimen_;
  double lowest_ = 0.0, mass_ = 0.0, size_ = 0.0, end_ = 0.0;  // [rad/s], [kg], [m], [s]
  std::int64_t ticks_ = 0, coarse_ticks_ = 0;
};

/// The true motion at its end.
struct TrueMotion {
  Eigen::Vector3d centre;  // [m] of mass
  Eigen::Matrix3d R;       // attitude of the axes that fit all points best
  Eigen::Matrix3Xd V;      // [m] displacements of all points along these axes
  Eigen::VectorXd mass;    // [kg] of all points
  Eigen::Matrix3Xd r;      // [m] of all points at rest
};

/// Returns the true motion at its end, or nullopt if the reference fails.
inline std::optional<TrueMotion> true_motion_of(const RandomMotion& random) {
  const Specimen& specimen = random.specimen();
  CartesianSystem system = true_geometry_of(specimen.points.value_or(specimen.scene));
  if (specimen.complete) specimen.complete(system);
  // a structure that flutters until it whirls needs more steps for half of its motion
  ReferenceOptions options;
  options.max_steps = 500'000;
  const double times[] = {random.end()};
  const ReferenceRun run = integrate(system, times, options);
  if (!run.error.empty()) {
    std::printf("%s\n", run.error.c_str());
    return std::nullopt;
  }
  const Eigen::Matrix3Xd& p_W = run.states.at(0).p_W;
  TrueMotion truth;
  truth.centre = p_W * system.mass / system.mass.sum();
  truth.R = fit_rotation(system.mass, system.r, p_W.colwise() - truth.centre);
  truth.V = truth.R.transpose() * (p_W.colwise() - truth.centre) - system.r;
  truth.mass = system.mass;
  truth.r = system.r;
  return truth;
}

/// The level of the verdict on a motion, its estimate and the true error. Errors of deformation are divided
/// by the scale of the verdict, or by the true displacement if it is larger.
struct KindVerdict {
  Verdict::Level level = Verdict::Level::kGood;
  MotionError estimate, error;  // position [m]/[m] over the size, attitude [rad], deformation [-]
  bool is_shared = false;       // the shadow is known to share an error, or a load is too fast for the ticks
  bool has_stopped = false;     // the step returned a fault, so there is no state to judge
  std::string text;

  /// Returns the error in units in which the limits of *good* and of *outside* are 0.02 and 0.2   (THEORY
  /// 15.8).
  double weighted_error() const {
    return std::max({error.deformation, error.position * kMostElastic / kMostPosition,
                     error.attitude * kMostElastic / kMostAttitude});
  }
};

inline Eigen::Matrix3d attitude_of(const MotionState& state) {
  return Eigen::Quaterniond(state.q_WB[0], state.q_WB[1], state.q_WB[2], state.q_WB[3]).toRotationMatrix();
}

/// Returns sqrt(sum m V.V / sum m) [m] over the first points, as many as V has.
inline double rms_over(const Eigen::VectorXd& mass, const Eigen::Matrix3Xd& V) {
  const auto first = mass.head(V.cols());
  return std::sqrt((V.colwise().squaredNorm() * first)(0) / first.sum());
}

/// Returns the verdict on the motion of a rung, or nullopt if the rung does not support the scene.
/// \param refusal  set to the reason
inline std::optional<KindVerdict> verdict_on(const RandomMotion& random, Fidelity rung,
                                             const TrueMotion& truth, std::string& refusal) {
  Scene scene = random.specimen().scene;
  scene.fidelity = rung;
  const bool is_coarse = rung == Fidelity::kCorotational;
  const std::int64_t ticks = is_coarse ? random.coarse_ticks() : random.ticks();
  scene.rate = static_cast<double>(ticks) / random.end();
  Faults faults;
  const auto structure = build_structure(scene, faults);
  const auto plan = structure ? make_plan(scene, *structure, faults) : std::nullopt;
  for (const Fault& fault : faults)
    if (fault.severity == Fault::Severity::kError) refusal = fault.message;
  if (!plan) return std::nullopt;
  Motion motion(*plan);
  const Eigen::Matrix3d at_start = attitude_of(motion.state());
  bool is_fine = true;
  for (std::int64_t k = 0; k < ticks && is_fine; ++k) is_fine = motion.advance().status == StepStatus::kOk;
  const Verdict& verdict = motion.verdict();
  KindVerdict result;
  result.level = verdict.level;
  result.estimate = verdict.error;
  result.is_shared = plan->verdict.shared != SharedError::kNone || !plan->verdict.fast_loads.empty();
  result.text = describe(*plan, verdict);
  // positions inside a superelement are not known
  const bool has_bodies = std::ranges::any_of(scene.points, has_attitude);
  const auto num_points = static_cast<Eigen::Index>(scene.points.size()),
             shown = has_bodies ? truth.V.cols() : num_points;
  const double size = structure->mass_properties.r.colwise().norm().maxCoeff(),
               scale = std::max(verdict.scale, rms_over(truth.mass, truth.V.leftCols(shown)));
  result.estimate.deformation /= scale;
  result.estimate.position /= size;
  if (!is_fine) {
    std::printf("  %-11s stops after tick %lld\n", name_of(rung), static_cast<long long>(verdict.tick));
    result.has_stopped = true;
    return result;
  }
  if (verdict.stopped == StepStatus::kOk) {
    EXPECT_EQ(verdict.tick, ticks) << "the estimate and the truth must belong to the same time";
  }
  const MotionState& state = motion.state();
  result.error.position = (Eigen::Map<const Eigen::Vector3d>(state.p_WB.data()) - truth.centre).norm() / size;
  Eigen::Matrix3Xd V(3, num_points);
  for (Eigen::Index i = 0; i < V.cols(); ++i)
    V.col(i) = vector_of(read_point(*plan, state, static_cast<int>(i)).V_B);
  Eigen::Matrix3d R = attitude_of(state) * at_start.transpose();
  if (shown == truth.V.cols()) {
    // The axes of the step may meet a condition that is linear in the rotations of bodies. Those of the truth
    // fit its points, so the points of the step are fitted too.
    const Scene& whole = random.specimen().points.value_or(random.specimen().scene);
    const Eigen::Matrix3Xd p_W = particle_positions(whole, scene, *plan, state);
    const Eigen::Vector3d centre = p_W * truth.mass / truth.mass.sum();
    R = fit_rotation(truth.mass, truth.r, p_W.colwise() - centre);
    V = R.transpose() * (p_W.colwise() - centre) - truth.r;
  }
  const Eigen::Matrix3d turn = R * truth.R.transpose();
  result.error.deformation = rms_over(truth.mass, V - truth.V.leftCols(shown)) / scale;
  result.error.attitude =
      0.5 * Eigen::Vector3d(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1)).norm();
  if (turn.trace() < 1.0) result.error.attitude = M_PI;
  return result;
}

/// Numbers of verdicts, of wrong ones, and of estimates within a factor of 1.3 of an error of 1e-3 to 0.3.
struct KindCounts {
  int all = 0, good = 0, false_good = 0, harmless = 0, false_outside = 0, close = 0, comparable = 0,
      refused = 0, stopped = 0, without_truth = 0,
      too_fast = 0;  // refused because a tick does not resolve the dashpots
};

inline void judge_kind(const Family& family, unsigned seed, KindCounts& counts) {
  const RandomMotion random(family, seed);
  std::printf("%s %u, %s, %.3f s, %lld ticks\n", family.name, seed, random.name().c_str(), random.end(),
              static_cast<long long>(random.ticks()));
  const auto truth = true_motion_of(random);
  if (!truth) return void(++counts.without_truth);
  for (const Fidelity rung :
       {Fidelity::kSeparated, Fidelity::kSpinLoaded, Fidelity::kCoupled, Fidelity::kCorotational}) {
    std::string refusal;
    const auto judged = verdict_on(random, rung, *truth, refusal);
    if (!judged) {
      std::printf("  %-11s is refused: %s\n", name_of(rung), refusal.c_str());
      const bool is_dashpot = refusal.find("dashpots and feedback change the motion") != std::string::npos;
      ++(is_dashpot ? counts.too_fast : counts.refused);
      continue;
    }
    if (judged->has_stopped) {
      ++counts.stopped;
      continue;
    }
    const double error = judged->weighted_error();
    const bool is_good = judged->level == Verdict::Level::kGood,
               is_outside = judged->level == Verdict::Level::kOutside;
    const double true_part = judged->error.deformation, estimate = judged->estimate.deformation;
    // light points stand for massless ones in the truth, and ring by up to 4e-3 of the displacement
    const double least = random.name() == "massless points on bodies" ? 1e-2 : 1e-3;
    const bool is_comparable = !judged->is_shared && true_part > least && true_part < 0.3,
               is_close = estimate < 1.3 * true_part && true_part < 1.3 * estimate;
    ++counts.all;
    counts.good += is_good;
    counts.false_good += is_good && error > 0.05;
    counts.harmless += error < 0.01;
    counts.false_outside += is_outside && error < 0.01;
    counts.comparable += is_comparable;
    counts.close += is_comparable && is_close;
    std::printf(
        "  %-11s deformation %.2e (estimate %.2e), position %.1e (%.1e), attitude %.1e (%.1e): %s%s\n",
        name_of(rung), true_part, estimate, judged->error.position, judged->estimate.position,
        judged->error.attitude, judged->estimate.attitude, judged->text.c_str(),
        is_good && error > 0.05      ? " FALSE GOOD"
        : is_outside && error < 0.01 ? " FALSE OUTSIDE"
        : is_comparable && !is_close ? " NOT CLOSE"
                                     : "");
  }
}

inline KindCounts judge_family(const Family& family, unsigned first_seed, int count) {
  KindCounts counts;
  for (int k = 0; k < count; ++k) judge_kind(family, first_seed + static_cast<unsigned>(k), counts);
  std::printf(
      "%s: %d verdicts, %d good, %d of them wrong; %d of %d harmless ones outside; %d of %d estimates within "
      "1.3; %d refused, %d more because of fast dashpots, %d stopped, %d without truth\n",
      family.name, counts.all, counts.good, counts.false_good, counts.false_outside, counts.harmless,
      counts.close, counts.comparable, counts.refused, counts.too_fast, counts.stopped, counts.without_truth);
  EXPECT_EQ(counts.false_good, 0);
  EXPECT_LE(counts.false_outside, 0.01 * counts.harmless);
  return counts;
}

}  // namespace freeflex::testing
