// Numbers that the documents name are those of the code.
#include <gtest/gtest.h>

#include <cctype>
#include <fstream>
#include <iterator>
#include <string>

#include "service/desk.hpp"
#include "service/io/wire/reason.hpp"
#include "service/loop.hpp"
#include "service/shared.hpp"

namespace freeflex::testing {
namespace {

using service::CommandDesk;

/// A document with every gap of lines and blanks as one blank.
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

/// 8864 as 8,864.
std::string with_commas(std::int64_t number) {
  std::string digits = std::to_string(number);
  for (auto at = static_cast<std::ptrdiff_t>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

/// The phrase with the number in place of #.
void expect_named(const char* document, std::string phrase, std::int64_t number) {
  phrase.replace(phrase.find('#'), 1, with_commas(number));
  EXPECT_NE(read_document(document).find(phrase), std::string::npos) << document << " lacks: " << phrase;
}

TEST(Documents, SecurityNamesTheNumbersOfTheCode) {
  constexpr const char* kSecurity = "service/SECURITY.md";
  expect_named(kSecurity, "one pass over the bytes, of which there are at most #, and",
               service::kMaxRawBytes);
  expect_named(kSecurity, "more than any sealed command has (# bytes:", service::kMaxRawBytes);
  expect_named(kSecurity, "a command of more than # points", kMaxCommandPoints);
  expect_named(kSecurity, "points or # groups", kMaxCommandWrenches);
  expect_named(kSecurity, "at most # s ahead of the daemon's clock", io::kMaxValidity / 1'000'000);
  expect_named(kSecurity, "`commands: max_hold` of the scene, # s where it says nothing",
               static_cast<std::int64_t>(CommandLimits{}.max_hold));
  EXPECT_EQ(decltype(service::SharedBlock::inbound)::kCapacity, 1024);
  EXPECT_NE(read_document(kSecurity).find("the ring of 1024 messages"), std::string::npos);
}

TEST(Documents, TheInterfaceNamesTheNumbersOfTheCode) {
  constexpr const char* kMessages = "messages/README.md";
  expect_named(kMessages, "that can be taken has at most # bytes",
               static_cast<std::int64_t>(service::kMaxCommandBytes));
  expect_named(kMessages, "in an `envelope_t` at most #,", service::kMaxRawBytes);
  expect_named(kMessages, "# slots can be in force or promised at once", kMaxSlots);
  expect_named(kMessages, "# are for the operator's socket", CommandDesk::kOperatorSlots);
  expect_named(kMessages, "operator's socket, # for the bus", CommandDesk::kBusSlots);
  expect_named(kMessages, "at most # commands wait", CommandDesk::kMaxPending);
  expect_named(kMessages, "# of the operator's socket, 192", CommandDesk::kOperatorPending);
  expect_named(kMessages, "# of the bus, of which", CommandDesk::kBusPending);
  expect_named(kMessages, "may be # ticks ahead at most", io::kMaxAheadTicks);
  expect_named(kMessages, "at most # commands are taken in at one tick", service::Simulation::kMaxDrained);
  expect_named(kMessages, "sequences of # senders", service::SenderTable::kMaxSenders);
  expect_named(kMessages, "last # such senders", service::SenderTable::kMaxControls);
  expect_named(kMessages, "more commands than the daemon holds: # forces not yet looked at",
               service::SharedBlock::num_places(service::InboundKind::kForce));
}

}  // namespace
}  // namespace freeflex::testing
