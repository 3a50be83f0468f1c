// Reads a key file for a controller. This reader does not need the reader of scenes.
#pragma once

#include <string>

#include "messages/seal.hpp"

namespace freeflex::client {

/// Reads the lines `id: NAME` and `secret: 64 hexadecimal digits`, and ignores all other lines. Returns an
/// empty string, or the error. It is an error if users other than the owner may read the file.
std::string read_key_file(const std::string& path, SealingKey& key);

}  // namespace freeflex::client
