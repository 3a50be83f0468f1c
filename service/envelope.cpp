#include "service/envelope.hpp"

#include <algorithm>
#include <iterator>

#include "freeflex_msgs/wire_layouts.hpp"
#include "service/io/wire/codec.hpp"
#include "service/io/wire/wire_walk.hpp"

namespace freeflex::service {
namespace {

using freeflex_msgs::envelope_t;
using Field = wire::Field;
using wire::Kind;

/// Fields that read_envelope takes from the bytes, in this order.
constexpr Field kFields[] = {
    {.name = "key_id", .kind = Kind::kString},   {.name = "session", .kind = Kind::kInt64},
    {.name = "sequence", .kind = Kind::kInt64},  {.name = "valid_until", .kind = Kind::kInt64},
    {.name = "num_bytes", .kind = Kind::kInt32}, {.name = "body", .kind = Kind::kByte},
    {.name = "tag", .kind = Kind::kByte}};
constexpr bool is_as_read(const wire::Layout& layout) {
  return layout.fields.size() == std::size(kFields) &&
         std::equal(std::begin(kFields), std::end(kFields), layout.fields.begin(),
                    [](const Field& a, const Field& b) { return a.name == b.name && a.kind == b.kind; });
}
static_assert(is_as_read(*wire::layout_of<envelope_t>));

}  // namespace

std::optional<Envelope> read_envelope(std::span<const std::byte> bytes) noexcept {
  if (io::integer_at<std::int64_t>(bytes, 0) != envelope_t::getHash()) return std::nullopt;
  // after this check every field lies within the bytes, and the tag is at their end
  if (!io::fits_layout(bytes, *wire::layout_of<envelope_t>)) return std::nullopt;
  Envelope envelope;
  envelope.key_id = *io::string_at(bytes, wire::kFingerprintBytes);
  if (!io::is_valid_sender(envelope.key_id)) return std::nullopt;
  std::int64_t at = wire::kFingerprintBytes + 4 + static_cast<std::int64_t>(envelope.key_id.size()) + 1;
  for (std::int64_t* number : {&envelope.session, &envelope.sequence, &envelope.valid_until}) {
    *number = *io::integer_at<std::int64_t>(bytes, at);
    at += 8;
  }
  const std::size_t body = index(at) + 4;
  envelope.tag = bytes.last(crypto_auth_BYTES);
  envelope.before_tag = bytes.first(bytes.size() - envelope.tag.size());
  envelope.body = envelope.before_tag.subspan(body);
  return envelope;
}

bool has_right_tag(const Envelope& envelope, std::string_view channel, const SealingKey& key) noexcept {
  const SealTag right = make_tag(envelope.before_tag, channel, key);
  return sodium_memcmp(right.data(), envelope.tag.data(), right.size()) == 0;
}

}  // namespace freeflex::service
