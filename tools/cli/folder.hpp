// The folder that --out names, where a long study puts its files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace freeflex::tools {

struct NamedText {
  const char* name;  // of the file
  std::string text;
};

/// Makes the folder, unless its name is empty. False, explained, when it takes no files: a long study is to
/// know before it starts.
bool prepare_folder(const std::filesystem::path& folder);

/// Writes the files; the first that cannot be written is explained, and false.
bool write_folder(const std::filesystem::path& folder, const std::vector<NamedText>& files);

}  // namespace freeflex::tools
