// A confined process can read the clock, use a limited amount of memory and exit. The filter of system calls
// ends the process at any other system call.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>

#include "service/ingress_confinement.hpp"

namespace freeflex::testing {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsInstrumented = true;
#else
constexpr bool kIsInstrumented = false;
#endif

/// Returns the exit status of a confined process that calls the function, or 1000 + signal if a signal ends
/// it.
int confined(const std::function<int()>& does) {
  const pid_t child = fork();
  if (child == 0) {
    service::confine({});
    _exit(does());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

class Confinement : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kIsInstrumented) GTEST_SKIP() << "a sanitizer makes system calls that the filter forbids";
    if (prctl(PR_GET_SECCOMP) < 0) GTEST_SKIP() << "this kernel cannot filter system calls";
  }
};

TEST_F(Confinement, AllowsAProcessToReadTheClockAllocateMemoryAndExit) {
  EXPECT_EQ(confined([] {
              timespec now{};
              clock_gettime(CLOCK_BOOTTIME, &now);
              void* const memory = std::malloc(1 << 20);
              std::free(memory);
              return memory != nullptr && now.tv_sec > 0 ? 7 : 1;
            }),
            7);
}

TEST_F(Confinement, LimitsTheMemoryOfTheProcess) {
  EXPECT_EQ(confined([] { return std::malloc(std::size_t{100} << 20) == nullptr ? 7 : 1; }), 7);
}

TEST_F(Confinement, EndsAProcessAtAForbiddenSystemCall) {
  constexpr int kEnded = 1000 + SIGSYS;
  EXPECT_EQ(confined([] { return open("/etc/passwd", O_RDONLY); }), kEnded);
  EXPECT_EQ(confined([] { return socket(AF_UNIX, SOCK_STREAM, 0); }), kEnded);
  EXPECT_EQ(confined([] { return fork() == 0 ? 0 : 1; }), kEnded);
  EXPECT_EQ(confined([] { return execl("/bin/true", "true", nullptr); }), kEnded);
  EXPECT_EQ(confined([] { return kill(getppid(), 0); }), kEnded);
  EXPECT_EQ(confined([] { return static_cast<int>(write(1, "", 0)); }), kEnded);
  EXPECT_EQ(confined([] {
              mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
              return 0;
            }),
            kEnded);
  static char page[8192];
  EXPECT_EQ(confined([] { return mprotect(page, 4096, PROT_READ | PROT_WRITE); }), kEnded);
}

TEST(IngressUser, IsUnprivilegedUnderRootAndOnlyRootMayChooseIt) {
  service::IngressUser user;
  EXPECT_EQ(service::find_ingress_user("", user), "");
  if (geteuid() == 0) {
    EXPECT_NE(user.uid, 0);
    EXPECT_NE(service::find_ingress_user("no such user", user), "");
  } else {
    EXPECT_EQ(user.uid, service::IngressUser::kSame);
    EXPECT_NE(service::find_ingress_user("nobody", user).find("needs root"), std::string::npos);
  }
}

}  // namespace
}  // namespace freeflex::testing
