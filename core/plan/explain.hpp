// What a motion lacks, effect by effect: the same motion on a ladder of plans between the plan and the best
// one, each of which has one effect more than the plan before it.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "core/error/shadow.hpp"
#include "core/plan/spec.hpp"

namespace freeflex {

/// Lists the effects that a motion may lack, in the order of the ladder.
enum class Effect : std::int32_t {
  kTruncation = 0,   // modes that the plan omits
  kIntegration = 1,  // the length of the tick
  kGyration = 2,     // Coriolis and centrifugal forces, and the elastic motion that acts back on the body
  kStiffness = 3,    // stiffness by the forces in links that spin, loads and commands cause
  kCurvature = 4,    // true lengths, directions and rotations of links
};

/// States how far a motion is from the same motion with one effect more.
struct EffectSize {
  Effect effect = Effect::kTruncation;
  // largest distance over the run   (THEORY 15.13); infinite if the motion with this effect stops
  MotionError most;
};

/// Steps the ladder of a motion beside it   (THEORY 15.13).
class Explanation {
 public:
  /// \param structure  structure of the scene, with all modes
  /// \param plan  plan of the scene with a verdict; must outlive this object
  /// \pre plan.verdict.shadows is not empty
  Explanation(const Scene& scene, const Structure& structure, const Plan& plan);
  Explanation(const Explanation&) = delete;
  Explanation& operator=(const Explanation&) = delete;

  /// Notes the commands of a tick. Call this function before take() of the next tick.
  void command(std::int64_t tick, std::span<const ForceCommand> commands);
  /// Takes the state at the start of an epoch and after every tick.
  void take(const MotionState& state);
  /// Returns the effects that the motion lacks, the largest deformation first.
  std::vector<EffectSize> effects() const;
  /// Returns the largest effect so far as text, for example "mostly geometric stiffness (0.00031 m)".
  std::string leading() const;

 private:
  struct Step {
    Effect effect;
    PlanShadow plan;
  };
  struct Place {
    std::vector<Vec3> V;  // [m] displacements of points, body axes
    Vec3 p_W{};
    Quat q_WB{};
  };
  void add(Effect effect, std::optional<Plan> plan, std::int32_t substeps);
  static Place place_of(const StepPlan& plan, const MotionState& state);
  MotionError distance(const Place& a, const Place& b) const;

  const Plan& plan_;
  std::vector<double> mass_;  // [kg] (num_points) 1 each if no point has mass
  std::deque<Step> steps_;
  std::deque<Shadow> shadows_;
  std::vector<EffectSize> sizes_;
  std::vector<bool> has_stopped_;
};

/// Runs a scene without commands for a time [s] and returns the effects that its motion lacks. Returns
/// nullopt if the motion stops.  \pre plan.verdict.shadows is not empty
std::optional<std::vector<EffectSize>> explain_motion(const Scene& scene, const Structure& structure,
                                                      const Plan& plan, double seconds);

/// Returns the name of an effect.
const char* name_of(Effect effect);
/// Returns what to do about an effect that a motion lacks.
std::string remedy_of(Effect effect, const Plan& plan);

}  // namespace freeflex
