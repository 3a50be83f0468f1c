// What the cases of the stability table are made with: a scene in motion, and the same scene under other
// methods.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/reference/cartesian.hpp"
#include "core/step/readout.hpp"
#include "core/step/step.hpp"
#include "core/validity/judgement.hpp"
#include "tools/stability/stability.hpp"

namespace freeflex::tools {

/// A compiled scene in motion.
class Ride {
 public:
  explicit Ride(const Scene& scene);

  /// Faults of the set-up, warnings too, one a line; empty when there are none.
  const std::string& said() const { return said_; }
  bool has_plan() const { return has_plan_; }
  /// False when a state is not finite; the one before it then stands.  \pre has_plan()
  bool run(std::int64_t ticks, std::span<const ForceCommand> commands = {});

  Eigen::Matrix3Xd positions_W() const;      // [m] (3 x N), every point published
  Eigen::Matrix3Xd displacements_B() const;  // [m] (3 x N)
  const Verdict& verdict() const { return judgement_->now(); }

  Plan plan;
  State state;
  Workspace workspace;

 private:
  template <typename Read>
  Eigen::Matrix3Xd read_points(Read read) const;

  std::string said_;
  std::optional<Judgement> judgement_;
  Budget budget_;  // none
  bool has_plan_ = false;
};

/// No answer, and why.
Outcome no_answer(const std::string& why);

/// Figure of a state of the full system at the end.
using Measure = std::function<double(const CartesianState&)>;

/// The other methods on the scene up to `end` [s]: hand-written ones at `step` [s], packaged ones at a local
/// error of 1e-8 of the elastic scale, which is taken from our own motion. Empty when the options want none.
std::vector<PeerFigure> run_peers(const Scene& scene, double step, double end,
                                  const StabilityOptions& options, const Measure& measure);

/// The lists of cases, in the order of the table.
void add_frequency_cases(std::vector<StabilityCase>& cases);   // stiffness and mass ratios, thin shapes
void add_oscillator_cases(std::vector<StabilityCase>& cases);  // omega h, damping, many ticks
void add_small_cases(std::vector<StabilityCase>& cases);       // one to three points, mechanisms, rigid links
void add_motion_cases(std::vector<StabilityCase>& cases);      // rotation, sizes of forces and of structures
void add_tick_cases(std::vector<StabilityCase>& cases);        // ticks that turn bodies and orbits far
void add_rung_cases(std::vector<StabilityCase>& cases);        // every rung at any step
void add_refusal_cases(std::vector<StabilityCase>& cases);     // what must be refused or flagged by name

}  // namespace freeflex::tools
