// What the subcommands share on the terminal: faults, JSON, progress, interruption.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/step/plan.hpp"
#include "service/io/scene/input.hpp"

namespace freeflex::tools {

using Json = nlohmann::ordered_json;

/// JSON as text, keys in the order they were written. A number that is not finite becomes null, and bytes
/// that are not UTF-8, which anybody on the bus may send, become U+FFFD. \param indent  -1: one line
std::string json_text(const Json& value, int indent = -1);
/// The same on stdout, with an end of line.
void print_json(const Json& value, int indent = 2);

/// "freeflex: error: TEXT" on stderr.
void print_error(const std::string& text);
/// "freeflex: warning: TEXT" on stderr.
void print_warning(const std::string& text);

/// Faults in full on stderr, in the order found.
void print_faults(const Faults& faults, const std::vector<std::string>& sources);

/// A plan from a scene or plan file, at another rate when rate > 0 [Hz], with values set in the scene. Prints
/// the faults; nullopt on an error, and when output, the file that is to be written, is one of those that the
/// scene is read from.
std::optional<Plan> load_or_explain(const std::string& path, double rate,
                                    const std::vector<std::string>& outputs = {},
                                    const io::Settings& settings = {});

/// True when output, or the file it is until complete, would be written over input, which is explained.
bool would_overwrite(const std::string& input, const std::string& output);

/// As printf, into a string.
__attribute__((format(printf, 1, 2))) std::string format_text(const char* format, ...);

/// Columns that a line of a table takes at most.
inline constexpr std::size_t kLineWidth = 120;
/// Text that begins in column `indent` of its line, broken at blanks within kLineWidth; what follows is
/// indented as much.
std::string wrapped(const std::string& text, std::size_t indent);

/// A fingerprint or hash as it is printed, in JSON too: 16 hexadecimal digits.
std::string fingerprint_text(std::uint64_t fingerprint);

/// "1 fault", "3 faults".
std::string counted(std::int64_t count, const std::string& noun);

/// "a, b, c and 97 more".
std::string listed(std::span<const std::string> names, std::size_t limit);

/// SIGINT and SIGTERM, also where they were ignored, end the program at once with exit_code and kInterrupted
/// on stderr, until is_interrupted() is asked: nothing is lost by then, and a set-up has nowhere to ask.
void end_when_interrupted(int exit_code);
/// From the first call on, SIGINT and SIGTERM only set a flag. True once one of them came.
bool is_interrupted();
inline constexpr const char* kInterrupted = "freeflex: interrupted before there was a result\n";

/// A line on stderr for work that turns out long: its name and the time so far, and a bar once it has told
/// how far it is. Nothing unless stderr is a terminal and `patience` has passed. It is drawn by a thread of
/// its own and goes away with the object: nothing else is to be printed meanwhile.
class Progress {
 public:
  explicit Progress(std::string what, std::chrono::milliseconds patience = std::chrono::milliseconds(500));
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// From any thread. \param fraction  0 to 1 done
  void update(double fraction) { done_.store(fraction, std::memory_order_relaxed); }
  /// What tells of a set-up.  \pre the object outlives it
  SetupProgress of_setup();

 private:
  void draw_until(const std::stop_token& stop, std::chrono::milliseconds patience) const;
  void draw() const;

  std::string what_;
  std::chrono::steady_clock::time_point start_;
  std::atomic<double> done_{-1.0};  // [-] < 0: not told
  std::jthread drawer_;             // last: its end comes before that of what it reads
};

/// Text of a message, which anybody may have sent, as it can be shown: bytes that are not of ASCII's
/// printable ones in hexadecimal, so that none of them moves a cursor or begins a line.
std::string printable(std::string_view text);

}  // namespace freeflex::tools
