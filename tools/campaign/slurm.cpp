#include "tools/campaign/slurm.hpp"

#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "service/io/scene/text.hpp"

namespace freeflex::campaign {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScript = "slurm.sh";
constexpr const char* kJobs = "slurm.jobs";  // numbers of submitted jobs, one a line

/// Returns text as a value in quotes of a line of #SBATCH. \param is_pattern  true: % must be doubled
std::string sbatch_value(const std::string& text, bool is_pattern) {
  std::string value = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') value += '\\';
    value += c == '%' && is_pattern ? std::string("%%") : std::string(1, c);
  }
  return value + "\"";
}

/// Runs a command of the shell and reads what it prints. Returns its exit code, or -1.
int read_command(const std::string& command, std::string& output) {
  std::FILE* const pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return -1;
  std::array<char, 4096> bytes;
  for (std::size_t count; (count = std::fread(bytes.data(), 1, bytes.size(), pipe)) > 0;)
    output.append(bytes.data(), count);
  const int status = ::pclose(pipe);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

std::string write_slurm_script(const Opened& opened, const SlurmOptions& options, std::string& script) {
  std::error_code error;
  fs::create_directories(opened.folder, error);
  const std::string folder = fs::absolute(opened.folder, error).lexically_normal().string();
  script = (fs::path(opened.folder) / kScript).string();
  std::ofstream file(script);
  file << "#!/bin/bash\n#SBATCH --job-name=" << sbatch_value(opened.campaign.name, false)
       << "\n#SBATCH --array=0-" << options.num_tasks - 1 << "\n#SBATCH --cpus-per-task=" << options.num_jobs
       << "\n#SBATCH --output=" << sbatch_value(folder, true)
       << "/slurm-%A_%a.out\n#SBATCH --open-mode=append\n#SBATCH --requeue\n";
  for (const std::string& directive : options.directives) file << "#SBATCH " << directive << "\n";
  file << "exec " << shell_word(fs::read_symlink("/proc/self/exe", error).string()) << " campaign run "
       << shell_word(fs::absolute(opened.campaign.path, error).lexically_normal().string()) << " --out "
       << shell_word(folder) << " --shard auto/" << options.num_tasks << " --jobs " << options.num_jobs
       << "\n";
  file.close();
  return file ? "" : "cannot write '" + script + "': " + std::strerror(errno);
}

std::string submit_to_slurm(const Opened& opened, const std::string& script, std::string& job) {
  std::string output;
  const int code = read_command("sbatch --parsable " + shell_word(script), output);
  if (code == 127)
    return "sbatch was not found; run this on a machine of a Slurm cluster, or submit " + script + " there";
  if (code != 0) return "sbatch refused the job (exit code " + std::to_string(code) + ")";
  job = output.substr(0, output.find_first_of(";\n"));  // NUMBER or NUMBER;CLUSTER
  std::ofstream jobs(fs::path(opened.folder) / kJobs, std::ios::app);
  jobs << job << "\n";
  jobs.close();
  return jobs ? ""
              : "job " + job +
                    " was submitted, but its number could not be noted in the folder of the results";
}

std::vector<std::string> slurm_jobs(const Opened& opened) {
  std::vector<std::string> jobs;
  std::ifstream file(fs::path(opened.folder) / kJobs);
  for (std::string job; std::getline(file, job);)
    if (io::reader::parse_integer(job, 1, INT64_MAX)) jobs.push_back(job);
  return jobs;
}

std::string slurm_states(const std::vector<std::string>& jobs, std::map<std::string, std::int64_t>& states) {
  std::string list, output;
  for (const std::string& job : jobs) list += (list.empty() ? "" : ",") + job;
  // squeue fails if it no longer knows any of the jobs, which have then ended
  const int code =
      read_command("squeue --noheader --array --format=%T --jobs=" + list + " 2>/dev/null", output);
  if (code == 127) return "squeue was not found on this machine";
  std::istringstream lines(output);
  for (std::string state; std::getline(lines, state);)
    if (!state.empty()) ++states[state];
  return {};
}

}  // namespace freeflex::campaign
