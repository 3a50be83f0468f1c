// freeflex campaign runs many cases of a scene.

#include <CLI/App.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "service/campaign/case.hpp"
#include "service/io/wire/log.hpp"
#include "tools/campaign/hdf5_table.hpp"
#include "tools/campaign/page.hpp"
#include "tools/campaign/slurm.hpp"
#include "tools/campaign/summary.hpp"
#include "tools/campaign/table.hpp"
#include "tools/campaign/worker.hpp"
#include "tools/cli/campaign_parts.hpp"
#include "tools/cli/commands.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/usage.hpp"

namespace freeflex::tools {

std::string in_folder(const campaign::Opened& opened, const std::string& name) {
  return (std::filesystem::path(opened.folder) / name).string();
}

std::optional<campaign::Results> read_or_explain(const campaign::Opened& opened,
                                                 const std::optional<campaign::Shard>& shard) {
  campaign::Results results = campaign::read_results(opened.folder, opened.stamp, shard);
  if (!results.error.empty()) {
    print_error(results.error);
    if (results.error.find(campaign::kOtherCampaign) != std::string::npos) {
      std::fputs("the files of this campaign are:", stderr);
      for (const std::string& file : opened.files) std::fprintf(stderr, " %s", file.c_str());
      std::fputs("\n", stderr);
    }
    return std::nullopt;
  }
  // the campaign may have had more cases before
  std::erase_if(results.rows, [&](const auto& row) { return row.first >= opened.campaign.sampling.cases; });
  return results;
}

campaign::StoredRow lost_row(const campaign::Campaign& of, std::int64_t number,
                             std::vector<std::string> values, bool is_hung, const std::string& why) {
  campaign::CaseResult result;
  result.number = number;
  result.values = values.empty() ? campaign::make_case(of, campaign::Sampler(of.sampling), number).values
                                 : std::move(values);
  result.message =
      is_hung ? format_text("the case did not end within %g s of wall clock (time_limit)", of.time_limit)
              : why;
  std::string row = campaign::table_row(of, result);
  const std::string passed = ",passed,";
  row.replace(row.find(passed), passed.size(), is_hung ? ",hung," : ",crashed,");
  return {row, 0.0, 0.0};
}

campaign::PoolOptions pool_options(const campaign::Opened& opened, int num_workers) {
  return {.command = campaign::worker_command(opened.campaign),
          .log = in_folder(opened, "workers.log"),
          .num_workers = num_workers,
          .time_limit = opened.campaign.time_limit};
}

namespace {

using campaign::Campaign;
using campaign::Opened;
using campaign::Results;
using campaign::Shard;
using campaign::StoredRow;

constexpr const char* kCampaignFooter = R"(Example:
  freeflex campaign run pointing.yaml               (runs, or goes on where it was stopped)
  freeflex campaign status pointing.yaml
  freeflex campaign rerun pointing.yaml 17          (case 17 as a scene and a recording)
  freeflex campaign shrink pointing.yaml 17         (which values make it fail)
  freeflex campaign run pointing.yaml --shard auto  (one task of a Slurm array, of MPI or of Kubernetes)
The file is described in service/campaign/README.md. Results are in pointing.results: cases.csv has one row a case,
cases.html has pictures.
Exit codes: 0 done, 1 results cannot be written, files changed meanwhile or no process got ready, 2 wrong arguments,
campaign or scene, or results of other files, 3 cases are missing, 130 interrupted.)";

void print_retried(const Results& results) {
  if (results.num_retried > 0)
    std::printf(
        "%s crashed or hung in one process and ended in another, whose result counts; find out why, because "
        "such cases may fail too\n",
        counted(results.num_retried, "case").c_str());
}

/// Writes the table, also in HDF5 if that is asked for, and the page.
int write_outputs(const Opened& opened, const Results& results, bool writes_hdf5) {
  const std::string table = in_folder(opened, "cases.csv"), page = in_folder(opened, "cases.html");
  if (const std::string error = campaign::write_table(opened, results, table); !error.empty())
    return print_error(error), kExitDiffers;
  if (writes_hdf5)
    if (const std::string error = campaign::write_hdf5(opened, results, in_folder(opened, "cases.h5"));
        !error.empty())
      return print_error(error), kExitDiffers;
  io::PartialFile file(page);
  std::ofstream stream(file.working_path(), std::ios::binary);
  stream << campaign::make_page(opened, results);
  stream.close();
  if (!stream) return print_error("cannot write '" + page + "'"), kExitDiffers;
  if (const std::string error = file.commit(); !error.empty()) return print_error(error), kExitDiffers;
  const campaign::Summary summary = campaign::summarize(results);
  std::printf("%s%s, %s\n", campaign::summary_text(summary).c_str(), table.c_str(), page.c_str());
  print_retried(results);
  if (summary.num_controller_faults() > 0)
    std::printf("what controllers printed: %s\n", in_folder(opened, "workers.log").c_str());
  if (summary.total() > 0 && summary.counts[0] == 0)
    print_warning("no case passed; read the column message of the table");
  return kExitOk;
}

/// Runs the cases of a shard that have no result yet. Returns the exit code.
int run_missing(const Opened& opened, const Shard& shard, int num_workers, Results& results) {
  const Campaign& of = opened.campaign;
  campaign::PartFile part;
  if (const std::string error = part.create(opened.folder, opened.stamp, shard); !error.empty())
    return print_error(error), kExitDiffers;
  std::int64_t at = shard.index, num_done = 0, num_missing = 0;
  for (std::int64_t i = shard.index; i < of.sampling.cases; i += shard.count)
    num_missing += results.rows.contains(i) ? 0 : 1;
  std::string write_error;
  std::optional<Progress> progress(std::in_place, "run");
  const campaign::PoolCalls calls{
      .next = [&]() -> std::optional<std::string> {
        while (at < of.sampling.cases && results.rows.contains(at)) at += shard.count;
        if (at >= of.sampling.cases) return std::nullopt;
        return std::to_string(std::exchange(at, at + shard.count));
      },
      .take =
          [&](StoredRow stored) {
            write_error = campaign::find_change(opened);
            if (write_error.empty()) write_error = part.append(stored);
            if (!write_error.empty()) return false;
            results.rows.insert_or_assign(campaign::number_of(stored.row), std::move(stored));
            progress->update(static_cast<double>(++num_done) / static_cast<double>(num_missing));
            return true;
          },
      .lost = [&](std::int64_t number, bool is_hung,
                  const std::string& why) { return lost_row(of, number, {}, is_hung, why); },
      .is_ended = [] { return is_interrupted(); }};
  const std::string error = campaign::run_pool(pool_options(opened, num_workers), calls);
  progress.reset();
  const auto left = static_cast<long long>(num_missing - num_done);
  if (!error.empty()) return print_error(error), kExitDiffers;
  if (!write_error.empty())
    return print_error(write_error + format_text("; %lld cases are left", left)), kExitDiffers;
  if (left == 0) return kExitOk;
  std::fprintf(stderr, "freeflex: interrupted: %lld cases are left; run again, which goes on\n", left);
  return kExitInterrupted;
}

int run(const CampaignOptions& options) {
  Shard shard;
  if (!options.shard.empty()) {
    std::string error;
    const auto parsed = campaign::parse_shard(
        options.shard, [](const char* name) { return std::getenv(name); }, error);
    if (!parsed) return print_error("--shard: " + error), kExitUsage;
    shard = *parsed;
  }
  const std::optional<Opened> opened =
      campaign::open_campaign(options.file, options.out, campaign::Check::kScene);
  if (!opened) return kExitUsage;
  std::optional<Results> results =
      read_or_explain(*opened, shard.count > 1 ? std::optional(shard) : std::nullopt);
  if (!results) return kExitUsage;
  if (options.retries_lost)
    std::erase_if(results->rows, [](const auto& row) { return campaign::is_lost(row.second.row); });
  const auto num_threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int exit_code = run_missing(*opened, shard, options.jobs > 0 ? options.jobs : num_threads, *results);
  if (exit_code != kExitOk) return exit_code;
  if (shard.count == 1) {
    // another process may have run the same cases
    results = read_or_explain(*opened);
    return results ? write_outputs(*opened, *results, false) : kExitDiffers;
  }
  std::printf("shard %lld of %lld is done; when all are, run: freeflex campaign merge %s\n",
              static_cast<long long>(shard.index), static_cast<long long>(shard.count),
              campaign::words_of_campaign(*opened).c_str());
  return kExitOk;
}

int merge(const CampaignOptions& options) {
  const std::optional<Opened> opened = campaign::open_campaign(options.file, options.out);
  if (!opened) return kExitUsage;
  const std::optional<Results> results = read_or_explain(*opened);
  if (!results) return kExitUsage;
  const std::int64_t missing =
      opened->campaign.sampling.cases - static_cast<std::int64_t>(results->rows.size());
  if (missing > 0 && !options.is_partial)
    return print_error(counted(missing, "case") + " of " + std::to_string(opened->campaign.sampling.cases) +
                       " have no result; run them, or write --partial for a table without them"),
           kExitIncomplete;
  return write_outputs(*opened, *results, options.writes_hdf5);
}

/// Prints what the tasks of submitted job arrays do.
void print_slurm(const Opened& opened) {
  const std::vector<std::string> jobs = campaign::slurm_jobs(opened);
  if (jobs.empty()) return;
  std::map<std::string, std::int64_t> states;
  if (const std::string error = campaign::slurm_states(jobs, states); !error.empty())
    return print_warning(error);
  std::string text;
  for (const auto& [state, count] : states)
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + state;
  std::printf("Slurm: %s, %s\n", counted(static_cast<std::int64_t>(jobs.size()), "job").c_str(),
              text.empty() ? "all tasks have ended" : ("tasks: " + text).c_str());
}

int status(const CampaignOptions& options) {
  const std::optional<Opened> opened = campaign::open_campaign(options.file, options.out);
  if (!opened) return kExitUsage;
  const std::optional<Results> results = read_or_explain(*opened);
  if (!results) return kExitUsage;
  const campaign::Summary summary = campaign::summarize(*results);
  const std::int64_t missing = opened->campaign.sampling.cases - summary.total();
  std::printf("%s in %s, %s\n", counted(results->num_files, "file").c_str(), opened->folder.c_str(),
              missing == 0 ? "complete" : (counted(missing, "case") + " missing").c_str());
  if (results->num_torn > 0)
    std::printf("%s left incomplete by killed processes; their cases run again\n",
                counted(results->num_torn, "line").c_str());
  if (summary.total() > 0) std::fputs(campaign::summary_text(summary).c_str(), stdout);
  print_retried(*results);
  print_slurm(*opened);
  if (summary.total() == 0) return kExitOk;
  const double each = (summary.setup_seconds + summary.run_seconds) / static_cast<double>(summary.total());
  std::printf("%.3g s a case on one processor, of which %.3g s are set-up", each,
              summary.setup_seconds / static_cast<double>(summary.total()));
  if (missing > 0)
    std::printf("; %.3g processor hours are left", each * static_cast<double>(missing) / 3600.0);
  std::printf("\n");
  return kExitOk;
}

int work(const CampaignOptions& options) {
  const std::string error = campaign::work(options.file);
  if (error.empty()) return kExitOk;
  print_error(error);
  return kExitDiffers;
}

}  // namespace

int write_for_slurm(const CampaignOptions& options) {
  const std::optional<Opened> opened = campaign::open_campaign(options.file, options.out);
  if (!opened) return kExitUsage;
  std::string script, job;
  std::string error = campaign::write_slurm_script(
      *opened, {options.num_tasks, std::max(options.jobs, 1), options.directives}, script);
  if (!error.empty()) return print_error(error), kExitDiffers;
  if (!options.submits)
    return std::printf("%s: submit it with sbatch, or write --submit\n", script.c_str()), kExitOk;
  error = campaign::submit_to_slurm(*opened, script, job);
  if (!error.empty()) return print_error(error), kExitDiffers;
  std::printf("job %s, %s; freeflex campaign status %s shows how far it is\n", job.c_str(),
              counted(options.num_tasks, "task").c_str(), options.file.c_str());
  return kExitOk;
}

namespace {

using Action = int (*)(const CampaignOptions&);

/// Adds a subcommand of campaign.
CLI::App* add_action(CLI::App& parent, const std::shared_ptr<CampaignOptions>& options, int& exit_code,
                     const std::string& name, const std::string& meaning, Action action) {
  CLI::App* const command = parent.add_subcommand(name, meaning);
  command->add_option("FILE", options->file, "campaign file")->required();
  if (name != "worker")
    command
        ->add_option("--out", options->out, "folder of the results; default: FILE with the ending .results")
        ->check(file_name())
        ->type_name("FOLDER");
  command->callback([options, action, &exit_code] { exit_code = action(*options); });
  return command;
}

}  // namespace

void add_campaign(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CampaignOptions>();
  CLI::App* const parent =
      app.add_subcommand("campaign", "runs many cases of a scene, each with its own values");
  parent->require_subcommand(1);
  parent->footer(kCampaignFooter);
  const auto add = [&](const char* name, const char* meaning, Action action) {
    return add_action(*parent, options, exit_code, name, meaning, action);
  };
  CLI::App* const run_command = add("run", "runs the cases that have no result yet", run);
  run_command->add_option("--jobs", options->jobs, "number of processes; default: one for each processor")
      ->check(whole_number(1, 4096))
      ->type_name("N");
  run_command->add_option(
      "--shard", options->shard,
      "K/N: only the cases whose number leaves the remainder K when divided by N; auto, auto/N: "
      "K and N of this task, from SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX or OMPI_COMM_WORLD_RANK");
  run_command->add_flag("--retry-lost", options->retries_lost,
                        "also runs the cases again that crashed or hung");
  add("status", "says how many cases are done, and what is left", status);
  CLI::App* const merging = add("merge", "writes the table and the page", merge);
  merging->add_flag("--partial", options->is_partial, "writes them although cases are missing");
  merging->add_flag("--hdf5", options->writes_hdf5, "also writes cases.h5, with a dataset for each column");
  const auto add_number = [&](CLI::App* command) {
    command->add_option("CASE", options->number, "number of the case, from 0")
        ->required()
        ->check(whole_number(0, kMost<std::int64_t>));
  };
  add_number(add("rerun", "writes a case as a scene and a recording", rerun_case));
  add_number(add("shrink", "finds the values that make a case fail", shrink_case));
  CLI::App* const slurm =
      add("slurm", "writes, and with --submit submits, a job array of Slurm", write_for_slurm);
  slurm->add_option("--tasks", options->num_tasks, "number of tasks of the array")
      ->required()
      ->check(whole_number(1, 1'000'000))
      ->type_name("N");
  slurm->add_option("--jobs", options->jobs, "processes of a task; default: 1")
      ->check(whole_number(1, 4096))
      ->type_name("N");
  slurm
      ->add_option("--sbatch", options->directives,
                   "further option of sbatch, as in --sbatch=--time=1:00:00; may be repeated")
      ->allow_extra_args(false)
      ->type_name("OPTION");
  slurm->add_flag("--submit", options->submits, "submits the array with sbatch");
  add("worker", "runs the cases that another process asks for", work)->group("");  // not in the help
}

}  // namespace freeflex::tools
