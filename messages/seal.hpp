// Sealed commands: the envelope that a daemon started with --keys accepts on FORCE and CONTROL. All code is
// in this header, but a program that includes the header must link libsodium.
#pragma once

#include <sodium.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "freeflex_msgs/envelope_t.hpp"

namespace freeflex {

/// The contents of a key file: the name of a sender, and the secret that proves that a command is from this
/// sender.
struct SealingKey {
  std::string id;                                            // sender of the commands sealed with the key
  std::array<unsigned char, crypto_auth_KEYBYTES> secret{};  // 32 bytes
};
using SealTag = std::array<unsigned char, crypto_auth_BYTES>;

/// Returns the tag of an envelope for a channel: libsodium's crypto_auth (HMAC-SHA-512 truncated to 32 bytes)
/// over the length of the channel's whole name (int32, big-endian), the name, and the encoded envelope up to
/// its tag.
inline SealTag make_tag(std::span<const std::byte> before_tag, std::string_view channel,
                        const SealingKey& key) {
  const auto length = static_cast<std::uint32_t>(channel.size());
  std::array<unsigned char, 4> prefix{};
  for (std::size_t i = 0; i < 4; ++i) prefix[i] = static_cast<unsigned char>(length >> (24 - 8 * i));
  const auto as_bytes = [](const auto* from) { return reinterpret_cast<const unsigned char*>(from); };
  crypto_auth_hmacsha512256_state state;
  crypto_auth_hmacsha512256_init(&state, key.secret.data(), key.secret.size());
  crypto_auth_hmacsha512256_update(&state, prefix.data(), prefix.size());
  crypto_auth_hmacsha512256_update(&state, as_bytes(channel.data()), channel.size());
  crypto_auth_hmacsha512256_update(&state, as_bytes(before_tag.data()), before_tag.size());
  SealTag tag{};
  crypto_auth_hmacsha512256_final(&state, tag.data());
  return tag;
}

/// Returns an encoded envelope that contains the force_t or control_t and is to be published on the channel.
/// Sets the sender of the command to the key's id.  \param valid_until  [us] wall clock after which the
/// daemon refuses the command; at most 60 s later than its own wall clock
template <class Command>
std::vector<std::byte> seal(Command command, const std::string& channel, const SealingKey& key,
                            std::int64_t valid_until) {
  command.sender = key.id;
  freeflex_msgs::envelope_t envelope{};
  envelope.key_id = key.id;
  envelope.session = command.session;
  envelope.sequence = command.sequence;
  envelope.valid_until = valid_until;
  envelope.num_bytes = command.getEncodedSize();
  envelope.body.resize(static_cast<std::size_t>(envelope.num_bytes));
  command.encode(envelope.body.data(), 0, envelope.num_bytes);
  std::vector<std::byte> sealed(static_cast<std::size_t>(envelope.getEncodedSize()));
  envelope.encode(sealed.data(), 0, static_cast<int>(sealed.size()));
  const std::span<std::byte> tag = std::span(sealed).last(crypto_auth_BYTES);
  const SealTag made = make_tag(std::span(sealed).first(sealed.size() - tag.size()), channel, key);
  for (std::size_t i = 0; i < tag.size(); ++i) tag[i] = static_cast<std::byte>(made[i]);
  return sealed;
}

}  // namespace freeflex
