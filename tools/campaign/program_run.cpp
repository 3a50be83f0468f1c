#include "tools/campaign/program_run.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <sstream>
#include <utility>
#include <vector>

#include "messages/channels.hpp"
#include "service/io/scene/text.hpp"
#include "service/io/wire/log.hpp"
#include "tools/bus/bus.hpp"
#include "tools/campaign/pool.hpp"
#include "tools/campaign/table.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::campaign {
namespace {

using Environment = std::vector<std::pair<std::string, std::string>>;

/// A child process, which is killed at the end of this object's life.
class Child {
 public:
  /// \param folder  in which the program runs; empty: that of this process
  Child(const std::vector<std::string>& words, const Environment& environment, const std::string& folder) {
    pid_ = ::fork();
    has_started_ = pid_ > 0;
    if (pid_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (const int signal : {SIGTERM, SIGHUP}) ::signal(signal, SIG_DFL);  // which the worker ignores
    // the jobs and the rows of the worker are not for this process
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::close(kResultDescriptor);
    if (!folder.empty() && ::chdir(folder.c_str()) != 0) ::_exit(126);
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execvp(arguments[0], arguments.data());
    const std::string error = std::string(arguments[0]) + ": " + std::strerror(errno) + "\n";
    static_cast<void>(!::write(STDERR_FILENO, error.data(), error.size()));
    ::_exit(127);
  }
  ~Child() {
    if (!is_running()) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, &status_, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  bool is_running() {
    if (pid_ > 0 && ::waitpid(pid_, &status_, WNOHANG) != 0) pid_ = -1;
    return pid_ > 0;
  }
  /// Returns how the process ended.
  std::string end() const {
    if (!has_started_) return "could not be started, because no process can be made";
    if (WIFSIGNALED(status_)) return std::string("was ended by signal ") + ::strsignal(WTERMSIG(status_));
    return "ended with exit code " + std::to_string(WEXITSTATUS(status_));
  }
  bool is_good() const { return has_started_ && WIFEXITED(status_) && WEXITSTATUS(status_) == 0; }

 private:
  pid_t pid_ = -1;
  bool has_started_ = false;
  int status_ = 0;
};

/// Returns the address of a bus that nobody else uses: one of 2.6e9, at random.
std::string private_bus() {
  std::random_device random;
  return "udpm://239.255." + std::to_string(random() % 256) + "." + std::to_string(random() % 256) + ":" +
         std::to_string(20000 + random() % 40000) + "?ttl=0";
}

Environment environment_of(const Case& of, std::uint64_t seed, const std::string& bus) {
  Environment environment{{"LCM_DEFAULT_URL", bus},
                          {"FREEFLEX_CASE", std::to_string(of.number)},
                          {"FREEFLEX_SEED", std::to_string(seed)}};
  for (const auto& [name, value] : of.parameters)
    environment.emplace_back("FREEFLEX_PARAMETER_" + name, io::reader::format_number(value));
  return environment;
}

/// Returns the path of the daemon, which is beside this program.
std::string find_daemon() {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "freeflexd").string();
}

/// Returns true if the system would find a program of this name.
bool is_program(const std::string& name) {
  if (name.find('/') != std::string::npos) return ::access(name.c_str(), X_OK) == 0;
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/bin:/usr/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (::access((std::filesystem::path(folder) / name).c_str(), X_OK) == 0) return true;
  return false;
}

}  // namespace

std::string find_program_fault(const Campaign& campaign) {
  const std::string& program = campaign.controller.files[0];
  if (!is_program(program)) return "controller: there is no program '" + program + "' that can be run";
  if (!std::filesystem::exists(find_daemon()))
    return "there is no '" + find_daemon() + "', which a controller that is a program needs";
  return tools::Bus({.lcm_url = private_bus(), .prefix = channels::kDefaultPrefix}).error();
}

std::string run_program(const Campaign& campaign, const Case& of, const std::string& folder, std::string& log,
                        std::string& fault) {
  std::string scene = (std::filesystem::path(folder) / "case.yaml").string();
  const std::string bus_url = private_bus();
  log = (std::filesystem::path(folder) / "case.log").string();
  if (fault = write_case_scene(of, scene); !fault.empty()) return {};
  tools::Bus bus({.lcm_url = bus_url, .prefix = channels::kDefaultPrefix});
  if (!bus.error().empty()) return fault = bus.error(), std::string();
  io::LogWriter writer(log);
  bool has_started = false;
  bus.subscribe("", [&](const tools::BusMessage& message) {
    has_started = true;
    writer.write(std::string(message.channel), tools::wall_clock_us(), message.bytes);
  });
  Child daemon(
      {find_daemon(), scene, "--lcm-url", bus_url, "--time", "lockstep", "--socket", "none", "--verdict",
       "off", "--log-level", "warning", "--until", io::reader::format_number(campaign.until)},
      {}, {});
  using std::chrono::milliseconds;
  while (!has_started && daemon.is_running()) bus.wait(milliseconds(50), [&] { return has_started; });
  if (!has_started)
    return fault = "freeflexd " + daemon.end() + " before it published anything", std::string();
  std::vector<std::string> words = campaign.controller.files;
  if (words[0].find('/') != std::string::npos) words[0] = std::filesystem::absolute(words[0]).string();
  Child program(words, environment_of(of, seed_of(campaign, of.number), bus_url), campaign.folder);
  constexpr int kMostWaits = 50;  // for the end of the daemon, if the program has ended: a second
  int num_waits = 0;
  while (daemon.is_running() && num_waits < kMostWaits && !tools::is_interrupted()) {
    bus.wait(milliseconds(20), [] { return false; });
    if (!program.is_running()) ++num_waits;
  }
  bus.wait(milliseconds(50), [] { return false; });  // what the daemon published last
  fault = writer.close();
  if (tools::is_interrupted()) fault = "interrupted";
  if (num_waits == kMostWaits && daemon.is_running())
    return "the program " + program.end() + " before the end of the case";
  if (!daemon.is_good() && fault.empty()) fault = "freeflexd " + daemon.end();
  return {};
}

}  // namespace freeflex::campaign
