// What a plan may do without.

#include <array>

#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

/// Every part by its number, then all of them.
std::vector<std::string_view> keep_words() {
  std::vector<std::string_view> words;
  words.reserve(std::size_t{kNumParts} + 1);
  for (int k = 0; k < kNumParts; ++k) words.emplace_back(name_of(static_cast<Part>(k)));
  words.emplace_back("all");
  return words;
}

}  // namespace

void SceneReader::read_leave_out(const Node& node) {
  const Fields fields(report_, node, "leave_out", {"tolerance", "horizon", "on_need", "keep"}, {},
                      "tolerance");
  LeaveOut& leave_out = scene_.leave_out;
  leave_out.origin = node.origin;
  fields.read("tolerance", {"-", Bound::kNonNegative}, leave_out.tolerance);
  if (leave_out.tolerance >= 1.0)
    report_.error(
        fields.find("tolerance")->origin,
        "leave_out: tolerance is " + format_number(leave_out.tolerance) + ", must be a share below 1");
  fields.read("horizon", {"s", Bound::kPositive}, leave_out.horizon);
  if (const Node* on_need = fields.find("on_need"))
    if (const auto word = read_word(report_, *on_need, "leave_out: on_need", {"keep", "refuse", "replan"}))
      leave_out.on_need = static_cast<OnNeed>(*word);
  const Node* keep = fields.find("keep");
  if (!keep) return;
  const std::vector<const Node*> items =
      keep->kind == Node::Kind::kList ? std::vector<const Node*>(keep->items.begin(), keep->items.end())
                                      : std::vector<const Node*>{keep};
  for (const Node* item : items) {
    const auto word = read_word(report_, *item, "leave_out: keep", keep_words());
    if (!word) continue;
    if (*word == kNumParts) {
      leave_out.keeps.fill(true);
    } else {
      if (leave_out.keeps[*word])
        report_.error(item->origin, "leave_out: keep names " + std::string(keep_words()[*word]) + " twice");
      leave_out.keeps[*word] = true;
    }
  }
}

}  // namespace freeflex::io::reader
