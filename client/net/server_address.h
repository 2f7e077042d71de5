// HOST:PORT and HOST:PORT/MODEL as given on command lines.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/support/result.h"
#include "protocol/limits.h"

namespace fanstream {

struct ServerAddress {
  std::string host;
  std::uint16_t port = kDefaultPort;
  std::string model;  // empty if not given

  // "host:port", IPv6 in brackets.
  std::string text() const;
};

// "example.org:7370/bunny", "[::1]:7370", "localhost/bunny" (default port). Errors say what is wrong with the text.
Result<ServerAddress> parse_server_address(std::string_view text);

}  // namespace fanstream
