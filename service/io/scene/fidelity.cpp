// Reads the rung of the fidelity ladder and the error budget.
#include "service/io/scene/reader.hpp"

namespace freeflex::io::reader {

void SceneReader::read_fidelity(const Fields& scene) {
  const Node *fidelity = scene.find("fidelity"), *tolerance = scene.find("tolerance");
  const bool is_former = fidelity != nullptr && fidelity->text == "exact-bars";
  if (is_former)
    report_.error(
        fidelity->origin,
        "scene: fidelity: exact-bars has become corotational, which also has beams, plates, angle springs "
        "and rigid bodies at true geometry; write fidelity: corotational");
  const std::optional<std::size_t> word = is_former ? std::nullopt : scene.read_word("fidelity");
  const bool is_auto = word && *word == kRungs.size();
  if (word && !is_auto) scene_.fidelity = kRungs[*word].rung;
  if (is_auto && !tolerance)
    report_.error(
        fidelity->origin,
        "scene: fidelity is auto without a tolerance; add tolerance: {position: [m], attitude: [rad], "
        "elastic: fraction, horizon: [s]}, with at least one of the first three");
  if (!tolerance) return;
  const Fields fields(report_, *tolerance, "tolerance", sections::kTolerance);
  if (!fields.is_mapping()) return;
  fields.read("displacement", scene_.tolerance);
  if (fidelity && !word) return;  // which keys are allowed is not known
  if (!is_auto) {
    for (const char* key : {"position", "attitude", "elastic", "horizon"})
      if (const Node* node = fields.find(key))
        report_.error(node->origin,
                      std::string("tolerance: ") + key +
                          " has no effect without fidelity: auto; set that, or remove this key");
    return;
  }
  AutomaticRung& automatic = scene_.automatic.emplace();
  automatic.origin = tolerance->origin;
  const auto read = [&](const char* key, std::optional<double>& value) {
    if (fields.find(key) == nullptr) return;
    double number = 0.0;
    fields.read(key, number);
    value = number;
  };
  read("position", automatic.position);
  read("attitude", automatic.attitude);
  read("elastic", automatic.elastic);
  fields.require("horizon", automatic.horizon);
  if (fields.lacks_all({"position", "attitude", "elastic"}))
    report_.error(tolerance->origin,
                  "tolerance: no error is given; give position [m], attitude [rad] or elastic (fraction)");
}

void SceneReader::read_error_budget(const Node& node) {
  const Fields fields(report_, node, "error_budget", sections::kErrorBudget);
  scene_.error_budget.origin = node.origin;
  fields.read("horizon", scene_.error_budget.horizon);
}

}  // namespace freeflex::io::reader
