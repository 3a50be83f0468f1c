// freeflex campaign rerun and shrink: single cases of a campaign.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "service/campaign/case.hpp"
#include "tools/campaign/shrink.hpp"
#include "tools/campaign/table.hpp"
#include "tools/cli/campaign_parts.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

using campaign::Campaign;
using campaign::Opened;
using campaign::Results;
using campaign::StoredRow;

/// Checks that a case exists.
bool has_case(const Opened& opened, std::int64_t number) {
  if (number < opened.campaign.sampling.cases) return true;
  print_error("there is no case " + std::to_string(number) + "; the numbers are 0 to " +
              std::to_string(opened.campaign.sampling.cases - 1));
  return false;
}

/// Runs one job after another in one worker. Returns an empty text or the error.
/// \param next  returns the next job when the row of the last one was taken
/// \param values  those of the job in hand, if they are not drawn
std::string run_in_turn(const Opened& opened, const std::function<std::optional<std::string>()>& next,
                        const std::function<void(const std::string& row)>& take,
                        const std::function<std::vector<std::string>()>& values) {
  bool is_waiting = false;
  return campaign::run_pool(pool_options(opened, 1),
                            {.next = [&]() -> std::optional<std::string> {
                               if (std::exchange(is_waiting, true)) return std::nullopt;
                               std::optional<std::string> job = next();
                               is_waiting = job.has_value();
                               return job;
                             },
                             .take =
                                 [&](const StoredRow& stored) {
                                   is_waiting = false;
                                   take(stored.row);
                                   return true;
                                 },
                             .lost =
                                 [&](std::int64_t number, bool is_hung, const std::string& why) {
                                   return lost_row(opened.campaign, number, values(), is_hung, why);
                                 },
                             .is_ended = [] { return is_interrupted(); }});
}

/// Runs another freeflex command and returns its exit code.
int run_freeflex(const std::vector<std::string>& arguments) {
  std::vector<char*> words;
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").string();
  words.push_back(const_cast<char*>(program.c_str()));
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  std::fflush(nullptr);
  pid_t child = 0;
  if (posix_spawn(&child, program.c_str(), nullptr, nullptr, words.data(), environ) != 0) return kExitDiffers;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : kExitInterrupted;
}

}  // namespace

int rerun_case(const CampaignOptions& options) {
  const std::optional<Opened> opened = campaign::open_campaign(options.file, options.out);
  if (!opened || !has_case(*opened, options.number)) return kExitUsage;
  const std::optional<Results> results = read_or_explain(*opened);
  if (!results) return kExitUsage;
  std::error_code ignored;
  std::filesystem::create_directories(opened->folder, ignored);
  const std::string name = in_folder(*opened, "case-" + std::to_string(options.number));
  std::string scene = name + ".yaml";
  const std::string commands = name + ".commands.log", log = name + ".log";
  if (const std::string error = campaign::write_case_scene(
          campaign::make_case(opened->campaign, campaign::Sampler(opened->campaign.sampling), options.number),
          scene);
      !error.empty())
    return print_error(error), kExitDiffers;
  // absolute, because a controller may go to another folder
  const auto absolute = [](const std::string& path) { return std::filesystem::absolute(path).string(); };
  std::string row, job = std::to_string(options.number) + "\t" + campaign::kTraceMark + "\t" +
                         absolute(scene) + "\t" + absolute(commands);
  const std::string error = run_in_turn(
      *opened, [&] { return row.empty() ? std::optional(job) : std::nullopt; },
      [&](const std::string& found) { row = found; }, [] { return std::vector<std::string>{}; });
  if (!error.empty()) return print_error(error), kExitDiffers;
  if (is_interrupted()) return std::fputs(kInterrupted, stderr), kExitInterrupted;
  std::printf("%s\n%s\n", campaign::table_header(opened->campaign).c_str(), row.c_str());
  const auto known = results->rows.find(options.number);
  if (known != results->rows.end() && known->second.row != row)
    return print_error("the row differs from that of the results: " + known->second.row), kExitDiffers;
  const std::string_view outcome = campaign::outcome_of(row);
  if (outcome == "refused" || campaign::is_lost(row))
    return std::printf("%s; without a motion there is no recording\n", scene.c_str()), kExitOk;
  std::printf("%s: freeflex run, freeflex view and freeflexd take this scene\n", scene.c_str());
  if (std::filesystem::file_size(commands, ignored) == 0)
    return std::printf("the controller did not begin, so there is no recording\n"), kExitOk;
  // from a plan, because eigenvectors differ between machines in their last bits
  const std::string plan = name + ".plan";
  if (const int code = run_freeflex({"compile", scene, "-o", plan}); code != kExitOk) return code;
  return run_freeflex({"run", plan, "--log", commands, "--out", log});
}

int shrink_case(const CampaignOptions& options) {
  const std::optional<Opened> opened = campaign::open_campaign(options.file, options.out);
  if (!opened || !has_case(*opened, options.number)) return kExitUsage;
  const Campaign& of = opened->campaign;
  std::error_code ignored;
  std::filesystem::create_directories(opened->folder, ignored);
  const auto drawn = campaign::make_case(of, campaign::Sampler(of.sampling), options.number).values;
  campaign::Shrinking shrinking(of, drawn);
  std::string first_outcome, last_row;
  std::vector<std::string> trial;
  const std::string error = run_in_turn(
      *opened,
      [&]() -> std::optional<std::string> {
        if (first_outcome.empty()) return std::to_string(options.number);
        if (first_outcome == "passed" || first_outcome == "refused") return std::nullopt;
        const auto values = shrinking.next();
        if (!values) return std::nullopt;
        trial = *values;
        std::string job = std::to_string(options.number);
        for (const std::string& value : *values) job += "\t" + value;
        return job;
      },
      [&](const std::string& row) {
        const std::string outcome(campaign::outcome_of(row));
        const bool fails = outcome != "passed" && outcome != "refused";
        if (fails) last_row = row;
        if (first_outcome.empty())
          first_outcome = outcome;
        else
          shrinking.take(fails);
      },
      [&] { return trial; });
  if (!error.empty()) return print_error(error), kExitDiffers;
  if (is_interrupted()) return std::fputs(kInterrupted, stderr), kExitInterrupted;
  if (last_row.empty())
    return print_error("case " + std::to_string(options.number) + " is " + first_outcome +
                       "; choose one that fails"),
           kExitUsage;
  const std::vector<std::size_t> remaining = shrinking.remaining();
  std::printf("%s; not nominal: %s\n", counted(shrinking.num_trials(), "trial").c_str(),
              (counted(static_cast<std::int64_t>(remaining.size()), "value") + " of " +
               std::to_string(of.variables.size()))
                  .c_str());
  for (const std::size_t k : remaining)
    std::printf("  %s: %s (nominal %s, in the case %s)\n", of.variables[k].name.c_str(),
                shrinking.values()[k].c_str(), of.variables[k].nominal.c_str(), drawn[k].c_str());
  if (remaining.empty()) std::printf("the case fails with nominal values too\n");
  if (shrinking.failing_factor() < 1.0)
    std::printf(
        "these values are at %.3g of their distances from the nominal ones in the case; nearer it "
        "passes\n",
        shrinking.failing_factor());
  std::printf("%s\n", last_row.c_str());
  return kExitOk;
}

}  // namespace freeflex::tools
