// Reads a key file for a controller, without the reader of scenes, which the client library does not contain.
#pragma once

#include <string>

#include "messages/seal.hpp"

namespace freeflex::client {

/// Reads the lines `id: NAME` and `secret: 64 hexadecimal digits`, and ignores all other lines. Returns an
/// empty string, or the error. It is an error if the mode of the file gives any right to users other than the
/// owner.
std::string read_key_file(const std::string& path, SealingKey& key);

}  // namespace freeflex::client
