#include "tools/terminal/console.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cinttypes>
#include <condition_variable>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>

#include "service/io/scene/machine.hpp"
#include "tools/terminal/json.hpp"

namespace freeflex::tools {
namespace {

// the signal handler uses these variables, so they are lock-free and never destroyed
std::atomic<bool> interrupted{false};
// exit code with which a signal ends the program. If it is < 0, a signal only sets the flag `interrupted`.
std::atomic<int> code_at_once{-1};
std::atomic<bool> draws{false};  // true if a line of Progress may be on the terminal
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

/// Runs on any thread at any time, so it makes only async-signal-safe calls.
extern "C" void on_interrupt(int) {
  if (const int code = code_at_once.load(); code >= 0) {
    const std::string_view clear = draws.load() ? "\r\033[K" : "";
    for (const std::string_view text : {clear, std::string_view(kInterrupted)}) {
      [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
    }
    _exit(code);
  }
  interrupted.store(true);
}

void handle_interrupts() {
  struct sigaction action {};
  action.sa_handler = on_interrupt;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

std::string json_text(const Json& value, int indent) {
  return value.dump(indent, ' ', false, Json::error_handler_t::replace);
}

void print_json(const Json& value, int indent) {
  const std::string text = json_text(value, indent);
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fputc('\n', stdout);
  std::fflush(stdout);
}

void print_error(const std::string& text) { std::fprintf(stderr, "freeflex: error: %s\n", text.c_str()); }

void print_warning(const std::string& text) { std::fprintf(stderr, "freeflex: warning: %s\n", text.c_str()); }

void print_faults(const Faults& faults, const std::vector<std::string>& sources) {
  for (const Fault& fault : faults) std::fprintf(stderr, "%s\n", io::format_fault(fault, sources).c_str());
}

std::optional<Plan> load_or_explain(const std::string& path, double rate,
                                    const std::vector<std::string>& outputs, const io::Settings& settings) {
  for (const std::string& output : outputs)
    if (would_overwrite(path, output)) return std::nullopt;
  io::PlanResult result = [&] {
    Progress progress("set-up");
    return io::load_plan(path, rate, progress.of_setup(), settings);
  }();
  for (const std::string& source : result.sources) {
    for (const std::string& output : outputs)
      if (would_overwrite(source, output)) return std::nullopt;
  }
  print_faults(result.faults, result.sources);
  return std::move(result.plan);
}

bool would_overwrite(const std::string& input, const std::string& output) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(input, ignored)) return false;
  for (const std::string& written : {output, output + ".partial"}) {
    if (!std::filesystem::equivalent(input, written, ignored)) continue;
    print_error(format_text("writing %s would overwrite %s, which is read; name another file to write",
                            written.c_str(), input.c_str()));
    return true;
  }
  return false;
}

std::string format_text(const char* format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  std::va_list again;
  va_copy(again, arguments);
  const int size = std::vsnprintf(nullptr, 0, format, again);
  va_end(again);
  std::string text(index(std::max(0, size)), '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, arguments);
  va_end(arguments);
  return text;
}

std::string wrapped(const std::string& text, std::size_t indent) {
  const std::size_t width = kLineWidth - indent;
  std::string lines;
  std::size_t begin = 0;
  while (text.size() - begin > width) {
    // a word that is longer than a line gets a line of its own
    std::size_t blank = text.rfind(' ', begin + width);
    if (blank == std::string::npos || blank <= begin) blank = text.find(' ', begin + width);
    if (blank == std::string::npos) break;
    lines += text.substr(begin, blank - begin) + "\n" + std::string(indent, ' ');
    begin = blank + 1;
  }
  return lines + text.substr(begin);
}

std::string fingerprint_text(std::uint64_t fingerprint) { return format_text("%016" PRIx64, fingerprint); }

std::string counted(std::int64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

std::string listed(std::span<const std::string> names, std::size_t limit) {
  std::string text;
  const std::size_t shown = names.size() <= limit + 1 ? names.size() : limit;
  for (std::size_t i = 0; i < shown; ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (shown < names.size()) text += " and " + std::to_string(names.size() - shown) + " more";
  return text;
}

bool is_interrupted() {
  static const bool is_asked = [] {
    code_at_once.store(-1);
    handle_interrupts();
    return true;
  }();
  return is_asked && interrupted.load();
}

void end_when_interrupted(int exit_code) {
  draws.store(isatty(STDERR_FILENO) == 1);
  code_at_once.store(exit_code);
  handle_interrupts();
}

Progress::Progress(std::string what, std::chrono::milliseconds patience)
    : what_(std::move(what)), start_(std::chrono::steady_clock::now()) {
  if (isatty(STDERR_FILENO) != 1) return;
  try {
    drawer_ = std::jthread([this, patience](const std::stop_token& stop) { draw_until(stop, patience); });
  } catch (const std::system_error&) {
    // if a thread cannot be created, the work continues without the line
  }
}

void Progress::draw_until(const std::stop_token& stop, std::chrono::milliseconds patience) const {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  const auto pause = [&](std::chrono::milliseconds time) {
    wake.wait_for(lock, stop, time, [] { return false; });
    return !stop.stop_requested();
  };
  if (!pause(patience)) return;
  do draw();
  while (pause(std::chrono::milliseconds(100)));
  std::fprintf(stderr, "\r\033[K");
}

SetupProgress Progress::of_setup() {
  io::keep_freed_memory();
  return {[this](const std::string&, double done) {
            update(done);
            return true;
          },
          io::machine_memory_MB(), io::share_on_two_threads};
}

void Progress::draw() const {
  constexpr int kWidth = 30;
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double done = std::min(1.0, done_.load(std::memory_order_relaxed));
  if (done <= 0.0) {
    std::fprintf(stderr, "\r%.30s: %.0f s\033[K", what_.c_str(), elapsed);
  } else {
    const auto filled = static_cast<std::size_t>(done * kWidth);
    std::fprintf(stderr, "\r%.30s [%s%s] %5.1f %%, %.0f s left\033[K", what_.c_str(),
                 std::string(filled, '#').c_str(), std::string(kWidth - filled, '.').c_str(), 100.0 * done,
                 elapsed * (1.0 - done) / done);
  }
  std::fflush(stderr);
}

std::string printable(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool is_plain = c >= ' ' && c <= '~';
    out += is_plain ? std::string(1, c) : format_text("\\x%02x", static_cast<unsigned char>(c));
  }
  return out;
}

}  // namespace freeflex::tools
