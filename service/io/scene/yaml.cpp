#include "service/io/scene/yaml.hpp"

#include <libfyaml.h>

#include <memory>
#include <new>
#include <string_view>
#include <unordered_map>

#include "service/io/scene/brackets.hpp"
#include "service/io/scene/text.hpp"

namespace freeflex::io::reader {
namespace {

// returns the advice for one of the most frequent faults, or an empty text for any other fault, which is then
// reported in libfyaml's words alone
std::string_view hint(std::string_view message) {
  struct Advice {
    std::string_view fragment, text;
  };
  static constexpr Advice kAdvice[] = {
      {"tab", "indent with spaces"},
      {"trailing content", "quote all of a value or nothing of it; separate values by commas"},
      {"extra closing", "remove it, or open it before"},
      {"multiline plain key", "check the indentation, and that the line before is complete"},
      {"cannot start with", "put the text in quotes"},
      {"invalid escape", "double the backslash, or use single quotes"},
      {"expected key", "items of one mapping or list must start in the same column"},
      {"invalid indentation", "items of one mapping or list must start in the same column"},
      {"missing comma", "separate items by commas"},
      {"nested block mapping",
       "give each key a line of its own, or open a brace before the first: {name: hub, mass: 40}"},
      {"wrongly indented sequence end", "indent the closing bracket deeper than the line that opens it"},
      {"wrongly indented mapping end", "indent the closing brace deeper than the line that opens it"},
      {"expected node content", "a value is missing here, or begins with a comma; write 0.5, not ,5"},
      {"double-quoted", "close the quote"},
      {"single-quoted", "close the quote"},
  };
  for (const Advice& advice : kAdvice)
    if (message.find(advice.fragment) != std::string_view::npos) return advice.text;
  return {};
}

struct ParserCloser {
  void operator()(fy_parser* parser) const { fy_parser_destroy(parser); }
};
struct DiagCloser {
  void operator()(fy_diag* diag) const { fy_diag_destroy(diag); }
};
struct EventCloser {
  fy_parser* parser;
  void operator()(fy_event* event) const { fy_parser_event_free(parser, event); }
};

std::string_view token_text(fy_token* token) {
  std::size_t length = 0;
  const char* text = token ? fy_token_get_text(token, &length) : nullptr;
  return text ? std::string_view(text, length) : std::string_view();
}

bool is_null_word(std::string_view text) {
  return text.empty() || text == "~" || text == "null" || text == "Null" || text == "NULL";
}

}  // namespace

/// Builds the tree from parser events. Unfinished lists and mappings are on an explicit stack.
class TreeBuilder {
 public:
  TreeBuilder(Report& report, int source, YamlTree& tree) : report_(report), source_(source), tree_(tree) {}

  /// Processes an event. Returns false if a limit is reached and parsing must stop.
  bool take(fy_event& event) {
    if (const fy_mark* mark = fy_event_start_mark(&event))
      place_ = {source_, report_.is_setting(source_) ? 0 : mark->line + 1, mark->column + 1};
    switch (event.type) {
      case FYET_DOCUMENT_START:
        if (++num_documents_ == 2)
          report_.error(place_,
                        "a second document starts here, but a scene is one document; remove the others");
        return num_documents_ == 1;
      case FYET_SCALAR:
        return add(scalar(event), event);
      case FYET_ALIAS:
        return add_alias(token_text(event.alias.anchor));
      case FYET_SEQUENCE_START:
        return open(Node::Kind::kList, event);
      case FYET_MAPPING_START:
        return open(Node::Kind::kMapping, event);
      case FYET_SEQUENCE_END:
      case FYET_MAPPING_END:
        return close();
      default:
        return true;
    }
  }
  /// Returns the root, or nullptr if there is no content or an alias is unknown.
  const Node* root() const { return is_broken_ ? nullptr : root_; }
  bool is_empty() const { return root_ == nullptr; }

 private:
  struct Open {
    Node* node;
    const Node* key = nullptr;  // the key whose value comes next
    std::string anchor;
  };

  Node* create(Node::Kind kind) {
    if (++num_nodes_ > kMaxYamlNodes) {
      report_.error(
          place_, "the scene has more than " + std::to_string(kMaxYamlNodes) +
                      " values; put points and links into CSV files, and matrices into Matrix Market files");
      return nullptr;
    }
    Node& node = tree_.nodes_.emplace_back();
    node.kind = kind;
    node.origin = place_;
    return &node;
  }

  Node* scalar(fy_event& event) {
    Node* node = create(Node::Kind::kText);
    if (!node) return nullptr;
    node->text = token_text(event.scalar.value);
    node->is_quoted = event.scalar.value && fy_token_scalar_style(event.scalar.value) != FYSS_PLAIN;
    if (!node->is_quoted && is_null_word(node->text)) node->kind = Node::Kind::kEmpty;
    return node;
  }

  bool add(Node* node, fy_event& event) {
    if (!node) return false;
    refuse_tag(event);
    attach(node);
    if (fy_token* anchor = fy_event_get_anchor_token(&event))
      anchors_[std::string(token_text(anchor))] = node;
    return true;
  }

  bool add_alias(std::string_view name) {
    if (const auto anchor = anchors_.find(std::string(name)); anchor != anchors_.end()) {
      attach(anchor->second);
      return true;
    }
    std::vector<std::string_view> known;
    for (const auto& [word, node] : anchors_) known.push_back(word);
    report_.error(place_, "alias " + quote(name) + " has no anchor before it" + did_you_mean(name, known));
    is_broken_ = true;
    Node* node = create(Node::Kind::kEmpty);
    if (node) attach(node);
    return node != nullptr;
  }

  bool open(Node::Kind kind, fy_event& event) {
    if (stack_.size() >= kMaxYamlDepth) {
      report_.error(place_, "the text is nested deeper than " + std::to_string(kMaxYamlDepth) +
                                " levels, but a scene needs at most 6");
      return false;
    }
    Node* node = create(kind);
    if (!node) return false;
    refuse_tag(event);
    stack_.push_back({node, nullptr, std::string(token_text(fy_event_get_anchor_token(&event)))});
    return true;
  }

  bool close() {
    if (stack_.empty()) return false;
    const Open done = stack_.back();
    stack_.pop_back();
    if (done.node->kind == Node::Kind::kMapping && !finish_mapping(*done.node)) return false;
    attach(done.node);
    // the anchor becomes known only after the node is complete, so that no node can contain itself
    if (!done.anchor.empty()) anchors_[done.anchor] = done.node;
    return true;
  }

  void attach(const Node* node) {
    if (stack_.empty()) {
      if (!root_) root_ = node;
      return;
    }
    Open& parent = stack_.back();
    if (parent.node->kind == Node::Kind::kList) {
      parent.node->items.push_back(node);
    } else if (!parent.key) {
      if (node->kind != Node::Kind::kText)
        report_.error(node->origin,
                      "a key is " + describe(*node) + ", but must be a word followed by a colon");
      parent.key = node;
    } else {
      parent.node->entries.emplace_back(parent.key, node);
      parent.key = nullptr;
    }
  }

  void refuse_tag(fy_event& event) {
    if (fy_token* tag = fy_event_get_tag_token(&event))
      report_.error(place_, "tag " + quote(token_text(tag)) + " has no meaning in a scene; remove it");
  }

  // libfyaml parses `mass: 1,5` in braces as the value 1 and a key 5 without a value. Restores the value 1,5,
  // so that the fault shows what the author wrote.
  bool join_split_numbers(Node& mapping) {
    std::vector<std::pair<const Node*, const Node*>> entries;
    for (const auto& [key, value] : mapping.entries) {
      const Node* before = entries.empty() ? nullptr : entries.back().second;
      if (!before || value->kind != Node::Kind::kEmpty || !is_split_number(*before, *key)) {
        entries.emplace_back(key, value);
        continue;
      }
      Node* joined = create(Node::Kind::kText);
      if (!joined) return false;
      joined->origin = before->origin;
      joined->text = before->text + "," + key->text;
      entries.back().second = joined;
    }
    mapping.entries = std::move(entries);
    return true;
  }

  // reports and removes repeated keys, and adds the entries of merged mappings whose keys the mapping lacks
  bool finish_mapping(Node& mapping) {
    if (!join_split_numbers(mapping)) return false;
    std::unordered_map<std::string_view, const Node*> seen;
    std::vector<std::pair<const Node*, const Node*>> entries;
    std::vector<const Node*> merged;
    for (const auto& [key, value] : mapping.entries) {
      if (key->kind != Node::Kind::kText) continue;  // reported
      if (key->text == "<<" && !key->is_quoted) {
        if (value->kind == Node::Kind::kList)
          merged.insert(merged.end(), value->items.begin(), value->items.end());
        else
          merged.push_back(value);
      } else if (const auto [first, is_new] = seen.emplace(key->text, key); is_new) {
        entries.emplace_back(key, value);
      } else {
        report_.error(key->origin, "key " + quote(key->text) + " is written twice, first " +
                                       describe_place(report_, first->second->origin, key->origin) +
                                       "; remove one");
      }
    }
    for (const Node* other : merged) {
      if (other->kind != Node::Kind::kMapping) {
        report_.error(other->origin,
                      "'<<' merges " + describe(*other) + ", but must be a mapping or a list of mappings");
        continue;
      }
      mapping.merged.push_back(other);
      num_nodes_ += other->entries.size();
      if (num_nodes_ > kMaxYamlNodes) return create(Node::Kind::kEmpty) != nullptr;  // reports
      for (const auto& entry : other->entries)
        if (seen.emplace(entry.first->text, entry.first).second) entries.push_back(entry);
    }
    mapping.entries = std::move(entries);
    return true;
  }

  Report& report_;
  int source_;
  YamlTree& tree_;
  Origin place_;
  int num_documents_ = 0;
  std::size_t num_nodes_ = 0;
  std::vector<Open> stack_;
  std::unordered_map<std::string, const Node*> anchors_;
  const Node* root_ = nullptr;
  bool is_broken_ = false;
};

std::string describe(const Node& node) {
  switch (node.kind) {
    case Node::Kind::kEmpty:
      return "empty";
    case Node::Kind::kList:
      return "a list";
    case Node::Kind::kMapping:
      return "a mapping";
    case Node::Kind::kText:
      break;
  }
  return "the text " + quote(node.text);
}

bool is_split_number(const Node& whole, const Node& fraction) {
  const auto is_plain = [](const Node& node) {
    return node.kind == Node::Kind::kText && !node.is_quoted && !node.text.empty();
  };
  if (!is_plain(whole) || !is_plain(fraction) || whole.origin.source != fraction.origin.source ||
      whole.origin.line != fraction.origin.line ||
      fraction.origin.column != whole.origin.column + static_cast<int>(whole.text.size()) + 1)
    return false;
  const std::size_t sign = whole.text.find_first_not_of("+-") == 1 ? 1 : 0;
  return whole.text.size() > sign && whole.text.find_first_not_of("0123456789", sign) == std::string::npos &&
         fraction.text.find_first_of("0123456789") == 0;
}

namespace {

// reports the parser's first fault. If a bracket before this fault is not closed, reports the bracket, and
// the parser's fault only if it is on an earlier line than the place that shows the fault of the bracket: a
// later fault of the parser is misleading.
void report_syntax(Report& report, int source, std::string_view text, const fy_diag_error* fault) {
  const int line = fault ? fault->line : 0, column = fault ? fault->column : 0;
  const auto unclosed = find_unclosed(text);
  const bool is_open = unclosed && (line <= 0 || unclosed->brackets.back().place.line <= line);
  if (is_open)
    report.error({source, unclosed->noticed.line, unclosed->noticed.column},
                 "YAML syntax: " + describe(*unclosed));
  if (is_open && (line <= 0 || line >= unclosed->noticed.line)) return;
  const std::string message = fault && fault->msg ? fault->msg : "the text cannot be parsed further";
  const std::string advice(hint(message));
  report.error({source, line, column}, "YAML syntax: " + message + (advice.empty() ? "" : "; ") + advice);
}

}  // namespace

const Node* YamlTree::parse(Report& report, int source) {
  std::string_view text = report.text(source);
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte order mark
  // libfyaml 0.7 crashed on bytes that are not UTF-8, so such bytes are never passed to it
  if (const std::size_t bad = find_bad_byte(text); bad != std::string_view::npos) {
    const TextPlace place = locate(text, bad);
    char byte[8];
    std::snprintf(byte, sizeof byte, "0x%02x", static_cast<unsigned char>(text[bad]));
    report.error(
        {source, place.line, place.column},
        std::string("byte ") + byte + " is not text, but a scene must be UTF-8 without control characters");
    return nullptr;
  }

  fy_diag_cfg diag_settings;
  fy_diag_cfg_default(&diag_settings);
  diag_settings.fp = nullptr;
  diag_settings.output_fn = [](fy_diag*, void*, const char*, std::size_t) {};
  const std::unique_ptr<fy_diag, DiagCloser> diag(fy_diag_create(&diag_settings));
  fy_diag_set_collect_errors(diag.get(), true);
  fy_parse_cfg settings{};
  settings.flags = static_cast<fy_parse_cfg_flags>(FYPCF_QUIET | FYPCF_COLLECT_DIAG | FYPCF_JSON_NONE |
                                                   FYPCF_DEFAULT_VERSION_1_2);
  settings.diag = diag.get();
  const std::unique_ptr<fy_parser, ParserCloser> parser(fy_parser_create(&settings));
  // the parser reads nothing in this call, so only lack of memory can make it fail
  if (!parser || fy_parser_set_string(parser.get(), text.data(), text.size()) != 0) throw std::bad_alloc();

  TreeBuilder builder(report, source, *this);
  bool is_within_limits = true;
  while (is_within_limits) {
    const std::unique_ptr<fy_event, EventCloser> event(fy_parser_parse(parser.get()),
                                                       EventCloser{parser.get()});
    if (!event || event->type == FYET_STREAM_END) break;
    is_within_limits = builder.take(*event);
  }
  if (!is_within_limits) return nullptr;
  if (fy_parser_get_stream_error(parser.get())) {
    void* position = nullptr;
    const fy_diag_error* fault = fy_diag_errors_iterate(diag.get(), &position);
    report_syntax(report, source, text, fault);
    return nullptr;
  }
  if (builder.is_empty() && report.is_setting(source)) {
    Node empty;
    empty.origin = {source, 0, 1};
    return &create(std::move(empty));
  }
  if (builder.is_empty())
    report.error({source, 1, 1}, "the file is empty, but a scene needs at least points");
  return builder.root();
}

}  // namespace freeflex::io::reader
