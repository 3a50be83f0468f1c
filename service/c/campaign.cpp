// The C interface of campaigns.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "service/c/handles.hpp"
#include "service/campaign/numbers.hpp"
#include "service/campaign/trace.hpp"
#include "service/io/scene/text.hpp"

namespace {

using namespace freeflex;
using c_interface::fail;
using c_interface::guarded;

/// Passes the calls of a case to the caller's functions.
class CallbackCommander : public campaign::Commander {
 public:
  CallbackCommander(const campaign::Campaign& campaign, const freeflex_controller& controller)
      : campaign_(campaign), controller_(controller) {}

  std::string begin(const std::shared_ptr<const campaign::CasePlan>& plan, const campaign::Case& of,
                    Watch watch) override {
    plan_.data = plan;
    motion_.emplace(plan, watch);
    has_begun_ = false;
    if (std::string fault = campaign::find_ticks(campaign_.controller, plan->plan.period, period_);
        !fault.empty())
      return fault;
    parameters_.clear();
    for (const auto& [name, value] : of.parameters) parameters_.push_back({name.c_str(), value});
    told_ = {of.number, campaign::seed_of(campaign_, of.number), parameters_.data(), parameters_.size()};
    has_begun_ = true;
    if (controller_.begin == nullptr) return {};
    return call([&] { return controller_.begin(&plan_, &told_, &self_, reason_.data()); });
  }

  Motion& motion() override { return motion_->motion; }

  std::string take(std::vector<ForceCommand>& commands) override {
    if (motion_->motion.tick() % period_ != 0) return {};
    std::string reason = call([&] { return controller_.act(self_, &*motion_, reason_.data()); });
    commands.swap(motion_->pending);
    motion_->pending.clear();
    return reason;
  }

  void end() override {
    if (has_begun_ && controller_.end != nullptr) controller_.end(self_);
    self_ = nullptr;
    motion_.reset();
  }

 private:
  // calls a function of the controller. Returns an empty text or the reason for which it ends the case; an
  // exception of C++ is one.
  template <class Function>
  std::string call(const Function& function) {
    reason_.fill('\0');
    int code = 0;
    try {
      code = function();
    } catch (const std::exception& error) {
      return error.what();
    } catch (...) {
      return "the controller threw what is no std::exception";
    }
    if (code == 0) return {};
    const std::string text(reason_.begin(), std::find(reason_.begin(), reason_.end(), '\0'));
    return text.empty() ? "the controller returned " + std::to_string(code) : text;
  }

  const campaign::Campaign& campaign_;
  const freeflex_controller controller_;
  freeflex_plan plan_;
  std::optional<freeflex_motion> motion_;
  std::vector<freeflex_parameter> parameters_;
  std::array<char, FREEFLEX_REASON_SIZE> reason_{};
  freeflex_case told_{};
  bool has_begun_ = false;
  void* self_ = nullptr;
  int period_ = 1;  // [ticks]
};

}  // namespace

struct freeflex_campaign {
  explicit freeflex_campaign(campaign::Campaign given) : campaign(std::move(given)), runner(campaign) {}

  const campaign::Campaign campaign;
  campaign::CaseRunner runner;
  std::string row;
};

int freeflex_campaign_open(const char* path, freeflex_campaign** opened) noexcept {
  return guarded([&] {
    if (path == nullptr || opened == nullptr)
      return fail(FREEFLEX_BAD_ARGUMENT, "path or campaign is NULL, but both must be given");
    campaign::CampaignResult read = campaign::read_campaign(path);
    std::string errors;
    for (const Fault& fault : read.faults) errors += io::format_fault(fault, read.sources, false) + "\n";
    if (!read.campaign) return fail(FREEFLEX_BAD_SCENE, errors);
    *opened = std::make_unique<freeflex_campaign>(std::move(*read.campaign)).release();
    return FREEFLEX_OK;
  });
}

void freeflex_campaign_free(freeflex_campaign* campaign) noexcept { delete campaign; }

std::int64_t freeflex_campaign_cases(const freeflex_campaign* campaign) noexcept {
  return campaign->campaign.sampling.cases;
}

std::int32_t freeflex_campaign_variables(const freeflex_campaign* campaign) noexcept {
  return static_cast<std::int32_t>(campaign->campaign.variables.size());
}

namespace {

/// Runs a case, and stores its row.
int run_case(freeflex_campaign& campaign, const campaign::Case& of, const freeflex_controller* controller,
             campaign::CaseObserver* observer, double* seconds) {
  campaign::Commander none;
  std::optional<CallbackCommander> called;
  if (controller != nullptr) called.emplace(campaign.campaign, *controller);
  const campaign::CaseResult result =
      campaign.runner.run(of, called ? static_cast<campaign::Commander&>(*called) : none, observer);
  campaign.row = campaign::table_row(campaign.campaign, result);
  if (seconds != nullptr) {
    seconds[0] = result.setup_seconds;
    seconds[1] = result.run_seconds;
  }
  return FREEFLEX_OK;
}

int check_case(const freeflex_campaign& campaign, std::int64_t number,
               const freeflex_controller* controller) {
  const std::int64_t cases = campaign.campaign.sampling.cases;
  if (number < 0 || number >= cases)
    return fail(FREEFLEX_BAD_ARGUMENT, "there is no case " + std::to_string(number) +
                                           "; the numbers are 0 to " + std::to_string(cases - 1));
  if (controller != nullptr && controller->act == nullptr)
    return fail(FREEFLEX_BAD_ARGUMENT, "the controller has no function act");
  // without them, the row would be that of another case
  if (controller == nullptr && campaign.campaign.controller.kind != campaign::ControllerFile::Kind::kNone)
    return fail(FREEFLEX_BAD_ARGUMENT, "the campaign names a controller, but none is given");
  if (!campaign.campaign.commands.empty())
    return fail(FREEFLEX_BAD_ARGUMENT,
                "the campaign has commands of a recording, which only 'freeflex campaign' applies");
  return FREEFLEX_OK;
}

}  // namespace

int freeflex_campaign_run(freeflex_campaign* campaign, std::int64_t number, const char* const* values,
                          const freeflex_controller* controller, const char** row,
                          double seconds[2]) noexcept {
  return guarded([&] {
    if (const int code = check_case(*campaign, number, controller); code != FREEFLEX_OK) return code;
    campaign::Case of;
    if (values == nullptr)
      of = campaign->runner.case_of(number);
    else
      of = make_case(campaign->campaign, number,
                     {values, values + static_cast<std::ptrdiff_t>(campaign->campaign.variables.size())});
    const int code = run_case(*campaign, of, controller, nullptr, seconds);
    *row = campaign->row.c_str();
    return code;
  });
}

int freeflex_campaign_trace(freeflex_campaign* campaign, std::int64_t number, const char* scene,
                            const freeflex_controller* controller, const char* log,
                            const char** row) noexcept {
  return guarded([&] {
    if (const int code = check_case(*campaign, number, controller); code != FREEFLEX_OK) return code;
    campaign::Case of = campaign->runner.case_of(number);
    of.scene = scene;
    of.settings.clear();
    campaign::CommandTrace trace(log);
    run_case(*campaign, of, controller, &trace, nullptr);
    *row = campaign->row.c_str();
    if (const std::string error = trace.close(); !error.empty()) return fail(FREEFLEX_INTERNAL, error);
    return FREEFLEX_OK;
  });
}

double freeflex_random_normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) noexcept {
  return campaign::normal_quantile(
      campaign::to_unit(campaign::random_bits({index, stream, 0, 0}, {seed, 0})[0]));
}
