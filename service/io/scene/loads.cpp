// Reads the loads of a scene, their histories and the wheels.
#include <algorithm>

#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {

void SceneReader::read_loads(const Node& node) {
  for (const Node* item : read_list(node, "loads", "loads")) {
    if (scene_.loads.size() == kMaxLoads) {
      report_.error(item->origin, "there are more than " + std::to_string(kMaxLoads) +
                                      " loads, so the rest is not read; remove some");
      return;
    }
    read_load(*item);
  }
}

void SceneReader::read_load(const Node& node) {
  const std::string number = std::to_string(scene_.loads.size() + 1);
  const ItemOfReport item(report_);
  const Fields fields(report_, node, item_label("load", node, number), sections::kLoad);
  Load load;
  load.origin = node.origin;
  load.name = number;
  if (const Node* name = fields.find("name"))
    if (const auto text = read_name(report_, *name, fields.label() + ": name")) load.name = *text;
  load.axes = static_cast<Axes>(fields.read_word("axes").value_or(0));
  const Node* forces = fields.find("forces");
  const Node* wrenches = fields.find("wrenches");
  const Node* torques = fields.find("torques");
  if (torques) read_torques(fields, *torques, load);
  const Node* wheels = fields.find("wheels");
  if (wheels) read_wheel_torques(fields, *wheels, load);
  if (forces) read_forces(fields, *forces, load);
  if (wrenches) read_wrenches(fields, *wrenches, load);
  if (wrenches && load.axes == Axes::kLocal)
    report_.error(wrenches->origin,
                  fields.label() +
                      ": wrenches cannot have axes local, because a group has no single local rotation; "
                      "use axes body, or forces on its points");
  if (const Node* const axes = fields.find("axes"); axes && wheels && !forces && !wrenches && !torques)
    report_.error(axes->origin,
                  fields.label() + ": axes has no effect on wheels, which have axes of their own; remove it");
  if (fields.lacks_all({"forces", "wrenches", "torques", "wheels"}))
    report_.missing(node, "forces",
                    fields.label() + " has neither forces, wrenches, torques nor wheels; it must have one");
  load.history = read_history(fields);
  loads_.add(report_, load.name, load.origin);
  scene_.loads.push_back(std::move(load));
}

void SceneReader::read_forces(const Fields& fields, const Node& node, Load& load) {
  const std::string label = fields.label_of("forces");
  const Quantity& quantity = fields.key("forces").quantity;
  if (node.kind != Node::Kind::kMapping)
    return report_.error(node.origin, label + " is " + describe(node) +
                                          ", but must be a mapping of point names to [x, y, z] in " +
                                          std::string(quantity.unit));
  if (!report_.count_mentions(node.entries.size(), node.origin)) return;
  for (const auto& [name, value] : node.entries) {
    const ItemOfReport item(report_);
    PointLoad point;
    point.point = points_.resolve(report_, name->text, name->origin, label).value_or(-1);
    if (const auto force = read_vector(report_, *value, label + ": " + name->text, quantity.unit))
      point.force = *force;
    load.forces.push_back(point);
  }
}

void SceneReader::read_torques(const Fields& fields, const Node& node, Load& load) {
  const std::string label = fields.label_of("torques");
  const Quantity& quantity = fields.key("torques").quantity;
  if (node.kind != Node::Kind::kMapping)
    return report_.error(node.origin, label + " is " + describe(node) +
                                          ", but must be a mapping of names of bodies to [x, y, z] in " +
                                          std::string(quantity.unit));
  if (!report_.count_mentions(node.entries.size(), node.origin)) return;
  for (const auto& [name, value] : node.entries) {
    const ItemOfReport item(report_);
    TorqueLoad body;
    body.point = points_.resolve(report_, name->text, name->origin, label).value_or(-1);
    if (const auto torque = read_vector(report_, *value, label + ": " + name->text, quantity.unit))
      body.torque = *torque;
    load.torques.push_back(body);
  }
}

void SceneReader::read_wheel_torques(const Fields& fields, const Node& node, Load& load) {
  const std::string label = fields.label_of("wheels");
  const Quantity& quantity = fields.key("wheels").quantity;
  if (node.kind != Node::Kind::kMapping)
    return report_.error(node.origin, label + " is " + describe(node) +
                                          ", but must be a mapping of names of wheels to torques in " +
                                          std::string(quantity.unit));
  if (!report_.count_mentions(node.entries.size(), node.origin)) return;
  for (const auto& [name, value] : node.entries) {
    const ItemOfReport item(report_);
    WheelLoad wheel;
    wheel.wheel = wheels_.resolve(report_, name->text, name->origin, label).value_or(-1);
    if (const auto torque = read_number(report_, *value, label + ": " + name->text, quantity))
      wheel.torque = *torque;
    load.wheels.push_back(wheel);
  }
}

void SceneReader::read_wheel(const Node& node) {
  const std::string number = std::to_string(scene_.wheels.size() + 1);
  const ItemOfReport item(report_);
  const Fields fields(report_, node, item_label("wheel", node, number), sections::kWheel);
  if (fields.is_misspelt({"name"})) wheels_.mark_incomplete();
  Wheel wheel;
  wheel.origin = node.origin;
  wheel.name = number;
  if (const Node* name = fields.find("name"))
    if (const auto text = read_name(report_, *name, fields.label() + ": name")) wheel.name = *text;
  if (const Node* at = fields.require("at", "must be the name of a point with inertia"))
    wheel.point = points_.resolve(report_, *at, fields.label() + ": at").value_or(-1);
  if (const Node* axis = fields.require("axis", "must be a direction [x, y, z] in the axes of the scene")) {
    const auto direction = read_vector(report_, *axis, fields.label() + ": axis", "-");
    if (direction && !(direction->stableNorm() > 0.0))
      report_.error(axis->origin, fields.label() + ": axis is zero, but must be a direction");
    else if (direction)
      wheel.axis = direction->stableNormalized();
  }
  fields.read("momentum", wheel.momentum);
  wheels_.add(report_, wheel.name, wheel.origin);
  scene_.wheels.push_back(std::move(wheel));
}

void SceneReader::read_wrenches(const Fields& fields, const Node& node, Load& load) {
  const std::string label = fields.label_of("wrenches");
  if (node.kind != Node::Kind::kMapping)
    return report_.error(node.origin, label + " is " + describe(node) +
                                          ", but must be a mapping of group names to {force, torque}");
  if (!report_.count_mentions(node.entries.size(), node.origin)) return;
  for (const auto& [name, value] : node.entries) {
    const ItemOfReport item(report_);
    const Fields wrench_fields(report_, *value, label + ": " + name->text, sections::kWrench);
    WrenchLoad wrench;
    wrench.group = groups_.resolve(report_, name->text, name->origin, label).value_or(-1);
    wrench_fields.read("force", wrench.force);
    wrench_fields.read("torque", wrench.torque);
    if (wrench_fields.lacks_all({"force", "torque"}))
      report_.missing(*value, "force",
                      wrench_fields.label() + " has neither force nor torque; it must have one");
    load.wrenches.push_back(wrench);
  }
}

History SceneReader::read_history(const Fields& fields) {
  const Node* given = nullptr;
  for (const std::string_view kind : {"pulse", "sine", "table"}) {
    const Node* node = fields.find(kind);
    if (node && given)
      report_.error(node->origin, fields.label() +
                                      " has a second history, but may have only one of pulse, sine and "
                                      "table, or none for a constant load");
    if (node) given = node;
  }
  if (const Node* node = fields.find("pulse")) {
    const Fields pulse_fields(report_, *node, fields.label() + ": pulse", sections::kPulse);
    PulseHistory pulse;
    pulse_fields.read("start", pulse.start);
    pulse_fields.read("duration", pulse.duration);
    return pulse;
  }
  if (const Node* node = fields.find("sine")) {
    const Fields sine_fields(report_, *node, fields.label() + ": sine", sections::kSine);
    SineHistory sine;
    sine_fields.read("frequency", sine.frequency);
    sine_fields.read("phase", sine.phase);
    return sine;
  }
  const Node* node = fields.find("table");
  if (!node) return ConstantHistory{};
  const Fields table_fields(report_, *node, fields.label() + ": table", sections::kTable);
  const std::string& label = table_fields.label();
  const Node* times_node = table_fields.require("times", "must be a list of numbers [s]");
  const Node* values_node = table_fields.require("values", "must be a list of numbers");
  if (!times_node || !values_node) return ConstantHistory{};
  const auto times =
      read_numbers(report_, *times_node, label + ": times", table_fields.key("times").quantity, std::nullopt);
  const auto values = read_numbers(report_, *values_node, label + ": values",
                                   table_fields.key("values").quantity, std::nullopt);
  if (!times || !values) return ConstantHistory{};
  if (times->empty())
    report_.error(times_node->origin, label + ": times is empty, but a table must have at least one row");
  if (times->size() != values->size())
    report_.error(values_node->origin,
                  label + " has " + std::to_string(times->size()) + " times and " +
                      std::to_string(values->size()) + " values, but must have as many of each" +
                      (times->size() > values->size() ? comma_hint(*times_node, values->size())
                                                      : comma_hint(*values_node, times->size())));
  for (std::size_t i = 1; i < times->size(); ++i)
    if ((*times)[i] <= (*times)[i - 1])
      report_.error(times_node->items[i]->origin, label + ": the time " + format_number((*times)[i]) +
                                                      " s comes after " + format_number((*times)[i - 1]) +
                                                      " s, but times must increase");
  return TableHistory{*times, *values};
}

}  // namespace freeflex::io::reader
