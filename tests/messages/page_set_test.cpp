// Pages are gathered into complete sets, whose memory is limited whatever strangers on the bus send. Packets
// of LCM are written and read.
#include "service/io/wire/page_set.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "service/io/wire/lcm_packet.hpp"

namespace freeflex::testing {
namespace {

using io::PageSet;

constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();

TEST(PageSet, IsCompleteWhenAllPagesHaveArrivedInAnyOrder) {
  PageSet pages;
  EXPECT_TRUE(pages.take({1, 0, 5}, 2, 3, 3, 100).is_first);
  EXPECT_FALSE(pages.take({1, 0, 5}, 0, 3, 3, 100).is_whole);
  EXPECT_FALSE(pages.take({1, 0, 5}, 0, 3, 3, 100).is_kept) << "a page that comes twice counts once";
  const PageSet::Taken last = pages.take({1, 0, 5}, 1, 3, 3, 100);
  EXPECT_TRUE(last.is_kept);
  EXPECT_TRUE(last.is_whole);
  EXPECT_TRUE(pages.take({1, 0, 5}, 0, 3, 3, 100).is_first) << "a set for the same tick may begin again";
}

TEST(PageSet, RefusesImpossiblePageNumbersAndKeepsEarlierPages) {
  PageSet pages;
  ASSERT_TRUE(pages.take({1, 0, 5}, 0, 2, 2, 100).is_kept);
  const std::vector<std::pair<std::int32_t, std::int32_t>> refused{
      {0, kMost}, {kMost - 1, kMost}, {0, 3}, {0, 0}, {0, -1}, {-1, 2}, {2, 2}};
  for (const auto& [page, num_pages] : refused) {
    const PageSet::Taken taken = pages.take({1, 0, 6}, page, num_pages, 2, 100);
    EXPECT_FALSE(taken.is_kept || taken.is_first || taken.is_whole) << page << " of " << num_pages;
  }
  EXPECT_TRUE(pages.take({1, 0, 5}, 1, 2, 2, 100).is_whole);
}

TEST(PageSet, AnotherTickOrEpochStartsANewSet) {
  PageSet pages;
  EXPECT_TRUE(pages.take({1, 0, 5}, 0, 2, 2, 100).is_first);
  EXPECT_TRUE(pages.take({1, 0, 6}, 1, 2, 2, 100).is_first);
  EXPECT_FALSE(pages.take({1, 1, 6}, 0, 2, 2, 100).is_whole)
      << "a page of another epoch does not complete the set";
}

TEST(PageSet, KeepsAtMostItsLimitOfBytes) {
  constexpr std::size_t kPage = 60'000;
  PageSet pages;
  std::size_t held = 0;
  for (std::int32_t page = 0; page < 10'000; ++page)
    if (pages.take({1, 0, 5}, page, 10'000, 10'000, kPage).is_kept) held += kPage;
  EXPECT_LE(held, PageSet::kMaxBytes);
  EXPECT_GT(held, PageSet::kMaxBytes - kPage);
}

TEST(LcmPackets, PacketsAreReadBackAsTheyWereMade) {
  const std::vector<std::byte> payload(60'000, std::byte{7});
  const std::vector<std::byte> packet = service::make_lcm_packet("FREEFLEX_STATE", payload, 0x01020304);
  const auto message = service::read_lcm_packet(packet);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->channel, "FREEFLEX_STATE");
  EXPECT_FALSE(message->is_fragment);
  EXPECT_TRUE(std::equal(payload.begin(), payload.end(), message->payload.begin(), message->payload.end()));
  EXPECT_EQ(packet[4], std::byte{1});
  EXPECT_EQ(packet[7], std::byte{4});
}

TEST(LcmPackets, InvalidChannelsAndSizesGiveNoPacket) {
  EXPECT_TRUE(service::make_lcm_packet("", {}, 0).empty());
  EXPECT_TRUE(service::make_lcm_packet(std::string(64, 'x'), {}, 0).empty());
  EXPECT_TRUE(service::make_lcm_packet(std::string_view("a\0b", 3), {}, 0).empty());
  const std::vector<std::byte> largest(65'499 - 2);
  EXPECT_FALSE(service::make_lcm_packet("a", largest, 0).empty());
  EXPECT_TRUE(service::make_lcm_packet("ab", largest, 0).empty());
}

}  // namespace
}  // namespace freeflex::testing
