// Saved plans with damaged bytes. Header only.
#pragma once

#include <gtest/gtest.h>
#include <xxhash.h>

#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "core/plan/file/plan_bytes.hpp"

namespace freeflex::testing {

constexpr std::size_t kHeaderSize = 28;  // magic 8, version 4, length 8, checksum 8

/// Writes the matching length and checksum, so that the reader checks the content itself.
inline void seal(std::vector<std::byte>& bytes) {
  const std::uint64_t checksum = XXH3_64bits(bytes.data() + kHeaderSize, bytes.size() - kHeaderSize);
  const std::uint64_t length = bytes.size() - kHeaderSize;
  std::memcpy(bytes.data() + 12, &length, 8);
  std::memcpy(bytes.data() + 20, &checksum, 8);
}

/// Changes a plan by `spoil` and returns the error that reading the plan gives.
template <typename Spoil>
std::string error_of_spoilt(Plan plan, const Spoil& spoil) {
  spoil(plan);
  std::string error;
  EXPECT_FALSE(plan_from_bytes(plan_to_bytes(plan), error).has_value());
  return error;
}

inline void expect_named(const std::string& error, const char* what) {
  EXPECT_NE(error.find(what), std::string::npos) << error << " lacks " << what;
}

/// Numbers of damaged plans that were refused and accepted. Each damaged plan has a flipped bit, four bytes
/// set or one byte removed, and a matching checksum.
struct DamageCount {
  int num_refused = 0, num_taken = 0;
};
/// \param exercise  runs an accepted plan, so that sanitizers report any access out of bounds
template <typename Exercise>
DamageCount damage(const Plan& intact, std::uint64_t seed, int num_trials, const Exercise& exercise) {
  const std::vector<std::byte> bytes = plan_to_bytes(intact);
  std::mt19937_64 engine(seed);
  DamageCount count;
  for (int trial = 0; trial < num_trials; ++trial) {
    std::vector<std::byte> damaged = bytes;
    const std::size_t at = kHeaderSize + engine() % (bytes.size() - kHeaderSize - 8);
    if (trial % 3 == 0)
      damaged[at] ^= static_cast<std::byte>(1U << (engine() % 8));
    else if (trial % 3 == 1)
      std::memset(damaged.data() + at, 0xff, 4);
    else
      damaged.erase(damaged.begin() + static_cast<std::ptrdiff_t>(at));
    seal(damaged);
    std::string error;
    const auto plan = plan_from_bytes(damaged, error);
    if (plan) exercise(*plan);
    ++(plan ? count.num_taken : count.num_refused);
  }
  return count;
}

}  // namespace freeflex::testing
