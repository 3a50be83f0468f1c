// The folder of --out, into which a long study writes its files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace freeflex::tools {

struct NamedText {
  const char* name;  // name of the file
  std::string text;
};

/// Makes the folder, unless its name is empty. If no file can be written there, prints an error and returns
/// false, so that a long study fails before it starts.
bool prepare_folder(const std::filesystem::path& folder);

/// Writes the files. At the first file that cannot be written, prints an error and returns false.
bool write_folder(const std::filesystem::path& folder, const std::vector<NamedText>& files);

}  // namespace freeflex::tools
