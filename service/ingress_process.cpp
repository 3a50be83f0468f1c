#include <errno.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>
#include <thread>
#include <utility>

#include "service/descriptors.hpp"
#include "service/ingress.hpp"
#include "service/io/wire/lcm_url.hpp"
#include "service/limits.hpp"

namespace freeflex::service {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstPause{5};  // first pause between two attempts to start
constexpr milliseconds kLongestPause{100};
constexpr milliseconds kReadyPeriod{2};  // time between checks of processes that are starting

constexpr int kNotLoaded = 127;  // exit status if the program or one of its libraries cannot be loaded

constexpr const char* kCannotStart = "the ingress process cannot be started";

/// Returns true if the filter of system calls ended the process.
bool is_of_filter(int status) { return WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS; }

/// Returns the meaning of a status of waitpid for the log.
std::string describe_end(int status) {
  if (is_of_filter(status)) return "made a system call that its filter forbids";
  if (WIFSIGNALED(status)) {
    return std::string("ended by signal ") + std::to_string(WTERMSIG(status)) + " (" +
           strsignal(WTERMSIG(status)) + ")";
  }
  switch (static_cast<IngressEnd>(WEXITSTATUS(status))) {
    case IngressEnd::kDaemonGone:
      return "ended because it lost its parent, the daemon";
    case IngressEnd::kBadBlock:
      return "could not map the shared memory";
  }
  if (WEXITSTATUS(status) == kNotLoaded) return "could not be loaded";
  return "ended with status " + std::to_string(WEXITSTATUS(status));
}

/// Returns the likely causes of a forbidden system call.
std::string explain_filter() {
  const char* const preloaded = std::getenv("LD_PRELOAD");
  if (preloaded != nullptr && *preloaded != '\0')
    return std::string(". LD_PRELOAD is set to '") + preloaded +
           "', and a library that is loaded that way (libfaketime, for one) makes such calls; start "
           "freeflexd without it";
  return ". A library that is loaded into every program (/etc/ld.so.preload) makes such calls. "
         "If there is none, a packet may have taken control of the process, and the filter stopped it";
}

/// Returns a text for the log: why a process may have ended before it was ready, and the remedy.
std::string explain_failed_start(int status) {
  if (is_of_filter(status)) return explain_filter();
  rlimit limit{};
  const bool has_limit = getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  return has_limit ? explain_limits(ENOMEM) : "";
}

/// The two attribute objects of posix_spawn, freed on every return path.
struct SpawnPlan {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  SpawnPlan() {
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;

  /// Passes a descriptor to the new process under this number, or does nothing if the descriptor is -1.
  void give(int fd, int number) {
    if (fd >= 0) posix_spawn_file_actions_adddup2(&actions, fd, number);
  }
  /// Resets signal mask, handlers and priority of the new process, and closes all descriptors above last_fd.
  void set_ordinary(int last_fd) {
    posix_spawn_file_actions_addclosefrom_np(&actions, last_fd + 1);
    sigset_t none;
    sigset_t all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    const sched_param ordinary{};
    posix_spawnattr_setschedpolicy(&attributes, SCHED_OTHER);
    posix_spawnattr_setschedparam(&attributes, &ordinary);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSCHEDULER);
  }
};

std::int64_t to_ns(std::chrono::steady_clock::time_point time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

}  // namespace

std::string check_prefix(const std::string& prefix) {
  if (is_channel_prefix(prefix)) return {};
  return "channel prefix '" + prefix + "' must be " + kPrefixAllowed;
}

IngressProcess::~IngressProcess() { stop(); }

std::string IngressProcess::start(const Options& options, const io::NameTable& names) {
  std::string fault = check_lcm_url(options.lcm_url);
  if (fault.empty()) fault = check_prefix(options.channel_prefix);
  if (fault.empty()) fault = find_network_fault(options.lcm_url);
  if (fault.empty()) fault = find_ingress_user(options.user, user_);
  if (fault.empty()) fault = make_memory(options, names);
  if (fault.empty()) fault = socket_.open(options.lcm_url, options.channel_prefix, options.timeout);
  is_wanted_ = true;
  if (fault.empty()) fault = wait_until_ready(options.timeout);
  if (!fault.empty()) stop();
  return fault;
}

std::string IngressProcess::make_memory(const Options& options, const io::NameTable& names) {
  auto settings = std::make_unique<IngressSettings>();
  settings->session = options.session;
  settings->daemon_pid = getpid();
  settings->are_keys_required = options.are_keys_required;
  std::copy(options.channel_prefix.begin(), options.channel_prefix.end(), settings->channel_prefix.begin());
  settings->names = names;
  settings_memory_ = std::make_unique<SharedMemory>();
  std::string fault = settings_memory_->make_sealed(std::as_bytes(std::span(settings.get(), 1)));
  if (!fault.empty()) return fault;
  block_memory_ = std::make_unique<SharedMemory>();
  fault = block_memory_->make(sizeof(SharedBlock));
  if (fault.empty()) block_ = new (block_memory_->address()) SharedBlock;
  return fault;
}

bool IngressProcess::is_ready(std::size_t seat) const {
  return workers_[seat].pid >= 0 && block_->seats[seat].beat.load(std::memory_order_relaxed) != 0;
}

std::string IngressProcess::spawn(std::size_t seat) {
  Worker& worker = workers_[seat];
  worker.order_fd = move_up(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (worker.order_fd < 0) return call_fault(kCannotStart, "eventfd");
  // posix_spawn runs no code of this program in the new process, so locks that other threads hold do no harm,
  // and the new process inherits only these descriptors
  SpawnPlan plan;
  plan.give(block_memory_->fd(), kBlockFd);
  plan.give(settings_memory_->fd(), kSettingsFd);
  plan.give(socket_.fd(), kSocketFd);
  plan.give(worker.order_fd, kOrderFd);
  plan.set_ordinary(kOrderFd);
  std::string name = program_invocation_short_name;
  std::string option = kIngressOption;
  std::string number = std::to_string(seat);
  std::string block = block_memory_->argument(kBlockFd);
  std::string settings = settings_memory_->argument(kSettingsFd);
  std::string uid = std::to_string(user_.uid);
  std::string gid = std::to_string(user_.gid);
  char* arguments[] = {name.data(),     option.data(), number.data(), block.data(),
                       settings.data(), uid.data(),    gid.data(),    nullptr};
  block_->seats[seat].beat.store(0);
  errno = posix_spawn(&worker.pid, "/proc/self/exe", &plan.actions, &plan.attributes, arguments, environ);
  if (errno != 0) {
    worker.pid = -1;
    std::string fault = call_fault(kCannotStart, "posix_spawn");
    forget(worker);
    return fault;
  }
  worker.watch.start(to_ns(Clock::now()));
  if (seat == active_) promote(seat);
  return {};
}

/// Starts missing processes, the receiving one first. Returns an empty string, or the reason why a process
/// could not be started.
std::string IngressProcess::spawn_missing() {
  for (const std::size_t seat : {active_, 1 - active_}) {
    if (workers_[seat].pid >= 0 || Clock::now() < spawn_at_) continue;
    if (std::string fault = spawn(seat); !fault.empty()) {
      spawn_at_ = Clock::now() + kLongestPause;
      return fault;
    }
    spawn_at_ = Clock::now() + std::max(pause_, kFirstPause);
  }
  return {};
}

std::string IngressProcess::wait_until_ready(milliseconds timeout) {
  const Clock::time_point deadline = Clock::now() + timeout;
  std::string event;
  while (!is_ready(active_)) {
    if (num_failed_starts_ >= kMostFailedStarts)
      return std::string(kCannotStart) + ", because " + std::to_string(num_failed_starts_) +
             " successive starts failed at once. The last event was: " + event;
    if (Clock::now() > deadline)
      return "the ingress process is not ready after " + std::to_string(timeout.count()) + " ms" +
             (event.empty() ? "" : ", because " + event);
    if (std::string found = poll(); !found.empty()) event = found;
    std::this_thread::sleep_for(kReadyPeriod);
  }
  return {};
}

std::string IngressProcess::poll() {
  if (!is_wanted_) return {};
  std::string events;
  const auto add = [&events](const std::string& event) {
    if (!event.empty()) events += (events.empty() ? "" : ". ") + event;
  };
  const std::size_t received = active_;
  for (const std::size_t seat : {received, 1 - received}) {
    look_for_hang(seat);
    add(reap(seat));
  }
  // the standby takes over, even if it is still starting
  if (workers_[active_].pid < 0 && workers_[1 - active_].pid >= 0) promote(1 - active_);
  add(spawn_missing());
  return events;
}

/// Kills the process at the seat if it hangs. reap() then notes its end, and spawn_missing() replaces it.
void IngressProcess::look_for_hang(std::size_t seat) {
  Worker& worker = workers_[seat];
  worker.was_ready = worker.was_ready || is_ready(seat);
  if (worker.pid < 0 || !worker.hang.empty()) return;
  const std::uint64_t beat = block_->seats[seat].beat.load(std::memory_order_relaxed);
  worker.hang = worker.watch.look(to_ns(Clock::now()), beat, [&] { return read_process(worker.pid); });
  if (!worker.hang.empty()) kill(worker.pid, SIGKILL);
}

/// Collects the exit status if the process at the seat has ended. Returns a text for the log, or an empty
/// string.
std::string IngressProcess::reap(std::size_t seat) {
  Worker& worker = workers_[seat];
  int status = 0;
  if (worker.pid < 0 || waitpid(worker.pid, &status, WNOHANG) != worker.pid) return {};
  // a process killed by hostile packets is replaced at once, but a process that cannot start is retried after
  // a pause
  const bool has_failed = !worker.was_ready && !is_ready(seat) && worker.hang.empty();
  num_failed_starts_ = has_failed ? num_failed_starts_ + 1 : 0;
  pause_ = has_failed ? std::clamp(2 * pause_, kFirstPause, kLongestPause) : milliseconds{0};
  if (pause_.count() > 0) spawn_at_ = Clock::now() + pause_;
  ++num_restarts_;
  std::string event = seat == active_ ? "the ingress process " : "the standby of the ingress process ";
  if (worker.hang.empty()) {
    event += describe_end(status);
    if (num_failed_starts_ == kMostFailedStarts)
      event += explain_failed_start(status);
    else if (is_of_filter(status) && !std::exchange(has_explained_filter_, true))
      event += explain_filter();
  } else {
    ++num_hangs_;
    event += worker.hang + " and was killed";
  }
  forget(worker);
  if (num_failed_starts_ >= kMostFailedStarts) return event;
  return event + (seat == active_ ? "; its standby takes over" : "; another is started");
}

/// Lets the process at the seat receive.  \pre the other process has ended, so that two never receive
void IngressProcess::promote(std::size_t seat) {
  active_ = seat;
  const std::uint64_t one = 1;
  // this write cannot fail, because nobody reads the counter and the counter does not overflow
  [[maybe_unused]] const ssize_t size = write(workers_[seat].order_fd, &one, sizeof one);
}

void IngressProcess::forget(Worker& worker) {
  if (worker.order_fd >= 0) close(worker.order_fd);
  worker = Worker{};
}

void IngressProcess::stop() {
  is_wanted_ = false;
  for (Worker& worker : workers_) {
    if (worker.pid >= 0) {
      kill(worker.pid, SIGKILL);  // the process owns nothing that needs a clean end
      waitpid(worker.pid, nullptr, 0);
    }
    forget(worker);
  }
  socket_.close();
}

}  // namespace freeflex::service
