// A campaign: many cases of one scene, each with its own values. service/campaign/README.md describes the
// file.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/faults.hpp"
#include "service/campaign/sampler.hpp"
#include "service/io/scene/input.hpp"

namespace freeflex::campaign {

/// A value that differs from case to case. Its distribution is Sampling::variables at the same index.
struct Variable {
  std::string name{};
  std::vector<std::string> paths;  // values of the scene that are set, or controller.NAME
  std::string nominal;             // YAML text of the value that `shrink` tries first
  Origin origin{};
};

/// Values of the controller have paths that begin with this.
inline constexpr const char* kControllerPath = "controller.";

/// The program that steers a case.
struct ControllerFile {
  enum class Kind { kNone, kLibrary, kPython, kProgram };
  Kind kind = Kind::kNone;
  std::vector<std::string> files;  // the library, the Python file, or the program and its arguments
  double every = 0.0;              // [s] simulated time between two calls; 0: each tick. Not for a program
  std::vector<std::pair<std::string, double>> parameters;
};

/// Finds the number of ticks between two calls.  \param period  [s] of a tick
/// \return why there is none, or an empty text
std::string find_ticks(const ControllerFile& controller, double period, int& ticks);

/// How the values of a quantity over time become one number.
enum class Statistic { kLargest, kMax, kMin, kMean, kRms, kFinal, kSettlingTime, kOvershoot };
inline constexpr std::array<const char*, 8> kStatistics{"largest", "max",   "min",           "mean",
                                                        "rms",     "final", "settling_time", "overshoot"};

/// A number that is measured in each case.
struct Measure {
  std::string name{};
  std::string quantity{};  // "point.tip.x"; quantities.hpp reads it
  Statistic statistic = Statistic::kLargest;
  double from = 0.0;                                    // [s] first and last time that count
  double to = std::numeric_limits<double>::infinity();  // [s]
  double target = 0.0;                                  // of the settling time and the overshoot
  double band = 0.0;  // of the settling time: largest distance from the target
  std::array<double, 4> reference{1.0, 0.0, 0.0, 0.0};  // of the quantity `attitude`: quaternion w x y z
  std::optional<double> fail_above{}, fail_below{};     // a case fails beyond these
  Origin origin{};
};

struct Campaign {
  std::string path, name;
  std::string folder;       // base of relative file names
  std::uint64_t hash = 0;   // of what the campaign file says, without its name and time_limit
  std::string scene;        // path of the scene
  std::string commands;     // path of a recording whose commands act in each case; empty: none
  io::Settings set;         // values of all cases
  double until = 0.0;       // [s]
  double time_limit = 0.0;  // [s] wall clock, after which a case counts as hung
  Sampling sampling;
  std::vector<Variable> variables;
  ControllerFile controller;
  std::vector<Measure> measures;
};

struct CampaignResult {
  std::optional<Campaign> campaign;  // empty if faults contains an error
  Faults faults;
  std::vector<std::string> sources;  // as in io::SceneResult
};
/// Reads a campaign file and reports all its faults. Does not read the scene.
CampaignResult read_campaign(const std::string& path);

}  // namespace freeflex::campaign
