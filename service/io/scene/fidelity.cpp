// Reads the rung of the fidelity ladder, and how the motion is judged.
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

void SceneReader::read_integration(const Node& node) {
  const Fields fields(report_, node, "integration", sections::kIntegration);
  if (!fields.is_mapping()) return;
  Integration& integration = scene_.integration;
  integration.origin = node.origin;
  if (const auto word = fields.read_word("by")) integration.by = static_cast<IntegrateBy>(*word);
  fields.read("accuracy", integration.accuracy);
  const Node* const accuracy = fields.find("accuracy");
  if (accuracy != nullptr && integration.by == IntegrateBy::kModes)
    report_.error(
        accuracy->origin,
        "integration: accuracy has no effect with by: modes, whose accuracy the rate sets; remove it");
  if (!scene_.automatic && !traits_of(scene_.fidelity).has_true_geometry)
    report_.error(node.origin, std::string("integration has no effect on the rung ") +
                                   name_of(scene_.fidelity) +
                                   "; set fidelity: corotational, full or auto, or remove it");
}

void SceneReader::read_verdict(const Node& node) {
  scene_.verdict.origin = node.origin;
  scene_.verdict.is_off = node.kind == Node::Kind::kText && node.text == "off";
  if (scene_.verdict.is_off) return;
  if (node.kind != Node::Kind::kMapping) {
    report_.error(node.origin, "verdict is " + describe(node) +
                                   ", but must be off or a mapping of horizon, step, share; leave it out to "
                                   "judge the motion with the defaults");
    return;
  }
  const Fields fields(report_, node, "verdict", sections::kVerdict);
  fields.read("horizon", scene_.verdict.horizon);
  fields.read("share", scene_.verdict.share);
  fields.read("step", scene_.verdict.step);
}

}  // namespace freeflex::io::reader
