// These tests check the path of the operator's socket. Daemon and operator find the same path, and never a
// path in a folder of another user, except that root also finds the socket of a service.
#include "service/io/wire/operator_address.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

namespace freeflex::testing {
namespace {

using service::choose_operator_place;
using service::operator_places;
using service::OperatorRoots;

/// Provides a temporary folder in which the tests create the system's folders for sockets.
class OperatorAddress : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::TempDir() + "operator-XXXXXX";
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
    roots_ = {root_ + "/xdg", root_ + "/users", root_ + "/system", root_ + "/tmp"};
    make(roots_.users);
    make(roots_.temporary);
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(root_, ignored);
  }
  static void make(const std::string& folder, mode_t mode = 0700) {
    ASSERT_EQ(mkdir(folder.c_str(), 0700), 0) << folder;
    ASSERT_EQ(chmod(folder.c_str(), mode), 0);
  }
  std::string chosen() const { return choose_operator_place("F", roots_).path; }
  std::vector<std::string> found() const { return operator_places("F", roots_).paths; }

  std::string root_;
  OperatorRoots roots_;
  const std::string uid_ = std::to_string(geteuid());
};

TEST_F(OperatorAddress, TheDaemonUsesTheFirstUsableFolderAndClientsSearchItFirst) {
  const std::string xdg = roots_.runtime + "/freeflexd-F.sock";
  const std::string user = roots_.users + "/" + uid_ + "/freeflexd-F.sock";
  const std::string system = roots_.system + "/freeflexd-F.sock";
  const std::string last = roots_.temporary + "/freeflexd-" + uid_ + "/F.sock";
  EXPECT_EQ(found(), std::vector<std::string>{}) << "the search creates no folder";
  EXPECT_NE(operator_places("F", roots_).faults.find(roots_.runtime + ": No such file"), std::string::npos)
      << "each folder that is passed over is named: " << operator_places("F", roots_).faults;
  EXPECT_EQ(chosen(), last);
  struct stat made {};
  ASSERT_EQ(stat((roots_.temporary + "/freeflexd-" + uid_).c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 0777, 0700u);
  make(roots_.system, 0755);
  EXPECT_EQ(chosen(), system);
  make(roots_.users + "/" + uid_);
  EXPECT_EQ(chosen(), user);
  make(roots_.runtime);
  EXPECT_EQ(chosen(), xdg);
  EXPECT_EQ(found(), (std::vector{xdg, user, system, last}));
  // if XDG_RUNTIME_DIR is not set, the other paths are found
  roots_.runtime.clear();
  EXPECT_EQ(found(), (std::vector{user, system, last}));
  roots_.runtime = "relative";
  EXPECT_EQ(chosen(), user);
}

TEST_F(OperatorAddress, AFolderThatOthersMayWriteToIsPassedOver) {
  make(roots_.runtime, 0777);
  make(roots_.system, 0775);
  const std::string last = roots_.temporary + "/freeflexd-" + uid_;
  make(last, 0702);
  const service::OperatorPlace place = choose_operator_place("F", roots_);
  EXPECT_EQ(place.path, "");
  EXPECT_EQ(place.fault, "no folder is suitable for the operator's socket: others may write to " +
                             roots_.runtime + "; " + roots_.users + "/" + uid_ +
                             ": No such file or directory; others may write to " + roots_.system +
                             "; others may write to " + last +
                             ". Set XDG_RUNTIME_DIR to a folder of this user with mode 700, or give --socket "
                             "PATH or --socket none");
  EXPECT_TRUE(found().empty());
}

TEST_F(OperatorAddress, AFolderOfAnotherUserIsPassedOver) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give a folder to another user";
  const std::string last = roots_.temporary + "/freeflexd-0";
  make(last);
  ASSERT_EQ(chown(last.c_str(), 12345, 12345), 0);
  EXPECT_EQ(chosen(), "");
  EXPECT_NE(choose_operator_place("F", roots_).fault.find(last + " belongs to user 12345"),
            std::string::npos);
  EXPECT_TRUE(found().empty()) << "a socket in that folder is not taken for the socket of a daemon";
  make(roots_.runtime);
  EXPECT_EQ(chosen(), roots_.runtime + "/freeflexd-F.sock")
      << "a folder of another user does not block the other folders";
  // root finds a daemon in the folder of a service, but does not put its own socket there, because the
  // service could replace it
  std::filesystem::remove(roots_.runtime);
  make(roots_.system, 0755);
  ASSERT_EQ(chown(roots_.system.c_str(), 12345, 12345), 0);
  EXPECT_EQ(found(), std::vector{roots_.system + "/freeflexd-F.sock"});
  EXPECT_EQ(chosen(), "");
}

TEST_F(OperatorAddress, ASymbolicLinkInTheTemporaryFolderIsPassedOver) {
  make(root_ + "/mine");
  std::filesystem::create_symlink(root_ + "/mine", roots_.temporary + "/freeflexd-" + uid_);
  EXPECT_EQ(chosen(), "");
  EXPECT_TRUE(found().empty());
}

TEST_F(OperatorAddress, APathThatIsTooLongForASocketIsPassedOver) {
  roots_.runtime = root_ + "/" + std::string(100, 'x');
  make(roots_.runtime);
  EXPECT_EQ(chosen(), roots_.temporary + "/freeflexd-" + uid_ + "/F.sock");
}

}  // namespace
}  // namespace freeflex::testing
