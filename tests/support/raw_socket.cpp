#include "tests/support/raw_socket.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace fanstream {
namespace {

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

}  // namespace

RawSocket RawSocket::connect(std::uint16_t port, int receive_buffer_bytes) {
  RawSocket socket(::socket(AF_INET, SOCK_STREAM, 0));
  if (receive_buffer_bytes > 0) socket.set_receive_buffer(receive_buffer_bytes);
  const sockaddr_in address = loopback(port);
  if (::connect(socket.descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) socket.close();
  return socket;
}

RawSocket& RawSocket::operator=(RawSocket&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

bool RawSocket::send(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t size = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (size <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(size));
  }
  return true;
}

std::vector<std::byte> RawSocket::receive_all() { return receive_some(~std::size_t{0}); }

std::vector<std::byte> RawSocket::receive_some(std::size_t size_bytes) {
  std::vector<std::byte> all;
  std::array<std::byte, 4096> part;
  while (all.size() < size_bytes) {
    pollfd waiting{descriptor_, POLLIN, 0};
    if (::poll(&waiting, 1, 10'000) <= 0) break;
    const ssize_t size = ::recv(descriptor_, part.data(), std::min(part.size(), size_bytes - all.size()), 0);
    if (size <= 0) {
      ended_ = true;
      break;
    }
    all.insert(all.end(), part.begin(), part.begin() + size);
  }
  return all;
}

std::vector<std::byte> RawSocket::receive_next() {
  std::vector<std::byte> part(4096);
  const ssize_t size = ::recv(descriptor_, part.data(), part.size(), 0);
  if (size <= 0) ended_ = true;
  part.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
  return part;
}

void RawSocket::half_close() { ::shutdown(descriptor_, SHUT_WR); }

void RawSocket::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
}

void RawSocket::reset() {
  const linger at_once{1, 0};
  ::setsockopt(descriptor_, SOL_SOCKET, SO_LINGER, &at_once, sizeof(at_once));
  close();
}

void RawSocket::set_receive_buffer(int size_bytes) {
  ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVBUF, &size_bytes, sizeof(size_bytes));
}

RawListener::RawListener() : descriptor_(::socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof(address);
  if (::bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), size) != 0) return;
  if (::listen(descriptor_, 16) != 0) return;
  ::getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &size);
  port_ = ntohs(address.sin_port);
}

RawListener::~RawListener() { ::close(descriptor_); }

RawSocket RawListener::accept() { return RawSocket(::accept(descriptor_, nullptr, nullptr)); }

}  // namespace fanstream
