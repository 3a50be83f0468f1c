// The terminal output of the subcommands: faults, JSON, progress, and what happens on interrupts.
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

#include "core/plan.hpp"
#include "service/io/scene/input.hpp"

namespace freeflex::tools {

using Json = nlohmann::ordered_json;

/// Returns JSON as text, with keys in the order of insertion. A number that is not finite becomes null. Bytes
/// that are not UTF-8 become U+FFFD, because any program on the bus may send such bytes.
/// \param indent  -1: one line
std::string json_text(const Json& value, int indent = -1);
/// Prints JSON on stdout, followed by an end of line.
void print_json(const Json& value, int indent = 2);

/// Prints "freeflex: error: TEXT" on stderr.
void print_error(const std::string& text);
/// Prints "freeflex: warning: TEXT" on stderr.
void print_warning(const std::string& text);

/// Prints faults in full on stderr, in the order in which they were found.
void print_faults(const Faults& faults, const std::vector<std::string>& sources);

/// Loads a plan from a scene or plan file. `settings` replace values of the scene, and a rate > 0 [Hz]
/// replaces its rate. Prints the faults. Returns nullopt on an error, or if one of the `outputs`, the files
/// to be written, is also read for the scene.
std::optional<Plan> load_or_explain(const std::string& path, double rate,
                                    const std::vector<std::string>& outputs = {},
                                    const io::Settings& settings = {});

/// If `output` or its partial file would overwrite `input`, prints an error and returns true.
bool would_overwrite(const std::string& input, const std::string& output);

/// Returns a string that is formatted as by printf.
__attribute__((format(printf, 1, 2))) std::string format_text(const char* format, ...);

/// Largest number of columns in a line of a table.
inline constexpr std::size_t kLineWidth = 120;
/// Breaks a text at blanks so that its lines end within kLineWidth. The first line is assumed to begin in
/// column `indent`, and further lines are indented to this column.
std::string wrapped(const std::string& text, std::size_t indent);

/// Returns a fingerprint or hash as 16 hexadecimal digits, the form in all output.
std::string fingerprint_text(std::uint64_t fingerprint);

/// Returns a count with its noun, such as "1 fault" or "3 faults".
std::string counted(std::int64_t count, const std::string& noun);

/// Returns names as a list, such as "a, b, c and 97 more", of at most limit + 1 names.
std::string listed(std::span<const std::string> names, std::size_t limit);

/// After this call and until the first call of is_interrupted(), SIGINT and SIGTERM end the program at once
/// with exit_code and kInterrupted on stderr, even if the program was started with these signals ignored.
/// During this time the program has no result that could be lost, and the set-up does not poll.
void end_when_interrupted(int exit_code);
/// Returns true if SIGINT or SIGTERM came. From the first call on, these signals only set a flag.
bool is_interrupted();
inline constexpr const char* kInterrupted = "freeflex: interrupted before there was a result\n";

/// Shows a line on stderr during long work: the name of the work, then the time so far or, after update() has
/// set a fraction above 0, a bar and the time left. A thread draws the line, only on a terminal and only
/// after `patience`. The line disappears when the object is destroyed, and nothing else may be printed
/// before.
class Progress {
 public:
  explicit Progress(std::string what, std::chrono::milliseconds patience = std::chrono::milliseconds(500));
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Sets the finished fraction. Any thread may call this function. \param fraction  0 to 1
  void update(double fraction) { done_.store(fraction, std::memory_order_relaxed); }
  /// Returns a progress callback for a set-up.  \pre this object outlives the callback
  SetupProgress of_setup();

 private:
  void draw_until(const std::stop_token& stop, std::chrono::milliseconds patience) const;
  void draw() const;

  std::string what_;
  std::chrono::steady_clock::time_point start_;
  std::atomic<double> done_{-1.0};  // [-] < 0: unknown
  // declared last, because the thread must end before the members that it reads are destroyed
  std::jthread drawer_;
};

/// Returns a text in which all bytes except printable ASCII are replaced by hexadecimal, so that a text from
/// an unknown sender cannot move the cursor or begin a line.
std::string printable(std::string_view text);

}  // namespace freeflex::tools
