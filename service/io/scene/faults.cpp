// Formats faults as text and as JSON.
#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "service/io/scene/input.hpp"
#include "service/io/scene/text.hpp"

namespace freeflex::io {
namespace {

std::string source_of(const Fault& fault, const std::vector<std::string>& sources) {
  const int source = fault.origin.source;
  if (source < 0 || index(source) >= sources.size()) return sources.empty() ? "" : sources.front();
  return sources[index(source)];
}

const char* severity_of(const Fault& fault) {
  return fault.severity == Fault::Severity::kError ? "error" : "warning";
}

// returns a line without its end-of-line characters, or nullopt if the file has no such line or the line is
// too long to show
std::optional<std::string> line_of_file(const std::string& path, int wanted) {
  constexpr std::size_t kLongest = 1 << 16;
  std::ifstream file(path, std::ios::binary);
  std::string line;
  for (int number = 1; file && number < wanted; ++number)
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  char c = 0;
  while (line.size() <= kLongest && file.get(c) && c != '\n') line += c;
  if (line.size() > kLongest || (line.empty() && !file)) return std::nullopt;
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return line;
}

// returns the line and a caret below the column, both cut to a window around the column
std::string show_line(const std::string& line, int column) {
  constexpr int kBefore = 60, kWindow = 100;
  const int first = std::max(1, column - kBefore);
  std::string shown, marks;
  int at = 1;
  for (std::size_t i = 0; i <= line.size() && at < first + kWindow; ++at) {
    std::size_t end = i + 1;  // one UTF-8 character: its first byte and its continuation bytes
    while (end < line.size() && (static_cast<unsigned char>(line[end]) & 0xc0) == 0x80) ++end;
    if (at >= first && i < line.size()) {
      const auto byte = static_cast<unsigned char>(line[i]);
      const bool is_shown =
          byte >= 0x20 && byte != 0x7f &&
          reader::find_bad_byte(std::string_view(line).substr(i, end - i)) == std::string_view::npos;
      shown += byte == '\t' ? " " : is_shown ? line.substr(i, end - i) : "?";
    }
    if (at >= first && at < column) marks += ' ';
    i = end;
  }
  return "    " + shown + "\n    " + marks + "^\n";
}

}  // namespace

std::string format_fault(const Fault& fault, const std::vector<std::string>& sources, bool with_source_line) {
  std::string text = source_of(fault, sources);
  if (fault.origin.line > 0) text += ":" + std::to_string(fault.origin.line);
  if (fault.origin.line > 0 && fault.origin.column > 0) text += ":" + std::to_string(fault.origin.column);
  if (!text.empty()) text += ": ";
  text += std::string(severity_of(fault)) + ": " + fault.message;
  if (with_source_line && fault.origin.line > 0 && fault.origin.source >= 0) {
    const auto line = line_of_file(source_of(fault, sources), fault.origin.line);
    if (line) text += "\n" + show_line(*line, std::max(1, fault.origin.column));
  }
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

std::string faults_to_json(const Faults& faults, const std::vector<std::string>& sources) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Fault& fault : faults)
    list.push_back({{"file", source_of(fault, sources)},
                    {"line", fault.origin.line},
                    {"column", fault.origin.column},
                    {"severity", severity_of(fault)},
                    {"message", fault.message}});
  // a file name need not be UTF-8, so invalid bytes are replaced
  return list.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace freeflex::io
