// Reads which features and modes a plan may omit.
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {

void SceneReader::read_leave_out(const Node& node) {
  const Fields fields(report_, node, "leave_out", sections::kLeaveOut);
  LeaveOut& leave_out = scene_.leave_out;
  leave_out.origin = node.origin;
  fields.read("tolerance", leave_out.tolerance);
  if (!fields.key("tolerance").range.holds(leave_out.tolerance))
    report_.error(
        fields.find("tolerance")->origin,
        "leave_out: tolerance is " + format_number(leave_out.tolerance) + ", but must be a fraction below 1");
  fields.read("horizon", leave_out.horizon);
  if (const auto word = fields.read_word("on_need")) leave_out.on_need = static_cast<OnNeed>(*word);
  const Node* keep = fields.find("keep");
  if (!keep) return;
  const std::vector<std::string_view>& parts = fields.key("keep").words;
  const std::vector<const Node*> items =
      keep->kind == Node::Kind::kList ? std::vector<const Node*>(keep->items.begin(), keep->items.end())
                                      : std::vector<const Node*>{keep};
  for (const Node* item : items) {
    const auto word = read_word(report_, *item, "leave_out: keep", parts);
    if (!word) continue;
    if (*word == kNumFeatures) {
      leave_out.keeps.fill(true);
    } else {
      if (leave_out.keeps[*word])
        report_.error(item->origin,
                      "leave_out: keep names " + std::string(parts[*word]) + " twice; name it once");
      leave_out.keeps[*word] = true;
    }
  }
}

}  // namespace freeflex::io::reader
