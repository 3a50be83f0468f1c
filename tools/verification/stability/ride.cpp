#include "tools/verification/stability/ride.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/shadow.hpp"
#include "core/structure/structure.hpp"
#include "tools/verification/reference/elastic_error.hpp"
#include "tools/verification/reference/rivals.hpp"
#include "tools/verification/report/measure.hpp"

namespace freeflex::tools {
namespace {

struct Entry {
  Rival rival;
  const char* name;
};
constexpr std::array kEntries{
    Entry{Rival::kVerlet, "velocity Verlet"}, Entry{Rival::kRungeKutta4, "Runge-Kutta 4"},
    Entry{Rival::kAdams, "CVODE Adams"},      Entry{Rival::kBdf, "CVODE BDF"},
    Entry{Rival::kErk8, "ARKODE explicit 8"}, Entry{Rival::kDirk5, "ARKODE implicit 5"}};

/// Returns the elastic scale of our own motion: its largest deformation and strain energy at 65 times.
ElasticScale elastic_scale(const Scene& scene, double end) {
  constexpr int kSamples = 64;
  ElasticScale scale;
  Ride ride(scene);
  if (!ride.has_plan()) return scale;
  const auto ticks = std::max<std::int64_t>(1, std::llround(end / ride.plan.period / kSamples));
  for (int k = 0; k <= kSamples; ++k) {
    const Eigen::Matrix3Xd V = ride.displacements_B();
    const Invariants now = read_invariants(ride.plan, ride.state());
    scale.displacement =
        std::max(scale.displacement, std::sqrt(V.squaredNorm() / static_cast<double>(V.cols())));
    scale.velocity = std::max(scale.velocity,
                              std::sqrt(2.0 * std::max(now.potential, now.kinetic_elastic) / ride.plan.mass));
    if (!ride.run(ticks)) break;
  }
  return scale;
}

PeerFigure run_peer(const Entry& entry, const CartesianSystem& system, RivalOptions rival_options, double end,
                    const StabilityOptions& options, const Measure& measure) {
  PeerFigure peer{entry.name, NAN, {}};
  std::string error;
  const auto method = make_rival(entry.rival, system, error);
  if (!method) {
    peer.failure = error;
    return peer;
  }
  const double start = thread_cpu();
  bool is_over = false;
  rival_options.is_stopped = [&] {
    return is_over = options.is_stopped() || thread_cpu() - start > options.peer_budget;
  };
  const double times[] = {end};
  const RivalRun run = method->run(
      times, rival_options, [&](std::size_t, const CartesianState& state) { peer.figure = measure(state); });
  if (is_over) {
    peer.failure = format_text("the method was stopped after %g s of CPU", options.peer_budget);
    peer.figure = NAN;
  } else if (!run.error.empty()) {
    peer.failure = run.error;
    peer.figure = NAN;
  } else if (!std::isfinite(peer.figure)) {
    peer.failure = "not finite";
  }
  return peer;
}

}  // namespace

Ride::Ride(const Scene& scene) {
  Faults faults;
  const auto structure = build_structure(scene, faults);
  std::optional<Plan> compiled;
  if (structure) compiled = make_full_plan(scene, *structure, scene.fidelity, faults);
  if (compiled) compile_verdict(scene, *structure, *structure, *compiled);
  for (const Fault& fault : faults) faults_text_ += (faults_text_.empty() ? "" : "\n") + fault.message;
  if (!compiled) return;
  plan = std::move(*compiled);
  motion_.emplace(plan);
}

bool Ride::run(std::int64_t ticks, std::span<const ForceCommand> commands) {
  assert(has_plan());
  for (std::int64_t k = 0; k < ticks; ++k)
    if (motion_->advance(k == 0 ? commands : std::span<const ForceCommand>{}).status != StepStatus::kOk)
      return false;
  return true;
}

template <typename Read>
Eigen::Matrix3Xd Ride::read_points(Read read) const {
  Eigen::Matrix3Xd values(3, static_cast<Eigen::Index>(plan.points.size()));
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    const Vec3 value = read(read_point(plan, state(), static_cast<int>(i)));
    values.col(i) = Eigen::Vector3d(value[0], value[1], value[2]);
  }
  return values;
}

Eigen::Matrix3Xd Ride::positions_W() const {
  return read_points([](const PointState& point) { return point.p_W; });
}

Eigen::Matrix3Xd Ride::displacements_B() const {
  return read_points([](const PointState& point) { return point.V_B; });
}

Outcome no_answer(const std::string& why) { return {NAN, why.empty() ? "no result" : why, {}}; }

std::vector<PeerFigure> run_peers(const Scene& scene, double step, double end,
                                  const StabilityOptions& options, const Measure& measure) {
  std::vector<PeerFigure> peers;
  if (!options.has_peers) return peers;
  std::string error;
  const auto system = make_cartesian_system(scene, error);
  if (!system) return {{"full system", NAN, error}};
  RivalOptions rival_options;
  rival_options.step = step;
  rival_options.tolerance = 1e-8;
  rival_options.scale = elastic_scale(scene, end);
  for (const Entry& entry : kEntries) {
    if (options.is_stopped()) return peers;
    peers.push_back(run_peer(entry, *system, rival_options, end, options, measure));
  }
  return peers;
}

}  // namespace freeflex::tools
