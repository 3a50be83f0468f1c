// What a plan may do without.
#include <array>

#include "core/model/leave_out.hpp"
#include "service/io/scene_reader.hpp"

namespace freeflex::io::reader {
namespace {

std::vector<std::string_view> part_names() {
  std::vector<std::string_view> names;
  for (int k = 0; k < kNumParts; ++k) names.emplace_back(name_of(static_cast<Part>(k)));
  return names;
}

}  // namespace

void SceneReader::read_leave_out(const Node& node) {
  const Fields fields(report_, node, "leave_out", {"tolerance", "horizon", "on_need", "keep"});
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
  if (keep->kind == Node::Kind::kText && keep->text == "all") return leave_out.keeps.fill(true);
  const std::vector<const Node*> items =
      keep->kind == Node::Kind::kList ? std::vector<const Node*>(keep->items.begin(), keep->items.end())
                                      : std::vector<const Node*>{keep};
  for (const Node* item : items)
    if (const auto part = read_word(report_, *item, "leave_out: keep", part_names())) {
      if (leave_out.keeps[*part])
        report_.error(item->origin, "leave_out: keep names " + std::string(part_names()[*part]) + " twice");
      leave_out.keeps[*part] = true;
    }
}

}  // namespace freeflex::io::reader
