// Latest-value box between two threads.
#include "service/box.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace freeflex::testing {
namespace {

using service::Box;

TEST(Box, GivesTheLatestValueOnce) {
  Box<int> box(7);
  EXPECT_EQ(box.take(), nullptr) << "nothing was offered yet";
  box.draft() = 1;
  box.offer();
  box.draft() = 2;
  box.offer();
  const int* value = box.take();
  ASSERT_NE(value, nullptr);
  EXPECT_EQ(*value, 2);
  EXPECT_EQ(box.take(), nullptr);
  box.draft() = 3;
  EXPECT_EQ(*value, 2) << "what was taken stays until the next take";
}

TEST(Box, NeverTearsAValueNorGoesBackBetweenThreads) {
  struct Value {
    std::array<std::int64_t, 64> copies{};
  };
  constexpr std::int64_t kLast = 200'000;
  Box<Value> box(Value{});
  std::thread writer([&box] {
    for (std::int64_t i = 1; i <= kLast; ++i) {
      box.draft().copies.fill(i);
      box.offer();
    }
  });
  std::int64_t latest = 0;
  while (latest < kLast) {
    const Value* value = box.take();
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
