// The set-up of a large scene fails with a message and leaves no file if memory runs out or the disk is full.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/large_scenes.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

constexpr const char* kFiles = "links.csv\npoints.csv\nscene.yaml\n";

// a program with a sanitizer needs far more address space than these limits allow
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsLimitable = false;
#else
constexpr bool kIsLimitable = true;
#endif

class LargeSetup : public ::testing::Test {
 protected:
  void make(int side, int count = 60) { write_two_layer_plate(folder_.path(), side, count); }
  std::string left() const { return run("ls " + folder_.path()).out; }
  Outcome compile_within(int kilobytes) const {
    return run("ulimit -v " + std::to_string(kilobytes) + "; cd " + folder_.path() + "; timeout 60 " +
               kFreeflex + " compile scene.yaml -o a.plan");
  }
  TemporaryFolder folder_;
};

// 180 MB is enough for the program but not for the buffer of OpenBLAS, and OpenBLAS alone would try for ever
// to allocate this buffer
TEST_F(LargeSetup, ReportsThatMemoryRanOutAndStatesTheRemedy) {
  if (!kIsLimitable) GTEST_SKIP() << "a sanitizer";
  make(25);
  for (const int megabytes : {85, 120, 180}) {
    const Outcome outcome = compile_within(1000 * megabytes);
    EXPECT_EQ(outcome.exit_code, 2) << megabytes << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "memory ran out")) << megabytes << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "or allow more memory (ulimit -v)")) << megabytes << outcome.err;
    EXPECT_EQ(left(), kFiles) << megabytes;
  }
}

TEST_F(LargeSetup, IsRefusedBeforehandIfTheMemoryLimitIsTooLow) {
  if (!kIsLimitable) GTEST_SKIP() << "a sanitizer";
  make(60, 2000);
  const Outcome outcome = compile_within(700000);
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "the machine or a limit (ulimit -v) provides")) << outcome.err;
  EXPECT_TRUE(contains(outcome.err, "ask for fewer modes with modes: {count: N}")) << outcome.err;
  EXPECT_EQ(left(), kFiles);
}

TEST_F(LargeSetup, LeavesNoFileOnAFullDisk) {
  const std::string mounted = "unshare -rm sh -c 'mount -t tmpfs -o size=8k none " + folder_.path() + " && ";
  if (run(mounted + "true'").exit_code != 0) GTEST_SKIP() << "the kernel refuses a private mount";
  const Outcome outcome = run(mounted + kFreeflex + " compile " + kScenes + "boom.yaml -o " +
                              folder_ / "a.plan" + "; echo $?; ls " + folder_.path() + "'");
  EXPECT_EQ(outcome.out, "1\n");
  EXPECT_TRUE(contains(outcome.err, "a.plan': No space left on device")) << outcome.err;
}

}  // namespace
}  // namespace freeflex::testing
