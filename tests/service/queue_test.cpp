// These tests check the queue between two threads, whose entries are filled in place.
#include "service/queue.hpp"

#include <gtest/gtest.h>

#include <array>
#include <thread>

namespace freeflex::testing {
namespace {

using service::Queue;

TEST(Queue, GivesEachValueOnceInOrderAndHasNoRoomWhenFull) {
  Queue<int> queue(7, 2);
  EXPECT_EQ(queue.front(), nullptr) << "empty before the first offer";
  for (int i = 1; i <= 2; ++i) {
    int* const draft = queue.draft();
    ASSERT_NE(draft, nullptr);
    *draft = i;
    queue.offer();
  }
  EXPECT_EQ(queue.draft(), nullptr) << "both entries wait for the reader";
  for (int i = 1; i <= 2; ++i) {
    const int* const oldest = queue.front();
    ASSERT_NE(oldest, nullptr);
    EXPECT_EQ(*oldest, i);
    EXPECT_EQ(queue.front(), oldest) << "the front stays until it is dropped";
    queue.drop();
    ASSERT_NE(queue.draft(), nullptr);
  }
  EXPECT_EQ(queue.front(), nullptr);
}

TEST(Queue, NeverTearsOrLosesAValueBetweenThreads) {
  struct Value {
    std::array<std::int64_t, 64> copies{};
  };
  constexpr std::int64_t kLast = 200'000;
  Queue<Value> queue(Value{}, 5);
  std::thread writer([&queue] {
    for (std::int64_t i = 1; i <= kLast;) {
      Value* const draft = queue.draft();
      if (draft == nullptr) {
        std::this_thread::yield();
        continue;
      }
      draft->copies.fill(i++);
      queue.offer();
    }
  });
  for (std::int64_t i = 1; i <= kLast;) {
    const Value* const value = queue.front();
    if (value == nullptr) {
      std::this_thread::yield();
      continue;
    }
    for (const std::int64_t copy : value->copies) ASSERT_EQ(copy, i);
    queue.drop();
    ++i;
  }
  writer.join();
}

}  // namespace
}  // namespace freeflex::testing
