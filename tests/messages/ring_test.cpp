// The ring buffer that passes entries between threads and between processes.
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <thread>

#include "service/shared.hpp"

namespace freeflex::testing {
namespace {

using service::Ring;

struct Entry {
  std::int64_t number = 0;
  std::array<std::int64_t, 30> copies{};
};
using SmallRing = Ring<Entry, 8>;

Entry make_entry(std::int64_t number) {
  Entry entry;
  entry.number = number;
  entry.copies.fill(number);
  return entry;
}

TEST(Ring, StoresNoMoreThanItsCapacity) {
  SmallRing ring;
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(ring.num_free(), 8 - i);
    EXPECT_TRUE(ring.try_push(make_entry(i)));
  }
  EXPECT_EQ(ring.num_free(), 0);
  EXPECT_FALSE(ring.try_push(make_entry(8)));
  Entry entry;
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(ring.try_pop(entry));
    EXPECT_EQ(entry.number, i);
  }
  EXPECT_FALSE(ring.try_pop(entry));
}

TEST(Ring, KeepsOrderWhenTheIndicesWrapManyTimes) {
  SmallRing ring;
  std::int64_t pushed = 0;
  std::int64_t popped = 0;
  Entry entry;
  for (int turn = 0; turn < 1000; ++turn) {
    for (int i = 0; i < 1 + turn % 8; ++i) pushed += ring.try_push(make_entry(pushed)) ? 1 : 0;
    for (int i = 0; i < 1 + turn % 5; ++i) {
      if (!ring.try_pop(entry)) break;
      ASSERT_EQ(entry.number, popped++);
    }
  }
  while (ring.try_pop(entry)) ASSERT_EQ(entry.number, popped++);
  EXPECT_EQ(popped, pushed);
}

TEST(Ring, BetweenTwoThreadsNoEntryIsLostOrTorn) {
  constexpr std::int64_t kEntries = 100'000;
  const auto ring = std::make_unique<SmallRing>();
  std::thread producer([&ring] {
    for (std::int64_t i = 0; i < kEntries;) {
      if (ring->try_push(make_entry(i))) {
        ++i;
      } else {
        std::this_thread::yield();
      }
    }
  });
  Entry entry;
  std::int64_t num_torn = 0;
  std::int64_t num_wrong = 0;
  for (std::int64_t i = 0; i < kEntries;) {
    if (!ring->try_pop(entry)) {
      std::this_thread::yield();
      continue;
    }
    num_wrong += entry.number != i ? 1 : 0;
    for (const std::int64_t copy : entry.copies) num_torn += copy != entry.number ? 1 : 0;
    ++i;
  }
  producer.join();
  EXPECT_EQ(num_wrong, 0);
  EXPECT_EQ(num_torn, 0);
}

/// Overwrites the producer's index (offset 0) or the consumer's (offset 64), as a hostile process would.
void overwrite(SmallRing& ring, std::size_t offset, std::uint64_t value) {
  std::memcpy(reinterpret_cast<char*>(&ring) + offset, &value, sizeof(value));
}

TEST(Ring, IsEmptyAfterAnImpossibleProducerIndex) {
  for (const std::uint64_t wild :
       {std::uint64_t{9}, std::uint64_t{1} << 40, ~std::uint64_t{0}, std::uint64_t{1} << 63}) {
    SmallRing ring;
    overwrite(ring, 0, wild);
    Entry entry;
    EXPECT_FALSE(ring.try_pop(entry)) << wild;
    EXPECT_TRUE(ring.try_push(make_entry(5))) << "the ring is usable again";
    ASSERT_TRUE(ring.try_pop(entry));
    EXPECT_EQ(entry.number, 5);
    EXPECT_FALSE(ring.try_pop(entry));
  }
}

TEST(Ring, IsNeverReadOutsideItsArrayWhateverItsIndices) {
  // the ring is on the heap, so that AddressSanitizer reports accesses beyond it
  const auto ring = std::make_unique<SmallRing>();
  std::uint64_t bits = 1;
  Entry entry;
  for (int i = 0; i < 10'000; ++i) {
    bits = bits * 6364136223846793005u + 1442695040888963407u;
    overwrite(*ring, 0, i % 3 == 0 ? bits : bits >> 60);
    overwrite(*ring, 64, i % 2 == 0 ? bits : bits >> 61);
    int num_popped = 0;
    while (num_popped <= 8 && ring->try_pop(entry)) ++num_popped;
    EXPECT_LE(num_popped, 8) << "a ring holds no more than its capacity";
    ring->try_push(make_entry(i));
  }
}

}  // namespace
}  // namespace freeflex::testing
