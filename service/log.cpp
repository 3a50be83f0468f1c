#include "service/log.hpp"

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <memory>
#include <system_error>
#include <thread>

namespace freeflex::service {

namespace {

constexpr std::size_t kNumQueued = 1024;  // lines that can wait. If more wait, the oldest are lost.
constexpr const char* kPlain = "plain";   // name of the logger that writes no prefix

std::shared_ptr<spdlog::logger> make_logger(const char* name, const char* pattern) {
  auto logger = std::make_shared<spdlog::async_logger>(
      name, std::make_shared<spdlog::sinks::stderr_color_sink_mt>(), spdlog::thread_pool(),
      spdlog::async_overflow_policy::overrun_oldest);
  logger->set_pattern(pattern);
  // a log that cannot be written must not stop the simulation
  logger->set_error_handler([](const std::string&) {});
  return logger;
}

}  // namespace

void start_log(const std::string& level) {
  spdlog::init_thread_pool(kNumQueued, 1);
  auto log = make_logger("freeflexd", "%H:%M:%S.%e %n %^%l%$ %v");
  log->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(std::move(log));
  spdlog::register_logger(make_logger(kPlain, "%v"));
}

void print_plainly(const std::string& text) {
  if (const auto plain = spdlog::get(kPlain)) plain->info("{}", text);
}

void end_log(int status) {
  constexpr std::chrono::seconds kLongest{1};
  constexpr std::chrono::milliseconds kWrites{20};  // long enough to write one line
  auto is_written = std::make_shared<std::promise<void>>();
  std::future<void> written = is_written->get_future();
  try {
    std::thread([is_written] {
      spdlog::shutdown();
      is_written->set_value();
    }).detach();
  } catch (const std::system_error&) {
    // no new thread could be started, so the thread of the log writes the queued lines
    const auto pool = spdlog::thread_pool();
    const auto end = std::chrono::steady_clock::now() + kLongest;
    while (pool && pool->queue_size() > 0 && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(kWrites);
    std::this_thread::sleep_for(kWrites);  // the last line has left the queue and may be half written
    _exit(status);
  }
  if (written.wait_for(kLongest) == std::future_status::timeout) _exit(status);
}

}  // namespace freeflex::service
