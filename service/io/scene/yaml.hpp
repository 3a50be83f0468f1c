// Parses YAML text into a tree that stores the position of every node. Only yaml.cpp uses libfyaml.
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
  bool is_quoted = false;  // true: text in quotes or in a block, which is never read as a number
  std::string text;
  Origin origin;
  std::vector<const Node*> items;                            // kList
  std::vector<std::pair<const Node*, const Node*>> entries;  // kMapping; distinct keys, after merges (<<)
  std::vector<const Node*> merged;                           // mappings whose entries were merged
};

/// Describes a node for messages: "a list", "the text 'abc'".
std::string describe(const Node& node);

/// Returns true if the two items, such as `1` and `5`, were written as one number with a decimal comma,
/// `1,5`. In brackets YAML reads that comma as a separator of items.
bool is_split_number(const Node& whole, const Node& fraction);

/// One YAML document. Aliases share nodes, so a node may have several parents.
class YamlTree {
 public:
  /// Returns the root of the source's document, or nullptr after reporting faults: bytes that are not UTF-8,
  /// wrong syntax, duplicate keys, tags, unknown aliases, more than one document, an empty document, too deep
  /// nesting or too many nodes. The parser stops at the first fault of syntax, at a second document and at a
  /// limit; all other faults are reported at once.
  const Node* parse(Report& report, int source);
  /// Adds a node, which exists as long as the tree.
  Node& create(Node node) { return nodes_.emplace_back(std::move(node)); }

 private:
  friend class TreeBuilder;
  std::deque<Node> nodes_;
};

}  // namespace freeflex::io::reader
