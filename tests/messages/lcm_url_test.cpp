// Valid bus URLs are accepted, and other URLs are refused with the cause.
#include "service/io/wire/lcm_url.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>

#include <vector>

namespace freeflex::testing {
namespace {

using service::check_lcm_url;

TEST(LcmUrl, ValidUdpmUrlsAndTheEmptyUrlAreAccepted) {
  for (const char* url :
       {"", service::kDefaultUrl, "udpm://", "udpm://?ttl=1", "udpm://239.255.76.67:7667",
        "udpm://224.0.0.1:1", "udpm://239.255.255.255:65535?ttl=255&recv_buf_size=4194304"}) {
    EXPECT_EQ(check_lcm_url(url), "") << url;
  }
}

TEST(LcmUrl, TheMessageOnAnInvalidUrlSaysWhatWasFoundAndWhatIsAllowed) {
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"memq://", "use udpm://"},
      {"file://log", "use udpm://"},
      {"tcpq://localhost:7700", "must be udpm://"},
      {"udpm:/239.255.76.67:7667", "must be udpm://"},
      {"239.255.76.67:7667", "must be udpm://"},
      // with port 0 liblcm would wait ten seconds for an answer
      {"udpm://239.255.76.67", "has the address '239.255.76.67', which must be ADDRESS:PORT"},
      {"udpm://239.255.76.67:", "1 to 65535"},
      {"udpm://239.255.76.67:0", "1 to 65535"},
      {"udpm://239.255.76.67:65536", "1 to 65535"},
      {"udpm://239.255.76.67:-1", "1 to 65535"},
      {"udpm://239.255.76.67:7667 ", "1 to 65535"},
      {"udpm://223.255.255.255:7667", "224.0.0.0 to 239.255.255.255"},
      {"udpm://240.0.0.0:7667", "224.0.0.0 to 239.255.255.255"},
      {"udpm://localhost:7667", "224.0.0.0 to 239.255.255.255"},
      {"udpm://[ff02::1]:7667", "224.0.0.0 to 239.255.255.255"},
      // liblcm would use the default of an option that it cannot read
      {"udpm://239.255.76.67:7667?ttl=abc", "'ttl=abc', which must be ttl=0 to 255"},
      {"udpm://239.255.76.67:7667?ttl=256", "'ttl=256'"},
      {"udpm://239.255.76.67:7667?ttl=0&ttl", "'ttl', which must be"},
      {"udpm://239.255.76.67:7667?ttl=0&&ttl=0", "'&', which must be"},
      {"udpm://239.255.76.67:7667?recv_buf_size=-1", "recv_buf_size=BYTES"},
      {"udpm://239.255.76.67:7667?tll=0", "'tll=0', which must be ttl"},
      {"udpm://239.255.76.67:7667?ttl=0&" + std::string(300, 'x'), "is too long"}};
  for (const auto& [url, text] : bad) {
    const std::string fault = check_lcm_url(url);
    EXPECT_NE(fault.find(text), std::string::npos) << url << ": " << fault;
  }
}

TEST(LcmUrl, AUrlGivesAddressPortAndBufferSize) {
  const service::LcmAddress given = service::read_lcm_url("udpm://224.0.0.1:80?ttl=3&recv_buf_size=70000");
  EXPECT_EQ(given.group, htonl(0xE0000001));
  EXPECT_EQ(given.port, 80);
  EXPECT_EQ(given.receive_buffer, 70000);
  for (const char* url : {"", "udpm://", "udpm://239.255.76.67:7667?ttl=1"}) {
    const service::LcmAddress usual = service::read_lcm_url(url);
    EXPECT_EQ(usual.group, htonl(0xEFFF4C43)) << url;
    EXPECT_EQ(usual.port, 7667) << url;
    EXPECT_EQ(usual.receive_buffer, 0) << url;
  }
}

}  // namespace
}  // namespace freeflex::testing
