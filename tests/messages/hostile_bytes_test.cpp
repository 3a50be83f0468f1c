// Whatever bytes arrive, the codec does not read outside them, does not allocate according to a count in
// them, and does not accept anything but a command. AddressSanitizer checks that nothing outside is read,
// because every buffer is on the heap and exactly as long as its message.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "messages/channels.hpp"
#include "tests/messages/commands.hpp"

namespace freeflex::testing {
namespace {

using io::Reason;
using Bytes = std::vector<std::byte>;

/// Holds the offset [bytes] of the sender's length in a force_t, after fingerprint, utime and session.
constexpr std::size_t kSenderLength = 24;
std::size_t count_offset(const freeflex_msgs::force_t& m) {
  return kSenderLength + 4 + m.sender.size() + 1 + 8 + 36;
}

void put32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::byte>(value >> (24 - 8 * i) & 0xFFu);
}

/// Decodes a copy of the bytes without spare capacity, so that a sanitizer reports any read beyond it.
io::Admission decode_exact(std::span<const std::byte> bytes, ForceCommand& command) {
  const std::unique_ptr<std::byte[]> copy(new std::byte[bytes.size()]);
  std::memcpy(copy.get(), bytes.data(), bytes.size());
  static const io::NameTable names = make_names();
  return io::decode_force({copy.get(), bytes.size()}, kSession, names, command);
}

TEST(HostileBytes, AMessageCutAtAnyByteIsMalformed) {
  const Bytes whole = io::encode(make_force());
  ForceCommand command;
  ASSERT_EQ(decode_exact(whole, command).reason, Reason::kAccepted);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(decode_exact(std::span(whole).first(size), command).reason, Reason::kMalformed) << size;
  }
  const Bytes control = io::encode(make_control());
  io::ControlCommand out;
  for (std::size_t size = 0; size < control.size(); ++size) {
    EXPECT_EQ(io::decode_control(std::span(control).first(size), kSession, out).reason, Reason::kMalformed)
        << size;
  }
}

TEST(HostileBytes, AMessageWithTrailingBytesIsRejected) {
  for (const std::size_t extra : {std::size_t{1}, std::size_t{8}, std::size_t{28}, std::size_t{52}}) {
    Bytes bytes = io::encode(make_force());
    bytes.resize(bytes.size() + extra);
    ForceCommand command;
    const io::Admission admission = decode_exact(bytes, command);
    EXPECT_EQ(admission.reason, Reason::kMalformed);
    EXPECT_NE(std::string(admission.text.data())
                  .find("but 3 forces and 2 wrenches and 0 torques and 0 wheels need"),
              std::string::npos);
    EXPECT_STREQ(admission.sender.data(), "pusher-1.a_B") << "the sender is known, so it can be answered";
    Bytes control = io::encode(make_control());
    control.resize(control.size() + extra);
    io::ControlCommand out;
    EXPECT_EQ(io::decode_control(control, kSession, out).reason, Reason::kMalformed);
  }
}

TEST(HostileBytes, AMessageWithAnImpossibleCountIsMalformed) {
  const freeflex_msgs::force_t message = make_force();
  // sizes computed in 32 bits would wrap: 2^29 * 8 and 2^30 * 28 to 0, and 153391690 * 28 = 2^32 + 24 to 24;
  // a force has 28 bytes
  for (const std::uint32_t count :
       {0xFFFFFFFFu, 1u << 29, 1u << 30, 0x7FFFFFFFu, 0x80000000u, 153'391'690u, 100'000'000u}) {
    for (const std::size_t offset : {0u, 4u, 8u}) {
      Bytes bytes = io::encode(message);
      put32(bytes, count_offset(message) + offset, count);
      ForceCommand command;
      EXPECT_EQ(decode_exact(bytes, command).reason, Reason::kMalformed) << count << " at " << offset;
      EXPECT_EQ(io::check_layout<freeflex_msgs::force_t>(bytes), Reason::kMalformed);
    }
  }
}

TEST(HostileBytes, AMessageWithAnImpossibleSenderLengthIsMalformed) {
  for (const std::uint32_t length : {0u, 0xFFFFFFFFu, 0x80000000u, 0x7FFFFFFFu, 1u << 30, 1000u, 12u, 14u}) {
    Bytes bytes = io::encode(make_force());  // the sender of the message has 12 characters and a terminator
    put32(bytes, kSenderLength, length);
    ForceCommand command;
    EXPECT_EQ(decode_exact(bytes, command).reason, Reason::kMalformed) << length;
  }
}

TEST(HostileBytes, AMessageWithANulInItsSenderIsMalformed) {
  Bytes bytes = io::encode(make_force());
  bytes[kSenderLength + 4 + 3] = std::byte{0};
  ForceCommand command;
  EXPECT_EQ(decode_exact(bytes, command).reason, Reason::kMalformed);
}

TEST(HostileBytes, AMessageAboveTheSizeLimitIsNotRead) {
  // liblcm can report more bytes than there are, so the codec must not read a byte before it has compared the
  // size with the limit
  const std::byte nothing{};
  const std::span<const std::byte> claim(&nothing, channels::kMaxMessageBytes + 1);
  ForceCommand command;
  io::ControlCommand control;
  EXPECT_EQ(io::decode_force(claim, kSession, make_names(), command).reason, Reason::kMalformed);
  EXPECT_EQ(io::decode_control(claim, kSession, control).reason, Reason::kMalformed);
}

/// Makes one random change. The change flips a bit, sets a byte, inserts or deletes bytes, copies bytes from
/// another message, or sets a 32-bit word to an extreme value.
void mutate(Bytes& bytes, const Bytes& other, std::mt19937_64& engine) {
  const auto below = [&engine](std::size_t limit) {
    return limit == 0 ? 0 : static_cast<std::size_t>(engine() % limit);
  };
  const std::size_t at = below(bytes.size());
  const auto position = bytes.begin() + static_cast<std::ptrdiff_t>(at);
  const std::size_t length = std::min(1 + below(64), bytes.size() - at);
  switch (engine() % 6) {
    case 0:
      bytes[at] ^= static_cast<std::byte>(1u << below(8));
      break;
    case 1:
      bytes[at] = static_cast<std::byte>(engine() & 0xFFu);
      break;
    case 2:
      bytes.insert(position, length, static_cast<std::byte>(engine() & 0xFFu));
      break;
    case 3:
      bytes.erase(position, position + static_cast<std::ptrdiff_t>(length));
      break;
    case 4: {
      const std::size_t from = below(other.size());
      const std::size_t size = std::min({length, other.size() - from, bytes.size() - at});
      std::copy_n(other.begin() + static_cast<std::ptrdiff_t>(from), size, position);
      break;
    }
    default:
      if (bytes.size() >= 4) {
        constexpr std::uint32_t kExtreme[] = {0,          1,        0x7FFFFFFF, 0x80000000,
                                              0xFFFFFFFF, 1u << 29, 1u << 30,   257};
        put32(bytes, below(bytes.size() - 3), kExtreme[below(8)]);
      }
  }
  if (bytes.empty()) bytes.push_back(std::byte{0});
}

TEST(HostileBytes, MutatedMessagesAreRejectedOrValidCommands) {
  constexpr int kMutants = 200'000;
  std::mt19937_64 engine(77);
  const io::NameTable names = make_names();
  std::vector<Bytes> originals;
  for (int i = 0; i < 64; ++i) originals.push_back(io::encode(random_force(engine, 12, 3)));
  originals.push_back(io::encode(make_control()));
  int num_accepted = 0;
  ForceCommand command;
  for (int i = 0; i < kMutants; ++i) {
    Bytes bytes = originals[engine() % originals.size()];
    const Bytes& other = originals[engine() % originals.size()];
    for (std::uint64_t n = 1 + engine() % 4; n > 0; --n) mutate(bytes, other, engine);
    const io::Admission admission = decode_exact(bytes, command);
    ASSERT_TRUE(admission.reason == Reason::kAccepted || io::is_sane(admission)) << admission.text.data();
    const Reason layout = io::check_layout<freeflex_msgs::force_t>(bytes);
    ASSERT_EQ(layout == Reason::kMalformed || layout == Reason::kWrongType,
              admission.reason == Reason::kMalformed || admission.reason == Reason::kWrongType);
    if (admission.reason == Reason::kAccepted) {
      // an accepted command encodes to exactly these bytes
      ++num_accepted;
      ASSERT_TRUE(io::is_sane(command, names));
      freeflex_msgs::force_t message;
      ASSERT_EQ(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())),
                static_cast<int>(bytes.size()));
      ASSERT_EQ(io::encode(io::to_message(command, message.session, message.utime)), bytes);
    }
    io::ControlCommand control;
    const io::Admission controlled = io::decode_control(bytes, kSession, control);
    ASSERT_TRUE(controlled.reason == Reason::kAccepted || io::is_sane(controlled));
  }
  // a changed time or a changed low bit of a force leaves a valid command, but most other changes do not
  EXPECT_GT(num_accepted, kMutants / 100);
  EXPECT_LT(num_accepted, kMutants / 2);
}

TEST(HostileMemory, ACommandInSharedMemoryIsNeverReadOutsideItsArrays) {
  // one to three 32-bit words of a valid command get random values, in the first 40 words or anywhere;
  // is_sane must then not read outside arrays
  std::mt19937_64 engine(99);
  const io::NameTable names = make_names();
  ForceCommand good;
  ASSERT_EQ(decode(make_force(), names, good).reason, Reason::kAccepted);
  int num_sane = 0;
  for (int i = 0; i < 20'000; ++i) {
    ForceCommand command = good;
    std::array<std::uint32_t, sizeof(ForceCommand) / 4> words;
    std::memcpy(words.data(), &command, sizeof(command));
    const std::size_t reach = i % 2 == 0 ? 40 : words.size();
    for (int n = 0; n < 1 + i % 3; ++n) words[engine() % reach] = static_cast<std::uint32_t>(engine());
    std::memcpy(&command, words.data(), sizeof(command));
    if (!io::is_sane(command, names)) continue;
    ++num_sane;
    ASSERT_LE(command.num_points, kMaxCommandPoints);
    for (int p = 0; p < command.num_points; ++p)
      ASSERT_LT(command.points[static_cast<std::size_t>(p)].point, 299);
  }
  EXPECT_GT(num_sane, 0);
  EXPECT_LT(num_sane, 20'000);
  ForceCommand unterminated = good;
  unterminated.sender.fill('a');
  EXPECT_FALSE(io::is_sane(unterminated, names));
  ForceCommand hidden = good;
  hidden.sender[31] =
      'x';  // if bytes after the terminator were allowed, one name could stand for two senders
  EXPECT_FALSE(io::is_sane(hidden, names));
}

}  // namespace
}  // namespace freeflex::testing
