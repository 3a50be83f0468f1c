#include "tools/cli/folder.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "tools/terminal/console.hpp"

namespace freeflex::tools {
namespace {

bool write_file(const std::filesystem::path& path, const std::string& text) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (stream) return true;
  print_error(path.string() + " cannot be written; name a folder that can be written");
  return false;
}

}  // namespace

bool prepare_folder(const std::filesystem::path& folder) {
  if (folder.empty()) return true;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::filesystem::is_directory(folder))
    error = std::make_error_code(std::errc::not_a_directory);
  if (!error && access(folder.c_str(), W_OK) != 0) error = std::error_code(errno, std::generic_category());
  if (!error) return true;
  print_error("--out " + folder.string() + ": " + error.message() + "; name a folder that can be written");
  return false;
}

bool write_folder(const std::filesystem::path& folder, const std::vector<NamedText>& files) {
  return std::all_of(files.begin(), files.end(),
                     [&folder](const NamedText& file) { return write_file(folder / file.name, file.text); });
}

}  // namespace freeflex::tools
