#include "tools/campaign/worker.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "service/c/freeflex.h"
#include "service/campaign/case.hpp"
#include "service/campaign/trace.hpp"
#include "service/io/scene/text.hpp"
#include "tools/campaign/pool.hpp"
#include "tools/campaign/program_run.hpp"
#include "tools/campaign/recorded_commands.hpp"
#include "tools/terminal/console.hpp"

namespace freeflex::campaign {
namespace {

/// Runs the cases of a campaign in this process. After an error, error() is not empty.
class Runner {
 public:
  virtual ~Runner() = default;
  /// Returns the row of a case.
  /// \param values  texts of the variables; empty: those that are drawn
  virtual std::string run(std::int64_t number, const std::vector<std::string>& values,
                          std::array<double, 2>& seconds) = 0;
  virtual std::string trace(std::int64_t number, const std::string& scene, const std::string& log) = 0;
  const std::string& error() const { return error_; }

 protected:
  std::string error_;
};

/// Runs cases without a controller.
class PlainRunner : public Runner {
 public:
  explicit PlainRunner(const Campaign& campaign) : campaign_(campaign), runner_(campaign) {
    if (campaign.commands.empty()) {
      commander_ = std::make_unique<Commander>();
      return;
    }
    auto recorded = std::make_unique<RecordedCommander>(campaign.commands);
    error_ = recorded->error();
    commander_ = std::move(recorded);
  }

  std::string run(std::int64_t number, const std::vector<std::string>& values,
                  std::array<double, 2>& seconds) override {
    const CaseResult result = runner_.run(
        values.empty() ? runner_.case_of(number) : make_case(campaign_, number, values), *commander_);
    seconds = {result.setup_seconds, result.run_seconds};
    return table_row(campaign_, result);
  }
  std::string trace(std::int64_t number, const std::string& scene, const std::string& log) override {
    Case of = runner_.case_of(number);
    of.scene = scene;
    of.settings.clear();
    CommandTrace commands(log);
    const CaseResult result = runner_.run(of, *commander_, &commands);
    error_ = commands.close();
    return table_row(campaign_, result);
  }

 private:
  const Campaign& campaign_;
  CaseRunner runner_;
  std::unique_ptr<Commander> commander_;
};

/// Runs cases that a program steers: first on a daemon, then with the commands that the daemon applied.
class ProgramRunner : public Runner {
 public:
  explicit ProgramRunner(const Campaign& campaign) : campaign_(campaign), runner_(campaign) {
    std::string folder = (std::filesystem::temp_directory_path() / "freeflex-case-XXXXXX").string();
    if (::mkdtemp(folder.data()) == nullptr)
      error_ = "no folder can be made in " + std::filesystem::temp_directory_path().string();
    folder_ = folder;
    if (error_.empty()) error_ = find_program_fault(campaign);
  }
  ~ProgramRunner() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::string run(std::int64_t number, const std::vector<std::string>& values,
                  std::array<double, 2>& seconds) override {
    const Case of = values.empty() ? runner_.case_of(number) : make_case(campaign_, number, values);
    return table_row(campaign_, run_case(of, of, nullptr, seconds));
  }
  std::string trace(std::int64_t number, const std::string& scene, const std::string& log) override {
    const Case of = runner_.case_of(number);
    Case on_scene = of;
    on_scene.scene = scene;
    on_scene.settings.clear();
    CommandTrace commands(log);
    std::array<double, 2> seconds{};
    const CaseResult result = run_case(of, on_scene, &commands, seconds);
    if (error_.empty()) error_ = commands.close();
    return table_row(campaign_, result);
  }

 private:
  /// \param stepped  the case that is run with the recorded commands
  CaseResult run_case(const Case& of, const Case& stepped, CaseObserver* observer,
                      std::array<double, 2>& seconds) {
    CaseResult result;
    result.number = of.number;
    result.values = of.values;
    result.outcome = Outcome::kRefused;
    if (runner_.plan_of(stepped, result.message) == nullptr) return result;
    std::string log;
    const auto start = std::chrono::steady_clock::now();
    result.message = run_program(campaign_, of, folder_, log, error_);
    const double on_daemon = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    result.outcome = Outcome::kController;
    if (result.message.empty() && error_.empty()) {
      RecordedCommander recorded(log);
      error_ = recorded.error();
      if (error_.empty()) result = runner_.run(stepped, recorded, observer);
      // without the last commands the motion would be another
      if (error_.empty() && recorded.known_until() < result.ticks)
        error_ = "the daemon was recorded up to tick " + std::to_string(recorded.known_until()) + " of " +
                 std::to_string(result.ticks) + " only";
    }
    seconds = {result.setup_seconds, result.run_seconds + on_daemon};
    return result;
  }

  const Campaign& campaign_;
  CaseRunner runner_;
  std::string folder_;
};

/// Runs cases with the controller in a library. The functions of the C interface are those of the libfreeflex
/// with which the controller is linked, so both agree on what a motion is.
class LibraryRunner : public Runner {
 public:
  explicit LibraryRunner(const Campaign& campaign) { error_ = open(campaign); }

  std::string run(std::int64_t number, const std::vector<std::string>& values,
                  std::array<double, 2>& seconds) override {
    std::vector<const char*> texts;
    texts.reserve(values.size());
    for (const std::string& value : values) texts.push_back(value.c_str());
    const char* row = "";
    if (run_(campaign_, number, texts.empty() ? nullptr : texts.data(), &controller_, &row, seconds.data()) !=
        FREEFLEX_OK)
      error_ = last_error_();
    return row;
  }
  std::string trace(std::int64_t number, const std::string& scene, const std::string& log) override {
    const char* row = "";
    if (trace_(campaign_, number, scene.c_str(), &controller_, log.c_str(), &row) != FREEFLEX_OK)
      error_ = last_error_();
    return row;
  }

 private:
  // opens the library and the campaign. Returns an empty text or the error.
  std::string open(const Campaign& campaign) {
    const std::string& path = campaign.controller.files[0];
    // a name without a slash would be searched for in the folders of the system
    library_ =
        ::dlopen((path.find('/') == std::string::npos ? "./" + path : path).c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library_ == nullptr) return std::string("controller: ") + ::dlerror();
    find("freeflex_controller_begin", controller_.begin);
    find("freeflex_controller_act", controller_.act);
    find("freeflex_controller_end", controller_.end);
    if (controller_.act == nullptr)
      return "controller: '" + path +
             "' has no function freeflex_controller_act; export it (freeflex.h describes it)";
    decltype(&freeflex_campaign_open) open_campaign = nullptr;
    find("freeflex_campaign_open", open_campaign);
    find("freeflex_campaign_run", run_);
    find("freeflex_campaign_trace", trace_);
    find("freeflex_last_error", last_error_);
    if (open_campaign == nullptr || run_ == nullptr || trace_ == nullptr || last_error_ == nullptr)
      return "controller: '" + path + "' is not linked with libfreeflex; link it with -lfreeflex";
    return open_campaign(campaign.path.c_str(), &campaign_) == FREEFLEX_OK ? std::string() : last_error_();
  }

  template <class Function>
  void find(const char* name, Function& function) {
    function = reinterpret_cast<Function>(::dlsym(library_, name));
  }

  void* library_ = nullptr;  // stays open, because the controller may have threads
  freeflex_controller controller_{};
  freeflex_campaign* campaign_ = nullptr;
  decltype(&freeflex_campaign_run) run_ = nullptr;
  decltype(&freeflex_campaign_trace) trace_ = nullptr;
  decltype(&freeflex_last_error) last_error_ = nullptr;
};

std::unique_ptr<Runner> make_runner(const Campaign& campaign) {
  if (campaign.controller.kind == ControllerFile::Kind::kLibrary)
    return std::make_unique<LibraryRunner>(campaign);
  if (campaign.controller.kind == ControllerFile::Kind::kProgram)
    return std::make_unique<ProgramRunner>(campaign);
  return std::make_unique<PlainRunner>(campaign);
}

/// Writes a line for the pool. Returns false if the pool has ended.
bool answer(const std::string& line) {
  for (std::string_view rest = line; !rest.empty();) {
    const ssize_t written = ::write(kResultDescriptor, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Reads a line without its end. Returns false at the end of the input.
bool read_line(std::FILE* from, std::string& line) {
  line.clear();
  int c = 0;
  while ((c = std::getc(from)) != EOF && c != '\n') line += static_cast<char>(c);
  return c != EOF;
}

/// Returns the texts after the tabs of a job.
std::vector<std::string> words_of(const std::string& job) {
  std::vector<std::string> words;
  for (std::size_t tab = job.find('\t'); tab != std::string::npos;) {
    const std::size_t next = job.find('\t', tab + 1);
    words.push_back(job.substr(tab + 1, next == std::string::npos ? next : next - tab - 1));
    tab = next;
  }
  return words;
}

std::string serve(const std::string& path) {
  const CampaignResult read = read_campaign(path);
  if (!read.campaign) return "the campaign '" + path + "' cannot be read";
  const std::unique_ptr<Runner> runner = make_runner(*read.campaign);
  if (!runner->error().empty()) return runner->error();
  // a controller that reads the standard input must not take the jobs
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> jobs(
      ::fdopen(::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 10), "r"), std::fclose);
  ::dup2(::open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
  bool is_served = answer(std::string(kReady) + "\n");
  for (std::string job; is_served && read_line(jobs.get(), job);) {
    std::array<double, 2> seconds{};
    const std::vector<std::string> words = words_of(job);
    const bool is_trace = words.size() == 3 && words[0] == kTraceMark;
    const std::string row = is_trace ? runner->trace(number_of(job), words[1], words[2])
                                     : runner->run(number_of(job), words, seconds);
    if (!runner->error().empty()) return runner->error();
    std::fflush(stdout);  // what the controller printed, before the process may be killed
    is_served = answer(row + "\t" + io::reader::format_number(seconds[0]) + "\t" +
                       io::reader::format_number(seconds[1]) + "\n");
  }
  return {};
}

}  // namespace

std::string work(const std::string& path) {
  // The pool ends its workers. If a cluster ends all processes of a job, rows of dying workers would say
  // nothing of their cases.
  static_cast<void>(tools::is_interrupted());  // its first call installs a handler
  ::signal(SIGTERM, SIG_IGN);
  ::signal(SIGHUP, SIG_IGN);
  ::fcntl(kResultDescriptor, F_SETFD, FD_CLOEXEC);  // programs that a controller starts must not hold it open
  std::string error;
  try {
    error = serve(path);
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  if (!error.empty()) {
    std::string line = kFaultMark + error;
    std::replace(line.begin(), line.end(), '\n', ' ');
    answer(line + "\n");
  }
  return error;
}

}  // namespace freeflex::campaign
