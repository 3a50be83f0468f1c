// These tests check the latest-value buffer between two threads.
#include "service/latest_value.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace freeflex::testing {
namespace {

using service::LatestValue;

TEST(LatestValue, GivesOnlyTheLatestValueAndGivesItOnce) {
  LatestValue<int> buffer(7);
  EXPECT_EQ(buffer.take(), nullptr) << "empty before the first offer";
  buffer.draft() = 1;
  buffer.offer();
  buffer.draft() = 2;
  buffer.offer();
  const int* value = buffer.take();
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(*value, 2);
  EXPECT_EQ(buffer.take(), nullptr);
  buffer.draft() = 3;
  EXPECT_EQ(*value, 2) << "a value that was taken does not change until the next take";
}

TEST(LatestValue, NeverGivesATornOrEarlierValueToAnotherThread) {
  struct Value {
    std::array<std::int64_t, 64> copies{};
  };
  constexpr std::int64_t kLast = 200'000;
  LatestValue<Value> buffer(Value{});
  std::thread writer([&buffer] {
    for (std::int64_t i = 1; i <= kLast; ++i) {
      buffer.draft().copies.fill(i);
      buffer.offer();
    }
  });
  std::int64_t latest = 0;
  while (latest < kLast) {
    const Value* value = buffer.take();
    if (value == nullptr) {
      std::this_thread::yield();
      continue;
    }
    for (const std::int64_t copy : value->copies) ASSERT_EQ(copy, value->copies[0]);
    ASSERT_GT(value->copies[0], latest);
    latest = value->copies[0];
  }
  writer.join();
}

}  // namespace
}  // namespace freeflex::testing
