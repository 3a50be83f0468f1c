// Simulates the scenes of the stability table, with freeflex and with other methods.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/motion.hpp"
#include "core/step/readout.hpp"
#include "tools/verification/reference/cartesian.hpp"
#include "tools/verification/stability/stability.hpp"

namespace freeflex::tools {

/// Simulates a compiled scene.
class Ride {
 public:
  explicit Ride(const Scene& scene);

  /// Returns the faults and warnings of the set-up, one per line, or an empty text if there are none.
  const std::string& faults_text() const { return faults_text_; }
  bool has_plan() const { return motion_.has_value(); }
  /// Advances by ticks. If the state after a tick is not finite, keeps the state before the tick and returns
  /// false. \pre has_plan()
  bool run(std::int64_t ticks, std::span<const ForceCommand> commands = {});

  Eigen::Matrix3Xd positions_W() const;      // [m] (3 x N), for which every point must be published
  Eigen::Matrix3Xd displacements_B() const;  // [m] (3 x N)
  const State& state() const { return motion_->state(); }
  const Verdict& verdict() const { return motion_->verdict(); }

  Plan plan;

 private:
  template <typename Read>
  Eigen::Matrix3Xd read_points(Read read) const;

  std::string faults_text_;
  std::optional<Motion> motion_;  // empty without a plan
};

/// Returns an outcome without a value, with the reason why there is none.
Outcome no_answer(const std::string& why);

/// Measures a quantity in the last state of the full system.
using Measure = std::function<double(const CartesianState&)>;

/// Runs the other methods on the scene up to `end` [s]: hand-written methods with steps of `step` [s],
/// packaged methods with local errors of 1e-8 of the elastic scale of our own motion. Returns an empty list
/// if has_peers is false.
std::vector<PeerFigure> run_peers(const Scene& scene, double step, double end,
                                  const StabilityOptions& options, const Measure& measure);

// Each function adds cases to the table. The order here is the order of the table.
void add_frequency_cases(std::vector<StabilityCase>& cases);   // stiffness and mass ratios, thin shapes
void add_oscillator_cases(std::vector<StabilityCase>& cases);  // omega h, damping, many ticks
void add_small_cases(std::vector<StabilityCase>& cases);       // one to three points, mechanisms, rigid links
void add_motion_cases(std::vector<StabilityCase>& cases);   // spin near the intermediate axis, very small and
                                                            // large forces, very small and large structures
void add_tick_cases(std::vector<StabilityCase>& cases);     // ticks with large rotations of bodies and orbits
void add_rung_cases(std::vector<StabilityCase>& cases);     // every rung at any step
void add_refusal_cases(std::vector<StabilityCase>& cases);  // scenes that must be refused or reported

}  // namespace freeflex::tools
