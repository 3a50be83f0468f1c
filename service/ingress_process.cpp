#include <errno.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <sys/ipc.h>
#include <sys/shm.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <thread>

#include "service/ingress.hpp"
#include "service/io/wire/lcm_url.hpp"

namespace freeflex::service {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t kUrlReserve = 32;  // [B] for the receive buffer that the ingress adds to a URL
static_assert(kMaxUrlSize + kUrlReserve < std::tuple_size_v<decltype(IngressSettings::lcm_url)>);
constexpr int kOwnerOnly = 0600;         // mode of the block
constexpr milliseconds kLongLife{1000};  // one that lived so long is restarted at once
constexpr milliseconds kFirstPause{5};
constexpr milliseconds kLongestPause{100};
constexpr milliseconds kReadyPeriod{2};  // between looks at a starting ingress

std::string system_error(const char* call) {
  return std::string("cannot start the ingress process: ") + call + ": " + std::strerror(errno);
}

/// What a status of waitpid means, for a log.
std::string describe_end(int status) {
  if (WIFSIGNALED(status)) {
    return std::string("ended by signal ") + std::to_string(WTERMSIG(status)) + " (" +
           strsignal(WTERMSIG(status)) + ")";
  }
  switch (static_cast<IngressEnd>(WEXITSTATUS(status))) {
    case IngressEnd::kDaemonGone:
      return "believed the daemon gone";
    case IngressEnd::kBadBlock:
      return "could not attach the shared memory";
    case IngressEnd::kNoRoute:
      return "could not receive over LCM";
    case IngressEnd::kReceiveFailed:
      return "had a failure inside LCM";
    case IngressEnd::kGrown:
      return "had grown too large (liblcm keeps every channel name)";
  }
  return "ended with status " + std::to_string(WEXITSTATUS(status));
}

/// posix_spawn's two helpers, freed on every way out.
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
};

}  // namespace

std::string check_prefix(const std::string& prefix) {
  if (is_channel_prefix(prefix)) return {};
  return "channel prefix '" + prefix + "': must be " + kPrefixAllowed;
}

IngressProcess::~IngressProcess() {
  stop();
  if (block_ != nullptr) shmdt(block_);
}

std::string IngressProcess::start(const Options& options, const io::NameTable& names) {
  std::string fault = check_lcm_url(options.lcm_url);
  if (fault.empty()) fault = check_prefix(options.channel_prefix);
  if (fault.empty()) fault = find_network_fault(options.lcm_url);
  if (fault.empty()) fault = make_block(options, names);
  if (fault.empty()) fault = spawn();
  if (fault.empty()) fault = wait_until_ready(options.timeout);
  if (!fault.empty()) stop();
  return fault;
}

std::string IngressProcess::make_block(const Options& options, const io::NameTable& names) {
  if (block_ == nullptr) {
    // not a file in memory: a limit of file size (`ulimit -f`), set for a log, holds for those as well
    block_id_ = shmget(IPC_PRIVATE, sizeof(SharedBlock), kOwnerOnly);
    if (block_id_ < 0) return system_error("shmget");
    void* memory = shmat(block_id_, nullptr, 0);
    const int error = errno;
    // it goes with the last process that has it, however that ends; until then Linux lets others join
    shmctl(block_id_, IPC_RMID, nullptr);
    errno = error;
    if (memory == kNotAttached) return system_error("shmat");
    block_ = static_cast<SharedBlock*>(memory);
  }
  new (block_) SharedBlock;
  IngressSettings& settings = block_->settings;
  const std::string url = effective_url(options.lcm_url);
  std::copy(url.begin(), url.end(), settings.lcm_url.begin());
  std::copy(options.channel_prefix.begin(), options.channel_prefix.end(), settings.channel_prefix.begin());
  settings.session = options.session;
  settings.daemon_pid = getpid();
  settings.are_keys_required = options.are_keys_required;
  settings.names = names;
  return {};
}

std::string IngressProcess::spawn() {
  SpawnPlan plan;
  // a spawned copy of this program needs nothing of it but the block: safe whatever threads run and hold
  posix_spawn_file_actions_addclosefrom_np(&plan.actions, STDERR_FILENO + 1);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&plan.attributes, &none);
  posix_spawnattr_setsigdefault(&plan.attributes, &all);
  const sched_param ordinary{};
  posix_spawnattr_setschedpolicy(&plan.attributes, SCHED_OTHER);
  posix_spawnattr_setschedparam(&plan.attributes, &ordinary);
  posix_spawnattr_setflags(&plan.attributes,
                           POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSCHEDULER);
  std::string name = program_invocation_short_name;
  std::string option = "--ingress-block";
  std::string id = std::to_string(block_id_);
  char* arguments[] = {name.data(), option.data(), id.data(), nullptr};
  block_->is_ready.store(0);
  errno = posix_spawn(&pid_, "/proc/self/exe", &plan.actions, &plan.attributes, arguments, environ);
  if (errno != 0) {
    pid_ = -1;
    return system_error("posix_spawn");
  }
  started_ = Clock::now();
  is_wanted_ = true;
  return {};
}

std::string IngressProcess::wait_until_ready(milliseconds timeout) {
  const Clock::time_point deadline = Clock::now() + timeout;
  const std::string url = block_->settings.lcm_url.data();
  while (block_->is_ready.load() == 0) {
    if (int status = 0; reap(status)) {
      if (!WIFSIGNALED(status)) return "the ingress process " + describe_end(status) + " on " + url;
      // a hostile packet may come as early as this: another try, within the same time
      if (std::string fault = spawn(); !fault.empty()) return fault;
      ++num_restarts_;
    }
    if (Clock::now() > deadline) {
      return "LCM's test of itself on " + url + " had no answer in " + std::to_string(timeout.count()) +
             " ms: something between this process and the group's address, a packet filter perhaps, drops "
             "packets";
    }
    std::this_thread::sleep_for(kReadyPeriod);
  }
  return {};
}

bool IngressProcess::reap(int& status) {
  if (pid_ < 0 || waitpid(pid_, &status, WNOHANG) != pid_) return false;
  pid_ = -1;
  return true;
}

std::string IngressProcess::poll() {
  if (!is_wanted_) return {};
  std::string event;
  if (int status = 0; reap(status)) {
    const Clock::time_point now = Clock::now();
    const bool had_long_life = now - started_ > kLongLife;
    pause_ = had_long_life ? milliseconds{0} : std::clamp(2 * pause_, kFirstPause, kLongestPause);
    restart_at_ = now + pause_;
    event = "the ingress process " + describe_end(status) + "; restarting it";
  }
  if (pid_ < 0 && Clock::now() >= restart_at_) {
    const std::string fault = spawn();
    if (fault.empty()) {
      ++num_restarts_;
    } else {
      restart_at_ = Clock::now() + kLongestPause;
      event += (event.empty() ? "" : ". ") + fault;
    }
  }
  return event;
}

void IngressProcess::stop() {
  is_wanted_ = false;
  if (pid_ < 0) return;
  kill(pid_, SIGKILL);  // it holds nothing that needs an orderly end
  waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

}  // namespace freeflex::service
