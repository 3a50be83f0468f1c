// The version and the advice on multicast routes are the same everywhere in the tree.
#include <gtest/gtest.h>

#include "service/io/wire/versions.hpp"
#include "tests/tools/shell.hpp"

namespace freeflex::testing {
namespace {

const std::string kVersion = FREEFLEX_PROJECT_VERSION;
const std::string kSource = FREEFLEX_SOURCE_DIR;

/// Returns the files of the tree that contain the text, except pictures and logs.
std::string files_with(const std::string& text) {
  std::string found;
  auto entry = std::filesystem::recursive_directory_iterator(kSource);
  for (; entry != std::filesystem::recursive_directory_iterator(); ++entry) {
    const std::string name = entry->path().filename().string(),
                      extension = entry->path().extension().string();
    if (entry->is_directory()) {
      if (name == "build" || name == ".git") entry.disable_recursion_pending();
    } else if (extension != ".png" && extension != ".svg" && extension != ".log" &&
               contains(read_text(entry->path().string()), text)) {
      found += entry->path().string() + "\n";
    }
  }
  return found;
}

TEST(Version, IsTheSameInProgramsMessagesAndPackages) {
  for (const char* name : {"freeflex", "freeflex-study", "freeflexd"}) {
    const Outcome outcome = run(std::string(FREEFLEX_BIN_DIR) + "/" + name + " --version");
    EXPECT_TRUE(contains(outcome.out, " " + kVersion + "\n")) << outcome.out;
  }
  EXPECT_TRUE(kVersion.starts_with(std::string(io::kMessagesVersion) + "."));
  const std::string packages = read_text(FREEFLEX_BUILD_DIR "/CPackConfig.cmake");
  EXPECT_TRUE(contains(packages, "set(CPACK_PACKAGE_VERSION \"" + kVersion + "\")"));
  const std::string package_file = read_text(FREEFLEX_BUILD_DIR "/freeflexConfigVersion.cmake");
  EXPECT_TRUE(contains(package_file, "set(PACKAGE_VERSION \"" + kVersion + "\")"));
  EXPECT_TRUE(contains(read_text(FREEFLEX_BUILD_DIR "/freeflex.pc"), "Version: " + kVersion + "\n"));
}

TEST(Version, TheVersionOfTheMessagesIsTheSameInTheirDocumentAndTheExample) {
  const std::string messages = io::kMessagesVersion;
  EXPECT_TRUE(contains(read_text(kSource + "/messages/README.md"), "these are of " + messages + "."));
  EXPECT_TRUE(contains(read_text(kSource + "/tools/examples/CMakeLists.txt"),
                       "find_package(freeflex " + messages + " "));
  EXPECT_TRUE(contains(read_text(kSource + "/tools/docs/build_a_package.md"),
                       "find_package(freeflex " + messages + " "));
}

// the domain names are composed at run time, so that this file does not contain them
TEST(Addresses, NoAddressIsInAnExampleDomain) {
  const std::string packages = read_text(FREEFLEX_BUILD_DIR "/CPackConfig.cmake");
  for (const char* end : {"org", "com", "net"}) {
    const std::string domain = std::string("example.") + end;
    EXPECT_EQ(files_with(domain), "");
    EXPECT_FALSE(contains(packages, domain));
  }
}

TEST(Addresses, TheAdviceOnMulticastIsTheSameEverywhere) {
  EXPECT_EQ(files_with(std::string("route add 224") + ".0.0.0"), "");
  for (const char* file : {"/service/README.md", "/service/io/wire/lcm_url.cpp", "/tools/demo",
                           "/tools/private-network", "/tools/python/freeflex/bus.py"})
    EXPECT_TRUE(contains(read_text(kSource + file), "ip route add 239.0.0.0/8 dev lo")) << file;
}

}  // namespace
}  // namespace freeflex::testing
