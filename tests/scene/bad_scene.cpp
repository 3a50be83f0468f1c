#include "tests/scene/bad_scene.hpp"

#include "service/io/scene/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {

void expect_refused(const BadScene& scene) {
  const TemporaryFolder folder;
  for (const auto& [name, bytes] : scene.files) folder.write(name, bytes);
  const io::PlanResult result = io::load_plan("scene.yaml");
  EXPECT_FALSE(result.plan.has_value());
  std::vector<std::string> messages;
  for (const Fault& fault : result.faults) messages.push_back(io::format_fault(fault, result.sources, false));
  EXPECT_EQ(messages, scene.messages);
}

}  // namespace freeflex::testing
