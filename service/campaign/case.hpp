// One case of a campaign: its values, its motion and its row of the table.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/motion.hpp"
#include "core/structure/structure.hpp"
#include "service/campaign/campaign.hpp"
#include "service/io/wire/codec.hpp"

namespace freeflex::campaign {

/// The values of one case. They depend only on the campaign and the number of the case.
struct Case {
  std::int64_t number = 0;
  std::vector<std::string> values;  // YAML text of each variable
  std::string scene;                // path
  io::Settings settings;            // of the scene: those of all cases, then those of this one
  std::vector<std::pair<std::string, double>> parameters;  // of the controller
};
/// \param number  0 to cases - 1
Case make_case(const Campaign& campaign, const Sampler& sampler, std::int64_t number);
/// Returns the seed for the random numbers of a case's controller.
std::uint64_t seed_of(const Campaign& campaign, std::int64_t number);
/// Makes a case from given texts of the variables, in place of those that are drawn.
Case make_case(const Campaign& campaign, std::int64_t number, std::vector<std::string> values);

/// How a case ended.
enum class Outcome {
  kPassed,
  kFailed,      // a measure is beyond its limit
  kUnstable,    // the state stopped being finite, or lost its shape
  kController,  // the controller reported an error, ended or hung
  kRefused,     // the values are not allowed, so there is no motion
};
inline constexpr std::array<const char*, 5> kOutcomes{"passed", "failed", "unstable", "controller",
                                                      "refused"};

struct CaseResult {
  std::int64_t number = 0;
  Outcome outcome = Outcome::kPassed;
  std::vector<std::string> values;                // as in Case
  std::vector<double> measures;                   // empty if the motion did not reach its end
  std::string message;                            // why the case did not pass
  double setup_seconds = 0.0, run_seconds = 0.0;  // wall clock
  std::int64_t ticks = 0;
};

/// A plan with the table against which commands are checked.
struct CasePlan {
  Plan plan;
  io::NameTable table;
};

/// The source of a case's commands. The base class has none. The functions return an empty text or the error.
class Commander {
 public:
  virtual ~Commander() = default;
  /// Makes the motion of a case, and gets ready to command it. The motion exists until end().
  virtual std::string begin(const std::shared_ptr<const CasePlan>& plan, const Case& of, Watch watch);
  virtual Motion& motion() { return *motion_; }
  /// Appends the commands that take effect at the next tick.
  virtual std::string take(std::vector<ForceCommand>&) { return {}; }
  virtual void end() { motion_.reset(); }

 private:
  std::shared_ptr<const CasePlan> plan_;
  std::optional<Motion> motion_;
};

/// Sees the commands of a case as they take effect.
class CaseObserver {
 public:
  virtual ~CaseObserver() = default;
  virtual void begin(const Plan& plan) = 0;
  /// \param tick  the tick at which the commands took effect
  virtual void stepped(std::int64_t tick, const StepReport& report,
                       const std::vector<ForceCommand>& commands) = 0;
  virtual void end(const State& state) = 0;
};

/// Runs cases one after another. Cases whose scenes are equal share one plan, and cases of which only the
/// initial state, the times of loads or fields differ share one structure. Nothing is judged unless a measure
/// asks for it. Throws std::runtime_error if the scene can no longer be read with the nominal values.
class CaseRunner {
 public:
  /// \param campaign  must outlive this object
  explicit CaseRunner(const Campaign& campaign) : campaign_(campaign), sampler_(campaign.sampling) {}

  CaseResult run(std::int64_t number, Commander& commander);
  /// Runs a case with given values.
  CaseResult run(const Case& given, Commander& commander, CaseObserver* observer = nullptr);
  Case case_of(std::int64_t number) const { return make_case(campaign_, sampler_, number); }
  /// Makes the plan of a case. If there is none, returns nullptr and sets `fault` to the first fault.
  std::shared_ptr<const CasePlan> plan_of(const Case& of, std::string& fault);

 private:
  std::optional<Plan> load_plan_file(const Case& of, std::string& fault);
  std::optional<Plan> make_plan_of_scene(const Case& of, std::string& fault);
  // throws if the scene cannot be read with the nominal values, because then the files have changed, and no
  // case says anything. `fault` is the reason.
  void check_files(const std::string& fault) const;
  void step_to_end(Commander& commander, CaseObserver* observer, CaseResult& result) const;

  const Campaign& campaign_;
  Sampler sampler_;
  std::string planned_scene_;  // of plan_
  io::Settings planned_;
  std::optional<Structure> structure_;
  std::shared_ptr<const CasePlan> plan_;
};

/// Returns the header of the table: case, outcome, the variables, the measures, message.
std::string table_header(const Campaign& campaign);
/// Returns the row of a case, with numbers from which the same bits are read back. It does not depend on the
/// time that the case took.
std::string table_row(const Campaign& campaign, const CaseResult& result);

}  // namespace freeflex::campaign
