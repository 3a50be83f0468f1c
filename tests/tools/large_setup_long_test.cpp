// These tests run the set-up of a large scene under signals, and under memory limits. Each limit is reached
// at another point between the start of the program and the last byte of the plan.
#include <gtest/gtest.h>

#include "tests/support/large_scenes.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

constexpr const char* kFiles = "links.csv\npoints.csv\nscene.yaml\n";

// 20,000 points, whose factorization alone takes seconds
TEST(LargeSetupLong, EndsWithinASecondAfterOneOrTwoSignals) {
  const TemporaryFolder folder;
  write_two_layer_plate(folder.path(), 100, 60);
  const std::string script = R"(cd $folder
for c in "$cli plan" "$cli check" "$cli run --until 1 --out a.csv" "$cli compile -o a.plan" "$daemon"; do
  $c scene.yaml & pids="$pids $!"
done
sleep 1.5
begin=$(date +%s%N)
kill -$signal $pids; eval "$again"
for p in $pids; do wait $p; echo $?; done
end=$(date +%s%N)
[ $(((end - begin) / 1000000)) -lt 1000 ] && echo in time || echo $(((end - begin) / 1000000)) ms)";
  const TemporaryFolder beside;
  write_text(beside / "script", script);
  for (const char* how : {"signal=INT again=", "signal=TERM again=", "signal=INT again='kill -INT $pids'"}) {
    const Outcome outcome = run("folder=" + folder.path() + " cli=" + kFreeflex + " daemon=" + kFreeflexd +
                                "; " + how + "; . " + beside / "script");
    EXPECT_EQ(outcome.out, "130\n130\n130\n130\n0\nin time\n") << how << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "freeflex: interrupted before there was a result\n")) << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "freeflexd: stopped by a signal before the first tick\n"))
        << outcome.err;
    EXPECT_EQ(run("ls " + folder.path()).out, kFiles) << how;
  }
}

// 3,042 points, 60 modes
TEST(LargeSetupLong, ReportsThatMemoryRanOutAtAnyPointAndLeavesNoFile) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a program with a sanitizer takes far more address space";
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
    // if the loader or OpenBLAS fails while it is loaded, no code of freeflex has run that could report this
    const bool is_loaded =
        !contains(outcome.err, "shared librar") && !contains(outcome.err, "pthread_create");
    if (!is_loaded) continue;
    ++num_short;
    EXPECT_EQ(outcome.exit_code, 2) << kilobytes << outcome.err;
    EXPECT_TRUE(contains(outcome.err, "memory ran out") || contains(outcome.err, "takes some"))
        << kilobytes << outcome.err;
    EXPECT_EQ(run("ls " + folder.path()).out, kFiles) << kilobytes;
  }
  EXPECT_TRUE(is_done);
  EXPECT_GT(num_short, 20);
  std::printf("%d limits too small, each reported\n", num_short);
}

}  // namespace
}  // namespace freeflex::testing
