#include "client/net/server_address.h"

#include <charconv>

namespace fanstream {

std::string ServerAddress::text() const {
  const bool v6 = host.find(':') != std::string::npos;
  std::string text = v6 ? "[" : "";
  return text.append(host).append(v6 ? "]:" : ":").append(std::to_string(port));
}

Result<ServerAddress> parse_server_address(std::string_view text) {
  const auto wrong = [&](const std::string& why) {
    return fail(ErrorKind::usage,
                std::string("'").append(text) + "': " + why + "; expected HOST:PORT or HOST:PORT/MODEL");
  };
  ServerAddress address;
  std::string_view rest = text;
  if (rest.substr(0, 1) == "[") {
    const std::size_t end = rest.find(']');
    if (end == std::string_view::npos) return wrong("the bracket is not closed");
    address.host = rest.substr(1, end - 1);
    rest = rest.substr(end + 1);
  } else {
    const std::size_t end = std::min(rest.find_first_of(":/"), rest.size());
    address.host = rest.substr(0, end);
    rest = rest.substr(end);
  }
  if (address.host.empty()) return wrong("no host");
  if (rest.substr(0, 1) == ":") {
    rest.remove_prefix(1);
    const std::string_view digits = rest.substr(0, rest.find('/'));
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), address.port);
    if (error != std::errc() || end != digits.data() + digits.size() || address.port == 0) {
      return wrong("the port is not a number from 1 to 65535");
    }
    rest = rest.substr(digits.size());
  }
  if (!rest.empty()) {
    if (rest[0] != '/') return wrong("what follows the host is neither a port nor a model");
    address.model = rest.substr(1);
    if (address.model.empty()) return wrong("no model after the slash");
    if (address.model.size() > kMaxNameBytes) return wrong("the model's name is longer than 255 bytes");
  }
  return address;
}

}  // namespace fanstream
