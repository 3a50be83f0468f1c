// Reads forces proportional to the motion of a point.
#include <algorithm>

#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

// reads a gain: one number for all body axes, one number for each axis, or the rows of a matrix
std::optional<Eigen::Matrix3d> read_gain(Report& report, const Node& node, const std::string& label,
                                         std::string_view unit) {
  if (node.kind == Node::Kind::kText) {
    const auto gain = read_number(report, node, label, {unit});
    if (!gain) return std::nullopt;
    return Eigen::Matrix3d(*gain * Eigen::Matrix3d::Identity());
  }
  const bool is_list = node.kind == Node::Kind::kList;
  const auto num_rows = std::count_if(node.items.begin(), node.items.end(),
                                      [](const Node* item) { return item->kind == Node::Kind::kList; });
  if (node.items.size() != 3 || (num_rows != 0 && num_rows != 3)) {
    const std::string found = !is_list ? " is " + describe(node)
                              : node.items.size() != 3
                                  ? " has " + std::to_string(node.items.size()) + " items"
                                  : " mixes numbers and lists";
    report.error(node.origin, label + found +
                                  ", but must be a number, a list of 3 (one for each body axis) or 3 "
                                  "lists of 3 (rows of a matrix) [" +
                                  std::string(unit) + "]" + (num_rows == 0 ? comma_hint(node, 3) : ""));
    return std::nullopt;
  }
  Eigen::Matrix3d gain = Eigen::Matrix3d::Zero();
  if (num_rows == 0) {
    const auto diagonal = read_vector(report, node, label, unit);
    if (!diagonal) return std::nullopt;
    gain.diagonal() = *diagonal;
    return gain;
  }
  bool is_good = true;
  for (int i = 0; i < 3; ++i) {
    const ItemOfReport one(report);
    const Node& item = *node.items[index(i)];
    const auto row = read_vector(report, item, label + ": row " + std::to_string(i + 1), unit);
    is_good = is_good && row.has_value();
    if (row) gain.row(i) = *row;
  }
  if (!is_good) return std::nullopt;
  return gain;
}

}  // namespace

void SceneReader::read_feedbacks(const Node& node) {
  for (const Node* item : read_list(node, "feedback", "feedbacks {name, at, from and gains}")) {
    if (scene_.feedbacks.size() == kMaxFeedbacks)
      return report_.error(item->origin, "there are more than " + std::to_string(kMaxFeedbacks) +
                                             " feedbacks, so the rest is not read; remove some");
    read_feedback(*item);
  }
}

void SceneReader::read_feedback(const Node& node) {
  const std::string number = std::to_string(scene_.feedbacks.size() + 1);
  const ItemOfReport item(report_);
  const Fields fields(report_, node, item_label("feedback", node, number), sections::kFeedback);
  Feedback feedback;
  feedback.origin = node.origin;
  feedback.name = number;
  if (const Node* name = fields.find("name"))
    if (const auto text = read_name(report_, *name, fields.label() + ": name")) feedback.name = *text;
  const Node* at = fields.require("at", "must be the name of the point that the force acts on");
  if (at) feedback.point = points_.resolve(report_, *at, fields.label() + ": at").value_or(-1);
  feedback.sensor = feedback.point;
  if (const Node* from = fields.find("from"))
    feedback.sensor = points_.resolve(report_, *from, fields.label() + ": from").value_or(-1);
  const auto read = [&](const char* key, Eigen::Matrix3d& gain) {
    const Node* value = fields.find(key);
    if (!value) return;
    if (const auto matrix = read_gain(report_, *value, fields.label_of(key), fields.key(key).quantity.unit))
      gain = *matrix;
  };
  read("displacement", feedback.displacement_gain);
  read("velocity", feedback.velocity_gain);
  read("acceleration", feedback.acceleration_gain);
  if (fields.lacks_all({"displacement", "velocity", "acceleration"}))
    report_.missing(node, "gain",
                    fields.label() + " has no gain; it must have displacement, velocity or acceleration");
  feedbacks_.add(report_, feedback.name, feedback.origin);
  scene_.feedbacks.push_back(std::move(feedback));
}

}  // namespace freeflex::io::reader
