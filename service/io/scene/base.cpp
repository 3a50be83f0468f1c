// Reads scenes that consist of another scene, their base, and of values that are set in it.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

constexpr int kMaxBases = 8;  // longest chain of bases

bool has_base(const Node& root) {
  return root.kind == Node::Kind::kMapping &&
         std::any_of(root.entries.begin(), root.entries.end(),
                     [](const auto& entry) { return entry.first->text == "base"; });
}

}  // namespace

std::string flow_text(const Node& node) {
  std::string text;
  const auto add = [&](std::string_view separator, const std::string& item) {
    if (!text.empty()) text += separator;
    text += item;
  };
  switch (node.kind) {
    case Node::Kind::kEmpty:
      return {};
    case Node::Kind::kText:
      return node.is_quoted ? nlohmann::json(node.text).dump() : node.text;
    case Node::Kind::kList:
      for (const Node* item : node.items) add(", ", flow_text(*item));
      return "[" + text + "]";
    case Node::Kind::kMapping:
      for (const auto& [key, value] : node.entries) add(", ", flow_text(*key) + ": " + flow_text(*value));
      return "{" + text + "}";
  }
  return {};
}

Settings read_settings(Report& report, const Node& node, const std::string& label, const std::string& file) {
  Settings settings;
  // a list of mappings keeps an order, and may set one path twice
  const bool is_list = node.kind == Node::Kind::kList;
  for (const Node* each : is_list ? node.items : std::vector<const Node*>{&node}) {
    if (each->kind != Node::Kind::kMapping) {
      report.error(each->origin,
                   label + " is " + describe(*each) +
                       ", but must be a mapping of paths to values, as in {points.hub.mass: 41}, or "
                       "a list of such mappings");
      continue;
    }
    for (const auto& [path, value] : each->entries) {
      const std::string text = flow_text(*value);
      std::string place = file + ": " + path->text;
      place += "=" + text;
      settings.push_back({path->text, text, std::move(place)});
    }
  }
  return settings;
}

const Node* SceneReader::read_bases(const Node* root) {
  for (int depth = 1; root != nullptr && has_base(*root); ++depth) {
    const Fields fields(report_, *root, "scene", sections::kBasedScene);
    if (depth > kMaxBases) {
      report_.error(root->origin, "a scene may have at most " + std::to_string(kMaxBases) +
                                      " bases, each the base of the next; does a base name itself?");
      return nullptr;
    }
    if (const Node* name = fields.find("name"))
      if (const auto text = read_name(report_, *name, "scene: name"); text && given_name_.empty())
        given_name_ = *text;
    const std::string& file = report_.sources()[static_cast<std::size_t>(root->origin.source)];
    if (const Node* set = fields.find("set")) {
      Settings values = read_settings(report_, *set, "scene: set", file);
      settings_of_all_.insert(settings_of_all_.begin(), values.begin(), values.end());
    }
    const Node& base = *fields.find("base");
    const auto path = read_text(report_, base, "scene: base");
    const auto source = path ? open_beside(base, "scene: base") : std::nullopt;
    if (!source) return nullptr;
    folder_ = (std::filesystem::path(folder_) / *path).parent_path().string();
    root = tree_.parse(report_, *source);
  }
  return root;
}

}  // namespace freeflex::io::reader
