// Runs programs in a shell, as a user does. Header only.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace freeflex::testing {

inline const std::string kFreeflex = std::string(FREEFLEX_BIN_DIR) + "/freeflex";
inline const std::string kFreeflexd = std::string(FREEFLEX_BIN_DIR) + "/freeflexd";
inline const std::string kScenes = std::string(FREEFLEX_SOURCE_DIR) + "/service/scenes/";
inline const std::string kGolden = std::string(FREEFLEX_SOURCE_DIR) + "/tests/tools/golden/";

/// Makes a temporary folder. The destructor removes the folder.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "freeflex-test-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline std::string read_text(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
inline void write_text(const std::string& path, std::string_view text) {
  std::ofstream(path, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}
inline bool contains(const std::string& text, std::string_view part) {
  return text.find(part) != std::string::npos;
}

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

/// Runs a shell command and waits for the end of the command.
inline Outcome run(const std::string& command) {
  const TemporaryFolder folder;
  const std::string line =
      "(" + command + ") >'" + folder / "out" + "' 2>'" + folder / "err" + "' </dev/null";
  const int status = std::system(line.c_str());
  Outcome outcome;
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  outcome.out = read_text(folder / "out");
  outcome.err = read_text(folder / "err");
  return outcome;
}

}  // namespace freeflex::testing
