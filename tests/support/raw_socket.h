// Plain TCP sockets for tests that misbehave on purpose.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fanstream {

class RawSocket {
 public:
  explicit RawSocket(int descriptor = -1) : descriptor_(descriptor) {}
  // With a receive buffer of so many bytes, as the system rounds them; 0: its own choice.
  static RawSocket connect(std::uint16_t port, int receive_buffer_bytes = 0);
  RawSocket(RawSocket&& other) noexcept : descriptor_(other.descriptor_) { other.descriptor_ = -1; }
  RawSocket& operator=(RawSocket&& other) noexcept;
  ~RawSocket() { close(); }

  // False once the peer has gone. Blocks while the peer takes nothing.
  bool send(std::span<const std::byte> bytes);
  // Everything until the peer ends the connection; gives up after ten seconds of silence and then says so by `ended`.
  std::vector<std::byte> receive_all();
  // At least this many bytes, or what came until the end.
  std::vector<std::byte> receive_some(std::size_t size_bytes);
  // What is there, waiting for at least one byte; empty at the end.
  std::vector<std::byte> receive_next();
  bool ended() const { return ended_; }
  int descriptor() const { return descriptor_; }
  void half_close();
  void close();
  // Closes with a reset instead of an orderly end.
  void reset();
  void set_receive_buffer(int size_bytes);

 private:
  int descriptor_ = -1;
  bool ended_ = false;
};

class RawListener {
 public:
  RawListener();  // on a free port of 127.0.0.1
  ~RawListener();
  std::uint16_t port() const { return port_; }
  RawSocket accept();

 private:
  int descriptor_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace fanstream
