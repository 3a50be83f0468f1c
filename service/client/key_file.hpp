// The file of a key, read without the scene's reader: what a controller needs of it.
#pragma once

#include <string>

#include "messages/seal.hpp"

namespace freeflex::client {

/// Reads the lines `id: NAME` and `secret: 64 hexadecimal digits`, and leaves others alone. Empty, or what is
/// wrong with the file: also when others than its owner may read it.
std::string read_key_file(const std::string& path, SealingKey& key);

}  // namespace freeflex::client
