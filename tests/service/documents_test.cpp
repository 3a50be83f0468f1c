// These tests check that numbers in the documents equal those in the code.
#include <gtest/gtest.h>

#include <cctype>
#include <fstream>
#include <iterator>
#include <string>

#include "service/command_queue.hpp"
#include "service/io/wire/reason.hpp"
#include "service/loop.hpp"
#include "service/shared.hpp"

namespace freeflex::testing {
namespace {

using service::CommandQueue;

/// Returns a document in which each sequence of blanks and line ends is replaced by one blank.
std::string read_document(const std::string& name) {
  std::ifstream file(std::string(FREEFLEX_SOURCE_DIR) + "/" + name);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  std::string flat;
  for (const char c : text) {
    const bool is_gap = std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!is_gap) flat += c;
    if (is_gap && !flat.empty() && flat.back() != ' ') flat += ' ';
  }
  return flat;
}

/// Returns the number with commas between thousands. For example, 8864 becomes 8,864.
std::string with_commas(std::int64_t number) {
  std::string digits = std::to_string(number);
  for (auto at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

/// Expects that the document contains the phrase, with the number in place of #.
void expect_named(const char* document, std::string phrase, std::int64_t number) {
  phrase.replace(phrase.find('#'), 1, with_commas(number));
  EXPECT_NE(read_document(document).find(phrase), std::string::npos) << document << " lacks: " << phrase;
}

TEST(Documents, SecurityStatesTheNumbersOfTheCode) {
  constexpr const char* kSecurity = "service/SECURITY.md";
  expect_named(kSecurity, "one pass over at most # bytes and no decoding", service::kMaxRawBytes);
  expect_named(kSecurity, "bytes than any sealed command has (# bytes:", service::kMaxRawBytes);
  expect_named(kSecurity, "a command of more than # points", kMaxCommandPoints);
  expect_named(kSecurity, "points or # groups", kMaxCommandWrenches);
  expect_named(kSecurity, "at most # s ahead of the daemon's clock", io::kMaxValidity / 1'000'000);
  expect_named(kSecurity, "`commands: max_hold` of the scene, # s by default",
               static_cast<std::int64_t>(CommandLimits{}.max_hold));
  EXPECT_EQ(decltype(service::SharedBlock::inbound)::kCapacity, 1024);
  EXPECT_NE(read_document(kSecurity).find("the ring of 1024 messages"), std::string::npos);
}

TEST(Documents, TheInterfaceStatesTheNumbersOfTheCode) {
  constexpr const char* kMessages = "messages/README.md";
  expect_named(kMessages, "that can be accepted has at most # bytes",
               static_cast<std::int64_t>(service::kMaxCommandBytes));
  expect_named(kMessages, "in an `envelope_t` has at most # bytes", service::kMaxRawBytes);
  expect_named(kMessages, "# slots can be in force or promised at once", kMaxSlots);
  expect_named(kMessages, "# are for the operator's socket", CommandQueue::kOperatorSlots);
  expect_named(kMessages, "operator's socket, # for the bus", CommandQueue::kBusSlots);
  expect_named(kMessages, "at most # commands wait", CommandQueue::kMaxPending);
  expect_named(kMessages, "# of the operator's socket, 192", CommandQueue::kOperatorPending);
  expect_named(kMessages, "# of the bus, of which", CommandQueue::kBusPending);
  expect_named(kMessages, "may be # ticks ahead at most", io::kMaxAheadTicks);
  expect_named(kMessages, "at most # commands are taken in at one tick", service::Simulation::kMaxDrained);
  expect_named(kMessages, "sequences of # senders", service::SenderTable::kMaxSenders);
  expect_named(kMessages, "last # such senders", service::SenderTable::kMaxControls);
  expect_named(kMessages, "the daemon cannot hold more commands: # forces are not yet decided",
               service::SharedBlock::num_places(service::InboundKind::kForce));
}

}  // namespace
}  // namespace freeflex::testing
