// Whatever bytes a scene, table or matrix contains, the reader does not crash, and every scene that it
// accepts is consistent.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "service/io/scene/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

const std::string kYaml = R"(name: target
rate: 1000   # Hz
points:
  - &p {name: a, mass: 10, at: [0, 0, 0]}
  - {<<: *p, name: "b", at: [1, 0, 0]}
  - name: 'c'
    mass: 1e0
    at:
      - 0
      - 1.5
      - -2
  - {csv: points.csv}
links:
  - {name: l, spring: [a..c], stiffness: 1e5}
  - {name: m, matrix: K.mtx, points: [a, b]}
  - {beam: [a, b], EA: 1, GJ: 1, EIy: 1, EIz: 1, GAy: 2, release: {from: [x, y], to: z}, loss_factor: .1}
  - {torsion: [a..e], stiffness: 3, viscous: 1e-3}
  - {plate: [a, b, c], E: 7e10, nu: 0.3, thickness: 0.01}
  - {rigid: [c..e]}
  - {dashpot: [a, c], damping: 5}
groups: {g: [a, b], h: all}
damping: {ratio: 0.01, modes: {1: 0.02}}
loads:
  - {forces: {a: [0, 0, 1]}, wrenches: {g: {torque: [0, 0, 1]}}, table: {times: [0, 1], values: [1, 0]}}
feedback: {name: f, at: a, from: b, velocity: [1, 2, 3], displacement: [[1, 0, 0], [0, 2, 0], [0, 0, 3]]}
attractor: {at: [7e6, 0, 0], mu: 3.986e14}
fidelity: spin-loaded
publish: {state: 50, points: {rate: 50, of: [a, d]}}
)";
const std::string kCsv = "name,mass,x,y,z\r\nd,1,2,3,4\n# note\ne, 2.5 ,-1,0,7\n";
const std::string kMatrix =
    "%%MatrixMarket matrix coordinate real symmetric\n% N/m\n6 6 3\n1 1 5\n4 1 -5\n4 4 5\n";

// makes one or two changes. Each change flips a bit, sets a byte, inserts a token, or cuts or repeats a piece
std::string mutate(std::string text, std::mt19937_64& engine) {
  static const std::vector<std::string> kTokens{"[",
                                                "]",
                                                "{",
                                                "}",
                                                ": ",
                                                "- ",
                                                "&a ",
                                                "*a",
                                                "<<: ",
                                                "\"",
                                                "'",
                                                "\n",
                                                "\t",
                                                "#",
                                                "|",
                                                ">",
                                                "%",
                                                "---\n",
                                                "...\n",
                                                "? ",
                                                "!!x ",
                                                "\\",
                                                "\xff",
                                                std::string(1, '\0'),
                                                "\xc3\xa9",
                                                ",",
                                                "..",
                                                "1e400",
                                                "-",
                                                "\r",
                                                "@",
                                                "`",
                                                "\xef\xbb\xbf",
                                                "\xe2\x80\xa8",
                                                "\"\\x",
                                                "\"\\u12"};
  const auto pick = [&](std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(engine);
  };
  for (std::size_t changes = 1 + pick(2); changes > 0 && !text.empty(); --changes) {
    const std::size_t at = pick(text.size()), length = 1 + pick(12);
    switch (pick(5)) {
      case 0:
        text[at] = static_cast<char>(text[at] ^ (1 << pick(8)));
        break;
      case 1:
        text[at] = static_cast<char>(pick(256));
        break;
      case 2:
        text.insert(at, kTokens[pick(kTokens.size())]);
        break;
      case 3:
        text.erase(at, length);
        break;
      default:
        text.insert(pick(text.size() + 1), text.substr(at, 4 * length));
        break;
    }
  }
  return text;
}

void expect_sound(const io::SceneResult& result) {
  bool has_fault = false;
  for (const Fault& fault : result.faults) {
    has_fault = has_fault || fault.severity == Fault::Severity::kError;
    EXPECT_FALSE(fault.message.empty());
    ASSERT_LT(fault.origin.source, static_cast<int>(result.sources.size()));
    ASSERT_FALSE(io::format_fault(fault, result.sources).empty());
  }
  ASSERT_NE(result.scene.has_value(), has_fault);
  if (!result.scene) return;
  const Scene& scene = *result.scene;
  const auto is_point = [&](int index) {
    return index >= 0 && index < static_cast<int>(scene.points.size());
  };
  for (const PointMass& point : scene.points) ASSERT_TRUE(point.mass > 0.0 && point.position.allFinite());
  for (const Link& link : scene.links) {
    ASSERT_GE(link.points.size(), 2u);
    for (const int point : link.points) ASSERT_TRUE(is_point(point));
    ASSERT_TRUE(std::isfinite(link.viscous) && link.viscous >= 0.0);
    ASSERT_TRUE(std::isfinite(link.loss_factor) && link.loss_factor >= 0.0);
  }
  for (const Feedback& feedback : scene.feedbacks) {
    ASSERT_TRUE(is_point(feedback.point) && is_point(feedback.sensor));
    ASSERT_TRUE(feedback.displacement_gain.allFinite() && feedback.velocity_gain.allFinite() &&
                feedback.acceleration_gain.allFinite());
  }
  for (const Load& load : scene.loads)
    for (const PointLoad& force : load.forces) ASSERT_TRUE(is_point(force.point));
  for (const Group& group : scene.groups)
    for (const int point : group.points) ASSERT_TRUE(is_point(point));
}

TEST(HostileScene, MutationsAreReadOrRefused) {
  const TemporaryFolder folder;
  std::mt19937_64 engine(20240601);
  int num_read = 0;
  constexpr int kRounds = 4000;
  for (int round = 0; round < kRounds; ++round) {
    const int target = round % 4;  // the scene is changed twice as often as each of the two tables
    folder.write("scene.yaml", target < 2 ? mutate(kYaml, engine) : kYaml);
    folder.write("points.csv", target == 2 ? mutate(kCsv, engine) : kCsv);
    folder.write("K.mtx", target == 3 ? mutate(kMatrix, engine) : kMatrix);
    const io::SceneResult result = io::read_scene("scene.yaml");
    num_read += result.scene.has_value();
    expect_sound(result);
    if (HasFatalFailure()) FAIL() << "round " << round;
  }
  // the test is meaningful only if both outcomes occur
  EXPECT_GT(num_read, kRounds / 50);
  EXPECT_LT(num_read, kRounds / 2);
}

TEST(HostileScene, EveryTruncationIsReadOrRefused) {
  const TemporaryFolder folder;
  folder.write("points.csv", kCsv);
  folder.write("K.mtx", kMatrix);
  for (std::size_t length = 0; length <= kYaml.size(); ++length) {
    folder.write("scene.yaml", kYaml.substr(0, length));
    expect_sound(io::read_scene("scene.yaml"));
    if (HasFatalFailure()) FAIL() << "length " << length;
  }
  EXPECT_TRUE(io::read_scene("scene.yaml").scene.has_value()) << "the unchanged scene is valid";
}

}  // namespace
}  // namespace freeflex::testing
