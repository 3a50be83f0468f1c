// Error against run time of one scene: every rung at several steps, every rival at several settings   (THEORY
// section 13).
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex::tools {

/// How much is read while a method runs: positions and velocities of all points.
enum class ReadOut { kOnce = 0, kEach10ms = 1, kEach1ms = 2 };
inline constexpr std::size_t kReadOuts = 3;
inline constexpr std::array<const char*, kReadOuts> kReadOutNames{"all points once", "all points each 10 ms",
                                                                  "all points each 1 ms"};

enum class Family { kRung, kHandWritten, kPackaged, kLinearised };

/// One method at one setting.
struct Run {
  Family family = Family::kRung;
  std::string method;      // "separated", "velocity Verlet"
  double step = 0.0;       // [s] 0: adaptive
  double free_step = 0.0;  // [s] of a rung once the loads have ended; 0: the same
  double tolerance = 0.0;  // [-] 0: fixed step alone
  std::string failure;     // empty: reached the end
  long steps = 0;
  double set_up = 0.0;     // [s] CPU before the first step
  std::size_t memory = 0;  // [bytes] of plan and state, or of the method's and the system's arrays
  std::array<std::optional<double>, kReadOuts> cpu;  // [s] CPU per simulated second, median of the repeats
  int repeats = 0;                                   // of the first read-out's
  // against the full system at the end
  double elastic_error = 0.0;             // [-]   (X37)
  double position_error = 0.0;            // [m] root mean square over points
  double attitude_error = 0.0;            // [rad] between the best fitting rotations
  std::optional<double> frequency_error;  // [-] of the mode that moves most, after the loads   (X118)
  std::optional<double> energy_drift;     // [-] of the elastic energy when the loads end   (X119)
  // parts of the elastic error: against its own equations solved exactly, and those against the full system
  double integration_error = 0.0, model_error = 0.0;  // [-] the first not a number for a rigid body
};

/// A method, or a setting of it, that did not run, and why.
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
  std::string reference;            // method and settings
  double reference_accuracy = 0.0;  // [-] elastic
  double reference_cpu = 0.0;       // [s]
  std::vector<Run> runs;
  std::vector<LeftOut> left_out;
  std::string error;  // why there is no study
  bool is_interrupted = false;
};

struct StudyOptions {
  double end = 2.0;      // [s] simulated
  double budget = 30.0;  // [s] CPU that one run may take
  int repeats = 3;       // at least, of a timing
  bool has_rivals = true;
};

/// \param told  called with a share done, 0 to 1; returns false to stop early
Study study_scene(const std::string& file, const Scene& scene, const StudyOptions& options,
                  const std::function<bool(double)>& told);

/// At one elastic error: the cheapest run of ours that has no more, and what others cost at that run's error.
struct Comparison {
  double level = 0.0;    // [-]
  std::size_t ours = 0;  // index into Study::runs
  double cpu = 0.0;      // [s] CPU per simulated second
  double error = 0.0;    // [-] asked of the others
  struct Other {
    std::string method;  // empty: none reaches the error
    double cpu = 0.0;    // [s] CPU per simulated second, interpolated between settings
    double ratio = 0.0;  // to ours
  };
  Other best, hand_written, packaged, linearised;
};
inline constexpr std::array kLevels{1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7};
inline constexpr double kFinest = 3e-8;  // [-] elastic error to which other methods are swept

/// nullopt when no rung has an elastic error of the level or less.
std::optional<Comparison> compare_at(const Study& study, double level, ReadOut read_out);

const char* name_of(Family family);
std::string setting_of(const Run& run);  // "10 ms", "100 ms, then 1.9 s", "tol 1e-06"

}  // namespace freeflex::tools
