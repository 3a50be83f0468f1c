// Which rung of the fidelity ladder a scene takes, and the budget of its errors.
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {
namespace {

constexpr Quantity kHorizon{"s", Bound::kPositive};

std::vector<std::string_view> rung_names() {
  std::vector<std::string_view> names;
  names.reserve(kRungs.size() + 1);
  for (const RungTraits& rung : kRungs) names.emplace_back(rung.name);
  names.emplace_back("auto");
  return names;
}

}  // namespace

void SceneReader::read_fidelity(const Node* fidelity, const Node* tolerance) {
  std::optional<std::size_t> word;
  if (fidelity) word = read_word(report_, *fidelity, "scene: fidelity", rung_names());
  const bool is_auto = word && *word + 1 == rung_names().size();
  if (word && !is_auto) scene_.fidelity = kRungs[*word].rung;
  if (is_auto && !tolerance)
    report_.error(
        fidelity->origin,
        "scene: fidelity is auto without a tolerance; add tolerance: {position: [m], attitude: [rad], "
        "elastic: share, horizon: [s]}, with at least one of the first three");
  if (!tolerance) return;
  const Fields fields(report_, *tolerance, "tolerance",
                      {"displacement", "position", "attitude", "elastic", "horizon"});
  if (!fields.is_mapping()) return;
  if (fields.find("displacement") != nullptr)
    fields.read("displacement", {"m", Bound::kPositive}, scene_.tolerance);
  if ((!fidelity || word) && !is_auto) {
    for (const char* key : {"position", "attitude", "elastic", "horizon"})
      if (const Node* node = fields.find(key))
        report_.error(node->origin, std::string("tolerance: ") + key +
                                        " has no effect but with fidelity: auto; add that or leave it out");
    return;
  }
  AutomaticRung& automatic = scene_.automatic.emplace();
  automatic.origin = tolerance->origin;
  const auto read = [&](const char* key, const char* unit, std::optional<double>& value) {
    if (fields.find(key) == nullptr) return;
    double number = 0.0;
    fields.read(key, {unit, Bound::kPositive}, number);
    value = number;
  };
  read("position", "m", automatic.position);
  read("attitude", "rad", automatic.attitude);
  read("elastic", "-", automatic.elastic);
  fields.require("horizon", kHorizon, automatic.horizon);
  if (!automatic.position && !automatic.attitude && !automatic.elastic)
    report_.error(tolerance->origin,
                  "tolerance: none is stated; give position [m], attitude [rad] or elastic (share)");
}

void SceneReader::read_error_budget(const Node& node) {
  const Fields fields(report_, node, "error_budget", {"horizon"}, {}, "horizon");
  scene_.error_budget.origin = node.origin;
  if (fields.is_mapping()) fields.require("horizon", kHorizon, scene_.error_budget.horizon);
}

}  // namespace freeflex::io::reader
