// YAML text -> a tree that knows where everything was written. The only place that sees libfyaml.
#pragma once

#include <deque>
#include <string>
#include <utility>
#include <vector>

#include "service/io/scene/report.hpp"

namespace freeflex::io::reader {

struct Node {
  enum class Kind { kEmpty, kText, kList, kMapping };
  Kind kind = Kind::kEmpty;
  bool is_quoted = false;  // text in quotes or a block: never a number
  std::string text;
  Origin origin;
  std::vector<const Node*> items;                            // kList
  std::vector<std::pair<const Node*, const Node*>> entries;  // kMapping, merges (<<) done, keys distinct
  std::vector<const Node*> merged;                           // mappings whose entries are among them
};

/// What a node is, for messages: "a list", "the text 'abc'".
std::string describe(const Node& node);

/// True for `1` and `5` in brackets from `1,5`: a decimal comma, which YAML takes to separate items.
bool is_split_number(const Node& whole, const Node& fraction);

/// One YAML document; aliases share nodes, so a node may be reached by more than one way.
class YamlTree {
 public:
  /// Root of the source's document, or nullptr after reporting: bytes that are not UTF-8, syntax, duplicate
  /// keys, tags, unknown aliases, more than one document, nothing at all, depth or number of nodes. Syntax
  /// stops at the first fault, the others are all reported.
  const Node* parse(Report& report, int source);
  /// A node of its own, which lives as long as the tree.
  Node& create(Node node) { return nodes_.emplace_back(std::move(node)); }

 private:
  friend class TreeBuilder;
  std::deque<Node> nodes_;
};

}  // namespace freeflex::io::reader
