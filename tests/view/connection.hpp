// Implements the browser's side of a connection to the page's server. Header only.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <string>
#include <utility>

namespace freeflex::testing {

/// Opens a TCP connection and sends and reads bytes.
class Connection {
 public:
  explicit Connection(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    timeval patience{5, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~Connection() { ::close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send(const std::string& text) {
    EXPECT_EQ(::send(socket_, text.data(), text.size(), 0), std::ssize(text));
  }
  /// Sends a text. Returns false if the server has closed the connection.
  bool try_send(const std::string& text) {
    return ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL) == std::ssize(text);
  }
  std::string read(std::size_t size) {
    std::string text(size, '\0');
    std::size_t got = 0;
    while (got < size) {
      const ssize_t n = ::recv(socket_, text.data() + got, size - got, 0);
      if (n <= 0) break;
      got += static_cast<std::size_t>(n);
    }
    text.resize(got);
    return text;
  }
  std::string read_head() {
    std::string head;
    while (!head.ends_with("\r\n\r\n")) {
      const std::string byte = read(1);
      if (byte.empty()) break;
      head += byte;
    }
    return head;
  }
  /// Reads an unmasked frame of the server. Returns opcode and content. The opcode is -1 if the connection
  /// has ended.
  std::pair<int, std::string> read_frame() {
    const std::string head = read(2);
    if (head.size() < 2) return {-1, {}};
    std::size_t size = static_cast<unsigned char>(head[1]) & 0x7fU;
    const std::size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (more > 0) {
      size = 0;
      for (const char byte : read(more)) size = size << 8 | static_cast<unsigned char>(byte);
    }
    return {head[0] & 0xf, read(size)};
  }
  /// Returns whether the server closes the connection within 5 s. Data that the server sends before it closes
  /// the connection are ignored.
  bool is_closed_by_server() {
    char rest[1024];
    while (true) {
      const ssize_t n = ::recv(socket_, rest, sizeof rest, 0);
      if (n == 0 || (n < 0 && errno == ECONNRESET)) return true;
      if (n < 0) return false;
    }
  }
  void send_text(const std::string& text) {
    std::string frame = "\x81";
    frame += static_cast<char>(0x80 | text.size());
    frame += std::string(4, '\0') + text;  // a mask of zeros
    send(frame);
  }
  /// Requests the WebSocket of the page. Returns the head of the answer.
  std::string open_socket(int port, const std::string& origin, const std::string& token) {
    send("GET /ws?token=" + token + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
         "\r\nOrigin: " + origin +
         "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    return read_head();
  }

 private:
  int socket_;
};

}  // namespace freeflex::testing
