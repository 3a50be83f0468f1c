// Memory that runs out anywhere between the start of the program and the last byte of its plan.
#include <gtest/gtest.h>

#include "tests/support/large_scenes.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

// 3,042 points, 60 modes
TEST(MemoryThatRunsOut, IsSaidWhereverItDoesAndLeavesNothing) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer's address space is no measure of what it takes";
#endif
  const TemporaryFolder folder;
  write_two_layer_plate(folder.path(), 39, 60);
  int num_short = 0;
  bool is_done = false;
  for (int kilobytes = 76000; kilobytes < 800000 && !is_done; kilobytes += 4000) {
    const Outcome outcome = run("ulimit -v " + std::to_string(kilobytes) + "; cd " + folder.path() +
                                "; timeout 60 " + kFreeflex + " compile scene.yaml -o a.plan");
    is_done = outcome.exit_code == 0;
    if (is_done) break;
    // where the loader or an OpenBLAS as it is loaded finds none, nothing of ours has begun
    const bool is_loaded =
        !contains(outcome.err, "shared librar") && !contains(outcome.err, "pthread_create");
    if (!is_loaded) continue;
    ++num_short;
    EXPECT_EQ(outcome.exit_code, 2) << kilobytes << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "memory ran out") || contains(outcome.err, "takes some"))
        << kilobytes << outcome.err;
    EXPECT_EQ(run("ls " + folder.path()).out, "links.csv\npoints.csv\nscene.yaml\n") << kilobytes;
  }
  EXPECT_TRUE(is_done);
  EXPECT_GT(num_short, 20);
  std::printf("%d limits too small, each said\n", num_short);
}

}  // namespace
}  // namespace freeflex::testing
