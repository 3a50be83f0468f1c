// These tests check plans as bytes. The round trip is exact, and a damaged or hostile file is refused with an
// error text.
#include "core/plan/file/plan_bytes.hpp"

#include <span>

#include "core/plan/compile.hpp"
#include "core/step/readout.hpp"
#include "core/step/step.hpp"
#include "tests/setup/make_scene.hpp"
#include "tests/setup/plan_damage.hpp"
#include "tests/support/structures.hpp"

namespace freeflex::testing {
namespace {

// Returns a plan with many kinds of content. It is so small that a test can cut it at each of its bytes.
Plan rich_plan() {
  Scene scene = square_truss(2);
  scene.name = "rich";
  add_link(scene, 0, 1, Beam{1e5, 1e3, 1e3, 1e3, {1.0, 0.0, 0.0}});
  const int hung = add_point(scene, 0.5, {3.0, 3.0, 3.0});
  add_link(scene, 5, hung, Spring{10.0});
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

// Steps an accepted plan and reads its motion.
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

TEST(PlanBytes, AChangeOfOneFieldChangesTheFingerprint) {
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

TEST(PlanBytes, APlanCutAtAnyByteIsRefused) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  std::string error;
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    error.clear();
    EXPECT_FALSE(plan_from_bytes(std::span(bytes).first(size), error).has_value()) << size;
    EXPECT_FALSE(error.empty()) << size;
  }
}

TEST(PlanBytes, ContentCutAtAnyByteIsRefusedEvenWithAValidChecksum) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  std::string error;
  for (std::size_t size = kHeaderSize; size < bytes.size(); ++size) {
    std::vector<std::byte> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    seal(cut);
    EXPECT_FALSE(plan_from_bytes(cut, error).has_value()) << size;
  }
}

TEST(PlanBytes, PlansOfOtherVersionsAreRefusedWithARemedy) {
  std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  for (const int version : {5, 15, 17}) {
    bytes[8] = static_cast<std::byte>(version);
    std::string error;
    EXPECT_FALSE(plan_from_bytes(bytes, error).has_value()) << version;
    EXPECT_EQ(error, "the plan has version " + std::to_string(version) +
                         ", but this program reads version 16; compile the scene again");
  }
}

// Only the members that change the motion, its messages or their meaning are in the fingerprint.
TEST(PlanBytes, TheReportAndTheTablesForTheVerdictAreNotInTheFingerprint) {
  const Plan plan = rich_plan();
  Plan other = plan;
  other.features.clear();
  other.tolerance += 1.0;
  other.conditioning += 1.0;
  other.verdict = {};
  other.command_limits.max_age += 1.0;
  EXPECT_NE(plan_to_bytes(other), plan_to_bytes(plan));
  EXPECT_EQ(plan_fingerprint(other), plan_fingerprint(plan));
}

TEST(PlanBytes, AWrongMagicNumberVersionLengthOrChecksumIsReported) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  const auto error_of = [](const std::vector<std::byte>& damaged) {
    std::string error;
    EXPECT_FALSE(plan_from_bytes(damaged, error).has_value());
    return error;
  };
  std::vector<std::byte> damaged = bytes;
  damaged[0] = std::byte{'X'};
  EXPECT_NE(error_of(damaged).find("the file is not a plan"), std::string::npos);
  damaged = bytes;
  damaged[8] = std::byte{77};
  EXPECT_NE(error_of(damaged).find("version 77"), std::string::npos);
  damaged = bytes;
  damaged.push_back(std::byte{0});
  EXPECT_NE(error_of(damaged).find("1 byte follows the end of the plan"), std::string::npos);
  seal(damaged);
  EXPECT_NE(error_of(damaged).find("the plan is inconsistent, because 1 byte belongs to no field"),
            std::string::npos);
  damaged = bytes;
  damaged.back() ^= std::byte{1};
  EXPECT_NE(error_of(damaged).find("checksum"), std::string::npos);
}

TEST(PlanBytes, APlanWithAFlippedBitIsRefused) {
  const std::vector<std::byte> bytes = plan_to_bytes(rich_plan());
  std::mt19937_64 engine(1);
  std::string error;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<std::byte> damaged = bytes;
    damaged[engine() % damaged.size()] ^= static_cast<std::byte>(1U << (engine() % 8));
    EXPECT_FALSE(plan_from_bytes(damaged, error).has_value());
  }
}

// In rich_plan a point on a single spring gives mechanisms. The first modes have frequency zero, one for each
// reported mechanism.
TEST(PlanBytes, AModeOfFrequencyZeroThatIsNotAMechanismIsRefused) {
  const Plan plan = rich_plan();
  const std::size_t num = plan.mechanisms.size();
  ASSERT_GT(num, 0U);
  EXPECT_EQ(find_inconsistency(plan), "");
  Plan no_mechanism = plan, fewer = plan, more = plan, later = plan;
  no_mechanism.mechanisms.clear();
  fewer.mechanisms.pop_back();
  more.mechanisms.push_back({0});
  std::swap(later.omega[0], later.omega[num]);
  for (const Plan* bad : {&no_mechanism, &fewer, &more})
    EXPECT_EQ(find_inconsistency(*bad),
              "the number of mechanisms is not the number of modes of frequency zero");
  EXPECT_EQ(find_inconsistency(later), "a mode of frequency zero comes after a mode of another frequency");
}

// A changed plan with a valid checksum is refused with a text, or harmless to run. Sanitizers report reads
// out of bounds.
TEST(PlanBytes, MutationsWithAValidChecksumAreRefusedOrHarmless) {
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
        case 1: {  // sets a count or an index to -1
          std::memset(damaged.data() + at, 0xff, 4);
          break;
        }
        case 2: {  // sets a count to a large value
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
