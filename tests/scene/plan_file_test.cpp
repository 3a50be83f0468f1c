// These tests check plan files. A plan on disk is either complete or absent, and the plan that is read back
// equals the written plan.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <cstring>

#include "core/plan/file/plan_bytes.hpp"
#include "service/io/scene/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

const std::string kScene =
    "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 2, at: [1, 0, 0]}, {name: c, mass: 3, at: "
    "[0, 1, 0]}]\n"
    "links: {bar: [a, b, c, a], EA: 1e6}\n"
    "loads: {name: kick, forces: {a: [0, 1, 0]}, pulse: {duration: 0.1}}\n";

class PlanFile : public ::testing::Test {
 protected:
  PlanFile() {
    folder_.write("scene.yaml", kScene);
    io::PlanResult result = io::load_plan("scene.yaml");
    if (result.plan) plan_ = std::move(*result.plan);
  }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
  std::string bytes_of(const std::string& name) const {
    std::ifstream file(folder_.path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string refusal(const std::string& bytes) const {
    folder_.write("bad.plan", bytes);
    const io::PlanResult result = io::load_plan("bad.plan");
    EXPECT_FALSE(result.plan.has_value());
    if (result.faults.size() != 1) return "not one fault";
    return io::format_fault(result.faults[0], result.sources);
  }
  TemporaryFolder folder_;
  Plan plan_;
};

// The pulse of 0.1 s is a whole number of ticks of 1 ms, but not of ticks of 0.4 s (2.5 Hz).
TEST_F(PlanFile, WarningsAboutTicksApplyToTheRequestedRate) {
  const auto moved = [](double rate) {
    std::string messages;
    for (const Fault& fault : io::load_plan("scene.yaml", rate).faults) messages += fault.message + "\n";
    return messages.find("not a tick at 2.5 Hz") != std::string::npos;
  };
  EXPECT_FALSE(moved(0.0));
  EXPECT_TRUE(moved(2.5));
  folder_.write("scene.yaml", kScene + "rate: 2.5\n");
  EXPECT_TRUE(moved(0.0));
  EXPECT_FALSE(moved(1000.0));
}

TEST_F(PlanFile, ASavedPlanIsReadBackBitForBit) {
  ASSERT_EQ(plan_.points.size(), 3u);
  EXPECT_EQ(io::save_plan(plan_, "boom.plan"), "");
  const io::PlanResult result = io::load_plan("boom.plan");
  ASSERT_TRUE(result.plan.has_value());
  EXPECT_TRUE(result.faults.empty());
  EXPECT_EQ(result.sources, std::vector<std::string>{"boom.plan"});
  EXPECT_EQ(plan_to_bytes(*result.plan), plan_to_bytes(plan_));
  EXPECT_EQ(names(), (std::vector<std::string>{"boom.plan", "scene.yaml"})) << "no temporary file remains";
}

TEST_F(PlanFile, ASaveOverwritesThePlanAndObeysTheUmask) {
  folder_.write("boom.plan", "old");
  const mode_t before = ::umask(027);
  EXPECT_EQ(io::save_plan(plan_, "boom.plan"), "");
  ::umask(before);
  struct stat status {};
  ASSERT_EQ(::stat("boom.plan", &status), 0);
  EXPECT_EQ(status.st_mode & 0777, mode_t{0640});
  EXPECT_TRUE(bytes_of("boom.plan").starts_with(kPlanMark));
}

TEST_F(PlanFile, ATruncatedPlanIsRefused) {
  ASSERT_EQ(io::save_plan(plan_, "boom.plan"), "");
  const std::string bytes = bytes_of("boom.plan");
  for (std::size_t length = kPlanMark.size(); length < bytes.size(); length += length < 64 ? 1 : 97) {
    folder_.write("bad.plan", bytes.substr(0, length));
    const io::PlanResult result = io::load_plan("bad.plan");
    ASSERT_FALSE(result.plan.has_value()) << length << " bytes";
    ASSERT_EQ(result.faults.size(), 1u);
  }
  EXPECT_EQ(refusal(bytes.substr(0, bytes.size() - 1)),
            "bad.plan: error: the plan is cut off after " + std::to_string(bytes.size() - 29) + " of " +
                std::to_string(bytes.size() - 28) + " bytes; compile the scene again");
  EXPECT_EQ(refusal(bytes + "x"),
            "bad.plan: error: 1 byte follows the end of the plan; compile the scene again");
}

TEST_F(PlanFile, APlanWithAFlippedBitIsRefused) {
  ASSERT_EQ(io::save_plan(plan_, "boom.plan"), "");
  const std::string bytes = bytes_of("boom.plan");
  for (std::size_t at = 0; at < bytes.size(); at += at < 64 ? 1 : 61) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    folder_.write("bad.plan", damaged);
    ASSERT_FALSE(io::load_plan("bad.plan").plan.has_value()) << "byte " << at;
  }
  std::string damaged = bytes;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  EXPECT_EQ(
      refusal(damaged),
      "bad.plan: error: the plan is damaged, because its checksum does not match; compile the scene again");
}

TEST_F(PlanFile, AFileWithoutTheMagicNumberOfAPlanIsReadAsAScene) {
  EXPECT_EQ(
      refusal("FFPLA"),
      "bad.plan:1:1: error: scene is the text 'FFPLA', but must be a mapping of name, rate, fidelity, "
      "tolerance, integration, verdict, points, links, groups, damping, gravity, attractor, initial, wheels, "
      "loads, feedback, leave_out, modes, publish, commands\n    FFPLA\n    ^");
}

TEST_F(PlanFile, AMessageContainsThePathThatCannotBeWritten) {
  EXPECT_EQ(io::save_plan(plan_, "nowhere/boom.plan"),
            "cannot write 'nowhere/boom.plan': No such file or directory");
  std::filesystem::create_directory(folder_.path() / "taken");
  EXPECT_EQ(io::save_plan(plan_, "taken"), "cannot write 'taken': it is a directory");
  EXPECT_EQ(io::save_plan(plan_, "/dev/null"), "cannot write '/dev/null': it is not a regular file");
  EXPECT_EQ(io::save_plan(plan_, "scene.yaml/boom.plan"),
            "cannot write 'scene.yaml/boom.plan': Not a directory");
  EXPECT_EQ(names(), (std::vector<std::string>{"scene.yaml", "taken"}));
}

TEST_F(PlanFile, AnInterruptedSaveKeepsTheOldPlanAndLeavesNoOtherFile) {
  folder_.write("boom.plan", "old");
  for (const int most : {0, 1}) {  // the save is interrupted before the first byte, or after the last
    int asked = 0;
    const auto is_ended = [&] { return asked++ >= most; };
    EXPECT_EQ(io::save_plan(plan_, "boom.plan", is_ended),
              "cannot write 'boom.plan': interrupted; nothing was written");
    EXPECT_EQ(bytes_of("boom.plan"), "old");
    EXPECT_EQ(names(), (std::vector<std::string>{"boom.plan", "scene.yaml"}));
  }
}

TEST_F(PlanFile, OnAFullDiskTheOldPlanIsKeptAndNoOtherFileIsLeft) {
  folder_.write("boom.plan", "old");
  // because of a limit of 100 bytes on the size of files, the kernel refuses more bytes, as on a full disk
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &limit), 0);
  const rlimit small{100, limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string problem = io::save_plan(plan_, "boom.plan");
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::signal(SIGXFSZ, before);
  EXPECT_EQ(problem, "cannot write 'boom.plan': File too large");
  EXPECT_EQ(bytes_of("boom.plan"), "old");
  EXPECT_EQ(names(), (std::vector<std::string>{"boom.plan", "scene.yaml"}));
}

}  // namespace
}  // namespace freeflex::testing
