#include "tools/terminal/console.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "core/plan/automatic.hpp"
#include "core/plan/rates.hpp"

namespace freeflex::tools {
namespace {

volatile std::sig_atomic_t interrupted = 0;

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

void print_json(const Json& value, int indent) {
  const std::string text = value.dump(indent, ' ', false, Json::error_handler_t::replace);
  std::fwrite(text.data(), 1, text.size(), stdout);
  std::fputc('\n', stdout);
  std::fflush(stdout);
}

void print_error(const std::string& text) { std::fprintf(stderr, "freeflex: error: %s\n", text.c_str()); }

void print_warning(const std::string& text) { std::fprintf(stderr, "freeflex: warning: %s\n", text.c_str()); }

void print_faults(const Faults& faults, const std::vector<std::string>& sources) {
  for (const Fault& fault : faults) std::fprintf(stderr, "%s\n", io::format_fault(fault, sources).c_str());
}

std::optional<Plan> load_or_explain(const std::string& path, double rate, const std::string& output) {
  if (would_overwrite(path, output)) return std::nullopt;
  io::PlanResult result = io::load_plan(path);
  for (const std::string& source : result.sources) {
    if (would_overwrite(source, output)) return std::nullopt;
  }
  print_faults(result.faults, result.sources);
  if (result.plan && rate > 0.0) {
    if (const std::string untried = find_untried_rate(*result.plan, rate); !untried.empty())
      std::fprintf(stderr, "%s: warning: %s\n", path.c_str(), untried.c_str());
    set_rate(*result.plan, rate);
  }
  return std::move(result.plan);
}

bool would_overwrite(const std::string& input, const std::string& output) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(input, ignored)) return false;
  for (const std::string& written : {output, output + ".partial"}) {
    if (!std::filesystem::equivalent(input, written, ignored)) continue;
    print_error(written + " is read, as " + input + ": name another file to write");
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
  std::string text(static_cast<std::size_t>(std::max(0, size)), '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, arguments);
  va_end(arguments);
  return text;
}

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
  static const bool is_installed = [] {
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = 1; };
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    return true;
  }();
  return is_installed && interrupted != 0;
}

Progress::Progress(std::string what)
    : what_(std::move(what)),
      start_ns_(now_ns()),
      next_ns_(start_ns_ + 500'000'000),
      is_terminal_(isatty(STDERR_FILENO) == 1) {}

void Progress::update(double fraction) {
  if (!is_terminal_) return;
  const std::int64_t now = now_ns();
  if (now < next_ns_) return;
  next_ns_ = now + 100'000'000;
  is_drawn_ = true;
  constexpr int kWidth = 30;
  const double done = std::clamp(fraction, 0.0, 1.0);
  const int filled = static_cast<int>(done * kWidth);
  const double elapsed = static_cast<double>(now - start_ns_) * 1e-9;
  const double left = done > 0.0 ? elapsed * (1.0 - done) / done : 0.0;
  std::fprintf(stderr, "\r%s [%s%s] %5.1f %%, %.0f s left\033[K", what_.c_str(),
               std::string(static_cast<std::size_t>(filled), '#').c_str(),
               std::string(static_cast<std::size_t>(kWidth - filled), '.').c_str(), 100.0 * done, left);
  std::fflush(stderr);
}

Progress::~Progress() {
  if (is_drawn_) std::fprintf(stderr, "\r\033[K");
}

}  // namespace freeflex::tools
