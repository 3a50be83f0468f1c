#include "tools/verification/report/estimates.hpp"

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <cmath>
#include <random>

#include "core/motion.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/automatic.hpp"
#include "core/step/readout.hpp"
#include "core/structure/structure.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/integrate.hpp"

namespace freeflex::tools {
namespace {

constexpr double kEnd = 1.0;  // [s]

/// Draws random numbers without the distributions of the standard library, because these differ between
/// implementations.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11U) * 0x1p-53;
  }
  double decade(double low, double high) {
    return std::pow(10.0, uniform(std::log10(low), std::log10(high)));
  }
  int whole(int low, int high) { return low + static_cast<int>(uniform(0.0, 1.0) * (high - low + 1)); }
  Eigen::Vector3d direction() {
    Eigen::Vector3d v;
    do v = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    while (v.squaredNorm() > 1.0 || v.squaredNorm() < 0.01);
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

void add_point(Scene& scene, const Eigen::Vector3d& position, double mass) {
  PointMass point;
  point.name = std::to_string(scene.points.size());
  point.mass = mass;
  point.position = position;
  scene.publication.points.push_back(static_cast<int>(scene.points.size()));
  scene.points.push_back(point);
}

void join(Scene& scene, int a, int b, double stiffness) {
  Link link;
  link.name = std::to_string(scene.links.size());
  link.points = {a, b};
  link.kind = Spring{stiffness};
  scene.links.push_back(link);
}

void make_cloud(Scene& scene, Draw& draw, const std::function<double()>& stiffness) {
  const int count = draw.whole(4, 9);
  while (static_cast<int>(scene.points.size()) < count) {
    const Eigen::Vector3d p(draw.uniform(-1.5, 1.5), draw.uniform(-1, 1), draw.uniform(-1, 1));
    if (std::all_of(scene.points.begin(), scene.points.end(),
                    [&](const PointMass& other) { return (other.position - p).norm() > 0.4; }))
      add_point(scene, p, draw.decade(0.1, 10.0));
  }
  for (int a = 0; a < count; ++a)
    for (int b = a + 1; b < count; ++b) join(scene, a, b, stiffness());
}

void make_truss(Scene& scene, Draw& draw, const std::function<double()>& stiffness) {
  const int sections = draw.whole(2, 5);
  const double mass = draw.decade(0.1, 10.0);
  constexpr double kCorners[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
  for (int i = 0; i < sections; ++i)
    for (const auto& corner : kCorners) add_point(scene, {1.0 * i, corner[0], corner[1]}, mass);
  for (int i = 0; i < sections; ++i) {
    for (int c = 0; c < 4; ++c) join(scene, 4 * i + c, 4 * i + (c + 1) % 4, stiffness());
    join(scene, 4 * i, 4 * i + 2, stiffness());
    join(scene, 4 * i + 1, 4 * i + 3, stiffness());
    for (int c = 0; c < 4 && i + 1 < sections; ++c)
      for (const int to : {c, (c + 1) % 4}) join(scene, 4 * i + c, 4 * i + 4 + to, stiffness());
  }
}

/// Makes a mast of tetrahedra. Three springs join each new point to the last three points, because three
/// springs are needed to fix a point.
void make_mast(Scene& scene, Draw& draw, const std::function<double()>& stiffness) {
  const int count = draw.whole(5, 14);
  for (int i = 0; i < count; ++i) {
    const double angle = 131.8 * M_PI / 180.0 * i;  // Boerdijk and Coxeter's helix of tetrahedra
    add_point(scene, {0.316 * i, 0.52 * std::cos(angle), 0.52 * std::sin(angle)}, draw.decade(0.1, 10.0));
    for (int back = 1; back <= std::min(i, 3); ++back) join(scene, i - back, i, stiffness());
  }
}

struct Measure {
  Eigen::VectorXd mass;
  Eigen::Matrix3Xd rest;
};

Measure measure_of(const Scene& scene) {
  const auto n = static_cast<Eigen::Index>(scene.points.size());
  Measure measure{Eigen::VectorXd(n), Eigen::Matrix3Xd(3, n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    measure.mass[i] = scene.points[index(i)].mass;
    measure.rest.col(i) = scene.points[index(i)].position;
  }
  return measure;
}

/// Returns the root mean square of displacements over the mass [m].
double rms(const Measure& measure, const Eigen::Matrix3Xd& V) {
  return std::sqrt((V.colwise().squaredNorm() * measure.mass)(0) / measure.mass.sum());
}

/// Holds the distance of a state from the true positions.
struct TrueDistance {
  double attitude = 0.0;     // [rad]
  double deformation = 0.0;  // [m] rms over the mass
  double size = 0.0;         // [m] the true displacements, rms over the mass
};
TrueDistance true_distance(const Measure& measure, const Plan& plan, const State& state,
                           const Eigen::Matrix3Xd& truth) {
  Eigen::Matrix3Xd p(3, truth.cols());
  for (Eigen::Index i = 0; i < p.cols(); ++i) {
    const Vec3 each = read_point(plan, state, static_cast<int>(i)).p_W;
    p.col(i) = Eigen::Vector3d(each[0], each[1], each[2]);
  }
  const auto centred = [&](const Eigen::Matrix3Xd& x) -> Eigen::Matrix3Xd {
    return x.colwise() - x * measure.mass / measure.mass.sum();
  };
  const Eigen::Matrix3Xd r = centred(measure.rest);
  const Eigen::Matrix3d R = fit_rotation(measure.mass, r, centred(p)),
                        R_true = fit_rotation(measure.mass, r, centred(truth));
  const Eigen::Matrix3Xd V_true = elastic_displacements(measure.mass, measure.rest, truth);
  return {std::sqrt(0.5) * (R - R_true).norm(),
          rms(measure, elastic_displacements(measure.mass, measure.rest, p) - V_true), rms(measure, V_true)};
}

/// Returns the largest true elastic error of a rung at any tick, divided by the largest true displacement.
/// The error is infinite if the rung has no plan or diverges.
double rung_error(Scene scene, Fidelity rung, const Structure& structure, const Measure& measure,
                  const std::vector<CartesianState>& truth) {
  scene.fidelity = rung;
  scene.automatic.reset();
  Faults faults;
  const auto plan = make_full_plan(scene, structure, scene.fidelity, faults);
  if (!plan) return INFINITY;
  Motion motion(*plan, kMotionAlone);
  double worst = 0.0, size = 0.0;
  for (const CartesianState& sample : truth) {
    while (motion.time() < sample.time - 0.5 * plan->period)
      if (motion.advance().status != StepStatus::kOk) return INFINITY;
    const TrueDistance distance = true_distance(measure, *plan, motion.state(), sample.p_W);
    worst = std::max(worst, distance.deformation);
    size = std::max(size, distance.size);
  }
  return worst > 0.0 ? worst / size : 0.0;
}

void judge_choice(const Scene& given, const Structure& structure, const Measure& measure,
                  const std::vector<CartesianState>& truth, EstimateRow& row) {
  Scene scene = given;
  scene.automatic = AutomaticRung{};
  scene.automatic->elastic = row.tolerance;
  scene.automatic->horizon = kEnd;
  Faults faults;
  std::vector<PlanRung> tried;
  const auto rung = choose_rung(scene, structure, tried, faults);
  row.chosen = rung ? name_of(*rung) : "none";
  row.cheapest = "none";
  bool is_past_choice = !rung;
  for (const RungTraits& each : kRungs) {
    if (!each.is_tried) continue;
    const double error = rung_error(scene, each.rung, structure, measure, truth);
    if (rung && each.rung == *rung) {
      row.chosen_error = error;
      is_past_choice = true;
    }
    if (error <= row.tolerance && row.cheapest == "none") row.cheapest = each.name;
    if (row.cheapest != "none" && is_past_choice) break;
  }
}

void judge_estimate(const Scene& scene, const Structure& structure, const Measure& measure,
                    const Eigen::Matrix3Xd& truth, EstimateRow& row) {
  Faults faults;
  auto plan = make_plan(scene, structure, faults);
  if (!plan) {
    row.error = faults.empty() ? "no plan was made" : faults.back().message;
    return;
  }
  Motion motion(*plan);
  while (motion.time() < kEnd - 0.5 * plan->period)
    if (motion.advance().status != StepStatus::kOk) {
      row.error = "the separated rung diverged";
      return;
    }
  row.verdict = motion.verdict();
  row.is_lost = row.verdict.cause == Verdict::Cause::kLost;
  const TrueDistance distance = true_distance(measure, *plan, motion.state(), truth);
  const auto relative = [&](double error) { return distance.size > 0.0 ? error / distance.size : 0.0; };
  row.truth = {distance.attitude, relative(distance.deformation)};
  row.estimate = {row.verdict.error.attitude, relative(row.verdict.error.deformation)};
  row.cause = text_of(*plan, row.verdict);
}

EstimateRow study_one(std::uint64_t seed, int number) {
  Scene scene = random_scene(seed, number);
  EstimateRow row;
  row.number = number;
  row.shape = scene.name;
  row.stiffness = std::get<Spring>(scene.links.front().kind).stiffness;
  row.spin = scene.initial.angular_velocity.norm();
  row.force = scene.loads.front().forces.front().force.norm();
  row.tolerance = Draw(seed * 7919 + static_cast<std::uint64_t>(number)).decade(1e-4, 0.1);
  std::string error;
  const auto system = make_cartesian_system(scene, error);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  if (!system || !structure) {
    row.error = "the structure cannot be set up: " + error;
    return row;
  }
  std::vector<double> times;
  for (int k = 1; k <= std::lround(kEnd * scene.rate); ++k) times.push_back(k / scene.rate);
  const ReferenceRun truth = integrate(*system, times);
  if (!truth.error.empty()) {
    row.error = truth.error;
    return row;
  }
  const Measure measure = measure_of(scene);
  judge_estimate(scene, *structure, measure, truth.states.back().p_W, row);
  if (row.error.empty()) judge_choice(scene, *structure, measure, truth.states, row);
  return row;
}

double lower_bound(int successes, int trials) {
  if (successes == 0) return 0.0;
  const boost::math::beta_distribution<> beta(successes, trials - successes + 1);
  return boost::math::quantile(beta, 0.05);
}

/// Returns the estimates over the true errors of the scenes that are compared.
std::vector<double> ratios(const std::vector<EstimateRow>& rows, double ErrorSize::*which) {
  const double least = which == &ErrorSize::attitude ? kLeastAttitude : kLeastElastic;
  std::vector<double> all;
  for (const EstimateRow& row : rows)
    if (row.error.empty() && !row.is_lost && row.truth.*which >= least)
      all.push_back(row.estimate.*which / row.truth.*which);
  return all;
}

struct Agreement {
  double close = 1.0, lower = 0.0, near = 1.0;
};
Agreement agreement(const std::vector<EstimateRow>& rows, double ErrorSize::*which) {
  const std::vector<double> all = ratios(rows, which);
  if (all.empty()) return {};
  const auto within = [&](double factor) {
    return static_cast<int>(std::count_if(
        all.begin(), all.end(), [&](double ratio) { return ratio <= factor && factor * ratio >= 1.0; }));
  };
  const int num = static_cast<int>(all.size());
  return {static_cast<double>(within(1.3)) / num, lower_bound(within(1.3), num),
          static_cast<double>(within(3.0)) / num};
}

}  // namespace

Scene random_scene(std::uint64_t seed, int number) {
  Draw draw(seed * 1'000'003 + static_cast<std::uint64_t>(number));
  Scene scene;
  const double base = draw.decade(1e3, 1e9);
  const auto stiffness = [&] { return base * draw.decade(0.5, 2.0); };
  switch (number % 3) {
    case 0:
      scene.name = "cloud";
      make_cloud(scene, draw, stiffness);
      break;
    case 1:
      scene.name = "truss";
      make_truss(scene, draw, stiffness);
      break;
    default:
      scene.name = "mast";
      make_mast(scene, draw, stiffness);
  }
  if (draw.uniform(0.0, 1.0) > 0.2)
    scene.initial.angular_velocity = draw.decade(1e-3, 5.0) * draw.direction();
  Load load;
  load.name = "push";
  load.forces.push_back({draw.whole(0, static_cast<int>(scene.points.size()) - 1),
                         draw.decade(0.1, 1000.0) * draw.direction()});
  load.history = PulseHistory{0.0, 0.1};
  scene.loads.push_back(load);
  scene.rate = 1000.0;
  return scene;
}

std::vector<EstimateRow> study_estimates(std::uint64_t seed, int count,
                                         const std::function<bool(double)>& keep_going) {
  std::vector<EstimateRow> rows;
  for (int k = 0; k < count && keep_going(static_cast<double>(k) / count); ++k)
    rows.push_back(study_one(seed, k));
  return rows;
}

EstimateSummary summarize(const std::vector<EstimateRow>& rows) {
  EstimateSummary sum;
  int num_good = 0, num_watch = 0, num_outside = 0, num_meets = 0, num_cheapest = 0;
  for (const EstimateRow& row : rows) {
    if (!row.error.empty()) {
      ++sum.num_failed;
      continue;
    }
    ++sum.num_scenes;
    num_good += row.verdict.level == Verdict::Level::kGood;
    num_watch += row.verdict.level == Verdict::Level::kWatch;
    num_outside += row.verdict.level == Verdict::Level::kOutside;
    num_meets += row.chosen == "none" ? row.cheapest == "none" : row.chosen_error <= row.tolerance;
    num_cheapest += row.chosen == row.cheapest;
  }
  if (sum.num_scenes == 0) return sum;
  const auto fraction = [&](int count) { return static_cast<double>(count) / sum.num_scenes; };
  sum.good = fraction(num_good), sum.watch = fraction(num_watch), sum.outside = fraction(num_outside);
  sum.auto_meets = fraction(num_meets), sum.auto_cheapest = fraction(num_cheapest);
  const Agreement attitude = agreement(rows, &ErrorSize::attitude),
                  elastic = agreement(rows, &ErrorSize::elastic);
  sum.close_attitude = attitude.close, sum.close_elastic = elastic.close;
  sum.lower_attitude = attitude.lower, sum.lower_elastic = elastic.lower;
  sum.near_attitude = attitude.near, sum.near_elastic = elastic.near;
  return sum;
}

std::vector<int> histogram(const std::vector<EstimateRow>& rows, double ErrorSize::*which) {
  std::vector<int> bins(kNumBins, 0);
  for (const double ratio : ratios(rows, which)) {
    const double bin = 5.0 * (std::log10(ratio) + 1.0) + 1.0;
    bins[static_cast<std::size_t>(std::clamp(bin, 0.0, kNumBins - 1.0))] += 1;
  }
  return bins;
}

}  // namespace freeflex::tools
