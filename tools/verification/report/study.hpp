// Measures the error and the run time on one scene, for every rung at several steps and for every other
// method at several settings (THEORY section 13).
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// How often a run reads positions and velocities of all points.
enum class ReadOut { kOnce = 0, kEach10ms = 1, kEach1ms = 2 };
inline constexpr std::size_t kReadOuts = 3;
inline constexpr std::array<const char*, kReadOuts> kReadOutNames{"all points once", "all points each 10 ms",
                                                                  "all points each 1 ms"};

enum class Family { kRung, kHandWritten, kPackaged, kLinearised };

/// What follows the name of a rung in runs that integrate points.
inline constexpr const char* kByPoints = ", points";

/// Result of one method at one setting.
struct Run {
  Family family = Family::kRung;
  std::string method;      // "separated", "velocity Verlet"
  double step = 0.0;       // [s] 0: adaptive
  double free_step = 0.0;  // [s] step of a rung after the end of the loads; 0: `step`
  double tolerance = 0.0;  // [-] or accuracy of the integration of points; 0 if the step is fixed
  std::string failure;     // reason why the run failed; empty if it reached its end
  long steps = 0;
  long evaluations = 0;  // of the forces of all links; 0 for a rung, and for methods that do not count them
  double set_up = 0.0;   // [s] CPU time before the first step
  // [bytes] memory of plan and state of a rung, or of the arrays of method and system
  std::size_t memory = 0;
  // [s] CPU time per simulated second, median of the repeats
  std::array<std::optional<double>, kReadOuts> cpu;
  int repeats = 0;  // number of timings with the first read-out
  // errors relative to the full system at the end
  double elastic_error = 0.0;   // [-]   (THEORY 10.11)
  double position_error = 0.0;  // [m] root mean square over points
  double attitude_error = 0.0;  // [rad] angle between the best fitting rotations
  // [-] error of the frequency of the mode that moves most after the loads end (THEORY 13.16)
  std::optional<double> frequency_error;
  // [-] relative to the elastic energy of the reference (THEORY 13.17)
  std::optional<double> energy_drift;
  // [-] two parts of the elastic error: the difference of the run from the exact solution of its own
  // equations, and the difference of that solution from the full system
  double integration_error = 0.0, model_error = 0.0;  // integration_error is NaN for a rigid body
};

/// A method or setting that did not run, and the reason.
struct LeftOut {
  std::string what, why;
};

struct Study {
  std::string scene, file;
  std::size_t points = 0, links = 0, elastic_freedoms = 0;
  double end = 0.0;            // [s]
  double spin = 0.0;           // [rad/s] at the start
  double top_frequency = 0.0;  // [rad/s]
  double lowest_frequency = 0.0;
  bool has_true_geometry =
      false;  // true: the full system has other links than springs and bars, or dissipates
  // [s] CPU time of one evaluation of the forces in other methods at true geometry; 0: not measured
  double evaluation_cpu = 0.0;
  std::string reference;            // method and settings
  double reference_accuracy = 0.0;  // [-] elastic
  double reference_cpu = 0.0;       // [s]
  std::vector<Run> runs;
  std::vector<LeftOut> left_out;
  std::string error;  // reason why there is no study, else empty
  bool is_interrupted = false;
};

struct StudyOptions {
  double end = 2.0;      // [s] simulated
  double budget = 30.0;  // [s] CPU time that one run may take
  int repeats = 3;       // smallest number of timings of a run
  bool has_rivals = true;
};

/// Studies one scene.  \param report_progress  called with the finished fraction, 0 to 1, or with a negative
/// number, which only asks whether to continue; returns false to stop early
Study study_scene(const std::string& file, const Scene& scene, const StudyOptions& options,
                  const std::function<bool(double)>& report_progress);

/// Costs at one elastic error: the cost of the cheapest rung with at most that error, and the costs of other
/// methods at the error of that rung.
struct Comparison {
  double level = 0.0;    // [-]
  std::size_t ours = 0;  // index into Study::runs
  double cpu = 0.0;      // [s] CPU per simulated second
  double error = 0.0;    // [-] error required of the other methods
  struct Other {
    std::string method;  // empty: no method reaches the error
    double cpu = 0.0;    // [s] CPU time per simulated second, interpolated between settings
    double ratio = 0.0;  // cost of this method divided by our cost
  };
  Other best, hand_written, packaged, linearised;
};
inline constexpr std::array kLevels{1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7};
inline constexpr double kFinest = 3e-8;  // [-] smallest elastic error that is required of other methods

/// Returns the comparison at a level, or nullopt if the elastic error of every rung exceeds the level
/// (THEORY 13.18).
std::optional<Comparison> compare_at(const Study& study, double level, ReadOut read_out);

const char* name_of(Family family);
std::string setting_of(const Run& run);  // such as "10 ms", "100 ms, then 1.9 s", "tol 1e-06"

}  // namespace freeflex::tools
