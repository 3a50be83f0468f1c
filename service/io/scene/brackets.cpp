#include "service/io/scene/brackets.hpp"

#include <algorithm>

namespace freeflex::io::reader {
namespace {

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
bool is_opening(char c) { return c == '{' || c == '['; }
bool is_closing(char c) { return c == '}' || c == ']'; }
// a quote after one of these characters begins a quoted text
bool begins_value(char c) { return is_opening(c) || c == ',' || c == ':'; }
char closing_of(char opening) { return opening == '{' ? '}' : ']'; }

// returns true for "- ..." or "key: ...", which begins an item of a block
bool starts_item(std::string_view line) {
  const auto ends_at = [&](std::size_t i) { return i == line.size() || is_blank(line[i]); };
  if (line.front() == '-') return ends_at(1);
  for (std::size_t i = 0; i < line.size() && !is_opening(line[i]) && line[i] != ','; ++i)
    if (line[i] == ':' && ends_at(i + 1)) return true;
  return false;
}

class BracketScanner {
 public:
  explicit BracketScanner(std::string_view text) : text_(text) {}

  std::optional<UnclosedBrackets> scan() {
    while (at_ < text_.size()) {
      if (is_line_start_ && !is_blank(text_[at_])) {
        is_line_start_ = false;
        indent_ = at_ - line_start_;
        if (begins_outside()) return unclosed();
      }
      const char c = text_[at_];
      const bool follows_blank = at_ == 0 || is_blank(text_[at_ - 1]);
      if (c == '#' && follows_blank) {
        at_ = std::min(text_.find('\n', at_), text_.size());
        continue;
      }
      if ((c == '"' || c == '\'') && (follows_blank || begins_value(text_[at_ - 1]))) {
        skip_quoted(c);
        continue;
      }
      if (is_opening(c) && (follows_blank || !open_.empty()))
        open_.push_back({c, at_, indent_, at_ == line_start_ + indent_});
      if (is_closing(c) && !open_.empty()) {
        if (closing_of(open_.back().opening) != c) return unclosed(c);
        open_.pop_back();
      }
      pass();
    }
    if (open_.empty()) return std::nullopt;
    return unclosed();
  }

 private:
  struct Open {
    char opening;
    std::size_t offset;
    std::size_t indent;  // indent of the line that contains the bracket [bytes]
    bool is_line_start;  // true: the bracket begins its line, so lines inside it may have the same indent
  };

  void pass() {
    if (text_[at_] == '\n') {
      is_line_start_ = true;
      line_start_ = at_ + 1;
    }
    ++at_;
  }

  // returns true if an item of the block that contains the outermost bracket begins at the first character of
  // this line
  bool begins_outside() const {
    if (open_.empty() || open_.front().is_line_start || indent_ > open_.front().indent) return false;
    return starts_item(text_.substr(at_, std::min(text_.find('\n', at_), text_.size()) - at_));
  }

  // skips a quoted text. If its quote is never closed, forgets the open brackets, because the parser reports
  // that fault.
  void skip_quoted(char quote) {
    for (pass(); at_ < text_.size() && text_[at_] != quote; pass())
      if (quote == '"' && text_[at_] == '\\' && at_ + 1 < text_.size()) pass();
    if (at_ == text_.size()) return open_.clear();
    pass();
    is_line_start_ = false;
  }

  UnclosedBrackets unclosed(char wrong_closing = 0) const {
    UnclosedBrackets result;
    result.noticed = locate(text_, at_);
    result.wrong_closing = wrong_closing;
    for (auto open = open_.rbegin(); open != open_.rend(); ++open) {
      result.brackets.push_back({open->opening, locate(text_, open->offset)});
      if (wrong_closing != 0) break;  // the outer brackets may be closed later
    }
    return result;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_start_ = 0;
  std::size_t indent_ = 0;  // indent of the present line [bytes]
  bool is_line_start_ = true;
  std::vector<Open> open_;
};

std::string describe(const TextPlace& place) {
  return "on line " + std::to_string(place.line) + ", column " + std::to_string(place.column);
}

std::string quoted(char c) { return {'\'', c, '\''}; }

}  // namespace

std::optional<UnclosedBrackets> find_unclosed(std::string_view text) { return BracketScanner(text).scan(); }

std::string describe(const UnclosedBrackets& unclosed) {
  const UnclosedBrackets::Bracket& innermost = unclosed.brackets.front();
  std::string text = innermost.opening == '{' ? "a flow mapping has no closing brace"
                                              : "a flow sequence has no closing bracket";
  text += "; it was opened " + describe(innermost.place) + "; close it with " +
          quoted(closing_of(innermost.opening));
  if (unclosed.wrong_closing != 0)
    text += " before this " + quoted(unclosed.wrong_closing) + ", or remove this one";
  for (std::size_t i = 1; i < unclosed.brackets.size(); ++i)
    text += ", and the " + quoted(unclosed.brackets[i].opening) + " " + describe(unclosed.brackets[i].place) +
            " with " + quoted(closing_of(unclosed.brackets[i].opening));
  return text;
}

}  // namespace freeflex::io::reader
