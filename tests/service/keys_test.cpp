// Key files must be private, every fault is reported with its location and remedy, and no message shows a
// secret.
#include "service/keys.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "tests/scene/temporary_folder.hpp"
#include "tests/service/rig.hpp"

namespace freeflex::testing {
namespace {

using service::KeysResult;
using service::load_key;
using service::load_keys;

const std::string kSecret(64, 'e');

class KeyFiles : public ::testing::Test {
 protected:
  KeyFiles() : plan_(octahedron_plan()) {
    for (std::size_t i = 0; i < plan_.points.size(); ++i) plan_.points[i].name = "p" + std::to_string(i);
    plan_.groups.resize(2);
    plan_.groups[0].name = "base", plan_.groups[1].name = "top";
    chmod(folder_.path().c_str(), 0700);
  }
  /// Writes a private file and returns its path.
  std::string write(const std::string& name, const std::string& text, mode_t mode = 0600) {
    const std::string path = folder_.path() / name;
    std::ofstream(path) << text;
    chmod(path.c_str(), mode);
    return path;
  }
  /// Returns the fault of a key file that contains `front` and then the lines `more`, without the path at its
  /// start.
  std::string fault_of(const std::string& more, const std::string& front = "id: a\nsecret: " + kSecret) {
    const std::string path = write("a.key", front + "\n" + more);
    const KeysResult result = load_keys(path, plan_);
    EXPECT_TRUE(result.keys.empty());
    EXPECT_EQ(result.faults.find("eeeeeeee"), std::string::npos) << "shows the secret: " << result.faults;
    return result.faults.starts_with(path) ? result.faults.substr(path.size()) : "? " + result.faults;
  }
  service::Grants grants_of(const std::string& more) {
    const KeysResult result = load_keys(write("a.key", "id: a\nsecret: " + kSecret + "\n" + more), plan_);
    EXPECT_EQ(result.faults, "");
    return result.keys.empty() ? service::Grants{} : result.keys[0].grants;
  }
  TemporaryFolder folder_;
  Plan plan_;
};

TEST_F(KeyFiles, ANewKeyFileIsPrivateAndReadableAndNeverOverwritten) {
  const std::string file = folder_.path() / "alice.key";
  ASSERT_EQ(service::make_key(file, "alice"), "");
  struct stat status {};
  ASSERT_EQ(stat(file.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777U, 0600u);
  const KeysResult first = load_key(file);
  ASSERT_EQ(first.faults, "");
  ASSERT_EQ(first.keys.size(), 1u);
  EXPECT_EQ(first.keys[0].sealing.id, "alice");
  EXPECT_EQ(service::make_key(file, "bob"),
            file + ": the file exists already, and a key is never overwritten; name another file");
  EXPECT_EQ(load_key(file).keys.at(0).sealing.secret, first.keys[0].sealing.secret);
  const std::string other = folder_.path() / "bob.key";
  ASSERT_EQ(service::make_key(other, "bob"), "");
  EXPECT_NE(load_key(other).keys.at(0).sealing.secret, first.keys[0].sealing.secret);
  const KeysResult both = load_keys(folder_.path(), plan_);
  ASSERT_EQ(both.keys.size(), 2u);
  EXPECT_EQ(both.keys[1].sealing.id, "bob");
  EXPECT_EQ(service::make_key(folder_.path() / "x.key", "no spaces"),
            "name 'no spaces' must be 1 to 31 of A-Z a-z 0-9 _ . - and not begin with local.");
  EXPECT_NE(service::make_key(folder_.path() / "x.key", "local.x"), "")
      << "names that begin with local. are reserved for the operator";
}

TEST_F(KeyFiles, KeysThatOthersCanReadOrReplaceAreRefused) {
  const std::string file = write("a.key", "id: a\nsecret: " + kSecret, 0640);
  EXPECT_EQ(
      load_keys(file, plan_).faults,
      file + ": error: the file has mode 0640, so other users have access; run chmod 600 '" + file + "'");
  EXPECT_EQ(load_keys(folder_.path(), plan_).faults, load_keys(file, plan_).faults);
  EXPECT_EQ(load_key(file).faults, load_keys(file, plan_).faults)
      << "load_key, which is for sealing, refuses it too";
  chmod(file.c_str(), 0400);
  EXPECT_EQ(load_keys(folder_.path(), plan_).faults, "");
  chmod(folder_.path().c_str(), 0730);
  const std::string folder = folder_.path();
  EXPECT_EQ(load_keys(folder, plan_).faults,
            folder + ": error: the folder has mode 0730, so others may put keys into it; run chmod go-w '" +
                folder + "'");
  if (geteuid() == 0) {
    chmod(folder_.path().c_str(), 0700);
    ASSERT_EQ(chown(file.c_str(), 12345, 12345), 0);
    EXPECT_EQ(
        load_keys(file, plan_).faults,
        file + ": error: the owner is user 12345, but must be user 0, who runs this program; run chown 0 '" +
            file + "'");
  }
}

TEST_F(KeyFiles, SymbolicLinksPipesAndMissingFilesAreRefused) {
  const std::string file = write("a.key", "id: a\nsecret: " + kSecret);
  const std::string link = folder_.path() / "b.key";
  ASSERT_EQ(symlink(file.c_str(), link.c_str()), 0);
  EXPECT_EQ(load_keys(link, plan_).faults, link + ": error: this is a symbolic link; give the file itself");
  EXPECT_EQ(load_keys(folder_.path(), plan_).faults, load_keys(link, plan_).faults);
  unlink(link.c_str());
  ASSERT_EQ(symlink(folder_.path().c_str(), link.c_str()), 0);
  EXPECT_EQ(load_keys(link + "/", plan_).faults,
            link + ": error: this is a symbolic link; give the file itself");
  unlink(link.c_str());
  ASSERT_EQ(mkfifo(link.c_str(), 0600), 0);
  EXPECT_EQ(load_keys(link, plan_).faults, link + ": error: this is not a regular file");
  unlink(link.c_str());
  EXPECT_EQ(load_keys(link, plan_).faults,
            link + ": error: the file cannot be read: No such file or directory");
  unlink(file.c_str());
  const std::string empty = write("e.key", "");
  EXPECT_EQ(load_key(empty).faults,
            empty + ": error: the file is empty; write a key with 'freeflex keygen ID --out FILE'");
  unlink(empty.c_str());
  write("readme.txt", "nothing");
  EXPECT_NE(load_keys(folder_.path(), plan_).faults.find("the folder holds no file *.key"),
            std::string::npos);
}

TEST_F(KeyFiles, TwoKeysWithTheSameIdOrSecretAreRefused) {
  const std::string a = write("a.key", "id: a\nsecret: " + kSecret);
  const std::string b = write("b.key", "id: a\nsecret: " + std::string(64, '1'));
  EXPECT_NE(load_keys(folder_.path(), plan_).faults.find("this key has the id of"), std::string::npos);
  write("b.key", "id: b\nsecret: " + kSecret);
  EXPECT_EQ(load_keys(folder_.path(), plan_).faults,
            b + ": error: this key has the secret of " + a + "; make another key with freeflex keygen");
}

TEST_F(KeyFiles, AKeyWithoutListsMayDoEverythingExceptClear) {
  const service::Grants grants = grants_of("");
  EXPECT_TRUE(grants.has_force && grants.has_control && grants.points.empty() && grants.groups.empty());
  EXPECT_EQ(grants.controls, ~(1U << 8)) << "all controls except clear, which acts on other senders";
  EXPECT_EQ(grants.num_slots, 64);
  EXPECT_EQ(grants.largest_force + grants.largest_torque + grants.commands_per_second, 0.0);
}

TEST_F(KeyFiles, TheListsInAKeyFileLimitWhatItsKeyMayDo) {
  const service::Grants grants = grants_of(
      "controls: [hold, stop, clear]\npoints: [p1..p3, p5]\ngroups: []\nlargest_force: 2.5\n"
      "largest_torque: 0.5\nslots: 4\ncommands_per_second: 20\n");
  EXPECT_EQ(grants.controls, 1U << 2 | 1U << 5 | 1U << 8);
  EXPECT_EQ(grants.points, (std::vector<bool>{false, true, true, true, false, true}));
  EXPECT_EQ(grants.groups, (std::vector<bool>{false, false}));
  EXPECT_EQ(grants.largest_force, 2.5);
  EXPECT_EQ(grants.largest_torque, 0.5);
  EXPECT_EQ(grants.num_slots, 4);
  EXPECT_EQ(grants.commands_per_second, 20.0);
  const service::Grants watcher = grants_of("channels: [CONTROL]\n");
  EXPECT_FALSE(watcher.has_force);
  EXPECT_TRUE(watcher.has_control);
}

TEST_F(KeyFiles, EveryFaultGivesItsLocationAndWhatIsAllowed) {
  const std::string rest = "\nsecret: " + kSecret;
  EXPECT_EQ(
      fault_of("", "secret: " + kSecret),
      ":1:1: error: key: id is missing; it must be 1 to 31 of A-Z a-z 0-9 _ . - and not begin with local.");
  EXPECT_NE(fault_of("", "id: local.x" + rest), "") << "the loop ignores such names from the bus";
  EXPECT_EQ(
      fault_of("", "id: a b" + rest),
      ":1:5: error: key: id is 'a b', but must be 1 to 31 of A-Z a-z 0-9 _ . - and not begin with local.");
  EXPECT_EQ(fault_of("", "id: a"), ":1:1: error: key: secret is missing; it must be 64 hexadecimal digits");
  const std::string bad =
      ":2:9: error: key: secret must be 64 hexadecimal digits, as freeflex keygen writes them";
  EXPECT_EQ(fault_of("", "id: a\nsecret: " + std::string(63, 'e')), bad);
  EXPECT_EQ(fault_of("", "id: a\nsecret: " + std::string(63, 'e') + "x"), bad);
  EXPECT_EQ(fault_of("", "id: a\nsecret: [" + kSecret + "]"), bad);
  EXPECT_NE(fault_of("", "id: " + kSecret + "\nsecret: a").find("error: key: id is '..."), std::string::npos);
  EXPECT_NE(fault_of("", kSecret).find("but must be a mapping of id, secret"), std::string::npos);
  EXPECT_NE(fault_of("chanels: [FORCE]\n")
                .find(":3:1: error: key: the key 'chanels' is unknown (did you mean 'channels'?)"),
            std::string::npos);
  EXPECT_EQ(
      fault_of("channels: FORCE\n"),
      ":3:11: error: key: channels is the text 'FORCE', but must be a list of FORCE, CONTROL; [] for none");
  EXPECT_NE(
      fault_of("controls: [halt]\n").find(":3:12: error: key: controls is the text 'halt', but must be run"),
      std::string::npos);
  EXPECT_NE(fault_of("points: [p9]\n").find("names the point 'p9', which the scene does not have"),
            std::string::npos);
  EXPECT_NE(fault_of("largest_force: 0\n").find(":3:16: error: key: largest_force is 0 N, but must be > 0"),
            std::string::npos)
      << fault_of("largest_force: 0\n");
  EXPECT_EQ(fault_of("slots: 65\n"),
            ":3:8: error: key: slots is the text '65', but must be a whole number from 1 to 64");
  EXPECT_EQ(fault_of("channels: [CONTROL]\nlargest_force: 3\n"),
            ":4:16: error: key: largest_force has no effect, because FORCE is not among its channels; remove "
            "one of the two");
}

}  // namespace
}  // namespace freeflex::testing
