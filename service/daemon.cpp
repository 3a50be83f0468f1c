#include "service/daemon.hpp"

#include <malloc.h>
#include <sched.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "core/faults.hpp"
#include "core/plan/file/plan_bytes.hpp"
#include "service/bus.hpp"
#include "service/ingress.hpp"
#include "service/io/scene/input.hpp"
#include "service/io/scene/machine.hpp"
#include "service/io/wire/lcm_url.hpp"
#include "service/io/wire/operator_address.hpp"
#include "service/io/wire/outbound.hpp"
#include "service/limited_log.hpp"
#include "service/limits.hpp"
#include "service/log.hpp"
#include "service/operator_socket.hpp"
#include "service/publisher.hpp"
#include "service/realtime.hpp"
#include "service/session.hpp"
#include "service/verifier.hpp"

namespace freeflex::service {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kSupervision{2};  // time between checks of the ingress
// [-] the daemon warns if the socket's queue is filled beyond this fraction; in normal operation the queue is
// nearly empty
constexpr double kFull = 0.9;
// a daemon publishes its status at least every 100 ms, so the status of a running daemon arrives within this
// time
constexpr milliseconds kListening{300};

/// An error that ends the daemon before the first tick, with the exit code. An empty text means that the
/// error was already printed.
struct StartFault : std::runtime_error {
  StartFault(ExitCode code_, const std::string& text) : std::runtime_error(text), code(code_) {}
  ExitCode code;
};

/// Returns a progress function that logs a line every few seconds while a large structure is set up.
SetupProgress log_now_and_then() {
  static constexpr std::chrono::seconds kBetween{5};
  auto say = [last = std::chrono::steady_clock::now()](const std::string& what, double) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (now - last < kBetween) return true;
    last = now;
    print_plainly("set-up: " + what);
    return true;
  };
  return {say, io::machine_memory_MB(), io::share_on_two_threads};
}

Plan read_plan(const DaemonOptions& options) {
  io::keep_freed_memory();
  io::PlanResult result = io::load_plan(options.input, options.rate, log_now_and_then(), options.settings);
  // faults are for the author of the file, so they are printed on standard error without a log prefix, as a
  // compiler does
  std::string text;
  for (const Fault& fault : result.faults)
    text += (text.empty() ? "" : "\n") + io::format_fault(fault, result.sources);
  if (!text.empty()) print_plainly(text);
  if (!result.plan) throw StartFault(kUsage, "");
  Plan plan = std::move(*result.plan);
  malloc_trim(0);
  const auto num_pushable = std::count_if(plan.points.begin(), plan.points.end(),
                                          [](const PlanPoint& point) { return point.pushable; });
  if (num_pushable > kMaxTablePoints)
    throw StartFault(kUsage,
                     fmt::format("{} points take commands, but the daemon has room for {}; list fewer under "
                                 "'commands: points' in the scene, or push them as groups",
                                 num_pushable, kMaxTablePoints));
  if (plan.points.size() > std::size_t{kMaxNamedPoints} || plan.groups.size() > std::size_t{kMaxGroups}) {
    throw StartFault(kUsage,
                     fmt::format("the scene has {} points and {} groups, but the daemon accepts at most {} "
                                 "points and {} groups; remove some",
                                 plan.points.size(), plan.groups.size(), kMaxNamedPoints, kMaxGroups));
  }
  return plan;
}

/// Returns the keys of --keys, or an empty list without --keys. Throws StartFault if a key file has a fault
/// or there is no key. (Without a key the daemon could accept no command from the bus.)
std::vector<Key> read_keys(const DaemonOptions& options, const Plan& plan) {
  if (!options.keys) return {};
  // no other process of this user may read the keys from the daemon's memory or from a core file
  if (sodium_init() < 0 || prctl(PR_SET_DUMPABLE, 0) != 0)
    throw StartFault(kRuntimeFailure,
                     "the keys cannot be kept secret, because libsodium or prctl does not work here");
  KeysResult result = load_keys(*options.keys, plan);
  if (result.faults.empty()) return std::move(result.keys);
  print_plainly(result.faults);
  throw StartFault(kUsage, "");
}

/// Returns the number of ticks until the time [s], or 0 if there is no end. A time shorter than half a tick
/// gives one tick.
std::int64_t count_ticks(double time, double period) {
  constexpr double kMost = 1e15;  // [ticks] the limit that also applies to the times of a command
  if (time <= 0.0) return 0;
  const double ticks = std::round(time / period);
  if (ticks > kMost)
    throw StartFault(kUsage,
                     fmt::format("--until {:g} is {:g} ticks, but may be at most 1e15 ticks", time, ticks));
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(ticks));
}

/// Checks that the wall time of a tick is not too long for deadlines, which are 64-bit integers in
/// nanoseconds.
void check_pace(const Timing& timing, double period) {
  constexpr double kLongest = 1e6;  // [s]
  const double tick = period / timing.scale;
  if (timing.is_paced() && tick > kLongest)
    throw StartFault(
        kUsage, fmt::format("a tick would last {:g} s, but may last at most {:g} s; change --rate or --time",
                            tick, kLongest));
}

/// Starts a thread with this body. If the system refuses, throws StartFault with the limits that may be the
/// cause.
template <class Body>
std::thread start_thread(const char* what, Body body) {
  try {
    return std::thread(std::move(body));
  } catch (const std::system_error& error) {
    throw StartFault(kRuntimeFailure,
                     fmt::format("the thread for {} cannot be started: {}{}", what, error.code().message(),
                                 explain_limits(error.code().value())));
  }
}

/// The running daemon. Its members are constructed in order and stopped in reverse order.
class Daemon {
 public:
  Daemon(const DaemonOptions& options, SignalWatch& signals);
  ~Daemon();
  int run();

 private:
  void start_ingress();
  void start_verifier(const io::NameTable& names);
  void open_socket();
  SharedBlock& inbound();
  void claim_prefix();
  std::int64_t listen(milliseconds time);
  NotJudged start_verdict();
  void start_simulation();
  void supervise();
  void note_late_verdicts(std::int64_t now_ns, std::int64_t& num_noted, LimitedLog& log) const;
  void log_start() const;
  void log_end() const;

  const DaemonOptions& options_;
  SignalWatch& signals_;
  Plan plan_;
  std::vector<Key> keys_;  // moved to the verifier
  std::int64_t until_tick_;
  Identity identity_;
  std::string url_;
  Output output_;
  IngressProcess ingress_;
  IngressCounts ingress_counts_;
  MonotonicClock clock_;
  std::unique_ptr<Verifier> verifier_;  // null if no keys are required
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<Publisher> publisher_;
  std::unique_ptr<OperatorSocket> operator_;
  std::unique_ptr<VerdictThread> verdicts_;  // null if nothing is judged
  std::unique_ptr<Simulation> simulation_;
  std::thread judging_;
  std::thread verifying_;
  std::thread publishing_;
  std::thread simulating_;
};

Daemon::Daemon(const DaemonOptions& options, SignalWatch& signals)
    : options_(options),
      signals_(signals),
      plan_(read_plan(options)),
      keys_(read_keys(options, plan_)),
      until_tick_(count_ticks(options.until, plan_.period)),
      url_(choose_url(options.lcm_url)),
      output_(plan_) {
  identity_ = {make_session(), plan_fingerprint(plan_), std::filesystem::absolute(options.input).string(),
               options.timing, plan_.command_limits};
  check_pace(options.timing, plan_.period);
  if (std::string fault = check_lcm_url(url_); !fault.empty()) throw StartFault(kUsage, fault);
}

Daemon::~Daemon() {
  if (simulation_) simulation_->request_stop();
  if (simulating_.joinable()) simulating_.join();
  if (verdicts_) verdicts_->request_stop();
  if (judging_.joinable()) judging_.join();
  if (publisher_) publisher_->request_stop();
  if (publishing_.joinable()) publishing_.join();
  if (verifier_) verifier_->request_stop();
  if (verifying_.joinable()) verifying_.join();
  ingress_.stop();
}

int Daemon::run() {
  log_start();
  start_ingress();
  claim_prefix();
  open_socket();
  start_simulation();
  supervise();
  simulating_.join();
  publishing_.join();
  log_end();
  return kClean;
}

void Daemon::start_ingress() {
  auto names = std::make_unique<io::NameTable>();
  io::fill_name_table(plan_, *names);
  io::limit_holds(plan_, *names);
  const IngressProcess::Options ingress{.session = identity_.session,
                                        .lcm_url = url_,
                                        .channel_prefix = options_.prefix,
                                        .user = options_.ingress_user,
                                        .are_keys_required = !keys_.empty()};
  IngressUser user;
  if (std::string fault = find_ingress_user(options_.ingress_user, user); !fault.empty())
    throw StartFault(kUsage, fault);
  if (std::string fault = ingress_.start(ingress, *names); !fault.empty())
    throw StartFault(kRuntimeFailure, fault);
  spdlog::info("commands are received by process {}, whose socket buffer has {} kB", ingress_.pid(),
               ingress_.socket().receive_buffer() / 1024);
  if (ingress_.user().uid == IngressUser::kSame)
    spdlog::info(
        "the process that receives commands runs with the rights of this user; --ingress-user needs root");
  if (const std::string lacks = describe_lacks(ingress_.lacks()); !lacks.empty())
    spdlog::warn("the process that receives commands {}, so it is less confined than intended", lacks);
  if (!ingress_.has_private_memory())
    spdlog::warn(
        "because of a file size limit (ulimit -f) the memory of commands is not private, so other processes "
        "of this user can attach it");
  if (!keys_.empty()) start_verifier(*names);
}

void Daemon::start_verifier(const io::NameTable& names) {
  std::string ids;
  for (const Key& key : keys_) ids += (ids.empty() ? "" : ", ") + key.sealing.id;
  spdlog::info("commands on the bus need one of these keys: {}", ids);
  const Verifier::Options verifier{.session = identity_.session, .channel_prefix = options_.prefix};
  verifier_ = std::make_unique<Verifier>(std::exchange(keys_, {}), verifier, names, ingress_.block());
  verifying_ = start_thread("keys", [this] { verifier_->run(); });
}

/// Opens the operator's socket. If another program listens on the path, this daemon does not start, because
/// `push --socket` would reach that program.
void Daemon::open_socket() {
  operator_ = std::make_unique<OperatorSocket>(plan_, identity_, output_, ingress_.block().senders);
  if (options_.socket == "none") return;
  const OperatorPlace place =
      options_.socket.empty() ? choose_operator_place(options_.prefix) : OperatorPlace{options_.socket, ""};
  if (!place.fault.empty()) throw StartFault(kRuntimeFailure, place.fault);
  const std::string fault = operator_->open(place.path);
  if (!fault.empty()) throw StartFault(kRuntimeFailure, fault);
  spdlog::info("commands of this user are accepted at {}", place.path);
}

/// Returns the block of shared memory that the simulation and the publisher read. This is the verifier's
/// block if keys are required, else the ingress's block.
SharedBlock& Daemon::inbound() { return verifier_ ? verifier_->block() : ingress_.block(); }

/// Ensures that only one daemon uses the prefix. Listens for another daemon before publishing anything. If
/// two daemons start at the same time, the older daemon continues. The older daemon has the smaller session
/// number.
void Daemon::claim_prefix() {
  const auto refuse = [this](std::int64_t other) {
    const std::string found =
        fmt::format("another freeflexd (session {}) is on prefix '{}' at {}", other, options_.prefix, url_);
    if (options_.takes_over)
      return spdlog::warn("{}; this daemon starts anyway, because of --take-over", found);
    throw StartFault(kRuntimeFailure, found +
                                          "; stop it, or start this one with another --prefix or "
                                          "--lcm-url. Any program on the bus can claim this, so if there is "
                                          "no other daemon, start with --take-over");
  };
  if (const std::int64_t other = listen(kListening); other != 0) refuse(other);
  bus_ = std::make_unique<Bus>(url_, options_.prefix);
  publisher_ = std::make_unique<Publisher>(plan_, identity_, *bus_, output_, inbound(), ingress_counts_);
  publishing_ = start_thread("publication", [this] { publisher_->run(); });
  if (const std::int64_t other = listen(kListening); other != 0 && other < identity_.session) refuse(other);
}

/// Returns the session of another daemon as soon as its STATUS arrives, or 0 if none arrives within the time.
std::int64_t Daemon::listen(milliseconds time) {
  const auto until = std::chrono::steady_clock::now() + time;
  std::int64_t other = 0;
  while (other == 0 && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(kSupervision);
    ingress_.poll();
    other = ingress_.block().other_session.load(std::memory_order_relaxed);
  }
  return other;
}

/// Starts the thread that judges the motion, unless the scene or the user has it off or the machine has too
/// few processors. Returns why nothing is judged.
NotJudged Daemon::start_verdict() {
  constexpr unsigned kLeastProcessors = 3;
  if (plan_.verdict.shadows.empty()) {
    spdlog::info("the motion is not judged: {}", not_judged_text(plan_));
    return NotJudged::kOff;
  }
  if (!options_.judges.value_or(true)) return NotJudged::kOff;
  if (!options_.judges && std::thread::hardware_concurrency() < kLeastProcessors) {
    spdlog::warn(
        "the motion is not judged, because this machine has fewer than {} processors; --verdict on judges it",
        kLeastProcessors);
    return NotJudged::kProcessors;
  }
  verdicts_ = std::make_unique<VerdictThread>(plan_);
  judging_ = start_thread("the verdict", [this] {
    // the thread runs while nothing else wants its processor, so that it delays no tick
    const sched_param idle{};
    sched_setscheduler(0, SCHED_IDLE, &idle);
    verdicts_->run();
  });
  return NotJudged::kJudged;
}

void Daemon::start_simulation() {
  const NotJudged not_judged = start_verdict();
  const LoopSettings settings{.timing = options_.timing,
                              .starts_holding = options_.starts_holding,
                              .until_tick = until_tick_,
                              .may_bus_clear = verifier_ != nullptr,
                              .not_judged = not_judged,
                              .limits = plan_.command_limits};
  simulation_ =
      std::make_unique<Simulation>(plan_, settings, clock_, inbound().inbound, output_, verdicts_.get());
  if (!has_default_arithmetic()) {
    throw StartFault(
        kRuntimeFailure,
        "the processor flushes denormals or does not round to nearest (because of a library built "
        "with -ffast-math?), so results would not be reproducible; remove that library");
  }
  const bool is_paced = options_.timing.is_paced();
  if (is_paced) {
    if (const std::string refused = lock_memory(); !refused.empty()) spdlog::warn("{}", refused);
  }
  signals_.end_start_up();
  std::string refused;
  std::atomic<bool> is_set{false};
  simulating_ = start_thread("the simulation", [this, is_paced, &refused, &is_set] {
    if (is_paced) refused = raise_priority();
    is_set.store(true, std::memory_order_release);
    is_set.notify_one();
    simulation_->run();
  });
  is_set.wait(false);
  if (!refused.empty()) spdlog::warn("{}", refused);
  spdlog::info("session {}: {}", identity_.session, options_.starts_holding ? "holding" : "running");
}

/// Supervises the ingress and serves the operator's socket until the simulation has ended. If a signal
/// arrives, tells the simulation to stop.
void Daemon::supervise() {
  LimitedLog log;
  bool is_full = false;
  std::int64_t num_late = 0;
  std::int64_t noted_other = ingress_.block().other_session.load(std::memory_order_relaxed);
  while (!output_.is_finished.load(std::memory_order_acquire)) {
    operator_->serve(kSupervision);
    if (signals_.received() != 0) simulation_->request_stop();
    const std::int64_t now_ns = MonotonicClock{}.now_ns();
    if (const std::string event = ingress_.poll(); !event.empty())
      log.write(LineKind::kIngressEnded, now_ns, event);
    ingress_counts_.restarts.store(ingress_.num_restarts(), std::memory_order_relaxed);
    ingress_counts_.hangs.store(ingress_.num_hangs(), std::memory_order_relaxed);
    const std::int64_t other = ingress_.block().other_session.load(std::memory_order_relaxed);
    if (other != noted_other) {
      log.write(
          LineKind::kOtherDaemon, now_ns,
          fmt::format("another freeflexd (session {}) publishes on prefix '{}' as well; stop one of the two",
                      other, options_.prefix));
      noted_other = other;
    }
    const double fill = ingress_.socket().fill();
    if (fill > kFull && !is_full)
      log.write(LineKind::kNotHeard, now_ns,
                "commands arrive faster than they are processed, so the socket's queue is full and commands "
                "are lost; send fewer a second");
    is_full = fill > (is_full ? kFull / 2 : kFull);
    note_late_verdicts(now_ns, num_late, log);
    log.write_due(now_ns);
  }
  operator_->serve(milliseconds{0});  // delivers the answer to a STOP
  log.end();
}

/// Logs comparisons that came too late since the last call.
void Daemon::note_late_verdicts(std::int64_t now_ns, std::int64_t& num_noted, LimitedLog& log) const {
  if (verdicts_ == nullptr || verdicts_->num_late() == num_noted) return;
  num_noted = verdicts_->num_late();
  log.write(
      LineKind::kVerdict, now_ns,
      fmt::format("{} comparisons of the verdict came too late and were skipped; free a processor for the "
                  "verdict, or set verdict: {{share: S}} to a smaller share",
                  num_noted));
}

void Daemon::log_start() const {
  spdlog::info("{}: {} points, {:.6g} kg, {} rigid freedoms, {} elastic modes", plan_.name,
               plan_.points.size(), plan_.mass, plan_.rigid_freedoms, plan_.num_elastic);
  if (const io::SceneListing listing = io::scene_listing(plan_); index(listing.points) < plan_.points.size())
    spdlog::info(
        "the bus lists the {} points and {} links that the scene names, but not the {} other points and {} "
        "other links",
        listing.points, listing.links, plan_.points.size() - index(listing.points),
        plan_.links.size() - index(listing.links));
  std::string left_out;
  for (const PlanFeature& part : plan_.features)
    if (part.is_left_out) left_out += (left_out.empty() ? "" : ", ") + std::string(name_of(part.feature));
  if (!left_out.empty()) spdlog::info("omitted: {}", left_out);
  for (const auto& [is_lacking, part] : {std::pair{plan_.scope.lacks_rotation, Feature::kRotation},
                                         std::pair{plan_.scope.lacks_out_of_plane, Feature::kOutOfPlane}})
    if (is_lacking)
      spdlog::info("a command that needs {} {}", name_of(part),
                   plan_.fallback.empty() ? "is refused" : "switches to the fallback plan");
  spdlog::info("{:.9g} Hz, {}, on {} with prefix {}", 1.0 / plan_.period, timing_name(options_.timing), url_,
               options_.prefix);
}

void Daemon::log_end() const {
  const int number = signals_.received();
  const std::string cause = number == 0 ? "ended as requested" : fmt::format("SIG{}", sigabbrev_np(number));
  spdlog::info("{}: {} ticks, {} overruns, {} slips, {} commands accepted, {} ingress restarts", cause,
               output_.tick.load(), output_.num_overruns.load(), output_.num_slips.load(),
               output_.num_accepted.load(), ingress_.num_restarts());
}

}  // namespace

int run_daemon(const DaemonOptions& options, SignalWatch& signals) {
  try {
    auto daemon = std::make_unique<Daemon>(options, signals);
    return daemon->run();
  } catch (const StartFault& fault) {
    // wrong usage is printed at any log level, but an empty text means that the error was printed before
    const std::string text = fault.what();
    if (fault.code != kUsage)
      spdlog::error("{}", text);
    else if (!text.empty())
      print_plainly("freeflexd: error: " + text);
    return fault.code;
  } catch (const std::bad_alloc&) {
    spdlog::error(
        "memory ran out before the first tick{}. A large scene takes less memory with modes: {{count: N}}, "
        "and with fewer points and links to publish and to push",
        explain_limits(ENOMEM));
    return kRuntimeFailure;
  } catch (const std::system_error& fault) {
    spdlog::error("{}{}", fault.what(), explain_limits(fault.code().value()));
    return kRuntimeFailure;
  } catch (const std::exception& fault) {
    spdlog::error("{}", fault.what());
    return kRuntimeFailure;
  }
}

}  // namespace freeflex::service
