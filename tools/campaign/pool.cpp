#include "tools/campaign/pool.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

namespace freeflex::campaign {
namespace {

using Clock = std::chrono::steady_clock;

// cases that a worker has at a time: the one in hand and, if cases are short, others so that it need not wait
// for this process
constexpr std::size_t kAhead = 4;
constexpr double kShortCase = 0.05;    // [s]
constexpr double kReadyWithin = 60.0;  // [s] at least, of a new worker
// of memory that a worker keeps for its next case (mallopt of glibc)
constexpr std::array<std::array<const char*, 2>, 3> kMemory{{{"MALLOC_TRIM_THRESHOLD_", "1000000000"},
                                                             {"MALLOC_MMAP_THRESHOLD_", "32000000"},
                                                             {"MALLOC_TOP_PAD_", "16000000"}}};
constexpr auto kEndsWithin = std::chrono::seconds(1);  // of a worker that has closed its output

void close_one(int& descriptor) {
  if (descriptor >= 0) ::close(descriptor);
  descriptor = -1;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::string last_line(const std::string& path) {
  std::ifstream file(path);
  std::string line, last;
  while (std::getline(file, line))
    if (!line.empty()) last = line;
  return last;
}

/// One worker process with the cases that it has.
class Worker {
 public:
  /// \param temporary  folder for its temporary files
  Worker(const PoolOptions& options, const std::string& temporary)
      : options_(options), temporary_(temporary) {}
  ~Worker() {
    if (is_running() && cases_.empty() && is_ready_)
      wait();  // it removes its files
    else
      kill();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  bool is_running() const { return pid_ > 0; }
  int descriptor() const { return from_; }
  const std::deque<std::string>& cases() const { return cases_; }
  bool is_ready() const { return is_ready_; }
  /// Returns why the worker ended, if it said so.
  const std::string& fault() const { return fault_; }
  std::size_t most_cases() const { return is_quick_ ? kAhead : 1; }
  double seconds_in_hand() const { return cases_.empty() ? 0.0 : seconds_since(since_); }

  std::string start() {
    std::array<int, 2> in{-1, -1}, out{-1, -1};
    if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0)
      return std::string("cannot make a pipe: ") + std::strerror(errno);
    const int log = ::open(options_.log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (log < 0) return "cannot write '" + options_.log + "': " + std::strerror(errno);
    pid_ = ::fork();
    if (pid_ == 0) become_worker(in[0], out[1], log);
    close_one(in[0]);
    close_one(out[1]);
    ::close(log);
    to_ = in[1];
    from_ = out[0];
    if (pid_ < 0) return std::string("cannot start a process: ") + std::strerror(errno);
    ::fcntl(from_, F_SETFL, O_NONBLOCK);
    since_ = Clock::now();
    is_ready_ = false;
    fault_.clear();
    return {};
  }

  void give(const std::string& job) {
    if (cases_.empty() && is_ready_) since_ = Clock::now();
    cases_.push_back(job);
    const std::string line = job + "\n";
    // a write to a worker that has ended fails; the end of its output is noticed later
    while (::write(to_, line.data(), line.size()) < 0 && errno == EINTR) {
    }
  }

  /// Reads what the worker has written, and passes whole rows on. Returns false at the end of its output.
  bool read(const std::function<bool(StoredRow)>& take, bool& is_stopped) {
    std::array<char, 65536> bytes;
    while (true) {
      const ssize_t count = ::read(from_, bytes.data(), bytes.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return errno == EAGAIN;
      if (count == 0) return false;
      buffer_.append(bytes.data(), static_cast<std::size_t>(count));
      for (std::size_t end; !is_stopped && (end = buffer_.find('\n')) != std::string::npos;) {
        const std::string line = buffer_.substr(0, end);
        buffer_.erase(0, end + 1);
        if (line[0] == kFaultMark) {
          fault_ = line.substr(1);
          return false;
        }
        if (!is_ready_) {
          if (line != kReady) return false;
          is_ready_ = true;
          since_ = Clock::now();
        } else if (finish_case(line)) {
          is_stopped = !take(parse(line));
        } else {
          return false;
        }
      }
      if (is_stopped) return true;
    }
  }

  void kill() {
    if (pid_ <= 0) return;
    ::kill(-pid_, SIGKILL);
    ::kill(pid_, SIGKILL);
    wait();
  }
  /// Waits for the end of a worker that has closed its output, and ends it if it does not end by itself.
  /// Returns how it ended.
  std::string wait() {
    close_one(to_);
    int status = 0;
    const auto start = Clock::now();
    while (::waitpid(pid_, &status, WNOHANG) == 0) {
      if (Clock::now() - start > kEndsWithin) ::kill(pid_, SIGKILL);
      ::usleep(1000);
    }
    ::kill(-pid_, SIGKILL);  // programs that it has left behind
    pid_ = -1;
    close_one(from_);
    buffer_.clear();
    if (WIFSIGNALED(status)) return std::string("by signal ") + ::strsignal(WTERMSIG(status));
    return "with exit code " + std::to_string(WEXITSTATUS(status));
  }
  /// Takes the cases back. The first is the one in hand.
  std::deque<std::string> take_cases() { return std::exchange(cases_, {}); }

 private:
  [[noreturn]] void become_worker(int in, int out, int log) const {
    ::setpgid(0, 0);  // Ctrl-C of the terminal does not reach it
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    // descriptors 0 to 3 may be those of the pipes, so these are moved out of the way first
    const int from = ::fcntl(in, F_DUPFD, 10), to = ::fcntl(out, F_DUPFD, 10),
              print = ::fcntl(log, F_DUPFD, 10);
    ::dup2(from, STDIN_FILENO);
    ::dup2(print, STDOUT_FILENO);
    ::dup2(print, STDERR_FILENO);
    ::dup2(to, kResultDescriptor);
    for (const int descriptor : {from, to, print}) ::close(descriptor);
    std::vector<char*> arguments;
    for (const std::string& word : options_.command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::signal(SIGPIPE, SIG_DFL);
    ::setenv("TMPDIR", temporary_.c_str(), 1);
    // A case takes some MB and gives them back. To ask the system for them anew takes ten times as long as
    // the set-up of two points.
    for (const auto& [name, bytes] : kMemory) ::setenv(name, bytes, 0);
    ::execvp(arguments[0], arguments.data());
    const std::string error = std::string(arguments[0]) + ": " + std::strerror(errno) + "\n";
    static_cast<void>(!::write(STDERR_FILENO, error.data(), error.size()));
    ::_exit(127);
  }

  // takes the first case off the list. Returns false if the line is not of this case.
  bool finish_case(const std::string& line) {
    if (cases_.empty() || number_of(line) != number_of(cases_.front())) return false;
    cases_.pop_front();
    is_quick_ = seconds_since(since_) < kShortCase;
    since_ = Clock::now();
    return true;
  }

  static StoredRow parse(const std::string& line) {
    StoredRow stored;
    const std::size_t last = line.rfind('\t'), first = line.rfind('\t', last - 1);
    stored.row = line.substr(0, first);
    if (first == std::string::npos || last == std::string::npos) return stored;
    std::from_chars(line.data() + first + 1, line.data() + last, stored.setup_seconds);
    std::from_chars(line.data() + last + 1, line.data() + line.size(), stored.run_seconds);
    return stored;
  }

  const PoolOptions& options_;
  const std::string& temporary_;
  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
  std::string buffer_;
  std::string fault_;
  std::deque<std::string> cases_;
  Clock::time_point since_{};  // when the case in hand began
  bool is_ready_ = false;
  bool is_quick_ = false;  // true: the last case was short
};

class Pool {
 public:
  Pool(const PoolOptions& options, const std::string& temporary, const PoolCalls& calls)
      : options_(options), temporary_(temporary), calls_(calls) {}

  std::string run() {
    for (int k = 0; k < options_.num_workers; ++k)
      workers_.push_back(std::make_unique<Worker>(options_, temporary_));
    while (!is_stopped_) {
      if (calls_.is_ended()) return {};
      // in rounds, so that the last cases are not all with one worker
      for (std::size_t depth = 1; depth <= kAhead; ++depth)
        for (const auto& worker : workers_)
          if (std::string error = feed(*worker, depth); !error.empty()) return error;
      if (!wait_for_rows()) return {};
      for (const auto& worker : workers_)
        if (std::string error = watch(*worker); !error.empty()) return error;
    }
    return {};
  }

 private:
  std::optional<std::string> next() {
    if (returned_.empty()) return calls_.next();
    std::string job = std::move(returned_.front());
    returned_.pop_front();
    return job;
  }

  // gives a worker a job if it has fewer than `depth`
  std::string feed(Worker& worker, std::size_t depth) {
    if (worker.cases().size() >= std::min(depth, worker.most_cases())) return {};
    const std::optional<std::string> job = next();
    if (!job) return {};
    if (!worker.is_running())
      if (std::string error = worker.start(); !error.empty()) return error;
    worker.give(*job);
    return {};
  }

  // waits for output of a worker. Returns false if none has a case.
  bool wait_for_rows() {
    std::vector<pollfd> polled;
    for (const auto& worker : workers_)
      if (!worker->cases().empty()) polled.push_back({worker->descriptor(), POLLIN, 0});
    if (polled.empty()) return false;
    constexpr int kWait = 100;  // [ms] after which interrupts and time limits are looked at
    ::poll(polled.data(), polled.size(), kWait);
    return true;
  }

  // reads the output of a worker, and replaces the worker if it has ended or takes too long
  std::string watch(Worker& worker) {
    if (!worker.is_running() || worker.cases().empty()) return {};
    const bool is_open = worker.read(calls_.take, is_stopped_);
    if (is_stopped_) return {};
    if (worker.cases().empty()) {
      if (!is_open) worker.wait();  // it ended between two cases, so another takes its place
      return {};
    }
    const double limit =
        worker.is_ready() ? options_.time_limit : std::max(options_.time_limit, kReadyWithin);
    const bool is_hung = is_open && worker.seconds_in_hand() > limit;
    if (is_open && !is_hung) return {};
    std::string why = worker.fault();
    if (is_hung)
      worker.kill();
    else if (const std::string end = worker.wait(); why.empty())
      why = "its process ended " + end;
    if (!worker.is_ready())
      return "a worker did not get ready" + (why.empty() ? " in time" : ", because " + why) +
             "; what it printed is in '" + options_.log + "'" +
             (worker.fault().empty() ? ": " + last_line(options_.log) : "");
    if (calls_.is_ended()) return {};  // whoever ends this process may end its workers too
    std::deque<std::string> cases = worker.take_cases();
    is_stopped_ = !calls_.take(calls_.lost(number_of(cases.front()), is_hung, why));
    cases.pop_front();
    returned_.insert(returned_.begin(), cases.begin(), cases.end());
    return {};
  }

  const PoolOptions& options_;
  const std::string& temporary_;
  const PoolCalls& calls_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::deque<std::string> returned_;  // cases that an ended worker had not begun
  bool is_stopped_ = false;
};

}  // namespace

std::string run_pool(const PoolOptions& options, const PoolCalls& calls) {
  ::signal(SIGPIPE, SIG_IGN);
  // workers that are killed leave their files here
  namespace fs = std::filesystem;
  std::error_code ignored;
  std::string folder = (fs::temp_directory_path(ignored) / "freeflex-campaign-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr)
    return "no folder can be made in " + fs::temp_directory_path(ignored).string();
  std::string error = Pool(options, folder, calls).run();
  fs::remove_all(folder, ignored);
  return error;
}

}  // namespace freeflex::campaign
