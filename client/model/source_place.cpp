#include "client/model/source_place.h"

namespace fanstream {

Result<SourcePlace> locate_source(const std::string& text) {
  std::error_code ignored;
  if (std::filesystem::exists(text, ignored)) return SourcePlace{std::nullopt, text};
  if (text.find(':') == std::string::npos) {
    return fail(ErrorKind::not_found, text + ": no such file; for a model on a server write HOST:PORT/MODEL");
  }
  Result<ServerAddress> address = parse_server_address(text);
  if (!address) return tl::unexpected<Error>(address.error());
  if (address->model.empty()) {
    return fail(ErrorKind::usage,
                "'" + text + "': names no model; expected HOST:PORT/MODEL, see fanstream-client list " + text);
  }
  return SourcePlace{std::move(*address), {}};
}

}  // namespace fanstream
