// A temporary folder. The folder is the current folder while the object exists, so that messages contain file
// names as they are in the scene.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

namespace freeflex::testing {

class TemporaryFolder {
 public:
  TemporaryFolder() : before_(std::filesystem::current_path()) {
    std::string name = (std::filesystem::temp_directory_path() / "freeflex-scene-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path_ = name;
    std::filesystem::current_path(path_);
  }
  ~TemporaryFolder() {
    std::filesystem::current_path(before_);
    std::error_code ignored;
    // schema_test.cpp sets this variable to check the scenes of the other tests too
    if (const char* kept = std::getenv("FREEFLEX_KEPT_SCENES"))
      std::filesystem::copy(path_, kept / path_.filename(), std::filesystem::copy_options::recursive,
                            ignored);
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
  }

 private:
  std::filesystem::path before_, path_;
};

}  // namespace freeflex::testing
