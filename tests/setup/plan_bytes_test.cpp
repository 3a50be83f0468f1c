// Plans as bytes: exact round trip, and no damaged or hostile file gets further than an error text.
#include "core/plan/plan_bytes.hpp"

#include <fstream>
#include <iterator>
#include <span>

#include "core/plan/compile.hpp"
#include "core/step/readout.hpp"
#include "core/step/step.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/setup/plan_damage.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

// every kind of content, small enough to try each of its bytes
Plan rich_plan() {
  Scene scene = square_truss(2);
  scene.name = "rich";
  add_link(scene, 0, 1, Beam{1e5, 1e3, 1e3, 1e3, {1.0, 0.0, 0.0}});
  const int loose = add_point(scene, 0.5, {3.0, 3.0, 3.0});
  add_link(scene, 5, loose, Spring{10.0});
  scene.pushable = {0, 7};
  scene.publication.points = {1};
  scene.publication.links = {0, static_cast<int>(scene.links.size()) - 2};
  scene.groups.push_back({"end", {4, 5, 6, 7}, {}});
  scene.publication.groups = {0};
  add_corner_pulse(scene);
  Load load;
  load.name = "table";
  load.axes = Axes::kBody;
  load.wrenches.push_back({0, {1.0, 0.0, 0.0}, {0.0, 2.0, 0.0}});
  load.history = TableHistory{{0.0, 1.0, 2.5}, {0.0, 1.0, -1.0}};
  scene.loads.push_back(load);
  load.axes = Axes::kWorld;
  load.history = SineHistory{3.0, 0.1};
  scene.loads.push_back(load);
  scene.initial.modes.push_back({4, 1e-3, 0.0});
  Plan plan = compile(scene);
  plan.command_limits = {.max_age = 0.5, .sender_share = 0.125, .max_hold = 1234.5};
  return plan;
}

// a plan that was accepted can be run and read
void exercise(const Plan& plan) {
  State state = make_state(plan);
  Workspace workspace = make_workspace(plan);
  StepReport report;
  for (int tick = 0; tick < 3; ++tick) step(plan, state, {}, workspace, report);
  for (const std::int32_t point : plan.published_points) read_point(plan, state, point);
  for (const std::int32_t group : plan.published_groups) read_group(plan, state, group);
  std::array<double, 12> forces{};
  for (std::size_t output = 0; output < plan.link_outputs.size(); ++output)
    read_link(plan, state, static_cast<int>(output),
              std::span(forces).first(static_cast<std::size_t>(plan.link_outputs[output].num_rows)));
  read_invariants(plan, state);
}

TEST(PlanBytes, RoundTripIsExactToTheBit) {
  const Plan plan = rich_plan();
  const std::vector<std::byte> bytes = plan_to_bytes(plan);
  std::string error;
  const auto back = plan_from_bytes(bytes, error);
  ASSERT_TRUE(back.has_value()) << error;
  EXPECT_EQ(plan_to_bytes(*back), bytes);
  EXPECT_EQ(plan_fingerprint(*back), plan_fingerprint(plan));
  EXPECT_EQ(back->name, "rich");
  EXPECT_EQ(back->points[3].name, plan.points[3].name);
  EXPECT_EQ(back->omega, plan.omega);
  EXPECT_EQ(back->mechanisms, plan.mechanisms);
  EXPECT_EQ(back->command_limits, plan.command_limits);
  EXPECT_EQ(back->histories[1].values, plan.histories[1].values);
  EXPECT_EQ(back->histories[1].pattern.Q_B, plan.histories[1].pattern.Q_B);
}

TEST(PlanBytes, FingerprintChangesWithEveryKindOfContent) {
  const Plan plan = rich_plan();
  const std::uint64_t before = plan_fingerprint(plan);
  for (int field = 0; field < 6; ++field) {
    Plan other = plan;
    if (field == 0) other.omega[3] = std::nextafter(other.omega[3], 1e9);
    if (field == 1) other.name += "x";
    if (field == 2) other.points[2].pushable = true;
    if (field == 3) other.histories[0].end_tick += 1;
    if (field == 4) other.propagator.lanes[0].l_qv[1] = -other.propagator.lanes[0].l_qv[1] + 1e-300;
    if (field == 5) other.published_points.clear();
    EXPECT_NE(plan_fingerprint(other), before) << field;
  }
}

TEST(PlanBytes, TruncationAtEveryByteIsRefused) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  std::string error;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    error.clear();
    EXPECT_FALSE(plan_from_bytes(std::span(bytes).first(size), error).has_value()) << size;
    EXPECT_FALSE(error.empty()) << size;
  }
}

TEST(PlanBytes, ContentCutAtEveryByteAndSealedAgainIsRefused) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  std::string error;
  for (std::size_t size = kHeaderSize; size < bytes.size(); ++size) {
    std::vector<std::byte> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    seal(cut);
    EXPECT_FALSE(plan_from_bytes(cut, error).has_value()) << size;
  }
}

// Two files of older programs: version 5 has no tables that judge, version 7 has no names and no longest
// hold.
TEST(PlanBytes, PlansOfOlderVersionsAreTaken) {
  for (const auto& [name, version] : {std::pair{"every_feature", 5}, {"bodies", 7}}) {
    std::ifstream file(std::string(FREEFLEX_SOURCE_DIR) + "/tests/bits/" + name + ".plan", std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    ASSERT_GT(text.size(), 8U) << name;
    EXPECT_EQ(static_cast<int>(text[8]), version) << name;
    std::string error;
    const auto plan = plan_from_bytes(std::as_bytes(std::span(text)), error);
    ASSERT_TRUE(plan) << name << ": " << error;
    EXPECT_EQ(plan->neglect.is_known, version > 5) << name;
    EXPECT_TRUE(plan->neglect.named.links.empty()) << name;
    EXPECT_EQ(plan->command_limits.max_hold, CommandLimits{}.max_hold) << name;
  }
}

TEST(PlanBytes, WrongMarkVersionLengthAndChecksumAreNamed) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  const auto error_of = [](const std::vector<std::byte>& damaged) {
    std::string error;
    EXPECT_FALSE(plan_from_bytes(damaged, error).has_value());
    return error;
  };
  std::vector<std::byte> damaged = bytes;
  damaged[0] = std::byte{'X'};
  EXPECT_NE(error_of(damaged).find("not a plan"), std::string::npos);
  damaged = bytes;
  damaged[8] = std::byte{77};
  EXPECT_NE(error_of(damaged).find("version 77"), std::string::npos);
  damaged = bytes;
  damaged.push_back(std::byte{0});
  EXPECT_NE(error_of(damaged).find("trailing bytes"), std::string::npos);
  seal(damaged);
  EXPECT_NE(error_of(damaged).find("belong to no field"), std::string::npos);
  damaged = bytes;
  damaged.back() ^= std::byte{1};
  EXPECT_NE(error_of(damaged).find("checksum"), std::string::npos);
}

TEST(PlanBytes, AnyFlippedBitIsFoundByTheChecksum) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  std::mt19937_64 engine(1);
  std::string error;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<std::byte> damaged = bytes;
    damaged[engine() % damaged.size()] ^= static_cast<std::byte>(1U << (engine() % 8));
    EXPECT_FALSE(plan_from_bytes(damaged, error).has_value());
  }
}

// rich_plan's loose point leaves mechanisms: modes of frequency zero, the first ones, one for each that is
// named
TEST(PlanBytes, AModeOfFrequencyZeroThatIsNoMechanismIsRefused) {
  const Plan plan = rich_plan();
  const std::size_t num = plan.mechanisms.size();
  ASSERT_GT(num, 0U);
  EXPECT_EQ(find_inconsistency(plan), "");
  Plan none = plan, fewer = plan, more = plan, later = plan;
  none.mechanisms.clear();
  fewer.mechanisms.pop_back();
  more.mechanisms.push_back({0});
  std::swap(later.omega[0], later.omega[num]);
  for (const Plan* bad : {&none, &fewer, &more})
    EXPECT_EQ(find_inconsistency(*bad), "there are not as many mechanisms as modes of frequency zero");
  EXPECT_EQ(find_inconsistency(later), "a mode of frequency zero does not come before the others");
}

// Mutations whose checksum agrees: refused with a text, or harmless to run. Sanitizers watch the reads.
TEST(PlanBytes, SealedMutationsAreRefusedOrHarmless) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  std::mt19937_64 engine(2);
  int num_refused = 0, num_taken = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    std::vector<std::byte> damaged = bytes;
    const std::uint64_t num_changes = 1 + engine() % 3;
    for (std::uint64_t change = 0; change < num_changes; ++change) {
      const std::size_t at = kHeaderSize + engine() % (damaged.size() - kHeaderSize - 8);
      switch (engine() % 4) {
        case 0:
          damaged[at] = static_cast<std::byte>(engine());
          break;
        case 1: {  // a count or an index of -1
          std::memset(damaged.data() + at, 0xff, 4);
          break;
        }
        case 2: {  // a large count
          const std::uint64_t count = 1ULL << (engine() % 64);
          std::memcpy(damaged.data() + at, &count, 8);
          break;
        }
        default:
          damaged.erase(damaged.begin() + static_cast<std::ptrdiff_t>(at));
      }
    }
    seal(damaged);
    std::string error;
    const auto plan = plan_from_bytes(damaged, error);
    if (plan) {
      ++num_taken;
      exercise(*plan);
    } else {
      ++num_refused;
      EXPECT_FALSE(error.empty());
    }
  }
  EXPECT_GT(num_refused, 200);
  EXPECT_GT(num_taken, 20);
}

}  // namespace
}  // namespace freeflex::testing
