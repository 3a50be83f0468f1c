// What the subcommands share on the terminal: faults, JSON, progress, interruption.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/step/plan.hpp"
#include "service/io/scene/input.hpp"

namespace freeflex::tools {

using Json = nlohmann::ordered_json;

/// Key order as written; a number that is not finite becomes null, text that is not UTF-8 is replaced.
void print_json(const Json& value, int indent = 2);

/// "freeflex: error: TEXT" on stderr.
void print_error(const std::string& text);
/// "freeflex: warning: TEXT" on stderr.
void print_warning(const std::string& text);

/// Faults in full on stderr, in the order found.
void print_faults(const Faults& faults, const std::vector<std::string>& sources);

/// A plan from a scene or plan file, at another rate when rate > 0 [Hz]. Prints the faults; nullopt on an
/// error, and when output, the file that is to be written, is one of those that the scene is read from.
std::optional<Plan> load_or_explain(const std::string& path, double rate, const std::string& output = {});

/// True when output, or the file it is until complete, would be written over input, which is explained.
bool would_overwrite(const std::string& input, const std::string& output);

/// As printf, into a string.
__attribute__((format(printf, 1, 2))) std::string format_text(const char* format, ...);

/// "1 fault", "3 faults".
std::string counted(std::int64_t count, const std::string& noun);

/// "a, b, c and 97 more".
std::string listed(std::span<const std::string> names, std::size_t limit);

/// From the first call on, SIGINT and SIGTERM only set a flag. True once one of them came.
bool is_interrupted();

/// A bar on stderr for work that turns out long: nothing unless stderr is a terminal and 0.5 s have passed.
class Progress {
 public:
  explicit Progress(std::string what);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// \param fraction  0 to 1 done
  void update(double fraction);

 private:
  std::string what_;
  std::int64_t start_ns_ = 0;  // [ns] monotonic
  std::int64_t next_ns_ = 0;   // [ns] when to draw next
  bool is_terminal_ = false;
  bool is_drawn_ = false;
};

}  // namespace freeflex::tools
