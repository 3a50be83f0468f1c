// These tests check two parts of the terminal output of all subcommands, which are wrapped lines, and a
// progress line that appears only on terminals.
#include "tools/terminal/console.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <sstream>

#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

TEST(Wrapped, ALineBreaksAtBlanksAndFollowingLinesAreIndented) {
  EXPECT_EQ(tools::wrapped("short", 7), "short");
  EXPECT_EQ(tools::wrapped("", 7), "");
  const std::string word(30, 'a');
  const std::string text = word + " " + word + " " + word + " " + word + " " + word;
  EXPECT_EQ(tools::wrapped(text, 0), word + " " + word + " " + word + "\n" + word + " " + word);
  EXPECT_EQ(tools::wrapped(text, 40), word + " " + word + "\n" + std::string(40, ' ') + word + " " + word +
                                          "\n" + std::string(40, ' ') + word);
  // `full` is exactly as wide as a line, and `longer` is five characters wider
  const std::string full(tools::kLineWidth, 'b'), longer(tools::kLineWidth + 5, 'c');
  EXPECT_EQ(tools::wrapped(full, 0), full);
  EXPECT_EQ(tools::wrapped(full + " a", 0), full + "\na");
  EXPECT_EQ(tools::wrapped("a " + longer + " b", 0), "a\n" + longer + "\nb");
}

TEST(Fingerprint, IsSixteenHexadecimalDigits) {
  EXPECT_EQ(tools::fingerprint_text(0xabc), "0000000000000abc");
  EXPECT_EQ(tools::fingerprint_text(~std::uint64_t{0}), "ffffffffffffffff");
}

/// Opens a pseudo-terminal and reads the text that is shown on it.
class Terminal {
 public:
  Terminal() { is_open_ = openpty(&master_, &slave_, nullptr, nullptr, nullptr) == 0; }
  ~Terminal() {
    close(master_);
    close(slave_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  bool is_open() const { return is_open_; }
  int slave() const { return slave_; }
  /// Reads until `part` has appeared. Returns false if no text arrives for a minute.
  bool shows(const std::string& part) {
    pollfd ready{master_, POLLIN, 0};
    while (!contains(seen_, part)) {
      std::array<char, 512> text{};
      if (poll(&ready, 1, 60'000) <= 0) return false;
      const ssize_t size = read(master_, text.data(), text.size());
      if (size <= 0) return false;
      seen_.append(text.data(), static_cast<std::size_t>(size));
    }
    return true;
  }
  const std::string& seen() const { return seen_; }

 private:
  int master_ = -1, slave_ = -1;
  bool is_open_ = false;
  std::string seen_;
};

/// Redirects standard error to another file while the object exists.
class StandardError {
 public:
  explicit StandardError(int other) : saved_(dup(STDERR_FILENO)) { dup2(other, STDERR_FILENO); }
  ~StandardError() {
    dup2(saved_, STDERR_FILENO);
    close(saved_);
  }
  StandardError(const StandardError&) = delete;
  StandardError& operator=(const StandardError&) = delete;

 private:
  int saved_;
};

TEST(Progress, ShowsTheTimeThenABarAndIsErasedAtTheEnd) {
  Terminal terminal;
  ASSERT_TRUE(terminal.is_open());
  {
    const StandardError here(terminal.slave());
    tools::Progress progress("set-up", std::chrono::milliseconds(0));
    EXPECT_TRUE(terminal.shows("set-up: 0 s")) << terminal.seen();
    progress.update(0.5);
    EXPECT_TRUE(terminal.shows("set-up [###############...............]  50.0 %, ")) << terminal.seen();
  }
  EXPECT_TRUE(terminal.shows(" s left\033[K\r\033[K")) << terminal.seen();
}

TEST(Progress, IsOnlyShownOnTerminals) {
  const TemporaryFolder folder;
  const int file = open((folder / "err").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
  {
    const StandardError here(file);
    tools::Progress progress("set-up", std::chrono::milliseconds(0));
    progress.update(0.5);
  }
  close(file);
  EXPECT_EQ(read_text(folder / "err"), "");
}

/// Runs freeflex with a terminal as standard error, and interrupts freeflex when the text appears on the
/// terminal. Returns false if the text does not appear.
bool shows_on_terminal(const std::string& arguments, const std::string& part) {
  Terminal terminal;
  const TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    dup2(terminal.slave(), STDERR_FILENO);
    dup2(open("/dev/null", O_RDWR), STDOUT_FILENO);
    const std::string line = "cd " + folder.path() + " && exec " + kFreeflex + " " + arguments;
    execl("/bin/sh", "sh", "-c", line.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  const bool is_seen = terminal.shows(part);
  kill(child, SIGINT);
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(is_seen) << arguments << ": " << terminal.seen();
  return is_seen;
}

// the progress line appears after half a second, and each command takes much longer
TEST(Progress, IsShownByEveryLongCommand) {
  const std::string large = kScenes + "truss-s3.yaml";
  shows_on_terminal("check " + large, "check: ");
  for (const char* command : {"modes ", "inspect ", "plan ", "compile -o a.plan "})
    shows_on_terminal(command + large, "set-up: ");
  shows_on_terminal("loads --spin 0,0,1 " + large, "set-up: ");
  shows_on_terminal("run --until 1e8 --out a.csv " + kGolden + "frame.plan", "run [");
  shows_on_terminal("report " + kScenes + "truss-s1.yaml", "truss");
  shows_on_terminal("report --estimates 1000", "estimates");
  shows_on_terminal("stability", "stability");
}

}  // namespace
}  // namespace freeflex::testing
